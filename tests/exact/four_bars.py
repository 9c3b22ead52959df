"""N four-bar mechanism: N + 1 upright bars on a level ground, N couplers between their tops, all of length L and mass m.

On the motion that the benchmark asks for all upright bars stay parallel. With a their angle from the upward vertical, clockwise,

    J a'' = G sin(a),   J = m L^2 ((N + 1)/3 + N),   G = m g L ((N + 1)/2 + N),

a pendulum let go at its top with a'(0) = v/L: it turns over and over, through the level poses in which the couplers could fold.
Its closed form is a = 2 am(v t/(2 L) | -n), n = 4 G L^2/(J v^2).

M. Gonzalez, D. Dopico, U. Lugris, J. Cuadrado, A benchmarking system for MBS simulation software, doi 10.1007/s11044-006-9020-8,
problem A02.
E. Bayo, A. Avello, Singularity-free augmented Lagrangian algorithms for constrained multibody dynamics, Nonlinear Dynamics 5
(1994), 209-231.
"""

from __future__ import annotations

import mpmath

GRAVITY = 9.81


def top(time: float, windows: int = 2, speed: float = 1.0, digits: int = 30) -> tuple[float, float, float, float]:
    """x, y, m, and vx, vy, m/s, of B0, the top of the first bar, at `time` s after it left (0, 1) m with vx = `speed`."""
    with mpmath.workdps(digits):
        inertia = mpmath.mpf(windows + 1) / 3 + windows
        weight = (mpmath.mpf(windows + 1) / 2 + windows) * mpmath.mpf(str(GRAVITY))
        start, n = mpmath.mpf(speed), 4 * weight / (inertia * mpmath.mpf(speed) ** 2)
        # dn and sd at a negative parameter: am(u | -n) has sin = sd(v | m)/sqrt(1 + n) with v = u sqrt(1 + n), m = n/(1 + n).
        m, v = n / (1 + n), start * time / 2 * mpmath.sqrt(1 + n)
        sn, cn, dn = (mpmath.ellipfun(name, v, m=m) for name in ("sn", "cn", "dn"))
        sine, cosine = sn / dn / mpmath.sqrt(1 + n), cn / dn
        rate = start / dn
        x, y = 2 * sine * cosine, 1 - 2 * sine**2
        return float(x), float(y), float(y * rate), float(-x * rate)
