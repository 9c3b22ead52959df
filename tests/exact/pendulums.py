"""The double pendulum in double precision.

Angles are measured from the downward vertical, anticlockwise; gravity is 9.81 m/s^2. That of point masses has both at the ends
of massless rods; that of uniform rods has its masses along them.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

GRAVITY = 9.81


def coefficients(kind: str, masses: tuple[Any, Any], lengths: tuple[Any, Any]) -> tuple[Any, Any, Any, Any, Any]:
    """a11, a12, a22, kg m^2, and the weights g1, g2, N m over g, of the double pendulum's equations."""
    (m1, m2), (l1, l2) = masses, lengths
    if kind == "points":
        return (m1 + m2) * l1**2, m2 * l1 * l2, m2 * l2**2, (m1 + m2) * l1, m2 * l2
    if kind == "rods":
        return (m1 / 3 + m2) * l1**2, m2 * l1 * l2 / 2, m2 * l2**2 / 3, (m1 / 2 + m2) * l1, m2 * l2 / 2
    raise ValueError(f"kind = {kind} must be points or rods")


def double_by_steps(kind: str, angles: tuple[float, float], end: float, tolerance: float = 1e-13) -> Any:
    """Both angles, rad, and rates, rad/s, at `end` s by DOP853, let go at rest; bodies of 1 m and 1 kg, shape (4,)."""
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
