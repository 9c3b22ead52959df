"""The solver `Closure`: chosen where it suits, named in the provenance, refused elsewhere, in agreement with the others."""

import numpy as np
import pytest
from simulations import BAR, block, fine, pendulum

from buckler.mbs import (
    Beam,
    Closure,
    Controlled,
    Drive,
    Equal,
    Exudyn,
    Guide,
    Link,
    Mechanism,
    Revolute,
    Section,
    Spectral,
    Torque,
    crank_rocker,
    simulate,
    slider_crank,
)  # fmt: skip
from buckler.mbs.functions import Piecewise
from buckler.mbs.kinematics.exact import once
from buckler.mbs.laws import Coulomb
from buckler.mbs.process import has_compiler

BEAM = Beam(Section(0.02, 1e-3))


def kind(result):
    return result.provenance["settings"]["kind"]


def test_it_answers_by_default_where_drives_decide_the_motion_and_says_so():
    chosen = fine(simulate(crank_rocker(BAR, speed=10.0), 0.1))
    assert kind(chosen) == "Closure" and chosen.work["newton_iterations"] == 0 and "exudyn_runs" not in chosen.work
    assert chosen.provenance["scene"] == {"Rigid": 3, "Revolute": 4, "Drive": 1, "coordinates": 9, "constraints": 9}
    assert kind(simulate(crank_rocker(BAR, speed=10.0), 0.1, accuracy=1e-3)) == "Closure"
    assert kind(simulate(pendulum(0.5), 0.1)) == ("Spectral" if has_compiler() else "Exudyn")


def test_the_solver_that_is_asked_for_answers():
    for solver in (Exudyn(Equal(200)), Spectral(), Closure()):
        assert kind(fine(simulate(crank_rocker(BAR, speed=10.0), 0.1, solver=solver))) == type(solver).__name__


@pytest.mark.parametrize(
    "solver", [Exudyn(Equal(4000), spectral_radius=0.6), Spectral(Controlled(tolerance=1e-9))], ids=["Exudyn", "Spectral"]
)
def test_three_solvers_agree_in_all_signals_and_their_signs(solver):
    mechanism = crank_rocker(BAR, speed=10.0)
    exact, other = (simulate(mechanism, 0.5, solver=s) for s in (Closure(Controlled(max_step=1e-4)), solver))
    late = other.time > 0.1  # generalized-alpha feels its start for a few steps
    for name, unit in exact.units.items():
        scale = max(np.abs(values).max() for n, values in exact.signals.items() if exact.units[n] == unit)
        assert np.abs(other[name] - exact.at(name, other.time))[late].max() < 2e-5 * scale, name


@pytest.mark.parametrize(("mechanism", "reason"), [
    (slider_crank(BEAM, law=None, mass=0.3, speed=1.25), "link 'coupler' bends"),
    (pendulum(0.5), "leave the linkage free, or nothing drives it"),
    (block(friction=Coulomb(0.1), speed=0.2), "friction of 'guide A' follows its reaction"),
], ids=["flexible", "free", "friction"])  # fmt: skip
def test_what_it_cannot_answer_is_refused_in_one_line(mechanism, reason):
    with pytest.raises(ValueError, match=rf"^solver = Closure\(\): joints and drives alone must decide .*; .*{reason}$"):
        simulate(mechanism, 0.1, solver=Closure())


def test_loads_are_felt_by_the_drive():
    """A torque on the crank is taken from the drive's, to the last digit."""
    mechanism = crank_rocker(BAR, speed=10.0)
    free, loaded = (simulate(m, 0.1, solver=Closure()) for m in (mechanism, mechanism.__class__(
        **{**vars(mechanism), "loads": [Torque("crank", 2.0)]})))  # fmt: skip
    assert loaded["drive.torque"] == pytest.approx(free["drive.torque"] - 2.0, abs=1e-9)


def test_both_sides_of_a_jump_are_samples_of_a_run_that_locks_early():
    linkage = Mechanism(
        {"O": (0, 0), "A": (0.1, 0.1), "B": (0.4, 0)}, [Link("a", "O", "A", BAR), Link("b", "A", "B", BAR)],
        [Revolute("O", "ground", "a"), Revolute("A", "a", "b")], guides=[Guide("B", "b")], drives=[Drive("B", 0.1)],
        loads=[Torque("a", Piecewise(lambda t, angle, spin: float(t > 0.3), breaks=(0.3,)))],
    )  # fmt: skip
    record = once(linkage, 2.0, Closure(Controlled(contact_resolution=5000)), None, None).record
    k = int(np.searchsorted(record.time, 0.3 + 1e-9))
    assert record.time[-1] < 1.0 and record.time[k - 1] - record.time[k - 2] < 1e-11
