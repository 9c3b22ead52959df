"""The double pendulum by Taylor series in 40 digits, and in double precision.

Angles are measured from the downward vertical, anticlockwise; gravity is 9.81 m/s^2. That of point masses has both at the ends
of massless rods; that of uniform rods has its masses along them.
"""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
from scipy.integrate import solve_ivp

GRAVITY = 9.81
Series = list[Any]


def coefficients(kind: str, masses: tuple[Any, Any], lengths: tuple[Any, Any]) -> tuple[Any, Any, Any, Any, Any]:
    """a11, a12, a22, kg m^2, and the weights g1, g2, N m over g, of the double pendulum's equations."""
    (m1, m2), (l1, l2) = masses, lengths
    if kind == "points":
        return (m1 + m2) * l1**2, m2 * l1 * l2, m2 * l2**2, (m1 + m2) * l1, m2 * l2
    if kind == "rods":
        return (m1 / 3 + m2) * l1**2, m2 * l1 * l2 / 2, m2 * l2**2 / 3, (m1 / 2 + m2) * l1, m2 * l2 / 2
    raise ValueError(f"kind = {kind} must be points or rods")


def double(kind: str, degrees: tuple[int, int], end: int, *, digits: int = 40, order: int = 50) -> tuple[Any, Any, Any, Any]:
    """Both angles, rad, and rates, rad/s, at `end` s, let go at rest from angles in degrees; bodies of 1 m and 1 kg.

    Taylor series of the given order; a step is so short that its last ten terms are below the last digit.
    """
    with mpmath.workdps(digits + 10):
        data = coefficients(kind, (mpmath.mpf(1),) * 2, (mpmath.mpf(1),) * 2)
        state = [mpmath.pi * a / 180 for a in degrees] + [mpmath.mpf(0)] * 2
        left = mpmath.mpf(end)
        while left > 0:
            series = _taylor(state, data, order)
            size = max(abs(terms[n]) ** (mpmath.mpf(1) / n) for terms in series for n in range(order - 9, order + 1))
            h = min(mpmath.mpf(10) ** (-mpmath.mpf(digits + 8) / order) / size, left)
            state = [_value(terms, h) for terms in series]
            left -= h
    with mpmath.workdps(digits):
        return tuple(+value for value in state)  # type: ignore[return-value]


def _taylor(state: Series, data: tuple[Any, ...], order: int) -> list[Series]:
    """Series of both angles and rates about a state: those of all quantities grow together, a coefficient at a time."""
    a11, a12, a22, g1, g2 = data
    g = mpmath.mpf(str(GRAVITY))
    q, w = [[state[0]], [state[1]]], [[state[2]], [state[3]]]
    angles: list[Series] = [q[0], q[1], [q[0][0] - q[1][0]]]
    sin = [[mpmath.sin(a[0])] for a in angles]
    cos = [[mpmath.cos(a[0])] for a in angles]
    squares: list[Series] = [[], []]
    pulls: list[Series] = [[], []]
    tops: list[Series] = [[], []]
    bottom: Series = []
    accelerations: list[Series] = [[], []]
    for n in range(order):
        for i in (0, 1):
            squares[i].append(_product(w[i], w[i], n))
        swing = [_product(sin[2], squares[i], n) for i in (0, 1)]
        pulls[0].append(-a12 * swing[1] - g * g1 * sin[0][n])
        pulls[1].append(a12 * swing[0] - g * g2 * sin[1][n])
        tops[0].append(a22 * pulls[0][n] - a12 * _product(cos[2], pulls[1], n))
        tops[1].append(a11 * pulls[1][n] - a12 * _product(cos[2], pulls[0], n))
        bottom.append((a11 * a22 if n == 0 else 0) - a12**2 * _product(cos[2], cos[2], n))
        for i in (0, 1):
            rest = mpmath.fsum(bottom[k] * accelerations[i][n - k] for k in range(1, n + 1))
            accelerations[i].append((tops[i][n] - rest) / bottom[0])
            q[i].append(w[i][n] / (n + 1))
            w[i].append(accelerations[i][n] / (n + 1))
        angles[2].append(q[0][n + 1] - q[1][n + 1])
        for i in range(3):
            slope = [(k + 1) * angles[i][k + 1] for k in range(n + 1)]
            sine, cosine = _product(cos[i], slope, n) / (n + 1), -_product(sin[i], slope, n) / (n + 1)
            sin[i].append(sine)
            cos[i].append(cosine)
    return [*q, *w]


def _value(series: Series, h: Any) -> Any:
    total = mpmath.mpf(0)
    for term in reversed(series):
        total = total * h + term
    return total


def _product(a: Series, b: Series, n: int) -> Any:
    return mpmath.fsum(a[k] * b[n - k] for k in range(n + 1))


def double_by_steps(kind: str, angles: tuple[float, float], end: float, tolerance: float = 1e-13) -> Any:
    """The same in double precision by DOP853, for bodies of 1 m and 1 kg, shape (4,)."""
    a11, a12, a22, g1, g2 = coefficients(kind, (1.0, 1.0), (1.0, 1.0))

    def rates(_: float, s: Any) -> Any:
        delta = s[0] - s[1]
        mass = np.array(((a11, a12 * np.cos(delta)), (a12 * np.cos(delta), a22)))
        turn = a12 * np.sin(delta)
        pull = np.array((-turn * s[3] ** 2 - GRAVITY * g1 * np.sin(s[0]), turn * s[2] ** 2 - GRAVITY * g2 * np.sin(s[1])))
        return np.concatenate((s[2:], np.linalg.solve(mass, pull)))

    run = solve_ivp(rates, (0.0, end), (*angles, 0.0, 0.0), method="DOP853", rtol=tolerance, atol=tolerance)
    assert run.success, run.message
    return run.y[:, -1]
