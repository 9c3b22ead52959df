"""The settled start: a strip that turns carries its own pull from the first instant, and does not ring."""

import numpy as np
import pytest

from buckler.mbs import Beam, Cable, Controlled, Exudyn, Link, Mechanism, Revolute, Section, Spectral, simulate

LENGTH, SPEED = 0.3, 40.0
SECTION = Section(0.02, 0.002)
PULL = SECTION.mass_per_length * SPEED**2 * LENGTH**2 / 3
"""Mean along a strip of rho A w^2 (L^2 - x^2)/2, N."""
SOLVERS = {"compiled": Spectral(Controlled(tolerance=1e-7)), "exudyn": Exudyn(Controlled(tolerance=1e-6, max_step=2e-6))}


def turning(body, start):
    return Mechanism(
        points={"O": (0, 0), "A": (LENGTH, 0)},
        links=[Link("strip", "O", "A", body)],
        joints=[Revolute("O", "ground", "strip")],
        velocities={"strip": SPEED},
        start=start,
    )


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("kind", [Beam, Cable])
def test_a_strip_that_turns_is_stretched_by_its_own_mass(kind, solver):
    """Free of a drive, as a body of its own; from an unstrained start the force swings between nothing and twice that."""
    settled, unstrained = (
        simulate(turning(kind(SECTION), start), 5e-4, solver=SOLVERS[solver])["strip.axial_force"]
        for start in ("settled", "unstrained")
    )
    assert settled == pytest.approx(np.full_like(settled, PULL), rel=0.02)
    assert unstrained[0] == pytest.approx(0.0, abs=1e-3 * PULL)
    assert unstrained.max() == pytest.approx(2 * PULL, rel=0.1)


@pytest.mark.parametrize("solver", SOLVERS)
def test_pins_and_drives_stay_where_they_are(solver):
    driven = Mechanism(
        points={"O": (0, 0), "A": (0.1, 0), "B": (0.4, 0.05)},
        links=[Link("crank", "O", "A", Beam(SECTION)), Link("strip", "A", "B", Beam(SECTION))],
        joints=[Revolute("O", "ground", "crank"), Revolute("A", "crank", "strip")],
        velocities={"crank": SPEED},
    )
    result = simulate(driven, 1e-5, solver=SOLVERS[solver])
    assert [result["O.x"][0], result["O.y"][0]] == pytest.approx([0, 0], abs=1e-12)
    assert result["A.x"][0] == pytest.approx(0.1, abs=1e-4)
    assert result["B.x"][0] == pytest.approx(0.4, abs=1e-4)


def test_what_is_slow_stays_as_it_was_given():
    """A bowed strip under its weight swings from where it is drawn: bending is no part of the settling."""
    hung = Mechanism(
        points={"A": (0, 0), "B": (LENGTH, 0)},
        links=[Link("strip", "A", "B", Cable(Section(0.02, 0.0005), imperfection=0.01))],
        joints=[Revolute(point, "ground", "strip") for point in "AB"],
        gravity=(0.0, -9.81),
    )
    first = simulate(hung, 1e-6, solver=Spectral())["strip.deflection"][0]
    assert first == pytest.approx(0.01, rel=2e-3)


def test_a_start_of_another_name_is_refused():
    with pytest.raises(ValueError, match="start = 'fast': must be one of 'unstrained', 'settled'"):
        turning(Beam(SECTION), "fast")
