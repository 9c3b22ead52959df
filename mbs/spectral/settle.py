"""The settled start of a scene of the compiled solver: its equations as `kinematics.settle` asks for them."""

from __future__ import annotations

import numpy as np

from buckler.mbs.geometry import Array
from buckler.mbs.kinematics.settle import About, settled, settles
from buckler.mbs.spectral.scene import Scene
from buckler.mbs.spectral.start import balance, start_rates


class _Equations:
    """Of a scene."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene

    def about(self, q: Array, v: Array, shift: float) -> About:
        """See `Equations`."""
        linear = self.scene.linear(q, v, 0.0, balance(self.scene, q, v).multipliers)
        factors, rows = linear.factor(mass=shift, stiffness=1.0), np.zeros(linear.jacobian.shape[0])
        return About(linear.mass, lambda right: factors.solve(np.append(right, rows))[: len(q)])

    def acceleration(self, q: Array, v: Array) -> Array:
        """See `Equations`."""
        return balance(self.scene, q, v).acceleration

    def force(self, q: Array, v: Array) -> Array:
        """See `Equations`."""
        return np.asarray(self.scene.assemble(q, v, tangents=False, sparse=True).force)

    def met(self, q: Array, v: Array) -> tuple[Array, Array]:
        """See `Equations`."""
        still = np.zeros(len(q))
        q = q - self.scene.held(q, still, self.scene.assemble(q, tangents=False, sparse=True).residual)[0]
        a = self.scene.assemble(q, tangents=False, sparse=True)
        return q, v + self.scene.held(q, still, a.speed - a.jacobian @ v)[0]


def begin(scene: Scene) -> tuple[Array, Array]:
    """Coordinates and rates at t = 0, settled if the mechanism asks for it."""
    q, v = scene.q0, start_rates(scene)
    return settled(_Equations(scene), scene.mechanism, q, v) if settles(scene.mechanism) else (q, v)
