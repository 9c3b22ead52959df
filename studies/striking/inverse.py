"""Inverse design of the striking slider-crank: equations for strip, stop and speed by wished forces and contact angle.

A slider of mass m moves along the negative x axis and meets a stop at a crank angle pi - g: the impact. The phase of contact
lasts from then to pi + g. In it the coupler, a pinned strip of width b and thickness h, is buckled and presses the slider against
the stop, most strongly at the outer dead centre pi. Crank and coupler have the paper's lengths r and L, the crank has the speed
omega. The slider has the position x(theta) < 0, with derivatives x' and x'' by the crank angle theta. K is the stop's stiffness.
A pinned strip whose ends approach each other by u L has the load p(u) E I/L^2 of the elastica (`buckler.elastica.law.fast`, to a
relative 1e-12):

    contact angle 2 g      ->  stop at x_s = x(pi - g);                                                         (1)
    contact force F_c      ->  u = 1 - (F_c/K - x_s - r)/L,   E I = F_c L^2/p(u),   I = b h^3/12;               (2)
    impact force F_i       ->  F_i = c1 Q + sqrt[(c1 Q)^2 + c0^2 (S - D)^2],   S = v sqrt(K m),   v = |x'(pi - g)| omega. (3)

At the dead centre the coupler lies on the x axis, between the crank's end at -r and the slider at x_s - F_c/K. The depth in the
stop is F_c/K. As u is below 2 r/L = 0.9, the ends of the strip do not meet. Equation (3) is the largest force on a linear stop
that a slider meets at speed v under a constant push Q. Its factors c0 and c1 (`buckler.mbs.laws.peak`) depend on the hysteresis
factor chi of the stop, whose force at the depth d is K d (1 + chi d'/v). S is the force of an elastic impact without push. The
coupler, at the angle phi to the x axis, pushes towards the stop with its Euler load P_cr, less the friction f of the slider:
Q = P_cr cos(phi) - f.

The push reaches Q only at a time t after first contact, which lessens S by D. Before contact the push is -m x'' omega^2, which
accelerates the slider; so it has to rise by Q' = Q + m x'' omega^2. The stop's force K (1 + chi) v tau at the time tau delays the
slider against the crank by K (1 + chi) v tau^3/(6 m). This compresses the strip, so the push rises as tau^3. The momentum missing
at t is the integral of Q' (1 - (tau/t)^3), that is 3 Q' t/4. A momentum m v gives the elastic force S = v sqrt(K m), which is
sqrt(K/m) times the momentum. Hence the missing momentum lessens S by

    D = (3/4) Q' t sqrt(K/m),   t = [6 m Q'/(k_s (1 + chi) K v)]^(1/3),   axial stiffness k_s = E A/L cos(phi)^2. (4)

Equations (1) and (2) are exact. For a massless strip, a `Strut`, (3) and (4) agree within 1 % with integrations of the impact up
to Q = 0.4 (S - D). A straight `Beam` buckles late and strikes far harder. Arrays broadcast.
Sources: B. Demirel et al., 2008, doi 10.1115/IMECE2008-68796; Carvalho, Martins 2019, doi 10.1016/j.mechmachtheory.2019.03.028.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from buckler.elastica import law, pinned
from buckler.mbs import STEEL
from buckler.mbs.laws import CarvalhoMartins
from buckler.mbs.laws.peak import peak_factors
from buckler.mbs.library import PAPER

Floats = Any
"""Float, or array that broadcasts with the others."""
MOST_RISE = 2.0
"""Largest Q' over P_cr. Q is P_cr at most, so at a larger Q' the slider's inertia pulls the strip with more than P_cr."""
LEAST_STRENGTH = 1e-3
"""Least S - D over F_i in the iteration. It keeps the speed positive where Q alone exceeds F_i; the limit `push` then fails."""


class _Positive:
    """Base class of numbers that must be positive; friction may be 0."""

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not (np.all(np.asarray(value) > 0) or (name == "friction" and np.all(np.asarray(value) >= 0))):
                raise ValueError(f"{name} = {value}: must be positive")


@dataclass(frozen=True)
class Wish(_Positive):
    """Wished largest forces F_c of contact and F_i of impact [N], and contact angle 2 g [rad]."""

    contact_force: Floats
    impact_force: Floats
    contact_angle: Floats


@dataclass(frozen=True)
class Given(_Positive):
    """Numbers of strip, slider and stop that the design does not change, in SI units; most defaults are chosen."""

    width: Floats = 0.030  # the paper's
    mass: Floats = 0.3
    stiffness: Floats = 7.2e4
    restitution: Floats = 0.8
    friction: Floats = 0.3  # force f on the slider
    yield_strength: Floats = 1e9
    fastest: Floats = 10.0  # largest crank speed of the drive

    @property
    def chi(self) -> Floats:
        """Hysteresis factor of the stop."""
        return CarvalhoMartins.hysteresis(self.restitution)


@dataclass(frozen=True)
class StrikeDesign:
    """Slider-crank with the wished forces and angle, if its `limits` allow it; floats, or arrays of one shape, in SI units."""

    wish: Wish
    given: Given
    thickness: Floats
    stop: Floats  # position on the slider's line
    speed: Floats
    angle: Floats  # of the crank at the impact
    shortening: Floats  # largest end shortening over length
    euler_load: Floats
    impact_speed: Floats
    push: Floats  # Q in equation (3)
    strength: Floats  # S - D in equation (3), or 0 where Q alone exceeds the wished force


def design(wish: Wish, given: Given | None = None) -> StrikeDesign:
    """Solve equations (1) and (2) for stop and thickness, and (3) with (4) for the speed by fixed-point iteration.

    For a wish without a solution the numbers are finite, and violate one of the `limits`. A stop so soft that u < 0 is no limit
    of its own: 5e4 random designs with such a stop all violate another limit.
    """
    given = Given() if given is None else given
    r, L, mass, stiffness = PAPER.crank, PAPER.coupler, given.mass, given.stiffness
    angle = np.pi - np.asarray(wish.contact_angle) / 2
    stop = PAPER.slider(angle)
    cosine, rate = PAPER.lean_cosine(angle, stop), np.abs(PAPER.slider_rate(angle))  # cos(phi), |x'|
    c0, c1 = peak_factors(given.chi)
    u = 1 - (wish.contact_force / stiffness - stop - r) / L
    bending = wish.contact_force * L**2 / law.fast(np.maximum(u, 0.0))
    thickness = np.cbrt(12 * bending / (STEEL.modulus * given.width))
    euler = np.pi**2 * bending / L**2
    push = euler * cosine - given.friction  # Q
    square = wish.impact_force * (wish.impact_force - 2 * c1 * push)  # c0^2 (S - D)^2 by equation (3)
    strength = np.sqrt(np.maximum(square, 0.0)) / c0
    axial = STEEL.modulus * thickness * given.width * cosine**2 / L  # k_s
    speed = 1.0  # [rad/s], where the iteration starts
    for _ in range(14):  # each reduces the error of D, which depends on the speed, 20-fold or more; 12 reach rounding
        # Q' in bounds for the iteration; below 0 the limit `buckling` excludes the design, above MOST_RISE the limit `pull`
        rise = np.clip(push + mass * PAPER.slider_second_rate(angle) * speed**2, 0.0, MOST_RISE * euler)
        rise_time = np.cbrt(6 * mass * rise / (axial * (1 + given.chi) * stiffness * rate * speed))  # t
        loss = 0.75 * rise * rise_time * np.sqrt(stiffness / mass)  # D
        elastic_force = np.maximum(strength, LEAST_STRENGTH * wish.impact_force) + loss  # S
        speed = elastic_force / (rate * np.sqrt(stiffness * mass))
    found = (thickness, stop, speed, angle, u, euler, rate * speed, push, strength)  # in the order of the fields
    shape = np.broadcast_shapes(*map(np.shape, found))
    return StrikeDesign(wish, given, *(np.broadcast_to(x, shape) if shape else float(x) for x in found))


class Limit(NamedTuple):
    """Limit of a design: a number, its description and its upper bound; floats or arrays."""

    name: str
    text: str
    value: Floats
    most: Floats

    @property
    def use(self) -> Floats:
        """Number over its bound: above 1 the limit is violated."""
        return self.value / self.most

    def __str__(self) -> str:
        return f"{self.name}: {self.text} {self.value:.4g}, at most {self.most:.4g} allowed"


def limits(chosen: StrikeDesign) -> list[Limit]:
    """List the limits of a design, or of an array; only a run shows if the slider rests at the dead centre, as (2) assumes."""
    u, strength = np.maximum(chosen.shortening, 0.0), np.maximum(chosen.strength, LEAST_STRENGTH * chosen.wish.impact_force)
    compression = _compression(chosen) / chosen.euler_load
    inertia = chosen.given.mass * PAPER.slider_second_rate(chosen.angle) * np.square(chosen.speed)
    rise = (chosen.push + inertia) / chosen.euler_load  # Q' over P_cr
    stress = pinned.surface_stress(u, chosen.thickness, PAPER.coupler, STEEL.modulus)
    return [
        Limit("yield", "bending stress in MPa", stress / 1e6, np.divide(chosen.given.yield_strength, 1e6)),
        Limit("buckling", "compression on the way over the Euler load", compression, 0.8),  # a sudden load overshoots
        Limit("pull", "rise of the strip's push in the impact over the Euler load", rise, MOST_RISE),
        Limit("push", "push of the strip over the impact's strength", chosen.push / strength, 0.4),  # or (3) errs by over 1 %
        Limit("speed", "crank speed in rad/s", chosen.speed, chosen.given.fastest),
    ]


def feasible(chosen: StrikeDesign) -> Floats:
    """Check that all limits are met."""
    return np.all(np.stack(np.broadcast_arrays(*(limit.use for limit in limits(chosen)))) <= 1.0, axis=0)


def binding(chosen: StrikeDesign) -> Limit:
    """Return the first limit that a design of floats violates, or else the limit that is nearest to its bound."""
    found = limits(chosen)
    return next((limit for limit in found if limit.use > 1.0), max(found, key=lambda limit: float(limit.use)))


def _compression(chosen: StrikeDesign) -> Floats:
    """Find the largest compression (f - m x'' omega^2)/cos(phi) of a rigid coupler before the impact [N]."""
    angle = np.linspace(0.0, chosen.angle, 33)  # on the first axis; with 33 of them the maximum is right within 1e-3
    cosine = PAPER.lean_cosine(angle, PAPER.slider(angle))
    inertia = chosen.given.mass * np.square(chosen.speed) * PAPER.slider_second_rate(angle)
    return np.maximum(((chosen.given.friction - inertia) / cosine).max(axis=0), 0.0)
