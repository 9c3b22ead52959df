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

from typing import Any

import mpmath
import numpy as np

from truths.rigid import Body, Linkage

LENGTH, MASS, GRAVITY = 1.0, 1.0, 9.81


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


def linkage(windows: int = 2) -> Linkage:
    """The mechanism as bodies in absolute coordinates."""
    inertia = MASS * LENGTH**2 / 12.0
    bodies = {f"bar{k}": Body(MASS, inertia, (k * LENGTH, LENGTH / 2.0)) for k in range(windows + 1)}
    bodies |= {f"coupler{k}": Body(MASS, inertia, ((k + 0.5) * LENGTH, LENGTH)) for k in range(windows)}
    pins = [((k * LENGTH, 0.0), "ground", f"bar{k}") for k in range(windows + 1)]
    for k in range(windows):
        pins += [((k * LENGTH, LENGTH), f"bar{k}", f"coupler{k}"), (((k + 1) * LENGTH, LENGTH), f"coupler{k}", f"bar{k + 1}")]
    return Linkage(bodies, pins, gravity=(0.0, -GRAVITY))


def stepped(end: float, windows: int = 2, speed: float = 1.0, tolerance: float = 1e-11) -> Any:
    """Place of B0 from the bodies in absolute coordinates, m."""
    system = linkage(windows)
    v = np.zeros(system.start.size)
    for k, body in enumerate(system.bodies.values()):
        v[3 * k] = speed * body.centre[1] / LENGTH
        v[3 * k + 2] = -speed / LENGTH if k <= windows else 0.0
    q, _ = system.run(end, v, max(1, round(20 * end)), tolerance)
    return system.point((0.0, LENGTH), "bar0", q)
