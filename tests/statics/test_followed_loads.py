"""A rest is the end of the loads' way: tipping bars and bowed columns beyond their critical loads; unstable states by name."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from buckler import mbs

DRAWS = np.random.default_rng(20)


@pytest.mark.parametrize(("aside", "over"), list(zip(DRAWS.uniform(0.5, 8.0, 6), DRAWS.uniform(0.8, 4.0, 6), strict=True)))
def test_a_bar_on_a_torsion_spring_tips_to_its_own_side(aside, over):
    """P L sin(a) = k (a - a0), the root that grows from a0 as the load does."""
    stiffness, length, start = 8.0, 0.4, np.radians(aside)
    load = over * stiffness / length
    bar = mbs.Mechanism(
        {"O": (0, 0), "A": (length * np.sin(start), length * np.cos(start))},
        [mbs.Link("bar", "O", "A", mbs.Rigid.of(mass=1e-3, inertia=1e-5))],
        [mbs.Revolute("O", "ground", "bar")],
        loads=[mbs.TorsionSpring("ground", "bar", stiffness), mbs.Force("A", (0, -load))],
    )
    rest = mbs.equilibrium(bar)
    exact = brentq(lambda a: load * length * np.sin(a) - stiffness * (a - start), start, np.pi)
    assert rest.status == "OK" and rest.stable
    assert np.arctan2(*rest.point("bar", "A").position) == pytest.approx(exact, abs=1e-8)


def column(strip, length, bow, load):
    return mbs.Mechanism(
        {"A": (0, 0), "B": (length, 0)},
        [mbs.Link("strip", "A", "B", mbs.Beam(strip, imperfection=bow), carries={"M": 0.5})],
        [mbs.Revolute("A", "ground", "strip")],
        guides=[mbs.Guide("B", "strip", mass=0.2)],
        loads=[mbs.Force("B", (-load, 0))],
    )


def bent(stiffness, length, bow, load):
    """Middle of an inextensible bowed column, by shooting: t' = k0 - P y/EI, y' = sin t; the most bent of its states."""

    def run(start, dense=False):
        def rate(s, y):
            return [-bow * (np.pi / length) ** 2 * np.sin(np.pi * s / length) - load * y[1] / stiffness, np.sin(y[0])]

        return solve_ivp(rate, (0, length), [start, 0.0], rtol=1e-9, atol=1e-12, dense_output=dense)

    starts = np.linspace(1e-4, 2.8, 80)
    ends = np.array([run(start).y[1, -1] for start in starts])
    last = np.flatnonzero(ends[1:] * ends[:-1] < 0)[-1]
    return float(run(brentq(lambda start: run(start).y[1, -1], *starts[last : last + 2]), dense=True).sol(length / 2)[1])


@pytest.mark.parametrize(
    ("bow", "over"),
    [(float(10**b), float(o)) for b, o in zip(DRAWS.uniform(-4, -2.5, 4), DRAWS.uniform(1.02, 1.8, 4), strict=True)],
)
@pytest.mark.parametrize("side", [1, -1])
def test_a_bowed_column_rests_bent_to_the_side_of_its_bow(bow, over, side):
    strip, length = mbs.Section(0.02, 0.001), 0.5
    load = over * np.pi**2 * strip.bending_stiffness / length**2
    rest = mbs.equilibrium(column(strip, length, side * bow, load))
    middle = bent(strip.bending_stiffness, length, bow, load)
    assert rest.status == "OK" and rest.stable
    assert rest.point("strip", "M").position[1] == pytest.approx(side * middle, abs=2e-3 * length)  # it is extensible, and thick


def test_a_straight_column_beyond_its_load_is_unstable_by_name():
    strip, length = mbs.Section(0.02, 0.001), 0.5
    critical = np.pi**2 * strip.bending_stiffness / length**2
    straight = column(strip, length, 0.0, 1.5 * critical)
    assert mbs.equilibrium(straight).status == mbs.frequencies(straight).status == "UNSTABLE"
    assert mbs.equilibrium(straight, load=0.6).status == "OK"
