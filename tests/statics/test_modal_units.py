"""Coordinates of modes are not angles: their extents in paths, and the coordinates whose whole turns do not count."""

import numpy as np
from exact.columns import LENGTH

from buckler.mbs import Link, Mechanism, Modal, Section, Weld
from buckler.mbs.modal import BarModes
from buckler.mbs.spectral.scene import CompiledScene
from buckler.mbs.statics.problem import Problem


def test_coordinates_of_modes_have_the_extents_of_their_units():
    body = Modal(Section(0.02, 0.002), BarModes(bending=2, axial=1), damping=0.01)
    scene = CompiledScene.of(Mechanism({"A": (0, 0), "B": (LENGTH, 0)}, [Link("s", "A", "B", body)], [Weld("A", "s", "ground")]))
    modes = slice(3, scene.size)
    assert np.array_equal(Problem(scene).extents[modes], scene.units[modes])
    assert np.flatnonzero(scene.is_angle).tolist() == [2]
