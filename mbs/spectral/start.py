"""Rates and accelerations at the start, consistent with the constraints."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from buckler.mbs.spectral.markers import place_markers

Array = np.ndarray[Any, Any]
SINGULAR = 1e-9
"""Singular values below this, of the largest, count as zero."""


class Balance(NamedTuple):
    """Accelerations (n,) and multipliers (r,)."""

    acceleration: Array
    multipliers: Array


def start_rates(scene: Any, given: list[tuple[Array, float]] | None = None) -> Array:
    """Rates at t = 0: every link moves as if rigid, pins with clearance as if ideal, with least kinetic energy.

    What the rigid links cannot do (a strip that a drive bends from the start) is then added with least kinetic energy.

    Parameters
    ----------
    scene : Scene
    given : list of (row, value), optional
        Further linear conditions row . v = value: velocities the mechanism asks for.
    """
    n, q = scene.size, scene.q0
    a = scene.assemble(q, tangents=False)
    rows, values = [*a.jacobian], [*a.speed]
    for pin, bush in scene.builder.ideal:
        rows += list(slopes(scene, pin, q)[:2] - slopes(scene, bush, q)[:2])
        values += [0.0, 0.0]
    for row, value in given or ():
        rows.append(row)
        values.append(value)
    rows, values = np.array(rows).reshape(-1, n), np.array(values)
    motions = [body.rigid_motion(scene.builder) for body in scene.builder.bodies.values()]
    basis = np.hstack([m for m in motions if m.shape[1]]) if motions else np.zeros((n, 0))
    loose = np.flatnonzero(~basis.any(axis=1))
    if scene.tables.modal.size:
        loose = np.array([i for i in loose if not any(o + 3 <= i < o + 3 + m for o, m, _ in scene.tables.modal)], dtype=int)
    loose = np.array([i for i in loose if not _inner(scene, i)], dtype=int)
    basis = np.hstack([basis, np.eye(n)[:, loose]])
    mass = scene.mass
    v = basis @ least_energy(basis.T @ mass @ basis, rows @ basis, values)
    rest = values - rows @ v
    if np.abs(rest).max(initial=0.0) > 1e-9 * (1e-6 + np.abs(values).max(initial=0.0)):
        v = v + least_energy(mass, rows, rest)
    return v


def _inner(scene: Any, i: int) -> bool:
    """Whether a coordinate is one of a strip's."""
    s = scene.tables
    return any(i in s.places[first : first + (3 - kind) * nb] for kind, nb, _, first, _ in s.strips)


def least_energy(mass: Array, rows: Array, values: Array) -> Array:
    """The u with least u^T mass u among those that meet rows u = values best."""
    if not len(rows):
        return np.zeros(len(mass))
    unit = np.sqrt(np.maximum(np.diag(mass), 1e-300))
    scaled = mass / np.outer(unit, unit)
    half = np.linalg.cholesky(scaled + 1e-14 * np.eye(len(mass)))
    back = np.linalg.inv(half).T / unit[:, None]
    return back @ np.linalg.lstsq(rows @ back, values, rcond=SINGULAR)[0]


def slopes(scene: Any, marker: int, q: Array) -> Array:
    """Derivatives of a marker's (x, y, angle) by the coordinates, shape (3, n)."""
    place_markers(scene.tables, scene.work, q, np.zeros(scene.size))
    _, _, _, first, count, _ = scene.tables.markers[marker]
    out = np.zeros((3, scene.size))
    for i in range(first, first + count):
        out[:, scene.tables.places[i]] += scene.work.slope[:, i]
    return out


def balance(scene: Any, q: Array, v: Array, t: float = 0.0, memory: Array | None = None) -> Balance:
    """Accelerations and multipliers: M a + G^T lambda = f, G a = change; least multipliers where rows are redundant."""
    lam = np.zeros(len(scene.tables.rows))
    for _ in range(20):
        out = scene.assemble(q, v, t, lam, memory, tangents=False)
        mass = scene.mass_at(q)
        inverse_rows = np.linalg.solve(mass, np.column_stack([out.force, out.jacobian.T]))
        schur = out.jacobian @ inverse_rows[:, 1:]
        new = np.linalg.lstsq(schur, out.jacobian @ inverse_rows[:, 0] - out.change, rcond=SINGULAR)[0]
        done = np.abs(new - lam).max(initial=0.0) <= 1e-12 * np.abs(new).max(initial=1e-300)
        lam = new
        if done or not _rubs(scene):
            break
    return Balance(inverse_rows[:, 0] - inverse_rows[:, 1:] @ lam, lam)


def _rubs(scene: Any) -> bool:
    """Whether a force depends on a constraint's own."""
    return bool((scene.tables.forces[:, 5] >= 0).any())
