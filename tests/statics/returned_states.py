"""A block on a slide and its periodic motions: closed forms, and a period and its derivative, integrated piece by piece.

A spring with a damper that only pushes is struck. Where the block touches, its acceleration jumps from a to a - s c d', s the
side: dP/dx jumps by 1 + (0, -s c d') (s, 0)^T/d' (saltation); where it is let go the force is zero already and nothing jumps.
"""

import numpy as np
from scipy.integrate import solve_ivp

from buckler import mbs
from buckler.mbs.statics.cycles import Periodic


def block(*loads, stops=(), along=(1, 0)):
    """A block of 1 kg on a slide, along x by default; its spring's other end is far, at S."""
    return mbs.Mechanism(
        {"P": (0, 0.05), "Q": (0, 0.15), "S": (10, 0.05)}, [mbs.Link("block", "P", "Q", mbs.Rigid.of(mass=1.0, inertia=1e-3))],
        [mbs.Slider("P", "block", "ground", along=along)], stops=list(stops), loads=list(loads),
    )  # fmt: skip


def start_at(motion, made, y):
    """A motion of a block that begins at a place and a speed, and the index of the coordinate that moves."""
    start = Periodic(**{**vars(motion), "q": motion.q.copy(), "v": motion.v.copy()})
    moving = int(np.argmax(np.abs(motion.v).max(axis=0)))
    start.q[0, moving] += y[0] - motion.point("block", "P")[0, np.argmax(np.abs(made.joints[0].along))]
    start.v[0, moving] = y[1]
    return start, moving


def hill(delta, epsilon):
    """Trace of the monodromy matrix of x'' + (delta + epsilon cos t) x = 0 over 2 pi, by Hill's determinant."""
    a, q, n = 4 * delta, -2 * epsilon, np.arange(-4000, 4001)
    side = q / ((2.0 * n) ** 2 - a)
    before, whole = 1.0, 1.0
    for one, other in zip(side[1:], side[:-1], strict=True):
        before, whole = whole, whole - one * other * before
    return 2 * (1 - 2 * whole * np.sin(np.pi * np.sqrt(complex(a)) / 2) ** 2).real


def struck(y, period, free, tangent, law, side=1.0, face=0.0):
    """Where it ends, and dP/dx, of x'' = free(t, x, x'), with derivatives `tangent` by x and x', and a law at its face."""
    t, y, matrix = 0.0, np.asarray(y, dtype=float), np.eye(2)
    touches = side * (y[0] - face) > 0 and push(y, law, side, face) > 0
    while t < period:

        def right(t, z, touches=touches):
            k, c = (law.stiffness, law.damping) if touches else (0.0, 0.0)
            slope = np.array([[0.0, 1.0], np.array(tangent(t, z[0], z[1])) - [k, c]])
            return [z[1], free(t, z[0], z[1]) - k * (z[0] - face) - c * z[1], *(slope @ z[2:].reshape(2, 2)).ravel()]

        def event(t, z, touches=touches):
            return push(z, law, side, face) if touches else side * (z[0] - face)

        event.terminal, event.direction = True, -1.0 if touches else 1.0
        longest = 0.1 / np.sqrt(law.stiffness) if touches else period / 20
        run = solve_ivp(right, (t, period), [*y, *matrix.ravel()], method="DOP853", rtol=1e-13, atol=1e-15, events=event,
                        max_step=longest)  # fmt: skip
        t, y, matrix = run.t[-1], run.y[:2, -1], run.y[2:, -1].reshape(2, 2)
        if t < period and not touches:
            matrix = (np.eye(2) + np.array([[0.0, 0.0], [-side * law.damping, 0.0]]) * side) @ matrix
        touches = not touches
    return y, matrix


def push(y, law, side, face):
    """What the spring and the damper push, were they in touch."""
    return side * (law.stiffness * (y[0] - face) + law.damping * y[1])


def returned(y, *given):
    """The state that returns, by Newton's method, and its multipliers, the largest first."""
    for _ in range(8):
        end, matrix = struck(y, *given)
        step = np.linalg.solve(matrix - np.eye(2), end - y)
        y = y - step
        if np.abs(step).max() < 1e-9:
            break
    values = np.linalg.eigvals(matrix)
    return y, values[np.argsort(-np.abs(values), kind="stable")]
