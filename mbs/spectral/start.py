"""Initial states: rates and accelerations that satisfy the constraints, and work arrays."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..geometry import Array
from .entry_points import place
from .frame_body import FrameBody
from .output import DormandPrince, DormandPrinceState, RadauState
from .scene import CompiledScene
from .strip_body import StripBody
from .tables import Forces, Memory, Tables

ROUNDING = 1e-12


class Balance(NamedTuple):
    """Accelerations (n,) and multipliers (r,)."""

    acceleration: Array
    multipliers: Array


def start_rates(scene: CompiledScene) -> Array:
    """Rates of all coordinates at t = 0: those of links by `scene.start`, rigid if possible.

    Constraints not yet satisfied (a pin inside a curved strip) are then met with least kinetic energy. A KinematicsError if
    drives and given velocities contradict each other.
    """
    found = scene.source.start
    v = np.zeros(scene.size)
    for name, body in scene.builder.bodies.items():
        if isinstance(body, FrameBody | StripBody):
            v += body.rigid_motion(scene.builder) @ found.rates[found.linkage.index[name]]
        if isinstance(body, StripBody) and name in found.bends:
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
    """Accelerations and multipliers by M a + G^T lambda = f, G a = change; multipliers of redundant rows are zero."""
    lam = np.zeros(len(scene.tables.rows))
    for _ in range(20):
        out = scene.assemble(q, v, t, lam, memory, tangents=False, sparse=True)
        acceleration, new = scene.accelerate(q, out.force, out.change)
        done = np.abs(new - lam).max(initial=0.0) <= 1e-12 * np.abs(new).max(initial=1e-300)
        lam = new
        if done or not (scene.tables.forces[:, Forces.ROW] >= 0).any():  # no force depends on a multiplier
            break
    return Balance(acceleration, lam)


def offset(scene: CompiledScene, spread: float, seed: int) -> Array:
    """A small random change of the start that satisfies the constraints to first order; modes stay at rest."""
    step = spread * np.random.default_rng(seed).standard_normal(scene.size)
    for body in scene.builder.bodies.values():
        if isinstance(body, FrameBody):
            step[body.offset + 3 : body.offset + 3 + body.modes] = 0.0
    return allowed(scene.assemble(scene.q0, tangents=False).jacobian, step)


def allowed(rows: Array, *changes: Array) -> Array:
    """Project changes of all coordinates onto those that satisfy the constraints to first order; concatenated."""
    if not len(rows):
        return np.concatenate(changes)
    back = np.linalg.pinv(rows, rcond=1e-10)
    return np.concatenate([each - back @ (rows @ each) for each in changes])


def radau_state(scene: CompiledScene, q: Array, v: Array, a: Array, lam: Array, memory: Array) -> RadauState:
    """Allocate the state and work arrays of an implicit run from this state."""
    tables, units, newton, mass = scene.tables, scene.units, scene.fronts, scene.heavy_fronts
    n, r, k, e, p = len(q), len(lam), len(memory), len(tables.elastic), int(tables.strips[:, 2].sum())
    m, z, slots = n + r, np.zeros, len(tables.mass)
    members, largest = int(tables.blocks[:r, 1].sum()), max(newton.largest, mass.largest)
    return RadauState(
        q=np.array(q, float), v=np.array(v, float), a=np.array(a, float), lam=np.array(lam, float), stress=z((p, 3)),
        places=z((3, n)), rates=z((3, n)), seconds=z((3, n)), multipliers=z((3, r)),
        stresses=z((3, p, 3)), slacks=z((3, p, 3)), past=z((4, n)), past_lam=z(r), past_stress=z((p, 3)),
        residual=z((3, m)), right=z(m), step=z(m),
        complex_step=z(m, dtype=complex), dq=z((3, n)), dv=z((3, n)), force=z(n), gap=z(r), speed=z(r),
        change=z(r), jacobian=z(members), base=z(members), mass=z(slots), damping=z(slots), stiffness=z(slots),
        matrix=z(slots), complex_matrix=z(slots, dtype=complex),
        real=z(newton.size), complex=z(newton.size, dtype=complex), real_swaps=z(len(newton.unknowns), dtype=np.int64),
        complex_swaps=z(len(newton.unknowns), dtype=np.int64), bare=tables.mass.copy(), heavy=z(mass.size),
        heavy_swaps=z(len(mass.unknowns), dtype=np.int64),
        amount_of_row=z(m), part=z(largest), complex_part=z(largest, dtype=complex),
        memory=memory.copy(), before=z((k, 8)), shifted=z((k, 8)),
        largest=z(k), old=memory.copy(), rest=z(e), whole=np.array(units, dtype=float), amount=z(e), weight=z(n),
        across=z(e), turn=z((e, 2)), remainder=np.ones(1),
    )  # fmt: skip


def dormand_prince(scene: CompiledScene, q: Array, v: Array, lam: Array, memory: Array) -> DormandPrince:
    """Allocate the data of an explicit run of a scene from this state."""
    apart = _modal_links_are_free(scene.tables)
    n, r, k, s, z = len(q), len(lam), len(memory), scene.tables, np.zeros
    e = scene.constant_fronts if apart else scene.heavy_fronts
    y = np.concatenate([q, v, memory[:, Memory.BRISTLE]])
    pace = np.array([max(1e-3, np.abs(v / scene.units).max(initial=0.0))])
    flight = DormandPrinceState(
        y, y.copy(), y.copy(), z((7, len(y))), np.array(lam, dtype=float), z(n), z(r), z(r), z(r),
        z(entries := int(s.blocks[:r, 1].sum())), z(entries), s.mass.copy(),
        z(e.size), z(len(e.unknowns), dtype=np.int64), z(n + r), z(e.largest), z(n + r), memory.copy(), z((k, 8)), pace,
        scene.units, z(1, dtype=np.int64), np.array([int(apart)]),
    )  # fmt: skip
    return DormandPrince(s, e, scene.work, flight)


def _modal_links_are_free(tables: Tables) -> bool:
    """Check that there are modal links, and no constraints on them."""
    held = {int(x) for at, m, _ in tables.blocks[: len(tables.rows)] for x in tables.members[at : at + m]}
    return len(tables.modal) > 0 and all(held.isdisjoint(range(o, o + 3 + m)) for o, m, _ in tables.modal.tolist())
