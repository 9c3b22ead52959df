"""Links that turn when a run starts, and rigid ones whose centre of mass lies beside their line: both solvers, closed forms."""

import numpy as np
import pytest

pytest.importorskip("numba")

from buckler.mbs import Beam, Cable, Controlled, Exudyn, Link, Mass, Mechanism, Revolute, Rigid, Section, Spectral, simulate

SOLVERS = {"Exudyn": Exudyn(Controlled(1e-7)), "Spectral": Spectral(Controlled(1e-7))}
LENGTH, SPIN, SECTION = 0.2, 3.0, Section(0.02, 0.004)
ARM = np.array([-0.08, 0.05])
BODIES = {"rigid": Rigid.of(mass=1.0, inertia=0.01, centre=(0.05, 0.08)), "beam": Beam(SECTION), "cable": Cable(SECTION)}


def hanging(body, masses=(), **given):
    """A link that stands upright on its pin: what is to the left of its line lies towards -x."""
    return Mechanism(
        {"O": (0, 0), "A": (0, LENGTH)},
        [Link("bar", "O", "A", body)],
        [Revolute("O", "ground", "bar")],
        masses=list(masses),
        **given,
    )


@pytest.mark.parametrize("solver", SOLVERS)
def test_a_centre_of_mass_beside_the_line_pulls_to_its_side(solver):
    """Angular acceleration m g d/(I + m r^2), counter-clockwise for a centre at the left."""
    result = simulate(hanging(BODIES["rigid"], gravity=(0.0, -9.81)), 0.01, solver=SOLVERS[solver])
    swing = 9.81 * 0.08 / (0.01 + ARM @ ARM)
    assert result["A.x"][-1] == pytest.approx(-LENGTH * swing * 0.01**2 / 2, rel=2e-3)


@pytest.mark.parametrize("tip", [None, Mass("A", 0.05, 1e-3)], ids=["alone", "with a tip that turns"])
@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("body", BODIES)
def test_a_link_that_turns_has_the_energy_of_its_turn(body, solver, tip):
    mechanism = hanging(BODIES[body], [tip] if tip else [], velocities={"bar": SPIN})
    result = simulate(mechanism, 0.002, solver=SOLVERS[solver], ledger=True)
    mass = SECTION.mass_per_length * LENGTH
    turning = 0.01 + ARM @ ARM if body == "rigid" else mass * LENGTH**2 / 3
    if body == "beam":
        turning += SECTION.inertia_per_length * LENGTH
    if tip:
        turning += tip.mass * LENGTH**2 + tip.inertia
    assert result.energy["kinetic"][0] == pytest.approx(0.5 * turning * SPIN**2, rel=2e-6)
    assert result["A.vx"][0] == pytest.approx(-SPIN * LENGTH, rel=1e-6)
    assert result["A.vx"][-1] == pytest.approx(-SPIN * LENGTH * np.cos(SPIN * 0.002), rel=1e-3)
    assert result.energy_balance < 1e-3
