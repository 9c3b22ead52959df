"""Loads along a strip: closed forms of small bending, both solvers, work."""

import numpy as np
import pytest

from buckler.mbs import Beam, Cable, Controlled, Exudyn, LineLoad, Link, Mechanism, Section, Spectral, Weld, equilibrium, simulate

LENGTH, SECTION = 0.5, Section(0.02, 0.002)


def cantilever(section=SECTION, kind=Beam, **load):
    return Mechanism(
        {"A": (0, 0), "B": (LENGTH, 0)}, [Link("strip", "A", "B", kind(section))], [Weld("A", "ground", "strip")],
        loads=[LineLoad("strip", **load)],
    )  # fmt: skip


@pytest.mark.parametrize(("turns", "factor"), [(False, 1.0), (True, 3.0)])
def test_a_cantilever_bends_as_in_closed_form(turns, factor):
    """W = p L^4/8 EI + p L^2/2 GA under a force, m L^3/3 EI under a moment; turns p L^3/6 EI, m L^2/2 EI."""
    p, m = 1e-4, -2e-5
    made = cantilever(force=(0.0, p / factor), moment=m / factor, turns=turns)
    rest = equilibrium(made, factor).point("strip", "B")
    bend, shear = SECTION.bending_stiffness, SECTION.shear_stiffness
    deflection = p * LENGTH**4 / (8 * bend) + p * LENGTH**2 / (2 * shear) + m * LENGTH**3 / (3 * bend)
    assert rest.position[1] == pytest.approx(deflection, rel=1e-7)
    assert rest.angle == pytest.approx((p * LENGTH**3 / 6 + m * LENGTH**2 / 2) / bend, rel=1e-7)


def test_a_moment_along_it_bends_a_strip_however_far():
    """EI theta'' = -m with theta' = 0 at the end: theta = m (L s - s^2/2)/EI, the place its integral."""
    m = 4.0 * SECTION.bending_stiffness / LENGTH**2
    rest = equilibrium(cantilever(moment=m)).point("strip", "B")
    s, w = np.polynomial.legendre.leggauss(40)
    s, w = LENGTH * (s + 1) / 2, LENGTH * w / 2
    theta = m * (LENGTH * s - s**2 / 2) / SECTION.bending_stiffness
    assert rest.position == pytest.approx([w @ np.cos(theta), w @ np.sin(theta)], rel=1e-7)


@pytest.mark.parametrize("turns", [False, True])
def test_both_solvers_and_the_balance_of_energy(turns):
    made = cantilever(SECTION.damped(0.05, LENGTH), force=(-3.0, 2.0), moment=0.1, turns=turns)
    ends = []
    for solver in (Spectral(Controlled(tolerance=1e-7), degree=10), Exudyn()):
        result = simulate(made, 0.1, solver=solver, ledger=True)
        assert result.energy_balance < 5e-3
        assert result.energy["given_load"][-1] > 0.1 * result.energy["throughput"][-1]
        ends.append([result.signals[name][-1] for name in ("B.x", "B.y")])
    assert ends[0] == pytest.approx(ends[1], abs=2e-4)


def test_only_beams_take_it():
    with pytest.raises(ValueError, match="must be a Beam"):
        cantilever(kind=Cable, force=(0.0, 1.0))


def test_it_survives_a_file():
    made = cantilever(force=(1.0, -2.0), moment=0.3, turns=True)
    assert Mechanism.from_dict(made.to_dict()) == made
