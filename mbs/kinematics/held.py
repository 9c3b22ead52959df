"""What joints hold besides points in loop closure: angles kept (welds, sliders), lines that turn with a link (sliders, slots)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from buckler.mbs.elements.element import GROUND

Array = np.ndarray[Any, Any]


def held(closure: Any, q: Array, q_t: Array) -> Iterator[tuple[float, Array, float]]:
    """Yield residual, Jacobian (links, 3) and convective term of each such row.

    Parameters
    ----------
    closure : Closure
    q, q_t : array, shape (links, 3)
        x, y, theta of the links and their rates.
    """
    for joint in closure.mechanism.joints:
        if not joint.pins:
            yield _line(closure, joint, q, q_t)
        if not joint.turns:
            yield _angle(closure, joint, q)


def _angle(closure: Any, joint: Any, q: Array) -> tuple[float, Array, float]:
    """theta_1 - theta_2 stays."""
    row, value = np.zeros_like(q), 0.0
    for body, sign in ((joint.first, 1.0), (joint.second, -1.0)):
        if body != GROUND:
            i = closure.index[body]
            row[i, 2] = sign
            value += sign * (q[i, 2] - closure.reference[i, 2])
    return value, row, 0.0


def _line(closure: Any, joint: Any, q: Array, q_t: Array) -> tuple[float, Array, float]:
    """n(theta_2) . (p_1 - p_2) stays zero, p_2 the place of the point on the second body, n square to the line there."""
    row = np.zeros_like(q)
    along, around, spin = np.array(joint.along), np.zeros(2), 0.0
    if joint.second != GROUND:
        j = closure.index[joint.second]
        turn, spin = q[j, 2] - closure.reference[j, 2], q_t[j, 2]
        c, s = np.cos(turn), np.sin(turn)
        along = np.array([c * along[0] - s * along[1], s * along[0] + c * along[1]])
        around = closure.position(joint.first, joint.point, q) - q[j, :2]  # from the second body's start to the pin
    across = np.array([-along[1], along[0]])
    i = closure.index[joint.first]
    arm = closure.position(joint.first, joint.point, q) - q[i, :2]
    row[i] = [*across, across[1] * arm[0] - across[0] * arm[1]]
    convective = q_t[i, 2] ** 2 * across @ arm
    sliding = q_t[i, :2] + q_t[i, 2] * np.array([-arm[1], arm[0]])
    if joint.second != GROUND:
        row[j] = [*-across, -(across[1] * around[0] - across[0] * around[1])]
        sliding = sliding - q_t[j, :2] - spin * np.array([-around[1], around[0]])
        convective += -(spin**2) * across @ around + 2 * spin * (sliding @ along)
    apart = closure.position(joint.first, joint.point, q) - closure.position(joint.second, joint.point, q)
    return float(across @ apart), row, float(convective)
