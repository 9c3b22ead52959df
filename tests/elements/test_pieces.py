"""Parts of elements by themselves: shapes, holes, stops away from the origin."""

import math

import numpy as np
import pytest
from simulations import BAR

from buckler.mbs import Exudyn, Link, Mechanism, Rigid, Stop, Weld, simulate
from buckler.mbs.laws import KelvinVoigt
from buckler.mbs.modal import PinHole


def test_a_pin_hole_takes_the_nodes_on_and_within_its_circle():
    nodes = np.array([[0.1, 0.005, 0.0], [0.1, 0.0, 0.3], [0.1, 0.006, 0.0], [0.09, 0.0, 0.0]])
    assert PinHole(0.005)(nodes, np.array([0.1, 0.0, 0.0])).tolist() == [True, True, False, False]


def test_a_stop_on_a_link_is_as_deep_as_its_force_says():
    """The face lies 0.2 m below the point at the start, 0.05 m above the link that carries it."""
    mechanism = Mechanism(
        points={"A": (-0.25, 0), "B": (0.25, 0), "C": (0.1, -0.2), "D": (0.4, -0.2)},
        links=[Link("rod", "A", "B", Rigid.of(mass=0.8, inertia=0.02)), Link("table", "C", "D", BAR)],
        joints=[Weld("C", "ground", "table")],
        stops=[Stop("B", at=-0.15, law=KelvinVoigt(1e5, 0.0), along=(0, 1), on="table:D")],
        gravity=(0, -9.81),
    )
    result = simulate(mechanism, 0.2, solver=Exudyn())
    force, depth = result["B.contact_force"], result["B.penetration"]
    k = int(np.argmax(force))
    assert result.time[np.argmax(force > 0)] == pytest.approx(math.sqrt(2 * 0.15 / 9.81), abs=1e-3)
    assert depth[k] == pytest.approx(force[k] / 1e5, rel=1e-6)
