"""A force whose line of action stays in the plane: both solvers, and the moment about its point."""

import numpy as np
import pytest

from buckler.mbs import Beam, Cable, Controlled, Exudyn, Force, Link, Mechanism, Rigid, Section, Spectral, Weld, simulate


def swinging(body, value):
    return Mechanism(
        {"A": (0, 0), "B": (0.4, 0.1)}, [Link("bar", "A", "B", body)],
        [Weld("A", "ground", "bar")] if body.flexible else [], loads=[Force("B", value, through=(0.2, -0.05))],
    )  # fmt: skip


@pytest.mark.parametrize("follows", [None, "bar"])
def test_a_free_bar_turns_by_the_moment_of_the_line(follows):
    """The work of force and moment is the energy that the bar takes, and both solvers move it to the same place."""
    free = Mechanism(
        {"A": (0, 0), "B": (0.4, 0.1)}, [Link("bar", "A", "B", Rigid.of(mass=0.5, inertia=0.01, centre=(0.2, 0.0)))],
        loads=[Force("B", (1.0, 2.0), follows=follows, through=(0.2, -0.05))],
    )  # fmt: skip
    places = []
    for solver in (Spectral(Controlled(tolerance=1e-9)), Exudyn()):
        result = simulate(free, 0.5, solver=solver, ledger=True)
        assert result.energy_balance < 1e-4
        places.append(result.signals["B.y"][-1])
    assert places[0] == pytest.approx(places[1], rel=1e-4)


@pytest.mark.parametrize("kind", [Beam, Cable])
def test_both_solvers_bend_a_strip_by_it(kind):
    made = swinging(kind(Section(0.02, 0.002).damped(0.1, 0.4)), lambda t: (-5.0 * np.sin(30 * t), 1.0))
    ends = [
        [simulate(made, 0.1, solver=solver).signals[name][-1] for name in ("B.x", "B.y")]
        for solver in (Spectral(degree=10), Exudyn())
    ]
    assert ends[0] == pytest.approx(ends[1], abs=2e-5)
