"""A block that strikes a spring with a damper that only pushes: a period and its derivative, integrated piece by piece.

Where the block touches, its acceleration jumps from a to a - s c d', s the side: dP/dx jumps by 1 + (0, -s c d') (s, 0)^T/d'
(saltation); where it is let go the force is zero already and nothing jumps.
"""

import numpy as np
from scipy.integrate import solve_ivp


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
