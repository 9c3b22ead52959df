"""Rates and accelerations at the start, consistent with the constraints, and settled as `kinematics.settle` has it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..geometry import Array
from ..kinematics.settle import About, settle_strips, settles
from .doors import place
from .frame_body import FrameBody
from .scene import CompiledScene

ROUNDING = 1e-12


class Balance(NamedTuple):
    """Accelerations (n,) and multipliers (r,)."""

    acceleration: Array
    multipliers: Array


def start_rates(scene: CompiledScene) -> Array:
    """Rates of all coordinates at t = 0: links as `kinematics.start` has them, rigid where they can be.

    What is left of the constraints (a pin inside a curved strip) is then met with least kinetic energy.

    Raises
    ------
    KinematicsError
        If what drives and given velocities ask for is impossible.
    """
    found = scene.source.start
    v = np.zeros(scene.size)
    for name, body in scene.builder.bodies.items():
        motion = body.rigid_motion(scene.builder)
        if motion.shape[1]:
            v += motion @ found.rates[found.linkage.index[name]]
        if name in found.bends:
            v += body.bending_rates(scene.builder, found, scene.mechanism.link(name))
    for offset, link, point, turns in scene.builder.loose:
        if turns:
            v[offset] = found.rates[found.linkage.index[link], 2]
        else:
            v[offset : offset + 2] = found.velocity(link, point)
    for i, rate in scene.builder.rates.items():
        v[i] = rate
    a = scene.assemble(scene.q0, tangents=False, sparse=True)
    rest = a.speed - a.jacobian @ v
    if np.abs(rest).max(initial=0.0) > ROUNDING * max(1.0, np.abs(a.speed).max(initial=0.0)):
        v = v + scene.accelerate(scene.q0, np.zeros(scene.size), rest)[0]
    return v


def slopes(scene: CompiledScene, marker: int, q: Array) -> Array:
    """Derivatives of a marker's (x, y, angle) by the coordinates, shape (3, n)."""
    place(scene.tables, scene.work, q, np.zeros(scene.size))
    _, _, _, first, count, *_ = scene.tables.markers[marker]
    out = np.zeros((3, scene.size))
    for i in range(first, first + count):
        out[:, scene.tables.places[i]] += scene.work.slope[:, i]
    return out


def balance(scene: CompiledScene, q: Array, v: Array, t: float = 0.0, memory: Array | None = None) -> Balance:
    """Accelerations and multipliers: M a + G^T lambda = f, G a = change; none of rows that say what others do."""
    lam = np.zeros(len(scene.tables.rows))
    for _ in range(20):
        out = scene.assemble(q, v, t, lam, memory, tangents=False, sparse=True)
        acceleration, new = scene.accelerate(q, out.force, out.change)
        done = np.abs(new - lam).max(initial=0.0) <= 1e-12 * np.abs(new).max(initial=1e-300)
        lam = new
        if done or not _rubs(scene):
            break
    return Balance(acceleration, lam)


def _rubs(scene: CompiledScene) -> bool:
    """Return True if a force depends on a constraint's own."""
    return bool((scene.tables.forces[:, 5] >= 0).any())


class _Equations:
    """Equations of a scene, linear about its start."""

    def __init__(self, scene: CompiledScene) -> None:
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

    def project(self, q: Array, v: Array) -> tuple[Array, Array]:
        """See `Equations`."""
        still = np.zeros(len(q))
        q = q - self.scene.accelerate(q, still, self.scene.assemble(q, tangents=False, sparse=True).residual)[0]
        a = self.scene.assemble(q, tangents=False, sparse=True)
        return q, v + self.scene.accelerate(q, still, a.speed - a.jacobian @ v)[0]


def begin(scene: CompiledScene) -> tuple[Array, Array]:
    """Coordinates and rates at t = 0, settled if the mechanism asks for it."""
    q, v = scene.q0, start_rates(scene)
    return settle_strips(_Equations(scene), scene.mechanism, q, v) if settles(scene.mechanism) else (q, v)


def offset(scene: CompiledScene, spread: float, seed: int) -> Array:
    """A small change of the start that constraints allow, to first order; modes stay at rest."""
    step = spread * np.random.default_rng(seed).standard_normal(scene.size)
    for body in scene.builder.bodies.values():
        if isinstance(body, FrameBody):
            step[body.offset + 3 : body.offset + 3 + body.modes] = 0.0
    return allowed(scene.assemble(scene.q0, tangents=False).jacobian, step)


def allowed(rows: Array, *changes: Array) -> Array:
    """The part of changes of all coordinates, one after the other, that constraints' rows allow, to first order."""
    if not len(rows):
        return np.concatenate(changes)
    back = np.linalg.pinv(rows, rcond=1e-10)
    return np.concatenate([each - back @ (rows @ each) for each in changes])
