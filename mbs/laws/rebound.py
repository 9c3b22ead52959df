"""Restitution of contact laws, and the damping that gives a prescribed restitution.

A body of mass m meets a contact at speed v0 and leaves at e v0. The force is F = K d^n (1 + chi d'/v0) at the depth d.
Separation of the variables d and d' in m d'' = -F gives a relation that does not contain K, n, m or v0:

    chi (1 + e) = ln[(1 + chi) / (1 - chi e)],     0 < chi e < 1.

The force is positive up to the end (1 - chi e > 0), so clipping it at zero changes nothing in a free impact.

The relation is that of A. S. Carvalho, J. M. Martins, doi 10.1016/j.mechmachtheory.2019.03.028. For the linear dashpot see
T. Schwager, T. Poeschel, doi 10.1007/s10035-007-0065-z.
"""

import math
from collections.abc import Callable

import numpy as np

from ..validate import number, positive
from .pieces import NormalLaw

_ROUNDING = 4.0 * float(np.finfo(float).eps)
"""Relative tolerance of roots: four roundings."""


def restitution(chi: float) -> float:
    """Compute the restitution e in (0, 1] that F = K d^n (1 + chi d'/v0) delivers, for chi >= 0 and any n, by Newton's method.

    The unknown is y = chi e, and the relation g(y) = -ln(1 - y) - y = chi - ln(1 + chi), written without cancellation. As g is
    convex and increasing and the start is above the root, the iteration converges monotonically.
    """
    chi = number("chi", chi, 0.0, math.inf, "1")
    if chi < 1e-6:  # Taylor series, with an error of order chi^3
        return 1.0 - 2.0 / 3.0 * chi * (1.0 - 2.0 / 3.0 * chi)
    target = -_log1p_minus(chi)
    y = min(-math.expm1(-1.0 - target), math.sqrt(2.0 * target))  # above the root: g(y) > y^2/2 and g(y) > -ln(1 - y) - 1
    while y < 1.0:  # for large chi the root rounds to 1
        change = (-_log1p_minus(-y) - target) * (1.0 - y) / y
        y -= change
        if change <= _ROUNDING * y:
            break
    return min(1.0, y / chi)


def chi_exact(e: float) -> float:
    """Compute the factor chi that delivers 0 < e <= 1, the inverse of ``restitution``: 1.5 (1 - e) as e -> 1, 1/e as e -> 0."""
    e = number("restitution", e, 0.0, 1.0, "1", open_low=True)
    return _root(lambda chi: restitution(chi) - e, 1.001 / e)  # as chi e < 1, the restitution of 1.001/e is below e


def restitution_linear(damping_ratio: float) -> float:
    """Compute the restitution of a spring k and dashpot c that do not pull, for zeta = c / (2 sqrt(k m)) >= 0.

    Contact ends when the force returns to zero, at a positive depth:
    e = exp(-2 zeta a / sin a), cos a = zeta (zeta < 1); e = exp(-2 zeta a / sinh a), cosh a = zeta (zeta > 1).
    """
    zeta = number("damping_ratio", damping_ratio, 0.0, math.inf, "1")
    if zeta == 1.0:
        return math.exp(-2.0)
    if zeta < 1.0:
        angle = math.acos(zeta)
        return math.exp(-2.0 * zeta * angle / math.sin(angle))
    angle = math.acosh(zeta)
    return math.exp(-2.0 * angle / math.tanh(angle))


def damping_ratio(e: float) -> float:
    """Compute the damping ratio zeta at which ``restitution_linear`` delivers a restitution 0 < e <= 1."""
    e = number("restitution", e, 0.0, 1.0, "1", open_low=True)
    highest = 1.0 + 0.5 / math.sqrt(e)  # beyond zeta = 1, e < 1 / (4 (zeta - 1)^2)
    return _root(lambda zeta: restitution_linear(zeta) - e, highest)


def _root(function: Callable[[float], float], highest: float) -> float:
    """Find the zero of a decreasing function in [0, highest] by Brent's method, to rounding."""
    from scipy.optimize import brentq  # it takes a while to load, and few laws need it

    return float(brentq(function, 0.0, highest, xtol=1e-300, rtol=_ROUNDING))  # xtol: none


def delivered(law: NormalLaw, mass: float | None = None, speed: float | None = None) -> float:
    """Compute the restitution that a law delivers to a mass m1 m2 / (m1 + m2) [kg] at a speed [m/s], where it depends on them."""
    if hasattr(law, "delivered"):  # else it is integrated
        return float(law.delivered(mass, speed))
    return restitution_integrated(law, require_given("mass", mass, "kg", law), require_given("speed", speed, "m/s", law))


def require_given(name: str, value: float | None, unit: str, law: object) -> float:
    """Return a positive value on which a law's restitution depends; a ValueError names the law if the value is None."""
    if value is None:
        kind = type(law).__name__
        raise ValueError(f"{name} = None: the restitution of {kind} depends on it; it must lie in (0, inf) {unit}")
    return positive(name, value, unit)


def elastic_depth(law: NormalLaw, mass: float, speed: float) -> float:
    """Compute the depth [m] at which the elastic part K d^n stops a mass [kg] of a speed [m/s]: K d^(n+1)/(n+1) = m v^2/2."""
    n = law.exponent
    return float((0.5 * (n + 1.0) * mass * speed**2 / law.stiffness) ** (1.0 / (n + 1.0)))


def contact_time(law: NormalLaw, mass: float, speed: float) -> float:
    """Compute the duration of an impact [s] on the elastic part alone: pi sqrt(m/K) for n = 1, 2.943 d/v0 for n = 1.5.

    It is 2 (d/v0) sqrt(pi) Gamma(1 + q) / Gamma(1/2 + q) with q = 1/(n + 1) and d the ``elastic_depth``. The effective mass is
    m1 m2 / (m1 + m2) [kg], v0 the approach speed [m/s].
    """
    mass, speed = positive("mass", mass, "kg"), positive("speed", speed, "m/s")
    q = 1.0 / (law.exponent + 1.0)
    return 2.0 * elastic_depth(law, mass, speed) / speed * math.sqrt(math.pi) * math.gamma(1.0 + q) / math.gamma(0.5 + q)


def restitution_integrated(law: NormalLaw, mass: float, speed: float) -> float:
    """Compute the restitution by integrating m d'' = -F, for a mass [kg] and an approach speed [m/s], until the depth is zero.

    LSODA solves the equation scaled by ``elastic_depth`` and speed, with a relative error of about 1e-8. The scaled depth starts
    at 1e-13: at 0 a law may jump. A body without damping leaves at the scaled time 3; contact at 1e6 raises RuntimeError.
    """
    from scipy.integrate import solve_ivp

    mass, speed = positive("mass", mass, "kg"), positive("speed", speed, "m/s")
    depth = elastic_depth(law, mass, speed)
    scale = depth / (mass * speed**2)  # scaled acceleration over the force [1/N]

    def motion(_: float, state: np.ndarray) -> tuple[float, float]:
        """Return the rates of depth/`depth` and rate/`speed` over the time in units of `depth`/`speed`."""
        x, v = state.tolist()
        return v, -scale * float(law.force(depth * x, speed * v, speed))  # `speed` is also that at onset

    def out(_: float, state: np.ndarray) -> float:
        """Return the scaled depth, which ends the impact at 0."""
        return float(state[0])

    out.terminal, out.direction = True, -1.0  # type: ignore[attr-defined]
    run = solve_ivp(motion, (0.0, 1e6), (1e-13, 1.0), method="LSODA", events=out, rtol=1e-10, atol=1e-13)
    if run.status != 1:
        raise RuntimeError(f"{law} at mass = {mass} kg, speed = {speed} m/s: no rebound found; {run.message}")
    return float(-run.y_events[0][0, 1])


def _log1p_minus(x: float) -> float:
    """Return ln(1 + x) - x without cancellation; ln(1 + x) = 2 artanh(r) with r = x / (2 + x), and 2 r - x = -r x."""
    if abs(x) > 0.5:
        return math.log1p(x) - x
    r = x / (2.0 + x)
    series = sum(r ** (2 * k) / (2 * k + 1) for k in range(1, 18))  # |r| <= 1/3: the next term is below 1e-18
    return r * (2.0 * series - x)
