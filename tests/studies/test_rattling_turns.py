"""Means over turns: of members, with their errors, objections by name; energies at the tolerance that studies have."""

import numpy as np
import pytest

pytest.importorskip("numba")

from buckler.mbs import Controlled, Spectral, simulate
from buckler.studies.rattling.bars import PlayParameters, RockerParameters
from buckler.studies.rattling.turns import DEPTHS, FORCE, period, run_turns, solver

READINGS = (FORCE.format(place="B"), "rms(coupler.ax)", "onsets(B.normal_force)")


def found(batch=0, **given):
    p = RockerParameters(**given)
    return run_turns(p, [p.bars()], READINGS, batch)[0]


@pytest.fixture(scope="module")
def rattling():
    return found(members=6, cycles=2)


def test_rattling_joints_scatter_and_their_threads_do_not_matter(rattling):
    again, other = found(members=6, cycles=2, workers=1), found(batch=1, members=6, cycles=2)
    assert rattling == again and rattling.notes == () and rattling.depth < 1
    for name in READINGS:
        mean, error, n = rattling.means[name]
        assert n == 6 and 0 < error < 0.15 * mean
        assert 0 < abs(other.means[name].value - mean) < 5 * np.hypot(error, other.means[name].error)
    assert 20 < rattling.means["onsets(B.normal_force)"].value < 150


def test_closed_joints_repeat_themselves():
    closed = found(damping_unit="N.s/mm", members=2, cycles=1)
    force, rms, impacts = (closed.means[name] for name in READINGS)
    assert force.value > 5000 and force.error < 0.02 * force.value  # the closing of the gap at each reversal
    assert rms.error < 0.05 * rms.value and impacts.value < 5


def test_a_pin_deeper_than_its_clearance_and_a_run_that_fails_have_names(monkeypatch):
    deep = found(clearance=5e-6, members=2, cycles=1, settle=0)
    assert deep.depth > 1 and deep.notes[0].startswith("PENETRATION: a pin")
    p = RockerParameters(members=2, cycles=1, settle=0)
    monkeypatch.setattr("buckler.studies.rattling.turns.solver", lambda *_: Spectral(Controlled(1e-6, max_steps=10)))
    (failed,) = run_turns(p, [p.bars()], READINGS)
    assert failed.notes[0].startswith("FAILED: 2 of 2 runs, one by TOO_MANY_STEPS") and np.isnan(failed.depth)


@pytest.mark.parametrize(("unit", "bound"), [("N.s/m", 1e-3), ("N.s/mm", 2e-3)])
def test_energies_balance_at_the_tolerance_of_studies(unit, bound):
    """Of closed joints the ledger sees the ends of steps only, which go over a part of each impact."""
    p = RockerParameters(damping_unit=unit)
    made = p.bars()
    assert simulate(made, period(made) / 4, solver=solver(made, p.tolerance), ledger=True).energy_balance < bound


def test_a_crank_that_stands_or_has_no_one_speed_has_no_turns():
    with pytest.raises(ValueError, match=r"speed = 0.0 rad/s: turns need a crank that turns"):
        period(PlayParameters().bars(speed=0.0))
    assert len(DEPTHS) == 4
