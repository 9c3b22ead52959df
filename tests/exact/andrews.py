"""Andrews' squeezing mechanism: seven bodies about the point E, driven by a motor at O, held by a spring; no gravity.

The angles (beta, theta, gamma, phi, delta, omega, epsilon) are those of Hairer and Wanner. E is the far end of four bodies:

    O = (0, 0)      crank K1 of length rr to F = rr (cos beta, sin beta)
    K2: F to E      E = F - d (cos, sin)(beta + theta)
    K3: B to E      E = B + ss (sin gamma, -cos gamma);  spring from C to D = B + sd (cos gamma, sin gamma) + sc (sin gamma,
    -cos gamma) K5: A to G      G = A + zt (cos delta, sin delta);   K4: G to E = G + e (sin, -cos)(phi + delta) K7: A to H
    H = A + u (sin epsilon, -cos epsilon);   K6: H to E = H + zf (cos, sin)(omega + epsilon)

Centres of mass: K1 at ra from O along it; K2 at da from F towards E; K4 at ea and K6 at fa from E along them; K3 at (sa, sb),
K5 at (ta, tb), K7 at (ua, ub), first along the body from its ground pivot, then across. Only distances matter: nothing weighs.

E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, 2nd ed., section VII.7, doi 10.1007/978-3-642-05221-7.
W. Schiehlen (ed.), Multibody Systems Handbook, 1990, doi 10.1007/978-3-642-50995-7.
F. Mazzia, C. Magherini, Test Set for Initial Value Problem Solvers, release 2.4, problem "Andrews' squeezing mechanism".
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

Array = np.ndarray[Any, Any]

MASS = {"K1": 0.04325, "K2": 0.00365, "K3": 0.02373, "K4": 0.00706, "K5": 0.07050, "K6": 0.00706, "K7": 0.05498}
"""kg."""
INERTIA = {"K1": 2.194e-6, "K2": 4.410e-7, "K3": 5.255e-6, "K4": 5.667e-7, "K5": 1.169e-5, "K6": 5.667e-7, "K7": 1.912e-5}
"""About the centre of mass, kg m^2."""
A, B, C = (-0.06934, -0.00227), (-0.03635, 0.03273), (0.014, 0.072)
"""Pivots on the ground and the spring's anchor, m."""
D, DA, E, EA = 0.028, 0.0115, 0.02, 0.01421
RR, RA = 0.007, 0.00092
SS, SA, SB, SC, SD = 0.035, 0.01874, 0.01043, 0.018, 0.02
TA, TB = 0.02308, 0.00916
U, UA, UB = 0.04, 0.01228, 0.00449
ZF, ZT, FA = 0.02, 0.04, 0.01421
"""Lengths, m."""
TORQUE, STIFFNESS, FREE_LENGTH = 0.033, 4530.0, 0.07785
"""Motor, N m; spring, N/m and m."""
START = np.array(
    (
        -0.0617138900142764496358948458001,
        0.0,
        0.455279819163070380255912382449,
        0.222668390165885884674473185609,
        0.487364979543842550225598953530,
        -0.222668390165885884674473185609,
        1.23054744454982119249735015568,
    )
)
"""Angles at rest at the start, rad."""
END = 0.03


def mass_matrix(q: Array) -> Array:
    """Mass matrix of the seven angles, kg m^2."""
    _, theta, _, phi, _, omega, _ = q
    m, i = list(MASS.values()), list(INERTIA.values())
    k4, k6 = E - EA, ZF - FA
    M = np.zeros((7, 7))
    M[0, 0] = m[0] * RA**2 + m[1] * (RR**2 - 2.0 * DA * RR * np.cos(theta) + DA**2) + i[0] + i[1]
    M[0, 1] = M[1, 0] = m[1] * (DA**2 - DA * RR * np.cos(theta)) + i[1]
    M[1, 1] = m[1] * DA**2 + i[1]
    M[2, 2] = m[2] * (SA**2 + SB**2) + i[2]
    M[3, 3] = m[3] * k4**2 + i[3]
    M[3, 4] = M[4, 3] = m[3] * (k4**2 + ZT * k4 * np.sin(phi)) + i[3]
    M[4, 4] = m[3] * (ZT**2 + 2.0 * ZT * k4 * np.sin(phi) + k4**2) + m[4] * (TA**2 + TB**2) + i[3] + i[4]
    M[5, 5] = m[5] * k6**2 + i[5]
    M[5, 6] = M[6, 5] = m[5] * (k6**2 - U * k6 * np.sin(omega)) + i[5]
    M[6, 6] = m[5] * (k6**2 - 2.0 * U * k6 * np.sin(omega) + U**2) + m[6] * (UA**2 + UB**2) + i[5] + i[6]
    return M


def forces(q: Array, v: Array) -> Array:
    """Motor, spring and velocity terms, N m."""
    _, theta, gamma, phi, _, omega, _ = q
    m2, m4, m6 = MASS["K2"], MASS["K4"], MASS["K6"]
    end = np.add(B, SD * np.array((np.cos(gamma), np.sin(gamma))) + SC * np.array((np.sin(gamma), -np.cos(gamma))))
    line = end - C
    length = np.hypot(*line)
    pull = -STIFFNESS * (length - FREE_LENGTH) / length * line
    k4, k6 = ZT * (E - EA) * m4 * np.cos(phi), U * (ZF - FA) * m6 * np.cos(omega)
    k2 = m2 * DA * RR * np.sin(theta)
    turn = pull @ (SC * np.cos(gamma) - SD * np.sin(gamma), SD * np.cos(gamma) + SC * np.sin(gamma))
    return np.array(
        (
            TORQUE - k2 * v[1] * (v[1] + 2.0 * v[0]),
            k2 * v[0] ** 2,
            turn,
            k4 * v[4] ** 2,
            -k4 * v[3] * (v[3] + 2.0 * v[4]),
            -k6 * v[6] ** 2,
            k6 * v[5] * (v[5] + 2.0 * v[6]),
        )
    )


def constraints(q: Array) -> tuple[Array, Array, Array]:
    """Gaps at E, m, their Jacobian, and the second derivative along q as a function of v, all of shape (6, ...)."""
    beta, theta, gamma, phi, delta, omega, epsilon = q
    arms = {  # (coordinates on which the angle depends, length, direction angle), E or a part of the way to it
        "rr": ((0,), RR, beta),
        "d": ((0, 1), -D, beta + theta),
        "ss": ((2,), SS, gamma - np.pi / 2.0),
        "e": ((3, 4), E, phi + delta - np.pi / 2.0),
        "zt": ((4,), ZT, delta),
        "zf": ((5, 6), ZF, omega + epsilon),
        "u": ((6,), U, epsilon - np.pi / 2.0),
    }
    loops = ((B, ("ss",)), (A, ("e", "zt")), (A, ("zf", "u")))
    gaps, rows, squares = np.zeros(6), np.zeros((6, 7)), np.zeros((6, 7, 7))
    for k, (pivot, chain) in enumerate(loops):
        at = slice(2 * k, 2 * k + 2)
        gaps[at] -= pivot
        for name, sign in [("rr", 1.0), ("d", 1.0)] + [(name, -1.0) for name in chain]:
            on, length, angle = arms[name]
            arm = sign * length * np.array((np.cos(angle), np.sin(angle)))
            gaps[at] += arm
            for i in on:
                rows[at, i] += (-arm[1], arm[0])
                for j in on:
                    squares[at, i, j] -= arm
    return gaps, rows, squares


def index_one(tolerance: float = 1e-12, end: float = END) -> Array:
    """Angles, rad, and their rates, rad/s, at `end` s from the index-1 equations, shape (14,)."""

    def rates(_: float, state: Array) -> Array:
        q, v = state[:7], state[7:]
        _, rows, squares = constraints(q)
        whole = np.block([[mass_matrix(q), rows.T], [rows, np.zeros((6, 6))]])
        bend = np.einsum("kij,i,j->k", squares, v, v)
        return np.concatenate((v, np.linalg.solve(whole, np.concatenate((forces(q, v), -bend)))[:7]))

    run = solve_ivp(
        rates, (0.0, end), np.concatenate((START, np.zeros(7))), method="DOP853", rtol=tolerance, atol=tolerance * 1e-2
    )
    assert run.success, run.message
    return run.y[:, -1]
