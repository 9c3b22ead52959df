"""Self-checks of a run: each names its fault in a run that has it, and is silent in runs that are right."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from simulations import BAR, LENGTH, STRIP, G, block, fine, pendulum, pressed, rates

from buckler.elastica import pinned
from buckler.mbs import (
    Beam,
    Cable,
    Clearance,
    Closure,
    Controlled,
    Drive,
    Equal,
    Exudyn,
    Force,
    Guide,
    Link,
    Mechanism,
    Modal,
    Ramp,
    Revolute,
    Rigid,
    Section,
    Status,
    Strut,
    Torque,
    Weld,
    crank_rocker,
    simulate,
    slider_crank,
)
from buckler.mbs.checks.mesh import MESH, STRUCK, _stretches, mesh_error
from buckler.mbs.checks.suspicions import suspicions
from buckler.mbs.engine import callback, clearance, kernel
from buckler.mbs.engine.scene import build
from buckler.mbs.engine.solve import once
from buckler.mbs.laws import AdamsFriction, CarvalhoMartins, ExactRestitution, Hertz, Impact, KelvinVoigt, NoFriction, Stiction
from buckler.mbs.library import CrankRocker
from buckler.mbs.record.signals import collect

K = 2.53e5 * 1e3**1.5
RATTLING, CLOSED = Impact(K, 253.0, 1e-5), Impact(K, 253e3, 1e-5)
FRICTION = AdamsFriction(0.3, 0.1)
BARS = Section(0.005, 0.020)


def rattling(law=RATTLING, friction=FRICTION, rocker=None, with_play="OABC", gap=2.5e-4):
    def play(point, first, second):
        return Clearance(point, first, second, 5e-3, gap, law, friction)

    return crank_rocker(rocker or Rigid(BARS), speed=10 * np.pi, play=play, with_play=with_play, section=BARS, angle=0.5)


def striking(coupler):
    return slider_crank(coupler, law=CarvalhoMartins(7.2e4, 0.8, exponent=1.0), mass=0.3, speed=1.25)


WET = STRIP.damped(0.05, LENGTH)
COUPLER = {
    "beam": Beam(WET, elements=8, imperfection=-1e-4 * LENGTH),
    "cable": Cable(WET, elements=12, imperfection=-1e-4 * LENGTH),
    "strut": Strut(STRIP),
}


def suspect(result, name):
    """The reasons by which a run is suspect, which must name this check."""
    assert result.status is Status.SUSPECT, f"{result.status}: {result.message}"
    reasons = [reason for reason in result.message.split("; ") if reason.startswith(f"{name}:")]
    assert reasons, result.message
    return reasons[0]


# --- runs that are right ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", COUPLER)
def test_slider_crank_is_fine(kind):
    fine(simulate(striking(COUPLER[kind]), 2.8))


ROCKERS = {"rigid": Rigid(BARS), "beam": Beam(BARS.damped(0.01, 0.175), elements=4), "modal": Modal(BARS, damping=0.01)}


@pytest.mark.parametrize("law", [RATTLING, CLOSED], ids=["rattling", "closed"])
@pytest.mark.parametrize("rocker", ["rigid", "modal", pytest.param("beam", marks=pytest.mark.slow)])
def test_crank_rocker_with_play_is_fine(rocker, law):
    fine(simulate(rattling(law, rocker=ROCKERS[rocker]), 0.02))


def test_ideal_linkage_is_fine_and_so_is_a_swing():
    fine(
        simulate(
            crank_rocker(Rigid(BARS), speed=10 * np.pi, section=BARS, angle=0.5), 0.2, solver=Exudyn(Controlled(max_step=5e-4))
        )
    )
    fine(simulate(pendulum(1.5), 2.0))


# --- contacts ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Backwards(Hertz):
    """Damping with the wrong sign: it drives."""

    def force(self, depth, rate, onset):
        return self.elastic(depth) * (1 - 0.5 * rate / onset)


@dataclass(frozen=True)
class Driving(NoFriction):
    """Friction with the wrong sign."""

    def coefficient(self, speed):
        return -0.3 * np.tanh(speed / 0.01)


def test_contact_damping_of_the_wrong_sign_makes_energy():
    assert "makes energy" in suspect(simulate(block(G, Backwards(1e8)), 0.3), "ENERGY")
    suspect(simulate(rattling(Backwards(K), with_play="B"), 0.005, timeout=20), "ENERGY")


@dataclass(frozen=True)
class Interpreted(Backwards):
    """The same, beyond what can be compiled."""

    def force(self, depth, rate, onset):
        return super().force(depth, rate, [onset][0])


@pytest.mark.slow
@pytest.mark.parametrize("law", [Backwards(1.01 * K), Interpreted(1.01 * K)], ids=["compiled", "plain"])
def test_law_for_which_no_step_is_short_enough_ends_by_name(law, monkeypatch):
    """The engine would reject the same step for ever, past any time limit."""
    for module in (kernel, callback):
        monkeypatch.setattr(module, "PATIENCE", 30_000)
    assert clearance.kernel(law, FRICTION).compiled == (type(law) is Backwards)
    result = simulate(rattling(law), 0.05, timeout=20)
    assert result.status is Status.NEWTON_DIVERGED and "rejected again and again" in result.message


def test_friction_of_the_wrong_sign_makes_energy():
    reason = suspect(simulate(rattling(friction=Driving(), with_play="B"), 0.005, timeout=20), "ENERGY")
    assert "'taken_friction' gives back" in reason


@dataclass(frozen=True)
class Sticky(KelvinVoigt):
    """A dashpot that pulls when the contact opens, as no contact does."""

    def force(self, depth, rate, onset):
        return self.stiffness * depth + self.damping * rate


def test_a_contact_that_pulls():
    assert "'A.contact_force' pulls with -" in suspect(simulate(block(G, Sticky(1e6, 1e3)), 0.3), "CONTACT")


def run_of(mechanism, duration, solver=None):
    """A run and its result, to be spoilt."""
    solver = solver or Exudyn()
    return once(mechanism, duration, solver, None, None), simulate(mechanism, duration, solver=solver)


@pytest.fixture(scope="module")
def fallen():
    return run_of(block(G, Hertz(1e8)), 0.3)


def complaints(run, **signals):
    """What is said of a run some of whose signals were replaced."""
    made, result = run
    return list(suspicions(made, replace(result, signals=result.signals | signals)))


def test_a_contact_that_acts_without_touching(fallen):
    assert complaints(fallen) == []
    apart = np.zeros_like(fallen[1].time)
    said = complaints(fallen, **{"A.penetration": apart})
    assert any("CONTACT: 'A.contact_force' acts without touching" in each for each in said)


def test_a_signal_that_is_no_number_and_time_that_turns_back(fallen):
    made, result = fallen
    spoilt = result.signals["A.x"].copy()
    spoilt[7] = np.nan
    assert complaints(fallen, **{"A.x": spoilt}) == ["NOT_FINITE: a signal is not finite"]
    time = result.time.copy()
    time[5] = time[7]
    assert list(suspicions(made, replace(result, time=time))) == ["TIME: time does not increase"]


def test_a_run_that_failed_is_not_checked(fallen):
    made, result = fallen
    failed = replace(result, status=Status.NOT_FINITE, message="why", time=result.time[::-1])
    assert list(suspicions(made, failed)) == []


def test_a_stop_and_a_bush_pierced():
    assert "'A' is" in suspect(simulate(block(G, Hertz(10.0)), 0.4), "PENETRATION")
    soft = Impact(1e-4 * K, 2.5, 1e-5)
    assert "more than 0.00025 m, its clearance" in suspect(simulate(rattling(soft), 0.01), "PENETRATION")


# --- branches ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("body", [Beam(STRIP), Cable(STRIP)], ids=["beam", "cable"])
def test_a_strip_that_stays_straight(body):
    """Perfectly straight and pressed in line: the integrator does not leave the branch that no strip takes."""
    assert "'strip' is" in suspect(simulate(pressed(body, 0.3 * LENGTH, 1.0), 1.0), "UNBUCKLED")


def test_a_bowed_strip_buckles_and_is_fine():
    strip = Beam(STRIP.damped(0.5, LENGTH), elements=8, imperfection=1e-3 * LENGTH)
    result = fine(simulate(pressed(strip, 0.3 * LENGTH, 10.0), 10.0))
    load = STRIP.euler_load(LENGTH) / np.pi**2 * float(pinned.load(0.3))
    late = result.time > 9.9
    assert np.median(result.signals["drive.force"][late]) == pytest.approx(load, rel=0.05)


def test_a_strut_whose_ends_meet():
    suspect(simulate(pressed(Strut(STRIP), 0.995 * LENGTH, 1.0), 1.0), "CROSSED")


LENGTHS = CrankRocker()


def short_of_dead_centre(room, solver=Closure):
    """A turn of a linkage whose frame is so short that coupler and rocker come into line but for this, m."""
    lengths = LENGTHS._replace(frame=LENGTHS.crank + LENGTHS.coupler - LENGTHS.rocker + room)
    mechanism = crank_rocker(Rigid(BARS), speed=10 * np.pi, section=BARS, lengths=lengths, angle=0.5)
    return simulate(mechanism, 0.2, solver=solver(Controlled(max_step=2e-4)))


def test_a_linkage_that_meets_a_dead_centre():
    fine(short_of_dead_centre(1e-2))
    fine(short_of_dead_centre(1e-5))
    result = short_of_dead_centre(0.0)
    assert result.status is Status.SINGULAR and "coupler and rocker in line" in result.message
    assert "is not determined" in result.message
    assert result.time[-1] == pytest.approx(0.1 - 0.5 / (10 * np.pi) + 0.1, abs=1e-6)  # the crank at 2 pi


def test_a_linkage_that_is_integrated_through_a_dead_centre():
    suspect(short_of_dead_centre(1e-5, Exudyn), "CLOSURE")
    assert "is not determined" in suspect(short_of_dead_centre(0.0, Exudyn), "BRANCH")


def test_equal_steps_too_long_for_a_linkage():
    mechanism = crank_rocker(Rigid(BARS), speed=10 * np.pi, section=BARS, angle=0.5)
    assert "loop closure gives another" in suspect(simulate(mechanism, 0.2, solver=Exudyn(Equal(20))), "CLOSURE")
    fine(simulate(mechanism, 0.2, solver=Exudyn(Equal(2000))))


# --- mesh -------------------------------------------------------------------------------------------------------------

COARSE = {
    "1 of 3 nodes": Beam(WET, elements=1, imperfection=-1e-4 * LENGTH),
    "2 of 3 nodes": Beam(WET, elements=2, imperfection=-1e-4 * LENGTH),
    "2 of 2 nodes": Beam(WET, elements=2, nodes=2, imperfection=-1e-4 * LENGTH),
    "1 cable": Cable(WET, elements=1, imperfection=-1e-4 * LENGTH),
    "2 cables": Cable(WET, elements=2, imperfection=-1e-4 * LENGTH),
}


@pytest.mark.parametrize("mesh", COARSE)
def test_a_mesh_too_coarse_for_a_rebound(mesh):
    """By the strip's own curvature; a run without settings is held against one of other elements, and says how far it is off."""
    assert f"allowed {STRUCK:g}" in suspect(simulate(striking(COARSE[mesh]), 2.8, solver=Exudyn()), "MESH")
    assert "a strip names its elements" in suspect(simulate(striking(COARSE[mesh]), 2.8), "ACCURACY")


@pytest.mark.parametrize("body", [Beam(WET, elements=1, imperfection=1e-3), Beam(WET, elements=4, nodes=2, imperfection=1e-3)])
def test_a_mesh_too_coarse_for_a_load(body):
    assert f"allowed {MESH:g}" in suspect(simulate(pressed(body, 0.3 * LENGTH, 10.0), 10.0), "MESH")


@pytest.mark.parametrize("held", ["neither", "start", "both"])
def test_the_curvature_is_none_at_an_end_where_nothing_exerts_a_moment(held):
    clamped = {"neither": "", "start": "A", "both": "AB"}[held]
    joints = [(Weld if end in clamped else Revolute)(end, "ground", "strip") for end in "AB"]
    points, body = {"A": (0.0, 0.0), "B": (LENGTH, 0.0)}, Beam(WET, elements=4)
    mechanism = Mechanism(points, [Link("strip", "A", "B", body)], joints, gravity=(0.0, -G))
    record = once(mechanism, 1e-3, Exudyn(), None, None).record
    bending, pieces = record.links["strip"].strains()[-1].value, record.links["strip"].pieces
    ((kappa, places),) = _stretches(record, "strip", bending, pieces)
    assert kappa.shape[1] == len(places) == 8 + 2 - len(clamped)
    for end, at, place in (("A", 0, 0.0), ("B", -1, LENGTH)):
        assert (places[at] == pytest.approx(place, abs=1e-12)) == (end not in clamped)
        assert (not kappa[:, at].any()) == (end not in clamped)


def test_the_angle_by_which_elements_turn_adds_to_their_error():
    """A strip bent to an arc has a curvature that any elements give; what they miss is by how far they turn."""
    arc = Section(0.03, 1e-3).damped(0.5, LENGTH)
    points, body = {"A": (0.0, 0.0), "B": (LENGTH, 0.0)}, Cable(arc, elements=4)
    moment = 2.0 * arc.bending_stiffness / LENGTH
    loads = [Torque("strip:B", lambda t, angle, speed: moment * min(t / 2, 1.0))]
    mechanism = Mechanism(points, [Link("strip", "A", "B", body)], [Weld("A", "ground", "strip")], loads=loads)
    record = once(mechanism, 3.0, Exudyn(), None, None).record
    c, order = body.worth.far
    assert mesh_error(record, "strip") == pytest.approx(c * 0.5**order, rel=0.2)


@pytest.mark.parametrize(
    ("make", "order"),
    [(lambda n: Beam(WET, elements=n, nodes=2, imperfection=1e-3), 2), (lambda n: Beam(WET, elements=n, imperfection=1e-3), 4)],
    ids=["2 nodes", "3 nodes"],
)
def test_mesh_error_is_that_of_the_load_and_falls_as_it_does(make, order):
    """Against the exact load, at a third of the length's shortening; held in place, so that nothing else errs."""
    from buckler.mbs.engine.pressed import pinned_strip

    found, right = [], []
    for n in (4, 8, 16):
        run = once(pressed(make(n), 0.3 * LENGTH, 10.0), 10.0, Exudyn(), None, None)
        found.append(mesh_error(run.record, "strip"))
        straight = replace(make(n), imperfection=0.0)
        right.append(abs(float(pinned_strip(straight, LENGTH, [0.3]).load[0]) / float(pinned.load(0.3)) - 1))
    assert rates(found) == pytest.approx([order, order], abs=0.5)
    assert 0.3 < found[0] / right[0] < 4


# --- straight strips --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("share", [1e-4, 4.9e-3])
@pytest.mark.parametrize("body", [Beam(STRIP), Cable(STRIP), Beam(STRIP, elements=16)], ids=["beam", "cable", "fine beam"])
def test_a_straight_strip_pressed_beyond_its_critical_load(body, share):
    """130 and 6400 times the critical load, the shortening far below half a per cent."""
    said = suspect(simulate(pressed(body, share * LENGTH, 1.0), 1.0), "UNBUCKLED")
    assert "straight, though its bending grows at" in said


def test_a_strip_with_a_bow_may_be_pressed_beyond_it():
    fine(simulate(pressed(Beam(WET, imperfection=1e-3), 4.9e-3 * LENGTH, 1.0), 1.0))


def test_a_straight_strip_may_be_pressed_beyond_it_for_a_moment():
    """In a tenth of a period nothing can have grown."""
    brief = 0.1 / STRIP.first_frequency(LENGTH)
    moved = replace(pressed(Beam(STRIP), 0.0, 1.0), drives=[Drive("A", 1e-5 * LENGTH / brief)])
    result = simulate(moved, brief)
    assert -result.signals["strip.axial_force"].min() > 5 * STRIP.euler_load(LENGTH)
    assert "UNBUCKLED" not in result.message


# --- steps ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("mechanism", "duration", "solver"),
    [
        (pendulum(2.5), 1.5, Exudyn(Equal(20))),
        (pendulum(2.5), 1.5, Exudyn(Equal(60))),
        (striking(COUPLER["strut"]), 2.8, Exudyn(Equal(200))),
        (rattling(CLOSED), 0.01, Exudyn(Equal(1200))),
        (rattling(), 0.01, Exudyn(Controlled(tolerance=1.0))),
        (striking(COUPLER["strut"]), 2.8, Exudyn(Controlled(tolerance=0.1))),
    ],
    ids=["swing", "finer swing", "strut", "closed joints", "play, tolerance", "strut, tolerance"],
)
def test_steps_too_long(mechanism, duration, solver):
    suspect(simulate(mechanism, duration, solver=solver, timeout=20), "STEPS")


@pytest.mark.parametrize(
    ("mechanism", "duration", "steps"),
    [(pendulum(2.5), 1.5, 40), (block(G, CarvalhoMartins(1e6, 0.8)), 0.3, 400), (rattling(with_play="B"), 0.005, 400)],
    ids=["swing", "stop", "play"],
)
def test_a_stretch_that_is_the_run_is_the_run_at_half_its_steps(mechanism, duration, steps):
    """The window starts from the run's own state, in a new scene: at the run's start it must do what a new run does."""
    made, _ = run_of(mechanism, duration, Exudyn(Equal(steps)))
    whole = simulate(mechanism, duration, solver=Exudyn(Equal(2 * steps)))
    window = made.again(0, steps)
    assert window.time == pytest.approx(whole.time)
    for point in mechanism.points:
        ends = window.point(point)[0][-1]
        assert ends == pytest.approx([whole.signals[f"{point}.{axis}"][-1] for axis in "xy"], abs=2e-6)


def test_a_stretch_of_a_run_recorded_seldom_is_recorded_at_the_same_times():
    mechanism = pendulum(2.5)
    made, _ = run_of(mechanism, 1.5, Exudyn(Equal(240, record_every=4)))
    whole = simulate(mechanism, 1.5, solver=Exudyn(Equal(480)))
    window = made.again(0, 60)
    assert window.time == pytest.approx(made.record.time) and window.time == pytest.approx(whole.time[::8])
    assert window.point("A")[0][-1] == pytest.approx([whole.signals["A.x"][-1], whole.signals["A.y"][-1]], abs=1e-9)


def test_a_stretch_that_begins_in_a_contact_remembers_its_onset():
    """Half way through an impact whose law knows the speed it began with."""
    made, result = run_of(rattling(ExactRestitution(8e9, 0.5), with_play="B"), 0.003, Exudyn(Equal(3000)))
    peak = int(np.argmax(result.signals["B.normal_force"]))
    window = made.again(peak, peak + 5)
    force = collect(window)["B.normal_force"].values[::2]
    assert force == pytest.approx(result.signals["B.normal_force"][peak : peak + 6], rel=0.01)


def test_a_stretch_amid_a_smooth_run_differs_by_its_second_order_error():
    changes = []
    for steps in (40, 80, 160):
        made, result = run_of(pendulum(2.5), 1.5, Exudyn(Equal(steps)))
        window = made.again(steps // 4, steps // 2)
        assert window.time[[0, -1]] == pytest.approx(result.time[[steps // 4, steps // 2]])
        changes.append(np.abs(window.point("A")[0][::2] - made.record.point("A")[0][steps // 4 : steps // 2 + 1]).max())
    assert rates(changes) == pytest.approx([2, 2], abs=0.3)


def test_a_stretch_leaves_the_run_alone():
    mechanism = block(G, Hertz(1e8))
    made, _ = run_of(mechanism, 0.3)
    record = made.record
    kept = [part.copy() for part in (record.time, record.links["bar"].q, record.channel("A", "force"))]
    made.again(3, 20)
    for part, before in zip((record.time, record.links["bar"].q, record.channel("A", "force")), kept, strict=True):
        assert (part == before).all()
    assert build(mechanism).summary() == made.summary


# --- no false alarm -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("stiffness", [1e5, 1e7])
@pytest.mark.parametrize("damping", [0.0, 100.0])
@pytest.mark.parametrize("duration", [0.1, 5.0])
def test_a_slider_that_sticks_is_fine(stiffness, damping, duration):
    """On a slope of 8 degrees, below its angle of friction: it does not move but for the bend of its bristles."""
    slope = np.radians(8.0)
    mechanism = block(friction=Stiction(0.3, 0.3, 1e-2, stiffness, damping), along=(np.cos(slope), np.sin(slope)))
    result = fine(simulate(replace(mechanism, gravity=(0.0, -G)), duration))
    pull = mechanism.guide("A").mass * G * np.sin(slope)
    assert np.hypot(result.signals["A.x"], result.signals["A.y"]).max() < 1e-3 * 0.1
    drag = result.signals["A.friction_force"]
    assert -2.1 * pull < drag.min() and drag.max() < 1e-3 * pull  # bristles that are not damped ring
    if damping or duration > 1:
        assert drag[-1] == pytest.approx(-pull, rel=0.05)


def column(body, share, mass=0.1, weight=False):
    """A strip between a pin and a slider under a share of its critical load: suddenly, or as the slider's weight."""
    load = share * WET.euler_load(LENGTH)
    return Mechanism(
        points={"A": (0, LENGTH), "B": (0, 0)},
        links=[Link("strip", "A", "B", body)],
        joints=[Revolute("B", "ground", "strip")],
        guides=[Guide("A", "strip", (0, 1), load / G if weight else mass)],
        loads=[] if weight else [Force("A", (0.0, -load))],
        gravity=(0.0, -G) if weight else (0.0, 0.0),
    )


@pytest.mark.parametrize(
    "mechanism",
    [
        column(Beam(WET, imperfection=1e-4 * LENGTH), 0.9),
        column(Beam(WET, imperfection=1e-4 * LENGTH), 0.9, mass=0.0),
        column(Cable(WET, imperfection=1e-3 * LENGTH), 0.9),
        column(Beam(WET, imperfection=1e-4 * LENGTH), 0.9, weight=True),
    ],
    ids=["beam", "light", "cable", "weight"],
)
def test_a_column_near_its_critical_load_is_fine(mechanism):
    """It hardly moves: the load's work is that of an axial vibration that steps leave out."""
    fine(simulate(mechanism, 1.0))


def test_a_double_pendulum_that_is_accurate_is_fine():
    """The ledger is that of the finest run, which extrapolation made more accurate."""
    places = {"O": (0, 0), "A": (0.5, 0), "B": (1.0, 0)}
    links = [Link("first", "O", "A", BAR), Link("second", "A", "B", BAR)]
    joints = [Revolute("O", "ground", "first"), Revolute("A", "first", "second")]
    fine(simulate(Mechanism(points=places, links=links, joints=joints, gravity=(0.0, -G)), 2.0, 1e-3))


def test_a_pin_deeper_than_its_clearance_is_remarked():
    """Its law is followed, as it would be with any clearance."""
    result = fine(simulate(rattling(Hertz(K), gap=1e-6), 0.003))
    assert any("more than its clearance 1e-06 m" in note for note in result.provenance["notes"])


@pytest.mark.parametrize("duration", [1e-3, 0.5])
def test_ramps_and_rest_are_fine(duration):
    fine(simulate(slider_crank(Rigid(BARS), law=None, mass=0.3, speed=Ramp(0.0, 10.0, duration)), 1.0))
    fine(simulate(block(), 1.0))
    fine(simulate(pendulum(0.0), 1.0))
