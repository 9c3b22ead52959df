"""What a design of the striking slider-crank must keep to, which limit binds, and the nearest wish that can be had.

Every limit is a number and the most or the least it may be; its use is their ratio, above 1 where the limit is broken. All
are closed forms and take arrays. Those marked * are estimates that keep the closed forms of `studies.striking.inverse` honest:

    dead centre   half contact angle, and its complement                              >= 5 degrees *
    shortening    u at the dead centre                                                <= 1: the strip's ends meet
    stop          depth of the impact, F_i/K over L                                   <= 0.02 *
    stop          depth under the contact force, F_c/K over u L                       <= 0.1 *
    stop          change of the slider's speed in sqrt(m/K), as a share of it         <= 0.03 *
    slenderness   h/L                                                                 <= 0.02: a strip, no rod *
    yield         bending stress at the dead centre, E h kappa/2                      <= yield strength
    buckling      compression of the rigid coupler on its way, (f - m x'')/cos(phi)   <= 0.8 P_cr *
    rebound       (5 Q^2 + 4 f S)/(e S)^2                                             <= 1: impact and contact are two *
    rest          angle the crank turns until the slider rests against the stop       <= 0.8 of the half contact angle *
    creep         loss of contact force by the guide's friction, (w tau)^2 |F''|/F    <= 0.002 *
    speed         of the crank                                                        within what the drive can do
    mass          of the slider                                                       within what it can be

buckling: a load that comes suddenly, as at the start, swings over, hence 0.8. rebound: the energy e^2 m v^2/2 must carry the
slider off against push and friction; 5 is fitted to simulations. rest: flights under the constant push F = Q + f last
m e v [1/(F + f) + 1/sqrt(F^2 - f^2)], each rho = e sqrt[(F - f)/(F + f)] times the one before, with half an oscillation on
the stop between them, until `rebound` says that the slider stays; then what it takes the oscillation on the stop to fall
to 1/200, with a damping ratio z = chi e/(2 sqrt 5) + f/(2 v_r sqrt(K m)); then seven times tau. creep: friction that is
linear below v_r (`GuideFriction`) lets the slider follow the stop only with the delay tau = f/(v_r K). True dry friction may
take anything up to f off the contact force. An impact force on a given stop fixes m v^2: mass and speed may be exchanged for
each other, and of these limits only what is due to tau depends on which is which.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import minimize

from buckler.elastica import law, pinned
from buckler.mbs.elements import GuideFriction
from buckler.mbs.geometry import Array

from .inverse import Design, Given, Wish, design

SLENDER, HELD, NEAR, RESTED, CREPT, DEEP, GIVEN_WAY, CHANGED = 0.02, 0.8, np.radians(5.0), 0.8, 2e-3, 0.02, 0.1, 0.03
"""The bounds above, angles in rad."""
PLACES = 33
"""Crank angles on the way at which the compression is looked at; its largest value is met within 1e-3."""
REACH = np.log(1e3)
"""Of the search for a wish that can be had: a thousandth to a thousand times each force."""
GRID, STARTS = 49, 3
"""Places of the search along each of the three, and how many of the nearest that can be had it goes on from."""
STEP = 1e-5
"""Of the differences by which the search sees how its limits change."""
INSIDE = 1e-3
"""Share by which the nearest wish stays inside its limits, so that it can be written down in four digits."""


class Limit(NamedTuple):
    """One limit of a design; value and allowed are floats or arrays."""

    name: str
    what: str
    value: Any
    allowed: Any
    unit: str
    least: bool = False

    @property
    def use(self) -> Any:
        """Above 1 where the limit is broken; never above 1e9."""
        over, under = (self.allowed, self.value) if self.least else (self.value, self.allowed)
        return np.minimum(over / np.maximum(under, 1e-9 * np.abs(over) + np.finfo(float).tiny), 1e9)

    def __str__(self) -> str:
        bound = "at least" if self.least else "at most"
        unit = "" if self.unit == "1" else f" {self.unit}"
        return f"{self.name}: {self.what} {self.value:.4g}{unit}, {bound} {self.allowed:.4g}{unit} allowed"


def limits(d: Design) -> list[Limit]:
    """All limits of a design, or of an array of them."""
    given, wish, L = d.given, d.wish, d.given.coupler
    half, u = np.pi - d.angle, np.clip(d.shortening, 0.0, 1.0)
    stress = pinned.surface_stress(u, d.thickness, L, given.modulus)
    impact_depth, contact_depth = wish.impact_force / (d.stiffness * L), wish.contact_force / (d.stiffness * L)
    return [
        Limit("dead centre", "half contact angle", np.degrees(half), np.degrees(NEAR), "deg", least=True),
        Limit("dead centre", "angle before contact", np.degrees(d.angle), np.degrees(NEAR), "deg", least=True),
        Limit("shortening", "end shortening over length", d.shortening, 1.0, "1"),
        Limit("stop", "depth of the impact over length", impact_depth, DEEP, "1"),
        Limit("stop", "depth of the contact over shortening", contact_depth / np.maximum(d.shortening, 1e-9), GIVEN_WAY, "1"),
        Limit("stop", "change of the slider's speed while it is struck", _change(d), CHANGED, "1"),
        Limit("slenderness", "thickness over length", d.thickness / L, SLENDER, "1"),
        Limit("yield", "bending stress", stress / 1e6, np.divide(given.yield_strength, 1e6), "MPa"),
        Limit("buckling", "compression on the way over the Euler load", _compression(d) / d.euler_load, HELD, "1"),
        Limit("rebound", "what holds the slider on the stop over what throws it back", _holding(d), 1.0, "1"),
        Limit("rest", "angle in which the slider comes to rest", np.degrees(_settling(d)), np.degrees(RESTED * half), "deg"),
        Limit("creep", "share of the contact force lost to friction", _creep(d), CREPT, "1"),
        Limit("speed", "crank speed", d.speed, given.fastest, "rad/s"),
        Limit("speed", "crank speed", d.speed, given.slowest, "rad/s", least=True),
        Limit("mass", "mass of the slider", d.mass, given.heaviest, "kg"),
        Limit("mass", "mass of the slider", d.mass, given.lightest, "kg", least=True),
    ]


def use(d: Design) -> Array:
    """Use of each limit, shape (limits, ...)."""
    return np.stack(np.broadcast_arrays(*(limit.use for limit in limits(d))))


def feasible(d: Design) -> Any:
    """Whether all limits are kept."""
    return np.all(use(d) <= 1.0, axis=0)


def broken(d: Design) -> list[Limit]:
    """Limits one design breaks, the most basic first: the estimates of the later ones suppose the earlier ones kept."""
    return [limit for limit in limits(d) if limit.use > 1.0]


def binding(d: Design) -> Limit:
    """The first limit one design breaks, or if it keeps them all the one it uses most."""
    return next(iter(broken(d)), max(limits(d), key=lambda limit: float(limit.use)))


# --- what the limits are about ----------------------------------------------------------------------------------------


def _compression(d: Design) -> Any:
    """Largest compression of the coupler, taken as rigid, from crank angle 0 to contact, N."""
    r, L = d.given.lengths
    inertia, largest = d.mass * np.square(d.speed), np.zeros(np.shape(d.speed))
    for share in np.linspace(0.0, 1.0, PLACES):
        c = np.cos(share * d.angle)
        s2 = 1 - c * c
        lean = np.sqrt(1 - (r / L) ** 2 * s2)  # slider_second_rate, spelt out: it is most of the work of a large array
        second = r * (r / (L * lean) * (1 - 2 * s2 + (r / (L * lean)) ** 2 * s2 * c * c) - c)
        largest = np.maximum(largest, (d.given.friction - inertia * second) / lean)
    return largest


def _change(d: Design) -> Any:
    """|x''| w sqrt(m/K)/|x'| at contact."""
    lengths = d.given.lengths
    return np.abs(lengths.slider_second_rate(d.angle) / lengths.slider_rate(d.angle)) * d.speed * np.sqrt(d.mass / d.stiffness)


def _holding(d: Design) -> Any:
    """(5 Q^2 + 4 f S)/(e S)^2."""
    strength = np.maximum(d.strength, 1e-3 * d.wish.impact_force)
    return (5 * np.maximum(d.push, 0.0) ** 2 + 4 * d.given.friction * strength) / (d.given.restitution * strength) ** 2


def _settling(d: Design) -> Any:
    """Angle the crank turns until the slider rests, rad; large where it never does."""
    f, e = d.given.friction, d.given.restitution
    push = np.maximum(d.push, 1e-6 * d.euler_load) + f  # where friction is too much for the strip, buckling says so
    kept = np.minimum(e * np.sqrt((push - f) / (push + f)), 1 - 1e-9)
    flight = d.mass * e * d.impact_speed * (1 / (push + f) + 1 / np.sqrt(push**2 - f**2))
    loss = np.log(kept)
    stays = (2 * f + np.sqrt(4 * f**2 + 5 * (e * (push - f)) ** 2)) / e**2  # strength at which `_holding` is 1
    flights = np.maximum(np.log(stays / np.maximum(d.strength, stays)) / loss, 1.0)
    flying = flight * np.expm1(flights * loss) / np.expm1(loss)
    unit = np.sqrt(d.mass / d.stiffness)
    damping = d.given.chi * e / np.sqrt(20) + f / (2 * GuideFriction.regularisation * np.sqrt(d.mass * d.stiffness))
    ringing = np.log(200) * unit / np.maximum(damping, 1e-9)
    return d.speed * (flying + flights * np.pi * unit + ringing + 7 * _delay(d))


def _delay(d: Design) -> Any:
    """Time constant tau of a slider that creeps after its stop, s."""
    return d.given.friction / (GuideFriction.regularisation * d.stiffness)


def _creep(d: Design) -> Any:
    """(w tau)^2 |F''|/F at the dead centre: F = p(u) cos(phi), u'' = -r e/(c L) and cos(phi)'' = -(r/c)^2, c the chord."""
    r, L = d.given.lengths
    u = np.clip(d.shortening, 0.0, 1.0 - 1e-6)
    chord = L * (1 - u)
    bend = law.fast_stiffness(u) / law.fast(u) * r * (chord + r) / (chord * L) + (r / chord) ** 2
    return np.square(d.speed * _delay(d)) * bend


# --- the nearest wish -------------------------------------------------------------------------------------------------


def nearest(wish: Wish, given: Given | None = None) -> Wish:
    """The wish that can be had with the least relative change: least sum of squares of the logarithms of the three ratios.

    A wish that can be had is returned as it is. The search scans wishes on a grid and then follows the limits by sequential
    quadratic programming from the best places there.

    Parameters
    ----------
    wish : Wish, of floats
    given : Given, of floats

    Raises
    ------
    NothingNearError
        If no wish within a thousandth to a thousand times these forces can be had.
    """
    if feasible(design(wish, given)):
        return wish
    asked = np.log([wish.contact_force, wish.impact_force, wish.contact_angle])

    def room(x: Array) -> Array:
        """How far each limit of changed logarithms is from being broken; positive within."""
        changed = design(Wish(*np.exp(np.moveaxis(x + asked, -1, 0))), given)
        return np.moveaxis(-np.log(np.maximum(use(changed), 1e-9)), 0, -1) - INSIDE

    def slope(x: Array) -> Array:
        return ((room(x + STEP * np.eye(3)) - room(x - STEP * np.eye(3))) / (2 * STEP)).T

    angle = np.log([2 * NEAR, 2 * np.pi - 2 * NEAR]) - asked[2]
    bounds = [(-REACH, REACH), (-REACH, REACH), (angle[0], angle[1])]
    grid = np.stack(np.meshgrid(*(np.linspace(low, high, GRID) for low, high in bounds)), axis=-1).reshape(-1, 3)
    starts = grid[np.all(room(grid) >= 0, axis=-1)]
    if not len(starts):
        raise NothingNearError(f"no wish within a thousandth to a thousand times these forces; {binding(design(wish, given))}")
    starts = starts[np.argsort((starts**2).sum(axis=-1))][:STARTS]
    kept = {"type": "ineq", "fun": room, "jac": slope}
    found = [
        minimize(lambda x: x @ x, start, jac=lambda x: 2 * x, method="SLSQP", bounds=bounds, constraints=kept,
                 options={"ftol": 1e-12, "maxiter": 60}).x
        for start in starts
    ]  # fmt: skip
    best = min([starts[0], *(x for x in found if np.all(room(x) >= -0.5 * INSIDE))], key=lambda x: float(x @ x))
    return Wish(*(float(v) for v in np.exp(best + asked)))


class NothingNearError(ValueError):
    """No wish of any size can be had with what is given."""
