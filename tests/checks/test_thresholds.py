"""Each check on both sides of each of its thresholds: a run that just trips it, and one that just does not.

The runs are right ones, spoilt by hand by a stated amount. The numbers stand here once more: a threshold that moves is seen.
"""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from simulations import STRIP, pendulum
from spoilt import CHECK, bent, linear, pressed_by, pressed_strip, right, said, stretched, unbalanced

from buckler import mbs
from buckler.mbs.checks import linkages
from buckler.mbs.checks.suspicions import CHECKS
from buckler.mbs.elements.clearance import PIERCED
from buckler.mbs.laws import Hertz
from buckler.mbs.record.errors import Norm, Status
from buckler.mbs.record.result import Result
from buckler.mbs.record.run import ledger
from buckler.mbs.view.verdicts import QUESTIONS

NEAR = {}
"""By check and threshold: `made(side)` gives what the check says of a run that is wrong (True) or right (False)."""


def near(name, threshold=""):
    def keep(function):
        NEAR[name, threshold] = function
        return function

    return keep


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


# --- constraints ---------------------------------------------------------------------------------------------------------


@near("CONSTRAINTS", "of the longest link")
def _(wrong):
    """One link of a four-bar is moved along x."""
    run, result = right("rocker")
    links = dict(run.record.links)
    name, motion = list(links.items())[1]
    links[name] = replace(motion, q=motion.q + np.array([1.2e-5 if wrong else 0.8e-5, 0.0, 0.0]))
    return said("CONSTRAINTS", replace(run, record=replace(run.record, links=links)), result)


# --- energy --------------------------------------------------------------------------------------------------------------


@near("ENERGY", "balance")
def _(wrong):
    return unbalanced(1.3e-2 if wrong else 0.8e-2)


def test_energy_may_be_off_by_what_is_told_of_energies():
    told = {("energy.kinetic", Norm.RMS): 0.03, ("energy.balance", Norm.PEAK): 0.5}
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


@near("ENERGY", "unseen bristle")
def _(wrong):
    """A slider of 0.1 m that rests on bristles bent by 3e-5 or 3e-6 m: the energy that they hold is missing."""
    return bent(3e-5 if wrong else 3e-6)


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


@near("UNBUCKLED", "end shortening")
def _(wrong):
    return pressed_strip(7e-3, 5e-3) if wrong else pressed_strip(4e-3, 3e-3)


@near("UNBUCKLED", "axial share")
def _(wrong):
    return pressed_strip(2e-2, 1.1e-2 if wrong else 0.9e-2)


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


@near("BRANCH", "distance")
def _(wrong):
    """All links turned, of a run whose determinant seems to vanish."""
    run, result = right("rocker")
    places, turn = linkages._places(run.record, range(3)), 1.2e-2 if wrong else 0.8e-2
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(linkages, "determinant", lambda _jacobian: np.linspace(1.0, -1.0, len(result.time)))
        patch.setattr(linkages, "_places", lambda _record, _indices: places + np.array([0.0, 0.0, turn]))
        return said("BRANCH", run, result)


@pytest.mark.parametrize(
    ("least", "phase", "vanishes"), [(0.0, 0.5, True), (0.1, 0.5, True), (4.0, 0.5, False), (4.0, 0.0, False)]
)
def test_a_determinant_between_samples(least, phase, vanishes):
    """Of a dead centre that is missed, sqrt(t^2 + least^2), at samples of distance 1; the second is seen by no sample."""
    time = np.arange(-20, 20) + phase
    assert linkages._may_vanish(time, np.hypot(time, least)) == vanishes
    uneven = time * np.where(time > 0, 0.1, 1.0)  # short steps on one side
    assert linkages._may_vanish(uneven, np.hypot(uneven, least)) == vanishes
    assert linkages._may_vanish(time, time) and linkages._may_vanish(time, np.full(len(time), np.nan))


# --- all of them ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("key", NEAR, ids=" ".join)
def test_a_run_that_just_trips_a_check_and_one_that_just_does_not(key):
    wrong, fine = NEAR[key](True), NEAR[key](False)
    assert len(wrong) >= 1 and all(text.startswith(key[0]) for text in wrong)
    assert fine == []


def test_every_check_is_held_from_both_sides_and_has_a_question():
    assert {name for name, _ in NEAR} == {check.name for check in CHECKS} <= set(QUESTIONS)
    assert len(CHECK) == len(CHECKS)


def test_right_runs_trip_nothing():
    for kind in ("fallen", "swing", "rocker", "strip", "clamped"):
        run, result = right(kind)
        assert [text for check in CHECKS for text in check(run, result)] == []
        assert ledger(run.record)["throughput"][-1] >= 0
