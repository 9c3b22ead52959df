"""The striking slider-crank designed backwards: from the forces and the angle wanted to strip, stop and speed.

A slider of mass m meets a stop at a crank angle pi - g and leaves it at pi + g; in between the buckled coupler, a pinned
strip, presses it against the stop, hardest at the dead centre pi. With crank r, coupler L, slider position x(theta)
(`buckler.mbs.kinematics.linkage.SliderCrank`), the exact elastica p(u) (`buckler.elastica.law.fast`) and a linear stop K:

    contact angle 2 g      ->  stop at x(pi - g)                                                                (1)
    contact force F_c      ->  u = 1 - (|stop| + F_c/K - r)/L,   E I = F_c L^2/p(u),   I = b h^3/12             (2)
    impact force F_i       ->  F_i = c1 Q + sqrt[(c1 Q)^2 + c0^2 (S - D)^2],   S = v sqrt(K m),   v = |x'(pi - g)| omega (3)

At the dead centre the coupler lies on the slider's line, and the stop has given way by F_c/K. In the impact a coupler that
never pushes with more than its Euler load pushes with Q = P_cr cos(phi) - f, f the friction of the slider, as soon as the
strip has been pressed up to that load. Until then a time t has passed in which the slider, slowed down by K (1 + chi) v t,
has fallen behind by K (1 + chi) v t^3/(6 m), which costs the momentum 3 Q t/4 and so

    D = (3/4) Q' t sqrt(K/m),   t = [6 m Q'/(k (1 + chi) K v)]^(1/3),   k = E A/L cos(phi)^2,                   (4)

where Q' = Q - m a leaves out what the slider's own acceleration a asked of the strip before. c0 and c1 are those of
`mbs.laws.peak`, chi that of `CarvalhoMartins`. Equations (1) and (2) are exact; (3) and (4) are for a massless strip, that
is for a `Strut`, and hold within 1 % up to Q = 0.4 S. A straight `Beam` buckles late and strikes far harder.

Floats or arrays that broadcast may stand for every number: arrays in, arrays out.

References
----------
B. Demirel et al., Compliant Impact Generator for Required Impact and Contact Force, doi 10.1115/IMECE2008-68796.
A. S. Carvalho, J. M. Martins, doi 10.1016/j.mechmachtheory.2019.03.028.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from buckler.elastica import law
from buckler.mbs.declare import Declared, Either, Nothing, Quantity, declared, field
from buckler.mbs.declare.declared import MISSING
from buckler.mbs.kinematics.slidercrank import SliderCrank
from buckler.mbs.laws import CarvalhoMartins
from buckler.mbs.laws.peak import peak_factors
from buckler.mbs.library import PAPER

GROUPS = ("thickness", "width"), ("speed", "mass", "stiffness")
"""Of each, one is solved for."""
FREE = sum(GROUPS, ())
Floats = Any
"""A float, or an array that broadcasts with the others."""
PASSES = 14
"""Of the fixed point for what (2) and (3) hold implicitly: each takes off two digits or more."""


class Numbers(Quantity):
    """A number, or an array of them."""

    def read(self, name: str, given: Any) -> Any:
        """Return it as it is; what is least and what is most decide whether it is in its range."""
        for end in (np.min, np.max):
            super().read(name, float(end(given)))
        return given


def numbers(unit: str, doc: str, default: object = MISSING, most: float = np.inf, optional: bool = False) -> Any:
    """Declare numbers above 0; None stands for those that are solved for, if they are optional."""
    spec = Numbers(unit, 0.0, most, open_low=True)
    return field(Either((spec, Nothing())) if optional else spec, doc, default)


@declared
class Wish(Declared):
    """What the mechanism shall do."""

    in_files = False

    contact_force: Floats = numbers("N", "largest force of the buckled coupler on the stop, at the dead centre")
    impact_force: Floats = numbers("N", "largest force of the first impact")
    contact_angle: Floats = numbers(
        "rad", "angle the crank turns between first contact and release: twice the half angle before the dead centre",
        most=2 * np.pi,
    )  # fmt: skip


@declared
class Given(Declared):
    """What is fixed beforehand. None stands for what is solved for: one of thickness and width, one of speed, mass, stiffness."""

    in_files = False

    thickness: Floats | None = numbers("m", "of the strip", None)
    width: Floats | None = numbers("m", "of the strip", 0.030, optional=True)
    speed: Floats | None = numbers("rad/s", "of the crank", None)
    mass: Floats | None = numbers("kg", "of the slider", 0.3, optional=True)
    stiffness: Floats | None = numbers("N/m", "of the stop", 7.2e4, optional=True)
    restitution: Floats = numbers("1", "of the stop", 0.8, most=1.0)
    friction: Floats = field(Numbers("N", 0.0), "of the slider in its guide, at any speed", default=0.3)
    yield_strength: Floats = numbers("Pa", "of the strip", 1e9)
    modulus: Floats = numbers("Pa", "Young's modulus of the strip", 210e9)
    crank: Floats = numbers("m", "length of the crank", PAPER.crank)
    coupler: Floats = numbers("m", "length of the coupler, the longer of the two", PAPER.coupler)
    slowest: Floats = numbers("rad/s", "the drive can run at", 0.1)
    fastest: Floats = numbers("rad/s", "the drive can run at", 10.0)
    lightest: Floats = numbers("kg", "the slider can be", 1e-3)
    heaviest: Floats = numbers("kg", "the slider can be", 10.0)

    def agree(self) -> None:
        """One of each group is solved for; the crank can turn."""
        for group in GROUPS:
            free = [name for name in group if getattr(self, name) is None]
            if len(free) != 1:
                raise ValueError(f"free = {free}: exactly one of {', '.join(group)} must be None, to be solved for")
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
class Design:
    """A mechanism that does what was wished, if its limits allow it (`inverse_limits`); floats, or arrays of one shape.

    Attributes
    ----------
    wish, given : what it was made from
    thickness, width : m, of the strip
    stop : m, its place on the slider's line
    speed : rad/s, of the crank
    mass : kg, of the slider
    stiffness : N/m, of the stop
    angle : rad, crank angle at first contact
    shortening : 1, largest end shortening of the strip over its length
    euler_load : N, of the strip
    impact_speed : m/s, of the slider at first contact
    push : N, what the coupler adds to the impact, Q of equation (3)
    strength : N, the impact's measure S - D of equation (3); 0 where the push alone is too much
    """

    wish: Wish
    given: Given
    thickness: Any
    width: Any
    stop: Any
    speed: Any
    mass: Any
    stiffness: Any
    angle: Any
    shortening: Any
    euler_load: Any
    impact_speed: Any
    push: Any
    strength: Any

    @property
    def contact_time(self) -> Any:
        """From first contact to release, s."""
        return self.wish.contact_angle / self.speed


def design(wish: Wish, given: Given | None = None) -> Design:
    """Solve equations (1) to (4) for everything that is not given.

    Parameters
    ----------
    wish : Wish
    given : Given, optional

    Returns
    -------
    Design, of floats if every number was one, else of arrays of the broadcast shape. Where a wish cannot be had the
    numbers stay finite, and a limit of `buckler.studies.striking.inverse_limits` says so.
    """
    given = Given() if given is None else given
    lengths, (r, L) = given.lengths, given.lengths
    angle = np.pi - np.asarray(wish.contact_angle) / 2
    stop = lengths.slider(angle)
    lean, rate = lengths.lean_cosine(angle, stop), np.abs(lengths.slider_rate(angle))
    c0, c1 = peak_factors(given.chi)
    stiffness = 1e5 if given.stiffness is None else given.stiffness
    speed = 1.0 if given.speed is None else given.speed
    mass = 0.1 if given.mass is None else given.mass
    for _ in range(PASSES):
        u = 1 - (wish.contact_force / stiffness - stop - r) / L
        bending = wish.contact_force * L**2 / law.fast(np.clip(u, 0.0, 1.0))
        thickness, width = _section(bending, given)
        euler = np.pi**2 * bending / L**2
        push = euler * lean - given.friction
        rise = np.clip(push + mass * lengths.slider_second_rate(angle) * speed**2, 0.0, 2 * euler)  # more is no design anyway
        lag = _lag(rise, given, thickness * width * lean**2, rate * speed)
        strength = np.sqrt(np.maximum(wish.impact_force * (wish.impact_force - 2 * c1 * push), 0.0)) / c0
        hit = np.maximum(strength, 1e-3 * wish.impact_force) + lag * (stiffness / mass) ** (1 / 6)
        if given.speed is None:
            speed = hit / (rate * np.sqrt(stiffness * mass))
        elif given.mass is None:
            mass = (hit / (rate * speed)) ** 2 / stiffness
        else:
            stiffness = (hit / (rate * speed)) ** 2 / mass
    found = (thickness, width, stop, speed, mass, stiffness, angle, u, euler, rate * speed, push, strength)
    shape = np.broadcast_shapes(*(np.shape(x) for x in found))
    return Design(wish, given, *(np.broadcast_to(x, shape) if shape else float(x) for x in found))


def _section(bending: Floats, given: Given) -> tuple[Floats, Floats]:
    """Thickness and width of the strip of a bending stiffness E b h^3/12."""
    if given.width is not None:
        return np.cbrt(12 * bending / (given.modulus * given.width)), given.width
    assert given.thickness is not None  # Given has seen to it
    return given.thickness, 12 * bending / (given.modulus * given.thickness**3)


def _lag(rise: Floats, given: Given, area: Floats, speed: Floats) -> Floats:
    """D of equation (4) without its factor (K/m)^(1/6); `area` is that of the strip times cos(phi)^2."""
    stiffness = given.modulus * area / given.coupler
    return 0.75 * rise * np.cbrt(6 * rise / (stiffness * (1 + given.chi) * speed))
