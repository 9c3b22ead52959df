"""Corners of the slider-crank: every run ends, and a run reported fine holds its energy and agrees with a finer one."""

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.stats import qmc

from buckler.mbs import (
    Beam,
    Controlled,
    Exudyn,
    GuideFriction,
    Material,
    Mechanism,
    Result,
    Section,
    Status,
    Strut,
    simulate,
    slider_crank,
)
from buckler.mbs.checks.energy import BALANCE
from buckler.mbs.laws import CarvalhoMartins

LENGTH, MASS = 0.310, 0.3
NAMED = {"ACCURACY", "ENERGY", "PENETRATION", "UNBUCKLED", "CROSSED"}


@dataclass(frozen=True)
class Case:
    """One corner: thickness [m], speed [rad/s], stop stiffness [N/m], restitution and friction coefficient."""

    thickness: float
    speed: float
    stiffness: float
    restitution: float
    friction: float

    def mechanism(self, kind: str) -> Mechanism:
        material = Material(210e9, 7850.0, axial_damping=9e-5 if kind == "strut" else 0.0)
        section = Section(0.030, self.thickness, material)
        beam = Beam(section.damped(0.05, LENGTH), elements=6, imperfection=-1e-4 * LENGTH)
        return slider_crank(
            Strut(section) if kind == "strut" else beam,
            law=CarvalhoMartins(self.stiffness, self.restitution, exponent=1.0),
            mass=MASS,
            speed=self.speed,
            friction=GuideFriction.of_weight(self.friction, MASS),
        )

    def run(self, kind: str, solver: Exudyn | None = None) -> Result:
        turn = 2 * np.pi / self.speed
        return simulate(self.mechanism(kind), turn, ledger=True, timeout=60, solver=solver)


def corners(count: int) -> list[Case]:
    """Spread over the whole range; thickness, speed and stiffness by their logarithm."""
    return [
        Case(5e-5 * 20 ** u[0], 0.1 * 600 ** u[1], 1e3 * 1e5 ** u[2], 0.1 + 0.9 * u[3], 0.9 * u[4])
        for u in qmc.Sobol(5, seed=7).random(count)
    ]


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
@pytest.mark.parametrize("case", corners(4)[1:], ids=lambda case: f"h={case.thickness:.1e}-w={case.speed:.2g}")
def test_every_corner_ends_fine_or_by_name(case, kind):
    assert complaint(case.run(kind)) == ""


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["beam", "strut"])
@pytest.mark.parametrize("case", corners(64), ids=lambda case: f"h={case.thickness:.1e}-w={case.speed:.2g}")
def test_fine_runs_agree_with_finer_ones(case, kind):
    """Largest contact force of a run reported fine, against a tolerance ten times smaller."""
    result, finer = case.run(kind), case.run(kind, Exudyn(Controlled(1e-6)))
    assert complaint(result) == ""
    if result.ok and finer.ok:
        peak, reference = (r.signals["B.contact_force"].max() for r in (result, finer))
        assert peak == pytest.approx(reference, rel=0.05, abs=1e-6)


EDGES = {
    "thinnest and slowest": Case(5e-5, 0.1, 1e5, 0.8, 0.0),
    "thickest and fastest": Case(1e-3, 60.0, 1e8, 0.5, 0.9),
    "elastic and stiff": Case(3e-4, 1.25, 1e8, 1.0, 0.0),
    "dead and soft": Case(3e-4, 1.25, 1e3, 0.1, 0.9),
}


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["beam", "strut"])
@pytest.mark.parametrize("edge", EDGES)
def test_the_edges_of_the_range_too(edge, kind):
    assert complaint(EDGES[edge].run(kind)) == ""
