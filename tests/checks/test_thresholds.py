"""Each check on both sides of each of its thresholds: a run that just trips it, and one that just does not.

The runs are right ones, spoilt by hand by a stated amount. The numbers stand here once more: a threshold that moves is seen.
"""

from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from simulations import LENGTH, STRIP, G, block, pendulum

from buckler import mbs
from buckler.mbs.checks import closure, dead_centre
from buckler.mbs.checks.suspicions import CHECKS
from buckler.mbs.elements.clearance import PIERCED
from buckler.mbs.engine.solve import once
from buckler.mbs.laws import Hertz, Stiction
from buckler.mbs.modal import BarModes
from buckler.mbs.record.energy import ledger
from buckler.mbs.record.errors import Errors
from buckler.mbs.record.means import axial_period
from buckler.mbs.record.result import Result
from buckler.mbs.record.status import Status
from buckler.mbs.view.verdicts import QUESTIONS

CHECK = {check.name: check for check in CHECKS}
NEAR = {}
"""By check and threshold: `made(side)` gives what the check says of a run that is wrong (True) or right (False)."""


def near(name, threshold=""):
    def keep(function):
        NEAR[name, threshold] = function
        return function

    return keep


def held(body, joints, guided=False):
    """A strip of a body under hardly any weight."""
    links, guides = [mbs.Link("s", "A", "B", body)], [mbs.Guide("B", "s")] if guided else []
    return mbs.Mechanism({"A": (0, 0), "B": (LENGTH, 0)}, links, joints, guides, gravity=(0.0, -1e-3))


def turned(mechanism):
    """The same, its link drawn from the other end."""
    (link,) = mechanism.links
    return replace(mechanism, links=[replace(link, start=link.end, end=link.start)])


@cache
def right(kind):
    """A run that is right, and its result."""
    bar = mbs.Rigid(mbs.Section(0.005, 0.020))
    strip, modal = mbs.Beam(STRIP.damped(0.5, LENGTH), elements=4), mbs.Modal(STRIP, BarModes(bending=2, axial=0))
    pin, clamps = [mbs.Revolute("A", "ground", "s")], [mbs.Weld(end, "ground", "s") for end in "AB"]
    made = {
        "fallen": lambda: (block(G, Hertz(1e8)), 0.3),
        "swing": lambda: (pendulum(0.5), 1.0),
        "rocker": lambda: (mbs.crank_rocker(bar, speed=30.0, section=bar.section, angle=0.5), 0.2),
        "strip": lambda: (held(strip, pin), 1.0),
        "clamped": lambda: (held(strip, clamps[:1]), 1.0),
        "column": lambda: (held(strip, pin, guided=True), 0.1),
        "propped": lambda: (held(strip, clamps[:1], guided=True), 0.1),
        "modal": lambda: (held(modal, pin, guided=True), 1.0),
        "modal from its end": lambda: (turned(held(modal, pin, guided=True)), 1.0),
        "built in": lambda: (held(strip, clamps), 1.0),
    }
    mechanism, duration = made[kind]()
    run = once(mechanism, duration, mbs.Exudyn(), None, None)
    assert run.failure is None
    return run, Result(Status.OK, "", run.record.time, run.values, run.units, run.work)


def said(name, run, result, **signals):
    """What a check says of a run some of whose signals were replaced."""
    return list(CHECK[name](run, replace(result, signals=result.signals | signals)))


# --- numbers and time ----------------------------------------------------------------------------------------------------


@near("NOT_FINITE")
def _(wrong):
    run, result = right("fallen")
    values = result.signals["A.x"].copy()
    values[7] = np.inf if wrong else 1e300
    return said("NOT_FINITE", run, result, **{"A.x": values})


@near("TIME")
def _(wrong):
    run, result = right("fallen")
    time = result.time.copy()
    time[7] = time[6] if wrong else np.nextafter(time[6], 1.0)
    return said("TIME", run, replace(result, time=time))


# --- energy --------------------------------------------------------------------------------------------------------------


def unbalanced(error, through=1.0, kind="fallen", told=None, **changed):
    """What ENERGY says of a ledger that is off by so much of what was put through, J."""
    run, result = right(kind)
    nothing = np.zeros_like(result.time)
    kept = {"error": nothing + error * through, "throughput": nothing + through, "taken_friction": nothing}
    return said("ENERGY", run, replace(result, energy=kept | changed, error=Errors(0.0, told or {})))


@near("ENERGY", "balance")
def _(wrong):
    return unbalanced(1.3e-2 if wrong else 0.8e-2)


def test_energy_may_be_off_by_what_is_told_of_energies():
    told = {"energy.kinetic": 0.03, "energy.balance": 0.5}
    assert unbalanced(3.5e-2, told=told) and not unbalanced(2.5e-2, told=told)


def test_energy_that_comes_back():
    time = right("fallen")[1].time
    for back, named in ((1.3e-2, True), (0.8e-2, False)):
        taken = np.where(np.arange(len(time)) < 100, 1.0, 1.0 - back)
        assert any("gives back" in text for text in unbalanced(0.0, taken_friction=taken)) == named


@near("ENERGY", "way of rest")
def _(wrong):
    """All that is put through moves the bar by 5e-7 or 5e-8 of its length in the run, and none of it balances."""
    run, result = right("swing")
    mass, length = sum(link.mass(0.5) for link in run.record.mechanism.links), 0.5
    speed = (5e-7 if wrong else 5e-8) * length / result.time[-1]
    return unbalanced(1.0, through=mass * speed**2 / 2, kind="swing")


@near("ENERGY", "unseen stretch")
def _(wrong):
    """The energy of an axial strain of 3e-5 or 3e-6 is missing, though steps follow its vibration."""
    return stretched(3e-5 if wrong else 3e-6, 0.2)


@near("ENERGY", "stretch that steps do not follow")
def _(wrong):
    """The energy of an axial strain of 3e-5 is missing; steps are a fifth of the period of its vibration, or a third."""
    return stretched(3e-5, 0.2 if wrong else 0.33)


def stretched(strain, step):
    """What ENERGY says of a strip whose axial energy is missing, by steps of so much of the period of its axial vibration."""
    run, result = right("strip")
    time = step * axial_period(run.record.mechanism) * np.arange(len(run.record.time))
    stiffness, nothing = STRIP.axial_stiffness, np.zeros_like(time)
    energy = nothing + stiffness * LENGTH * strain**2 / 2
    off = replace(result, energy={"error": energy, "throughput": energy})
    made = replace(run, record=replace(run.record, time=time))
    return said("ENERGY", made, off, **{"s.axial_force": nothing + stiffness * strain})


@near("ENERGY", "unseen bristle")
def _(wrong):
    """A slider of 0.1 m that rests on bristles bent by 3e-5 or 3e-6 m: the energy that they hold is missing."""
    return bent(3e-5 if wrong else 3e-6)


def bent(way):
    """What ENERGY says of a slider on bristles bent by so much, m, whose energy is missing."""
    push = 2.0
    mechanism = replace(block(0.0, friction=Stiction(0.3, 0.3, 1e-2, 1e3)), gravity=(0.0, -G))
    run = once(mechanism, 0.1, mbs.Exudyn(), None, None)
    time = run.record.time
    memory = np.zeros((len(time), 4))
    memory[:, 1] = way
    law = mechanism.guide("A").friction
    normal = push / law.coefficient(np.zeros(1), np.array([way]))
    channels = dict(run.record.channels) | {"guide A": {"reaction": np.full((len(time), 1), normal), "memory": memory}}
    run = replace(run, record=replace(run.record, channels=channels))
    result = Result(Status.OK, "", time, run.values, run.units, run.work)
    held = float(mechanism.guide("A")._held("guide A", run.record)[0])
    assert held == pytest.approx(push * way / 2) and result.signals["A.friction_force"].max() == pytest.approx(push)
    nothing = np.zeros_like(time)
    return said("ENERGY", run, replace(result, energy={"error": nothing + held, "throughput": nothing + held}))


# --- contacts ------------------------------------------------------------------------------------------------------------


@near("CONTACT", "share of the largest force")
def _(wrong):
    run, result = right("fallen")
    force = result.signals["A.contact_force"].copy()
    force[0] = -(3e-9 if wrong else 3e-10) * force.max()
    return said("CONTACT", run, result, **{"A.contact_force": force})


@near("PENETRATION")
def _(wrong):
    """A fifth of the bar's 0.1 m."""
    run, result = right("fallen")
    return said("PENETRATION", run, result, **{"A.penetration": np.full_like(result.time, 2.2e-2 if wrong else 1.8e-2)})


@pytest.mark.parametrize(("gap", "wrong", "fine"), [(1e-6, 3e-4, 2e-4), (1e-3, 1.1e-3, 0.9e-3)])
def test_a_pin_may_be_as_deep_as_its_clearance_or_a_twentieth_of_its_radius(gap, wrong, fine):
    joint = mbs.Clearance("A", "ground", "bar", 5e-3, gap, Hertz(1e9))
    (depth,) = joint.depths("A", None)
    assert fine < depth.allowed < wrong and PIERCED == 0.05
    notes = list(joint.remarks("A", {"A.penetration": np.array([1.2 * gap])}))
    assert len(notes) == 1 and f"more than its clearance {gap:.3g} m" in notes[0]
    assert not list(joint.remarks("A", {"A.penetration": np.array([0.8 * gap])}))


# --- strips --------------------------------------------------------------------------------------------------------------


def pressed_strip(shortening, strain, deflection=0.01, kind="strip", lasts=1.0):
    """What UNBUCKLED says of a strip short by a share of its length, of which some is axial strain, that bends by a share."""
    run, result = right(kind)
    nothing = np.zeros_like(result.time)
    signals = {
        "s.end_shortening": nothing + shortening * LENGTH,
        "s.axial_force": nothing - strain * STRIP.axial_stiffness,
        "s.deflection": np.where(result.time > 0, deflection * LENGTH, 0.0),
    }
    return said("UNBUCKLED", run, replace(result, time=lasts * result.time), **signals)


@near("UNBUCKLED", "end shortening")
def _(wrong):
    return pressed_strip(7e-3, 5e-3) if wrong else pressed_strip(4e-3, 3e-3)


@near("UNBUCKLED", "axial share")
def _(wrong):
    return pressed_strip(2e-2, 1.1e-2 if wrong else 0.9e-2)


def pressed_by(load, growth, deflection=0.0, kind="column"):
    """The same under so many Euler loads, for as long as the first bending mode at two of them takes to grow by exp(growth)."""
    strain = load * STRIP.euler_load(LENGTH) / STRIP.axial_stiffness
    run_time = right(kind)[1].time[-1]
    return pressed_strip(0.0, strain, deflection, kind, growth / STRIP.first_frequency(LENGTH) / run_time)


@near("UNBUCKLED", "growth, exponent")
def _(wrong):
    """Damped by half, the bending grows 0.618 times as fast: sqrt(1 + 1/4) - 1/2."""
    return pressed_by(2.0, 26.0 if wrong else 18.0)


@near("UNBUCKLED", "deflection that is none")
def _(wrong):
    return pressed_by(2.0, 60.0, 3e-4 if wrong else 3e-3)


@pytest.mark.parametrize(
    ("kind", "below", "beyond"), [("column", 0.95, 1.5), ("propped", 1.9, 2.8), ("built in", 3.8, 5.5), ("clamped", 0.24, 0.6)]
)
def test_a_strip_is_overloaded_beyond_its_own_critical_load(kind, below, beyond):
    """1 of a strip between pins, 2.0457 of one that is clamped at one end, 4 at both, 1/4 of a cantilever, in Euler loads."""
    assert pressed_by(beyond, 60.0, kind=kind)
    assert not pressed_by(below, 60.0, kind=kind)


def linear(load, deflection, growth, kind="modal"):
    """The same of a modal link between a pin and a guide, that bends by a share of its length."""
    run, result = right(kind)
    still = np.zeros_like(result.time)
    signals = {"A.ground-s.fx": still + load * STRIP.euler_load(LENGTH), "A.ground-s.fy": still}
    signals["s.deflection"] = still + deflection * LENGTH
    lasts = growth / STRIP.first_frequency(LENGTH) / result.time[-1]
    return said("LINEAR", run, replace(result, time=lasts * result.time), **signals)


@near("LINEAR", "of the length")
def _(wrong):
    return linear(0.5, 2.6e-3 if wrong else 1.5e-3, 100.0)


@near("LINEAR", "growth, exponent")
def _(wrong):
    return linear(2.0, 0.0, 18.0 if wrong else 11.0)


@pytest.mark.parametrize("kind", ["modal", "modal from its end"])
def test_the_force_on_a_modal_link_is_that_of_the_pin_at_either_end(kind):
    """Twice the critical load, 1.05 and 0.95 of it; pulled it carries any."""
    assert linear(2.0, 0.0, 18.0, kind) and linear(1.05, 0.0, 200.0, kind)
    assert not linear(0.95, 0.0, 200.0, kind) and not linear(-2.0, 0.0, 18.0, kind)


@near("CROSSED", "distance over length")
def _(wrong):
    mechanism = replace(pendulum(0.5), links=[mbs.Link("bar", "O", "A", mbs.Strut(STRIP))])
    time = np.array([0.0, 1.0])
    short = np.array([0.0, 0.985 if wrong else 0.975]) * mechanism.length("bar")
    run = SimpleNamespace(record=SimpleNamespace(mechanism=mechanism))
    return said("CROSSED", run, Result(Status.OK, "", time, {"bar.end_shortening": short}, {}, {}))


# --- linkages ------------------------------------------------------------------------------------------------------------


@near("BRANCH", "determinant")
def _(wrong):
    run, result = right("rocker")
    size = np.linspace(1.0, 3e-4 if wrong else 3e-3, len(result.time))
    known = dead_centre.Followed(None, None, size[:, None, None])
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(dead_centre, "followed", lambda _record: known)
        return said("BRANCH", run, result)


@near("CLOSURE", "of the largest")
def _(wrong):
    """All links' speeds are taken too large by a share."""
    run, result = right("rocker")
    links = {name: replace(m, q_t=m.q_t * (1.07 if wrong else 1.01)) for name, m in run.record.links.items()}
    return said("CLOSURE", replace(run, record=replace(run.record, links=links)), result)


def test_the_scale_of_accelerations_counts_those_towards_the_centre_of_a_turn():
    """A link of 0.5 m that turns at 4 rad/s steadily has none along its turn, and 8 m/s^2 towards its centre."""
    mechanism = pendulum(0.0)
    speed, nothing = np.array([[0.0, 0.0, 4.0]]), np.zeros((1, 3))
    off, scale = closure._apart(mechanism, np.array([[0.8]]), nothing, speed)
    assert off == pytest.approx([0.4]) and scale == pytest.approx(8.0)


def excused(jump, after):
    """Whether a sample so long after a jump of the acceleration, of its largest, is left out."""
    driven = np.concatenate([[0.0] * 40, np.linspace(0, 1 - jump, 60), [1.0] * 60])[:, None]
    return bool(closure._after_jumps(driven)[100 + after])


@near("CLOSURE", "jump")
def _(wrong):
    return [] if excused(0.3, 3) and not excused(0.1, 3) and not wrong else ["CLOSURE a small jump is none"] if wrong else ["no"]


@near("CLOSURE", "steps after a jump")
def _(wrong):
    return ["CLOSURE"] if not excused(0.5, 30 if wrong else 10) else []


# --- all of them ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("key", NEAR, ids=" ".join)
def test_a_run_that_just_trips_a_check_and_one_that_just_does_not(key):
    wrong, fine = NEAR[key](True), NEAR[key](False)
    assert len(wrong) >= 1 and all(text.startswith(key[0]) for text in wrong)
    assert fine == []


def test_every_threshold_of_every_check_is_held_from_both_sides():
    asked = {(check.name, threshold) for check in CHECKS for threshold in check.thresholds or ("",)}
    assert asked == set(NEAR)


def test_every_check_has_a_name_a_meaning_and_a_question():
    assert len(CHECK) == len(CHECKS) and set(CHECK) <= set(QUESTIONS)
    assert all(check.fails.startswith("failed when ") for check in CHECKS)


def test_right_runs_trip_nothing():
    for kind in ("fallen", "swing", "rocker", "strip", "clamped"):
        run, result = right(kind)
        assert [text for check in CHECKS for text in check(run, result)] == []
        assert ledger(run.record)["throughput"][-1] >= 0
