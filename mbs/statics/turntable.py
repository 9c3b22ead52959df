"""Steady spin of a mechanism with its ground, loads and drives, in the rotating frame.

    M u'' + 2 w M J u' - w^2 M (u - c) = f - G^T lambda,    J a quarter turn of all places, c the centre.

Stiffening by the pull outwards comes from f, as in any other state under load.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array

from ..spectral.frame_body import FrameBody
from ..spectral.scene import CompiledScene


class Turntable:
    """Centrifugal and gyroscopic terms of a steady spin.

    Attributes
    ----------
    outwards : sparse array, shape (n, n)
        w^2 M on places: force for each displacement from the centre.
    entries : array, shape (slots + 1,)
        The same by the matrices' entries.
    gyroscopic : sparse array, shape (n, n)
        2 w M J.
    centre : array, shape (n,)
        Coordinates of a state in which all points are at the centre; angles are zero.

    Raises
    ------
    ValueError
        If gravity acts, or a mass matrix depends on the shape.
    """

    def __init__(self, scene: CompiledScene, spin: float, centre: tuple[float, float]) -> None:
        if any(scene.mechanism.gravity):
            raise ValueError("spin: gravity does not turn with the mechanism; leave it out")
        n, frames = scene.size, {name: b for name, b in scene.builder.bodies.items() if isinstance(b, FrameBody)}
        if modal := [name for name, body in frames.items() if body.modes]:
            raise ValueError(f"spin: '{modal[0]}' has modes, whose mass depends on its shape; make it a Beam")
        self.centre = np.zeros(n)
        places = [*map(np.array, scene.twins), *(np.array([[body.offset], [body.offset + 1]]) for body in frames.values())]
        for each in places:
            self.centre[each[:, :2]] = np.array(centre)[:, None]
        pairs = np.hstack(places)
        x, y = np.unique(pairs, axis=1)
        quarter = csr_array((np.repeat([-1.0, 1.0], len(x)), (np.append(x, y), np.append(y, x))), shape=(n, n))
        s, place = scene.tables, np.zeros(n + len(scene.tables.rows))
        place[pairs] = 1.0
        self.entries = spin**2 * s.mass * np.append(place[s.row] * place[s.col], 0.0)
        mass = csr_array(scene.mass_at(scene.q0))
        self.outwards, self.gyroscopic = -(spin**2) * mass @ quarter @ quarter, 2.0 * spin * mass @ quarter
