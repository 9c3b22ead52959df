"""Equilibria of strips against the elastica and finer meshes."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from buckler import mbs


def test_the_error_of_a_bent_strip_bounds_its_difference_to_a_fine_one():
    section = mbs.Section(0.03, 0.0005)
    load = 10 * section.bending_stiffness / 0.25
    made = mbs.Mechanism(
        {"A": (0, 0), "B": (0.5, 0)}, [mbs.Link("strip", "A", "B", mbs.Beam(section))], [mbs.Weld("A", "ground", "strip")],
        loads=[mbs.Force("B", (0.0, -load))],
    )  # fmt: skip
    fine = mbs.equilibrium(made, degree=30).point("strip", "B").position
    for degree in (4, 6, 8, None):
        rest = mbs.equilibrium(made, degree=degree)
        true = np.abs(rest.point("strip", "B").position - fine).max() / 0.5
        assert true <= rest.error + 1e-10
        assert rest.error < (1e-8 if degree is None else 1.0)


@pytest.mark.parametrize("times", [5.0, 28.0, 30.0])
def test_a_force_across_a_strip_that_turns_with_it_rolls_it_up(times):
    """Against Reissner's strip integrated from its tip, in whose frame the force is known."""
    section, length = mbs.Section(0.02, 0.0005), 0.5
    force = times * section.bending_stiffness / length**2
    axial, shear, bend = section.axial_stiffness, section.shear_stiffness, section.bending_stiffness

    def back(s, y):
        along, across = 1 + force * np.sin(y[2]) / axial, force * np.cos(y[2]) / shear
        x = along * np.cos(y[2]) - across * np.sin(y[2])
        return [-x, -(along * np.sin(y[2]) + across * np.cos(y[2])), -y[3] / bend, x * force]

    x, y, turn, _ = solve_ivp(back, (0, length), np.zeros(4), rtol=1e-11, atol=1e-13).y[:, -1]
    c, s = np.cos(turn), np.sin(turn)
    rest = mbs.equilibrium(mbs.Mechanism(
        {"A": (0, 0), "B": (length, 0)}, [mbs.Link("strip", "A", "B", mbs.Beam(section))], [mbs.Weld("A", "ground", "strip")],
        loads=[mbs.Force("B", (0.0, force), follows="strip")],
    ))  # fmt: skip
    assert rest.point("strip", "B").position == pytest.approx([-c * x - s * y, s * x - c * y], abs=1e-8)
    assert rest.status == "OK"
    assert rest.error < 1e-7
    assert rest.stable
    assert rest.neutral == ()
