"""Inverse design of the striking slider-crank: strip, stop and speed for given forces and contact angle.

A slider of mass m meets a stop at a crank angle pi - g and leaves it at pi + g; in between the buckled coupler, a pinned
strip, presses it against the stop, hardest at the dead centre pi. With crank r, coupler L, slider position x(theta), the exact
elastica p(u) (`buckler.elastica.law.fast`) and a linear stop K:

    contact angle 2 g      ->  stop at x(pi - g);                                                               (1)
    contact force F_c      ->  u = 1 - (|stop| + F_c/K - r)/L,   E I = F_c L^2/p(u),   I = b h^3/12;            (2)
    impact force F_i       ->  F_i = c1 Q + sqrt[(c1 Q)^2 + c0^2 (S - D)^2],   S = v sqrt(K m),   v = |x'(pi - g)| omega. (3)

At the dead centre the coupler lies on the slider's line, and the stop has given way by F_c/K. A coupler that never
pushes with more than its Euler load pushes in the impact with Q = P_cr cos(phi) - f, f the friction of the slider. It does so
once the strip is pressed up to that load, after a time t. Until then K (1 + chi) v t slows the slider down. It falls behind
by K (1 + chi) v t^3/(6 m), which costs the momentum 3 Q t/4. So:

    D = (3/4) Q' t sqrt(K/m),   t = [6 m Q'/(k (1 + chi) K v)]^(1/3),   k = E A/L cos(phi)^2.                   (4)

Here Q' = Q - m a leaves out what the slider's own acceleration a asked of the strip before. c0 and c1 are those of
`buckler.mbs.laws.peak`, chi that of `CarvalhoMartins`. Equations (1) and (2) are exact; (3) and (4) are for a massless strip,
a `Strut`, and hold within 1 % up to Q = 0.4 S. A straight `Beam` buckles late and strikes far harder. Floats or arrays that
broadcast may stand for every number.

References
----------
B. Demirel et al., Compliant Impact Generator for Required Impact and Contact Force, doi 10.1115/IMECE2008-68796.
A. S. Carvalho, J. M. Martins, doi 10.1016/j.mechmachtheory.2019.03.028.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from buckler.elastica import law, pinned
from buckler.mbs.kinematics.slidercrank import SliderCrank
from buckler.mbs.laws import CarvalhoMartins
from buckler.mbs.laws.peak import peak_factors
from buckler.mbs.library import PAPER

Floats = Any
"""A float, or an array that broadcasts with the others."""
PASSES = 14
"""Passes of the fixed point for the speed, which (4) holds implicitly: each takes off two digits or more."""
SWUNG = 0.8
"""Most compression on the way over the Euler load: a load that comes suddenly, as at the start, swings over."""
HARD = 0.4
"""Most Q over S - D: up to there equation (3) holds within 1 %, and impact and contact are two."""
PLACES = 33
"""Number of crank angles before contact at which the compression is computed, for a largest value within 1e-3."""


def _refuse(spec: object) -> None:
    """Raise a ValueError at a number that is not positive; friction may be 0."""
    for name, value in vars(spec).items():
        if not (np.all(np.asarray(value) > 0) or (name == "friction" and np.all(np.asarray(value) >= 0))):
            raise ValueError(f"{name} = {value}: must be positive")


@dataclass(frozen=True)
class Wish:
    """Largest force of the strip on the stop and of the first impact [N]; crank angle from first contact to release [rad]."""

    contact_force: Floats
    impact_force: Floats
    contact_angle: Floats

    def __post_init__(self) -> None:
        _refuse(self)


@dataclass(frozen=True)
class Given:
    """Numbers fixed beforehand, in SI units: of the strip, the slider, the stop and the linkage."""

    width: Floats = 0.030
    mass: Floats = 0.3
    stiffness: Floats = 7.2e4
    restitution: Floats = 0.8
    friction: Floats = 0.3
    yield_strength: Floats = 1e9
    modulus: Floats = 210e9
    crank: Floats = PAPER.crank
    coupler: Floats = PAPER.coupler
    fastest: Floats = 10.0

    def __post_init__(self) -> None:
        _refuse(self)
        if not np.all(np.less(self.crank, self.coupler)):
            raise ValueError(f"crank = {self.crank} m: must be shorter than the coupler, {self.coupler} m, to turn fully")

    @property
    def lengths(self) -> SliderCrank:
        """Crank and coupler."""
        return SliderCrank(self.crank, self.coupler)

    @property
    def chi(self) -> Floats:
        """Hysteresis factor of the stop."""
        return CarvalhoMartins.hysteresis(self.restitution)


@dataclass(frozen=True)
class StrikeDesign:
    """A mechanism with the wished numbers, if its `limits` allow it; floats, or arrays of one shape, in SI units.

    `stop` is its place on the slider's line, `angle` that of the crank at first contact, `shortening` the strip's largest over
    its length; `push` and `strength` are Q and S - D of equation (3); strength is 0 where the push alone is too much.
    """

    wish: Wish
    given: Given
    thickness: Floats
    stop: Floats
    speed: Floats
    angle: Floats
    shortening: Floats
    euler_load: Floats
    impact_speed: Floats
    push: Floats
    strength: Floats


def design(wish: Wish, given: Given | None = None) -> StrikeDesign:
    """Solve equations (1) to (4) for thickness, stop and, by fixed-point iteration, speed.

    Where a wish cannot be had the numbers stay finite, and one of `limits` says so.
    """
    given = Given() if given is None else given
    lengths, (r, L) = given.lengths, given.lengths
    angle = np.pi - np.asarray(wish.contact_angle) / 2
    stop = lengths.slider(angle)
    lean, rate = lengths.lean_cosine(angle, stop), np.abs(lengths.slider_rate(angle))
    c0, c1 = peak_factors(given.chi)
    mass, stiffness = given.mass, given.stiffness
    u = 1 - (wish.contact_force / stiffness - stop - r) / L
    bending = wish.contact_force * L**2 / law.fast(np.clip(u, 0.0, 1.0))
    thickness = np.cbrt(12 * bending / (given.modulus * given.width))
    euler = np.pi**2 * bending / L**2
    push = euler * lean - given.friction
    strength = np.sqrt(np.maximum(wish.impact_force * (wish.impact_force - 2 * c1 * push), 0.0)) / c0
    axial, speed = given.modulus * thickness * given.width * lean**2 / L, 1.0
    for _ in range(PASSES):
        rise = np.clip(push + mass * lengths.slider_second_rate(angle) * speed**2, 0.0, 2 * euler)  # more is no design anyway
        lag = 0.75 * rise * np.cbrt(6 * rise / (axial * (1 + given.chi) * rate * speed))  # D without (K/m)^(1/6)
        hit = np.maximum(strength, 1e-3 * wish.impact_force) + lag * (stiffness / mass) ** (1 / 6)
        speed = hit / (rate * np.sqrt(stiffness * mass))
    found = (thickness, stop, speed, angle, u, euler, rate * speed, push, strength)
    shape = np.broadcast_shapes(*(np.shape(x) for x in found))
    return StrikeDesign(wish, given, *(np.broadcast_to(x, shape) if shape else float(x) for x in found))


# --- limits -----------------------------------------------------------------------------------------------------------


class Limit(NamedTuple):
    """One limit of a design: its number and the most it may be, floats or arrays."""

    name: str
    what: str
    value: Floats
    most: Floats

    @property
    def use(self) -> Floats:
        """Number over its bound, above 1 if that is violated."""
        return self.value / self.most

    def __str__(self) -> str:
        return f"{self.name}: {self.what} {self.value:.4g}, at most {self.most:.4g} allowed"


def limits(chosen: StrikeDesign) -> list[Limit]:
    """List the limits of a design, or of an array of them.

    A run shows the rest: whether the slider comes to rest before the dead centre, and whether impact and contact are two.
    """
    u, least = np.clip(chosen.shortening, 0.0, 1.0), 1e-3 * chosen.wish.impact_force
    stress = pinned.surface_stress(u, chosen.thickness, chosen.given.coupler, chosen.given.modulus)
    return [
        Limit("shortening", "end shortening over length", chosen.shortening, 1.0),
        Limit("yield", "bending stress in MPa", stress / 1e6, np.divide(chosen.given.yield_strength, 1e6)),
        Limit("buckling", "compression on the way over the Euler load", _compression(chosen) / chosen.euler_load, SWUNG),
        Limit("push", "push of the strip over the impact's strength", chosen.push / np.maximum(chosen.strength, least), HARD),
        Limit("speed", "crank speed in rad/s", chosen.speed, chosen.given.fastest),
    ]


def feasible(chosen: StrikeDesign) -> Floats:
    """Check that all limits are met."""
    return np.all(np.stack(np.broadcast_arrays(*(limit.use for limit in limits(chosen)))) <= 1.0, axis=0)


def binding(chosen: StrikeDesign) -> Limit:
    """Return the first limit that a design violates, or the one nearest to its bound if there is none."""
    found = limits(chosen)
    return next((limit for limit in found if limit.use > 1.0), max(found, key=lambda limit: float(limit.use)))


def _compression(chosen: StrikeDesign) -> Floats:
    """Find the largest compression of the coupler, taken as rigid, from crank angle 0 to contact [N]."""
    angle = np.linspace(0.0, 1.0, PLACES).reshape(-1, *np.ones(np.ndim(chosen.angle), int)) * chosen.angle
    lean = np.sqrt(1 - (chosen.given.crank / chosen.given.coupler * np.sin(angle)) ** 2)
    inertia = chosen.given.mass * np.square(chosen.speed) * chosen.given.lengths.slider_second_rate(angle)
    return np.maximum(((chosen.given.friction - inertia) / lean).max(axis=0), 0.0)
