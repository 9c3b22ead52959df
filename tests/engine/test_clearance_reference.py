"""Joints with clearance in the engine against the compiled reference, which shares with it the contact laws and nothing else."""

from dataclasses import replace

import numpy as np
import pytest
from clearance_pair import distance, forces
from fourbar import FourBar, run
from simulations import fine

pytest.importorskip("numba")

from buckler.mbs import Controlled, Exudyn, Modal, simulate
from buckler.mbs.library import CLOSED

BAR = FourBar()
"""Joints that rattle, 253 N s/m: 0.25 mm, 300 r/min."""
SHORT = 0.010
"""Time, s, for which rattling motion may be compared: after it an offset grows too fast."""


def run_engine(bar, duration, tolerance, rocker=None):
    """A run that may be trusted, its energy in balance."""
    solver = Exudyn(Controlled(tolerance=tolerance, max_step=min(duration / 100, bar.period / 720)))
    result = fine(simulate(bar.mechanism(rocker), duration, solver=solver, ledger=True))
    assert result.energy_balance < 1e-3
    return result


def run_reference(bar, duration, tolerance=1e-12):
    """The reference, sampled each microsecond, or 40 thousand times, so that it can be read between its samples."""
    found = run(bar, duration, tolerance=tolerance, samples=min(round(1e6 * duration), 40_000) + 1)
    assert found.ok and found.energy_balance < 1e-7
    return found


def slope(results, errors):
    """Order of convergence in the number of steps, first to last."""
    return -np.log(errors[-1] / errors[0]) / np.log(results[-1].work["steps"] / results[0].work["steps"])


# --- trajectories -----------------------------------------------------------------------------------------------------


def test_rattling_rigid_bars_move_as_the_reference_says():
    """Fourth order in the steps at least, down to 1e-11 m; each joint is struck as often, and as hard.

    The integrator is of fifth order; the onset of each contact falls within a step. Rounding, which differs between
    processors, moves the slope between 4.0 and 4.4.
    """
    run = run_reference(BAR, SHORT)
    results = [run_engine(BAR, SHORT, tolerance) for tolerance in (1e-4, 1e-5, 1e-6, 1e-8)]
    errors = [distance(result, run).max() for result in results]
    assert errors[-1] < 1e-10
    assert (np.diff(errors) < 0).all() and slope(results, errors) > 3.8
    struck = (np.diff((run.depth > 0).astype(int), axis=0) > 0).sum(axis=0)  # samples are a microsecond apart
    assert struck.sum() >= 20
    assert [results[-1].signals[f"{point}.contacts"][-1] for point in "OABC"] == list(struck)
    np.testing.assert_allclose(forces(results[-1]).max(axis=0), run.peak_force.max(axis=0), rtol=1e-4)
    for what in ("contact", "friction"):
        lost = [results[-1].energy[f"{point}.taken_{what}"][-1] for point in "OABC"]
        np.testing.assert_allclose(lost, getattr(run, f"taken_{what}")[-1], rtol=1e-3)
        assert sum(lost) == pytest.approx(results[-1].energy[f"taken_{what}"][-1], rel=1e-12)


def test_closed_rigid_bars_move_as_the_reference_says():
    """A quarter of a turn with stiff dampers, implicit steps: second order, down to 1e-7 m."""
    bar = replace(BAR, law=CLOSED)
    run = run_reference(bar, bar.period / 4, 1e-10)
    results = [run_engine(bar, bar.period / 4, tolerance) for tolerance in (1e-6, 1e-7)]
    errors = [distance(result, run).max() for result in results]
    assert errors[-1] < 1e-7
    assert slope(results, errors) == pytest.approx(2.0, abs=0.5)  # which step a peak falls into is decided by rounding
    np.testing.assert_allclose(forces(results[-1]).max(axis=0), run.peak_force.max(axis=0), rtol=5e-3)


@pytest.mark.parametrize("law", [BAR.law, CLOSED], ids=["rattling", "closed"])
def test_modal_rocker_moves_as_the_reference_with_the_same_modes(law):
    """Implicit: second order in the steps. A rigid rocker is a hundred times farther off, other damping shows."""
    rocker = Modal(BAR.section, damping=0.01)
    bar = replace(BAR, law=law, modes=rocker)
    run = run_reference(bar, SHORT, 1e-11)
    results = [run_engine(bar, SHORT, tolerance, rocker) for tolerance in (1e-5, 1e-6)]
    errors = [distance(result, run).max() for result in results]
    assert errors[-1] < 2e-6 and slope(results, errors) > 1.5
    rigid, undamped = replace(bar, modes=None), replace(bar, modes=replace(bar.modes, damping=0.0))
    for other, factor in ((rigid, 50), (undamped, 10)):
        assert distance(results[-1], run_reference(other, SHORT, 1e-11)).max() > factor * errors[-1]
