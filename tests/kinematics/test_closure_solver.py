"""The solver `Closure`: chosen where it suits, named in the provenance, refused elsewhere, in agreement with the others."""

import numpy as np
import pytest
from simulations import BAR, block, fine, pendulum

from buckler import mbs
from buckler.mbs.functions import Piecewise
from buckler.mbs.kinematics.determined import Follower, UnclosedError
from buckler.mbs.kinematics.exact import once
from buckler.mbs.laws import Coulomb
from buckler.mbs.library import CrankRocker
from buckler.mbs.process import has_compiler

BEAM = mbs.Beam(mbs.Section(0.02, 1e-3))


def kind(result):
    return result.provenance["settings"]["kind"]


def test_it_answers_by_default_where_drives_decide_the_motion_and_says_so():
    chosen = fine(mbs.simulate(mbs.crank_rocker(BAR, speed=10.0), 0.1))
    assert kind(chosen) == "Closure" and chosen.work["newton_iterations"] == 0 and "exudyn_runs" not in chosen.work
    assert chosen.provenance["scene"] == {"Rigid": 3, "Revolute": 4, "Drive": 1, "coordinates": 9, "constraints": 9}
    assert kind(mbs.simulate(mbs.crank_rocker(BAR, speed=10.0), 0.1, accuracy=1e-3)) == "Closure"
    assert kind(mbs.simulate(pendulum(0.5), 0.1)) == ("Spectral" if has_compiler() else "Exudyn")


@pytest.mark.parametrize("solver", [mbs.Exudyn(mbs.Equal(4000), spectral_radius=0.6), mbs.Spectral(mbs.Controlled(1e-9))])
def test_three_solvers_agree_in_all_signals_and_their_signs(solver):
    mechanism = mbs.crank_rocker(BAR, speed=10.0)
    exact, other = (fine(mbs.simulate(mechanism, 0.5, solver=s)) for s in (mbs.Closure(mbs.Controlled(max_step=1e-4)), solver))
    assert (kind(exact), kind(other)) == ("Closure", type(solver).__name__)
    late = other.time > 0.1  # generalized-alpha feels its start for a few steps
    for name, unit in exact.units.items():
        scale = max(np.abs(values).max() for n, values in exact.signals.items() if exact.units[n] == unit)
        assert np.abs(other[name] - exact.at(name, other.time))[late].max() < 2e-5 * scale, name


@pytest.mark.parametrize(("mechanism", "reason"), [
    (mbs.slider_crank(BEAM, law=None, mass=0.3, speed=1.25), "link 'coupler' bends"),
    (pendulum(0.5), "leave the linkage free, or nothing drives it"),
    (block(friction=Coulomb(0.1), speed=0.2), "friction of 'guide A' follows its reaction"),
], ids=["flexible", "free", "friction"])  # fmt: skip
def test_what_it_cannot_answer_is_refused_in_one_line(mechanism, reason):
    with pytest.raises(ValueError, match=rf"^solver = Closure\(\): joints and drives alone must decide .*; .*{reason}$"):
        mbs.simulate(mechanism, 0.1, solver=mbs.Closure())


def test_loads_are_felt_by_the_drive():
    """A torque on the crank is taken from the drive's, to the last digit."""
    mechanism = mbs.crank_rocker(BAR, speed=10.0)
    free, loaded = (mbs.simulate(m, 0.1, solver=mbs.Closure()) for m in (mechanism, mechanism.__class__(
        **{**vars(mechanism), "loads": [mbs.Torque("crank", 2.0)]})))  # fmt: skip
    assert loaded["drive.torque"] == pytest.approx(free["drive.torque"] - 2.0, abs=1e-9)


def test_both_sides_of_a_jump_are_samples_of_a_run_that_locks_early():
    linkage = mbs.Mechanism(
        {"O": (0, 0), "A": (0.1, 0.1), "B": (0.4, 0)}, [mbs.Link("a", "O", "A", BAR), mbs.Link("b", "A", "B", BAR)],
        [mbs.Revolute("O", "ground", "a"), mbs.Revolute("A", "a", "b")], guides=[mbs.Guide("B", "b")],
        drives=[mbs.Drive("B", 0.1)], loads=[mbs.Torque("a", Piecewise(lambda t, angle, spin: float(t > 0.3), breaks=(0.3,)))],
    )  # fmt: skip
    record = once(linkage, 2.0, mbs.Closure(mbs.Controlled(contact_resolution=5000)), None, None).record
    k = int(np.searchsorted(record.time, 0.3 + 1e-9))
    assert record.time[-1] < 1.0 and record.time[k - 1] - record.time[k - 2] < 1e-11


def test_loops_that_do_not_close_between_two_times_end_the_run(monkeypatch):
    """As from 10 ms on."""
    whole = Follower.at

    def torn(self, times):
        if times[-1] > 0.01:
            raise UnclosedError(float(times[np.argmax(times > 0.01)]))
        return whole(self, times)

    monkeypatch.setattr(Follower, "at", torn)
    result = mbs.simulate(mbs.crank_rocker(BAR, speed=30.0), 0.05)
    assert result.status is mbs.Status.SINGULAR and "loops do not close at t = 0.01" in result.message
    assert 0.0 < result.time[-1] <= 0.01


def test_error_covers_forces_between_the_samples():
    """A quick return's crank turns a rocker through a slot: tan(angle) = (h + r sin wt)/(r cos wt), torque J angle'' angle'/w."""
    r, h, w, inertia = 0.08, 0.2, 10.0, 0.1
    slope = np.array([r, h]) / np.hypot(r, h)
    mechanism = mbs.Mechanism(
        points={"O": (0, 0), "A": (r, 0), "C": (0, -h), "E": tuple(0.4 * slope - [0, h])},
        links=[
            mbs.Link("crank", "O", "A", mbs.Rigid.of(mass=0.1, inertia=1e-4, centre=(0, 0))),
            mbs.Link("rocker", "C", "E", mbs.Rigid.of(mass=1.0, inertia=inertia, centre=(0, 0))),
        ],
        joints=[
            mbs.Revolute("O", "ground", "crank"), mbs.Revolute("C", "ground", "rocker"),
            mbs.Slot("A", "crank", "rocker", along=tuple(slope)),
        ],
        drives=[mbs.Drive("crank", w)],
    )  # fmt: skip
    result = fine(mbs.simulate(mechanism, 1.0))
    t = np.linspace(0, 1, 20001)
    square = r**2 + h**2 + 2 * h * r * np.sin(w * t)  # of the distance from the rocker's pivot to the pin
    rate = w * (r**2 + h * r * np.sin(w * t)) / square
    second = w**2 * h * r * np.cos(w * t) * (h**2 - r**2) / square**2
    error = np.abs(result.at("drive.torque", t) - inertia * second * rate / w)
    assert error.max() < result.error.absolute("drive.torque", "peak") < 20 * error.max()


@pytest.mark.parametrize("room", [1e-8, 3e-5, 1e-3])
@pytest.mark.parametrize("angle", [0.5, -0.3, -0.01])
def test_peaks_of_forces_near_a_dead_centre_are_seen_and_their_errors_told(room, angle):
    """Coupler and rocker miss a line by this, m; the compiled solver, whose steps adapt to the motion, knows the peaks."""
    bars = CrankRocker()
    lengths = bars._replace(frame=bars.crank + bars.coupler - bars.rocker + room)
    mechanism = mbs.crank_rocker(BAR, speed=10.0, lengths=lengths, angle=angle)
    result = fine(mbs.simulate(mechanism, 0.7))
    exact = mbs.simulate(mechanism, 0.7, solver=mbs.Spectral(mbs.Controlled(tolerance=1e-8, max_step=1e-3)))
    for name in ("C.ground-rocker.fx", "C.ground-rocker.fy", "drive.torque"):
        peak, right = abs(result[name]).max(), abs(exact[name]).max()
        assert peak == pytest.approx(right, rel=0.02), name
        assert abs(peak - right) < result.error.absolute(name, "peak") + 1e-3 * right, name


@pytest.mark.parametrize("angle", [0.5, -0.3])
@pytest.mark.parametrize("speed", [0.1, 30.0])
@pytest.mark.parametrize(("crank", "coupler", "rocker"), [(0.105, 0.272, 0.175), (0.08, 0.25, 0.175), (0.12, 0.3, 0.2)])
def test_rounding_leads_past_no_dead_centre(crank, coupler, rocker, speed, angle):
    """The lengths allow all bars to lie in one line but for their rounding: what follows is not determined."""
    lengths = CrankRocker(crank, coupler, rocker, crank + coupler - rocker)
    result = mbs.simulate(mbs.crank_rocker(BAR, speed=speed, lengths=lengths, angle=angle), 7 / speed)
    assert result.status is mbs.Status.SINGULAR, result.message
    assert result.time[-1] * speed == pytest.approx(-angle % (2 * np.pi), abs=1e-5)
