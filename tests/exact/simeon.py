"""Simeon's flexible slider-crank: the modal model of the test set for initial value problem solvers, in minimal coordinates.

The crank (angle p1 = W t) is rigid; the connecting rod (angle p2) bends in two sine modes q1, q2 and stretches in a quadratic
shape with nodes at its middle, q3, and its end, q4; the block is at x3. Loops close at l1 sin p1 + (l2 + q4) sin p2 = 0 and x3
= l1 cos p1 + (l2 + q4) cos p2, so q and its rate are the state, p2 and x3 follow, and nothing drifts. The equations of motion
with all terms in p are solved with their three multipliers at every call.

In the test set the mass matrix of the stretching shape is rho A l2 (8, 1; 1, 2): 15 times what the shape functions give.

B. Simeon, Modelling a flexible slider crank mechanism by a mixed system of DAEs and PDEs, Mathematical Modelling of Systems 2
(1996), 1-18.
F. Mazzia, C. Magherini, Test Set for Initial Value Problem Solvers, release 2.4, problem "Slider crank".
"""

from __future__ import annotations

from math import cos, sin
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

Array = np.ndarray[Any, Any]

CRANK, ROD = 0.15, 0.30
"""Lengths, m."""
MASSES = (0.36, 0.151104, 0.075552)
"""Crank, rod, block, kg."""
INERTIAS = (0.002727, 0.0045339259)
"""Crank about its pivot, rod about its crank pin, kg m^2."""
MODULUS, WIDTH, HEIGHT, DENSITY = 0.20e12, 0.008, 0.008, 7870.0
SPEED = 150.0
"""Crank, rad/s."""
PI = 3.1415927
"""As in the test set."""
START = np.array((0.0, 0.0, 1.03339863e-5, 1.69327969e-5))
START_RATE = np.array((4.448961125815990e-1, 4.634339319238670e-3, -1.785910760000550e-6, -2.689386719979040e-6))
END = 0.1


class Rod:
    """Integrals of the rod's shape functions."""

    def __init__(self) -> None:
        volume = WIDTH * HEIGHT * ROD
        stiffness, slender = MODULUS * WIDTH * HEIGHT / ROD, (HEIGHT / ROD) ** 2
        stretch = np.array(((8.0, 1.0), (1.0, 2.0)))
        self.M, self.K, self.B = np.zeros((4, 4)), np.zeros((4, 4)), np.zeros((4, 4))
        self.M[:2, :2], self.M[2:, 2:] = 0.5 * np.eye(2), stretch
        self.M *= DENSITY * volume
        self.K[:2, :2] = np.diag((PI**4 / 24.0, PI**4 * 2.0 / 3.0)) * slender
        self.K[2:, 2:] = np.array(((16.0, -8.0), (-8.0, 7.0))) / 3.0
        self.K *= stiffness
        upper = np.array(((-16.0 / PI**3, 8.0 / PI**3 - 1.0 / PI), (0.0, 0.5 / PI)))
        self.B[:2, 2:], self.B[2:, :2] = upper, -upper.T
        self.B *= volume
        self.c1 = volume * np.array((0.0, 0.0, 2.0 / 3.0, 1.0 / 6.0))
        self.c2 = volume * np.array((2.0 / PI, 0.0, 0.0, 0.0))
        self.c12 = ROD * volume * np.array((0.0, 0.0, 1.0 / 3.0, 1.0 / 6.0))
        self.c21 = ROD * volume * np.array((1.0 / PI, -0.5 / PI, 0.0, 0.0))


def full_state(time: float, q: Array, rate: Array) -> tuple[Array, Array]:
    """Positions and velocities (p1, p2, x3, q1 ... q4) that belong to the rod's."""
    p1, length = SPEED * time, ROD + q[3]
    p2 = -np.arcsin(CRANK * sin(p1) / length)
    v2 = -(CRANK * cos(p1) * SPEED + rate[3] * sin(p2)) / (length * cos(p2))
    x3 = CRANK * cos(p1) + length * cos(p2)
    v3 = -CRANK * sin(p1) * SPEED - length * sin(p2) * v2 + rate[3] * cos(p2)
    return np.array((p1, p2, x3, *q)), np.array((SPEED, v2, v3, *rate))


def accelerations(rod: Rod, time: float, q: Array, rate: Array) -> Array:
    """Accelerations, shape (7,)."""
    p, v = full_state(time, q, rate)
    p1, p2 = p[:2]
    w1, w2 = v[:2]
    s, c = sin(p1 - p2), cos(p1 - p2)
    (_, m2, m3), (j1, j2) = MASSES, INERTIAS
    a = np.zeros((7, 7))
    a[0, 0], a[1, 1], a[2, 2] = j1 + m2 * CRANK**2, j2 + q @ rod.M @ q + 2.0 * DENSITY * rod.c12 @ q, m3
    a[0, 1] = 0.5 * CRANK * ROD * m2 * c + DENSITY * CRANK * (s * (rod.c2 @ q) + c * (rod.c1 @ q))
    a[0, 3:] = DENSITY * CRANK * (-s * rod.c1 + c * rod.c2)
    a[1, 3:] = DENSITY * (rod.c21 + q @ rod.B)
    a[3:, 3:] = rod.M
    a = np.triu(a) + np.triu(a, 1).T

    f = np.zeros(7)
    f[0] = -0.5 * CRANK * ROD * m2 * w2**2 * s
    f[0] += DENSITY * CRANK * w2**2 * (c * (rod.c2 @ q) - s * (rod.c1 @ q))
    f[0] -= 2.0 * DENSITY * CRANK * w2 * (c * (rod.c1 @ rate) + s * (rod.c2 @ rate))
    f[1] = 0.5 * CRANK * ROD * m2 * w1**2 * s + DENSITY * CRANK * w1**2 * (s * (rod.c1 @ q) - c * (rod.c2 @ q))
    f[1] -= 2.0 * DENSITY * w2 * (rod.c12 @ rate) + 2.0 * w2 * (rate @ rod.M @ q) + DENSITY * rate @ rod.B @ rate
    f[3:] = w2**2 * (rod.M @ q) - rod.K @ q
    f[3:] += DENSITY * (w2**2 * rod.c12 + CRANK * w1**2 * (c * rod.c1 + s * rod.c2) + 2.0 * w2 * (rod.B @ rate))

    g = np.zeros((3, 7))
    length = ROD + q[3]
    g[0, :2], g[0, 6] = (CRANK * cos(p1), length * cos(p2)), sin(p2)
    g[1, :3], g[1, 6] = (CRANK * sin(p1), length * sin(p2), 1.0), -cos(p2)
    g[2, 0] = 1.0
    bend = np.array(
        (
            -CRANK * sin(p1) * w1**2 - length * sin(p2) * w2**2 + 2.0 * w2 * cos(p2) * rate[3],
            CRANK * cos(p1) * w1**2 + length * cos(p2) * w2**2 + 2.0 * w2 * sin(p2) * rate[3],
            0.0,
        )
    )
    whole = np.block([[a, g.T], [g, np.zeros((3, 3))]])
    return np.linalg.solve(whole, np.concatenate((f, -bend)))[:7]


def end_state(tolerance: float) -> Array:
    """(p1, p2, x3, q1 ... q4 and their rates) at `END`, s, shape (14,)."""
    rod = Rod()

    def rates(time: float, state: Array) -> Array:
        return np.concatenate((state[4:], accelerations(rod, time, state[:4], state[4:])[3:]))

    scale = np.array((1e-4, 1e-5, 1e-5, 1e-5, 1e-1, 1e-2, 1e-2, 1e-2))
    state = np.concatenate((START, START_RATE))
    run = solve_ivp(rates, (0.0, END), state, method="DOP853", rtol=tolerance, atol=tolerance * scale)
    assert run.success, run.message
    return np.concatenate(full_state(END, run.y[:4, -1], run.y[4:, -1]))
