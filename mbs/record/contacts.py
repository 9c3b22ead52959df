"""What joints with play did during a run: forces, penetration, sliding, contact state, energy taken."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from buckler.mbs.elements.journal import BRISTLE, COLUMNS, SINCE
from buckler.mbs.laws import BristleLaw

if TYPE_CHECKING:
    from buckler.mbs.record.signals import History

Array = np.ndarray[Any, Any]
FREE, IMPACT, CONTINUOUS = 0.0, 1.0, 2.0
"""Contact states: apart; in touch, going in and out once; in touch beyond the first rebound of the depth."""


def report(history: History, group: int, states: tuple[Array, Array, Array, Array] | None = None) -> dict[str, Array]:
    """What the kernel reports of a group's joints, each of shape (times, joints); at other states if given.

    States are times, coordinates, their rates and the memory, whose time is set to theirs.
    """
    part = history.scene.clearances[group]
    flat = part.columns.ravel()
    time, q, q_t, memory = states or (history.time, history.q, history.q_t, history.memory[group])
    memory = np.array(memory)
    memory[:, :, SINCE] = time[:, None]
    out = np.zeros((len(time), len(part.joints), len(COLUMNS)))
    q, q_t = np.ascontiguousarray(q[:, flat]), np.ascontiguousarray(q_t[:, flat])
    part.kernel.along(time, q, q_t, memory, part.places, part.numbers, out)
    return {name: out[:, :, k] for k, name in enumerate(COLUMNS)}


def add_joints(history: History, group: int, add: Any) -> None:
    """Signals of each joint with play; forces are those on the second body."""
    found = report(history, group)
    for j, joint in enumerate(history.scene.clearances[group].joints):
        column = {name: values[:, j] for name, values in found.items()}
        name = joint.point
        add(f"{name}.{joint.first}-{joint.second}.fx", -column["fx"], "N")
        add(f"{name}.{joint.first}-{joint.second}.fy", -column["fy"], "N")
        add(f"{name}.normal_force", column["normal"], "N")
        add(f"{name}.friction_force", column["tangential"], "N")
        add(f"{name}.penetration", np.maximum(column["depth"], 0.0), "m")
        add(f"{name}.sliding_speed", column["sliding"], "m/s")
        eccentricity = column["depth"] + joint.gap
        add(f"{name}.journal_x", eccentricity * column["nx"], "m")
        add(f"{name}.journal_y", eccentricity * column["ny"], "m")
        add(f"{name}.contact_state", contact_state(column["depth"]), "1")
        add(f"{name}.contacts", np.cumsum(np.diff(column["depth"] > 0, prepend=False) & (column["depth"] > 0)), "1")


def contact_state(depth: Array) -> Array:
    """FREE, IMPACT or CONTINUOUS at each sample: continuous from the first minimum of the depth within a contact on."""
    touching = depth > 0
    dip = np.zeros_like(touching)
    dip[1:-1] = touching[1:-1] & (depth[1:-1] < depth[:-2]) & (depth[1:-1] <= depth[2:]) & touching[:-2] & touching[2:]
    dips = np.cumsum(dip)
    start = np.maximum.accumulate(np.where(touching, 0, dips))  # dips counted before the present contact
    return np.where(touching, np.where(dips > start, CONTINUOUS, IMPACT), FREE)


def moment_of_contacts(history: History, body: str) -> Array:
    """Moment of all joints with play on a rigid link about its centre, N m, shape (times,)."""
    total = np.zeros_like(history.time)
    columns = history.scene.placed[body].columns(history.scene.system)[0]
    centre = history.q[:, columns[:2]] + history.scene.placed[body].reference[0, :2]
    for group, part in enumerate(history.scene.clearances):
        found = report(history, group)
        for j, joint in enumerate(part.joints):
            if body in (joint.first, joint.second):
                place = history.point(joint.first, joint.point)[0] if joint.first in history.scene.placed else None
                pin = np.array(history.scene.mechanism.points[joint.point]) if place is None else place
                arm = pin + joint.pin * np.column_stack([found["nx"][:, j], found["ny"][:, j]]) - centre
                moment = arm[:, 0] * found["fy"][:, j] - arm[:, 1] * found["fx"][:, j]
                total = total + (moment if body == joint.first else -moment)
    return total


def energies(history: History, group: int) -> tuple[Array, Array, Array]:
    """What a group's contacts and bristles hold, and what they took by damping and by friction since t = 0, J, joint by joint.

    Powers are integrated by Simpson's rule, the state at half a step from the cubic Hermite interpolation of the positions; the
    bristle half-way is the mean of those at the ends.
    """
    joints = history.scene.clearances[group].joints
    ends = report(history, group)
    h = np.diff(history.time)[:, None]
    a, b, va, vb = history.q[:-1], history.q[1:], history.q_t[:-1], history.q_t[1:]
    memory = history.memory[group][1:].copy()
    memory[:, :, BRISTLE] = (ends["bristle"][:-1] + ends["bristle"][1:]) / 2
    time = history.time[:-1] + h[:, 0] / 2
    middle = report(history, group, (time, (a + b) / 2 + h * (va - vb) / 8, 1.5 * (b - a) / h - (va + vb) / 4, memory))

    def work(force: str, speed: str) -> Array:
        power, half = ends[force] * ends[speed], middle[force] * middle[speed]
        done = np.zeros_like(power)
        np.cumsum(h * (power[:-1] + 4 * half + power[1:]) / 6, axis=0, out=done[1:])
        return done

    law, friction = joints[0].law, joints[0].friction
    elastic, bent = law.potential(ends["depth"]), np.zeros_like(ends["depth"])
    if isinstance(friction, BristleLaw):
        bent = ends["normal"] * friction.stored(ends["bristle"])
    damped, rubbed = work("normal", "rate"), work("tangential", "sliding")
    return elastic + bent, damped - (elastic - elastic[0]), rubbed - (bent - bent[0])
