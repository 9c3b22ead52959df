"""Corners of the slider-crank: every run ends, and a run reported fine holds its energy and agrees with a finer one."""

import numpy as np
import pytest
from scipy.stats import qmc

from buckler.mbs import Controlled, Exudyn, Result, Status, simulate
from buckler.mbs.checks.energy import BALANCE
from buckler.studies.trust.extremes_listed import EDGES, slider

NAMED = {"ACCURACY", "ENERGY", "PENETRATION", "UNBUCKLED", "CROSSED"}


def run(kind: str, corner: dict[str, float], solver: Exudyn | None = None) -> Result:
    """A turn of the crank."""
    turn = 2 * np.pi / corner.get("speed", 1.25)
    mesh = {"elements": 6} if kind == "beam" else {}
    return simulate(slider(kind, **corner, **mesh), turn, ledger=True, timeout=60, solver=solver)


def corners(count: int) -> list[dict[str, float]]:
    """Spread over the whole range; thickness, speed and stiffness by their logarithm."""
    names = ("thickness", "speed", "stiffness", "restitution", "friction")
    return [
        dict(zip(names, (5e-5 * 20 ** u[0], 0.1 * 600 ** u[1], 1e3 * 1e5 ** u[2], 0.1 + 0.9 * u[3], 0.9 * u[4]), strict=True))
        for u in qmc.Sobol(5, seed=7).random(count)
    ]


def shown(corner: dict[str, float]) -> str:
    return f"h={corner['thickness']:.1e}-w={corner['speed']:.2g}"


def complaint(result: Result) -> str:
    """What is wrong with how a run ended: nothing if it is fine and holds its energy, or is suspect for a named reason."""
    if not np.isfinite(result.signals["B.x"]).all() or not (np.diff(result.time) > 0).all():
        return "not finite, or time stands still"
    if result.signals["B.contact_force"].min() < 0:
        return "the stop pulls"
    if result.status is Status.OK:
        return "" if result.energy_balance <= BALANCE else "energy out of balance, unnoticed"
    named = result.status is Status.SUSPECT and any(name in result.message for name in NAMED)
    return "" if named else f"{result.status}: {result.message}"


@pytest.mark.parametrize("kind", ["beam", "strut"])
@pytest.mark.parametrize("case", corners(4)[1:], ids=shown)
def test_every_corner_ends_fine_or_by_name(case, kind):
    assert complaint(run(kind, case)) == ""


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["beam", "strut"])
@pytest.mark.parametrize("case", corners(64), ids=shown)
def test_fine_runs_agree_with_finer_ones(case, kind):
    """Largest contact force of a run reported fine, against a tolerance ten times smaller."""
    result, finer = run(kind, case), run(kind, case, Exudyn(Controlled(1e-6)))
    assert complaint(result) == ""
    if result.ok and finer.ok:
        peak, reference = (r.signals["B.contact_force"].max() for r in (result, finer))
        assert peak == pytest.approx(reference, rel=0.05, abs=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["beam", "strut"])
@pytest.mark.parametrize("edge", list(EDGES)[:4])
def test_the_edges_of_the_range_too(edge, kind):
    assert complaint(run(kind, EDGES[edge])) == ""
