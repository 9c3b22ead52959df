"""Frequencies about a steady turn: Southwell's cantilever, by an own problem of three fields and by published values."""

import numpy as np
import pytest
from numpy.polynomial.legendre import legder, leggauss, legval

from buckler.mbs import Beam, Link, Mechanism, Revolute, Rigid, Section, Slider, Spring, Weld, equilibrium, frequencies

LENGTH, MEMBERS = 0.5, 18


def cantilever(thickness):
    strip = Section(0.02, thickness)
    return strip, Mechanism(
        {"A": (0, 0), "B": (LENGTH, 0)}, [Link("strip", "A", "B", Beam(strip))], [Weld("A", "ground", "strip")]
    )


def spun(strip, spin):
    """Exponents of Timoshenko's cantilever, stretched by its own pull, with Coriolis' forces, by Galerkin's method."""
    x, w = leggauss(80)
    arc, weight, shapes = LENGTH * (x + 1) / 2, LENGTH * w / 2, np.eye(MEMBERS)
    value = (x + 1) * legval(x, shapes)
    slope = 2 / LENGTH * (legval(x, shapes) + (x + 1) * legval(x, legder(shapes)))
    axial, shear, bend = strip.axial_stiffness, strip.shear_stiffness, strip.bending_stiffness
    mass, turn = strip.mass_per_length, strip.inertia_per_length
    k = spin * np.sqrt(mass / axial)
    stretch = np.cos(k * arc) / np.cos(k * LENGTH)
    pull = axial * (stretch - 1)

    def over(factor, one, other):
        return (one * weight * factor) @ other.T

    none = np.zeros((MEMBERS, MEMBERS))
    out = over(mass, value, value)
    across = over(pull - shear * stretch, slope, value)
    stiffness = np.block([
        [over(axial, slope, slope) - spin**2 * out, none, none],
        [none, over(shear, slope, slope) - spin**2 * out, across],
        [none, across.T, over(bend, slope, slope) + over(shear * stretch**2 - pull * stretch, value, value)],
    ])  # fmt: skip
    inertia = np.block([[out, none, none], [none, out, none], [none, none, over(turn, value, value)]])
    coriolis = 2 * spin * np.block([[none, -out, none], [out, none, none], [none, none, none]])
    still, one = np.zeros_like(inertia), np.eye(len(inertia))
    values = np.linalg.eigvals(np.block([[still, one], [-np.linalg.solve(inertia, np.hstack([stiffness, coriolis]))]]))
    return np.sort(values.imag[values.imag > 0])


@pytest.mark.parametrize(("thickness", "bar"), [(0.02, 1e-8), (0.005, 1e-7)])
@pytest.mark.parametrize("turns", [0.0, 2.0, 10.0])
def test_a_spinning_cantilever_is_southwells(thickness, bar, turns):
    strip, made = cantilever(thickness)
    spin = turns * np.sqrt(strip.bending_stiffness / strip.mass_per_length) / LENGTH**2
    found, exact = frequencies(made, count=4, spin=spin), spun(strip, spin)[:4]
    assert found.status == "OK"
    assert found.stable
    assert found.angular == pytest.approx(exact, rel=bar)
    assert (np.abs(found.angular - exact) <= 2 * np.pi * found.errors + 1e-8 * exact).all()


@pytest.mark.parametrize(("turns", "flapping"), [(1.0, 3.6816), (4.0, 5.5850), (10.0, 11.2023)])
def test_a_thin_one_has_the_published_first_frequency(turns, flapping):
    """Out of its plane of turning (A. D. Wright et al., J. Appl. Mech. 49 (1982) 197); in it the square is less by spin^2."""
    strip, made = cantilever(0.0005)
    unit = np.sqrt(strip.bending_stiffness / strip.mass_per_length) / LENGTH**2
    first = frequencies(made, count=1, spin=turns * unit).angular[0] / unit
    assert first == pytest.approx(np.sqrt(flapping**2 - turns**2), abs=2e-4)


def test_a_block_on_a_turning_slide_moves_out_and_leaves_at_its_own_frequency():
    """K (r - r0) = m w^2 r; small motions at sqrt(k/m - w^2), none beyond; about any centre."""
    spring, body = Spring("P", "ground:S", stiffness=90.0, free_length=0.3), Rigid.of(mass=1.0, inertia=1e-3, centre=(0, 0))
    made = Mechanism(
        {"S": (0.2, 0), "P": (0.5, 0), "Q": (0.6, 0)}, [Link("block", "P", "Q", body)],
        [Slider("P", "block", "ground", along=(1, 0))], loads=[spring],
    )  # fmt: skip
    rest = equilibrium(made, spin=6.0, centre=(0.2, 0.0))
    assert rest.stable
    assert rest.point("block", "P").position[0] - 0.2 == pytest.approx(90.0 * 0.3 / (90.0 - 36.0), rel=1e-10)
    assert frequencies(made, rest, count=1, spin=6.0, centre=(0.2, 0.0)).angular[0] == pytest.approx(np.sqrt(54.0), rel=1e-10)
    thrown = equilibrium(made, spin=10.0, centre=(0.2, 0.0))
    assert not thrown.stable


def test_what_cannot_turn_steadily_is_refused():
    falling = Mechanism(
        {"O": (0, 0), "A": (1, 0)}, [Link("bar", "O", "A", Rigid(Section(0.02, 0.01)))], [Revolute("O", "ground", "bar")],
        gravity=(0, -9.81),
    )  # fmt: skip
    with pytest.raises(ValueError, match="gravity does not turn"):
        frequencies(falling, spin=1.0)
    with pytest.raises(ValueError, match="spin = nan"):
        equilibrium(falling, spin=np.nan)
