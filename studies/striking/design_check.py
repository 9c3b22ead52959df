"""A design of the striking slider-crank simulated, and corrected by simulated turns until a coupler with inertia does as wished.

`strut`, the coupler a massless exact elastica, is the model of the closed form. `beam` gives the coupler its inertia: it
buckles late and strikes harder, and a bow takes some of its contact force. Each simulated turn tells by how much; contact
force, angle and the free number (speed, mass or stiffness of the stop) are corrected until the beam does what was wished.
Thickness or width go with the contact force and the place of the stop with the angle, one to one; the impact goes with a power
of the free number, found on the way. Where that leaves its range, the range is scanned: either two of its turns enclose the
wish, or none do, and that is said.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from math import degrees, exp, isfinite, log, nan, pi
from typing import Any, NamedTuple

import numpy as np

from buckler.mbs import Controlled, Exudyn, Material, Section
from buckler.mbs.elements.section import STEEL
from buckler.studies.striking.assumptions import StrikeParameters
from buckler.studies.striking.impact import ModelRun, read
from buckler.studies.striking.impact_models import COUPLERS, coupler, simulated, striking
from buckler.studies.striking.inverse import Design, Given, Wish, design
from buckler.studies.striking.inverse_limits import DEEP, NEAR, feasible, limits

AFTER_RELEASE = np.radians(2.0)
"""How far the crank turns on after the release, rad."""
BARS: dict[str, dict[str, float]] = {
    "strut": {"contact_force": 5e-3, "impact_force": 2e-2, "contact_angle": float(np.radians(0.5))},
    "beam": {"contact_force": 5e-3, "impact_force": 5e-2, "contact_angle": float(np.radians(0.5))},
}
"""How far a model may be off a wish that the design is to hold for: relative for the forces, rad for the angle."""
CLOSE = 0.1
"""How close the corrections come, in parts of the bars."""
TURNS, SCANNED = 14, 9
"""Turns that may be simulated, and values of the free number that are scanned if they lead out of its range."""
POWERS = 0.15, 2.5
"""Least and largest power of the free number that the impact force is taken to go with."""
STIFFEST = 1e8
"""Of a stop, N/m."""
ALWAYS = ("dead centre", "shortening", "slenderness", "yield")
"""Limits of the closed form that any strip must keep; the simulated turn shows what the others are about."""


class CheckedTurn(NamedTuple):
    """What a simulated turn of the crank did; nan where it did not happen.

    Attributes
    ----------
    contact_force, impact_force : on the stop at the dead centre, and the largest of the first impact, N
    contact_angle : from first contact to release, rad
    settled : crank angle from which the slider rests against the stop, rad; nan if it is off it at the dead centre
    run : the run it was read off
    """

    contact_force: float
    impact_force: float
    contact_angle: float
    settled: float
    run: ModelRun

    @classmethod
    def of(cls, run: ModelRun) -> CheckedTurn:
        """Read a run."""
        found = read(run)
        return cls(found.force_180 if found.impact_peak else nan, found.impact_peak or nan, found.turned, found.settled, run)

    def off(self, wish: Wish) -> dict[str, float]:
        """How far it is off a wish: relative for the forces, rad for the angle."""
        forces = {name: getattr(self, name) / getattr(wish, name) - 1 for name in ("contact_force", "impact_force")}
        return forces | {"contact_angle": self.contact_angle - wish.contact_angle}

    def within(self, wish: Wish, bars: Mapping[str, float], share: float = 1.0) -> bool:
        """Whether it does as wished, to a share of the bars, at rest against the stop at the dead centre."""
        return isfinite(self.settled) and all(abs(x) <= share * bars[name] for name, x in self.off(wish).items())


def check(model: str, design: Design, numerics: StrikeParameters | None = None, finer: bool = False) -> CheckedTurn:
    """Simulate a designed slider-crank from crank angle 0 until it has left the stop, and read it.

    Parameters
    ----------
    model : {"strut", "beam"}
    design : Design, of floats
    numerics : StrikeParameters, optional
    finer : bool
        With twice the elements and a hundredth of the tolerance.
    """
    p, given = StrikeParameters() if numerics is None else numerics, design.given
    section = Section(design.width, design.thickness, Material(float(given.modulus), STEEL.density))
    elements, tolerance = (2 * p.elements, p.tolerance / 100) if finer else (p.elements, p.tolerance)
    made = striking(
        coupler(COUPLERS[model], section, float(given.coupler), p.damping, p.imperfection, elements),
        p,
        stiffness=design.stiffness,
        restitution=float(given.restitution),
        mass=design.mass,
        friction=float(given.friction),
        speed=design.speed,
        stop=design.stop,
        lengths=given.lengths,
    )
    solver = Exudyn(Controlled(tolerance=tolerance, max_step=pi / 180 / design.speed))
    duration = (2 * pi - design.angle + AFTER_RELEASE) / design.speed
    return CheckedTurn.of(simulated(model, made, duration, solver, p.timeout))


def random_wishes(around: Design, count: int, seed: int) -> list[Design]:
    """So many designs, or fewer where hardly any can be had, of random wishes that keep all limits, everything given as it is."""
    wishes = drawn_wishes(around.wish, 200 * count, seed)
    drawn = (np.array([getattr(w, name) for w in wishes]) for name in ("contact_force", "impact_force", "contact_angle"))
    kept = np.flatnonzero(feasible(design(Wish(*drawn), around.given))) if count else ()
    return [design(wishes[i], around.given) for i in kept[:count]]


def drawn_wishes(wish: Wish, count: int, seed: int, spread: float = 4.0) -> list[Wish]:
    """Wishes drawn around one: forces within a factor, the angle within its square root."""
    generator = np.random.default_rng(seed)
    factors = np.exp(generator.uniform(-1, 1, (3, count)) * np.log(spread) * np.array([[1], [1], [0.5]]))
    angles = np.minimum(wish.contact_angle * factors[2], 2 * pi - 1e-3)
    forces, impacts = wish.contact_force * factors[0], wish.impact_force * factors[1]
    return [Wish(float(f), float(i), float(a)) for f, i, a in zip(forces, impacts, angles, strict=True)]


# --- designs that hold for the beam -----------------------------------------------------------------------------------


class BeamDesign(NamedTuple):
    """A design for the beam, its `wish` the one asked for, after so many simulated turns.

    `reason` is why no strip does it, beginning with a name; empty if this one does.
    """

    design: Design
    turns: int
    reason: str


class _Inner(NamedTuple):
    """What the closed form is asked for so that the beam does as wished, and the free number."""

    force: float
    angle: float
    free: float


class _Search:
    """The turns simulated on the way to one wish."""

    def __init__(self, wish: Wish, given: Given, numerics: StrikeParameters) -> None:
        self.wish, self.given, self.numerics, self.turns = wish, given, numerics, 0
        ranges = {
            "speed": (given.slowest, given.fastest),
            "mass": (given.lightest, given.heaviest),
            "stiffness": (wish.impact_force / (DEEP * given.coupler), STIFFEST),
        }
        self.free = next(name for name in ranges if getattr(given, name) is None)
        self.range = ranges[self.free]

    def made(self, inner: _Inner) -> Design:
        """The mechanism of inner wishes; its closed forms are told the free number, its wish is the one asked for."""
        found: dict[str, Any] = {self.free: inner.free}
        return replace(design(Wish(inner.force, self.wish.impact_force, inner.angle), self.given), wish=self.wish, **found)

    def turn(self, inner: _Inner) -> CheckedTurn:
        """Simulate one."""
        self.turns += 1
        return check("beam", self.made(inner), self.numerics)

    def follow(self, inner: _Inner, low: float, high: float) -> tuple[_Inner, str | None]:
        """Correct from here until the beam does as wished; why it does not, None if the free number would leave its range."""
        before = None
        for _ in range(TURNS):
            if broken := [x for x in limits(self.made(inner)) if x.name in ALWAYS and x.use > 1.0]:
                return inner, str(broken[0])
            turn = self.turn(inner)
            if not isfinite(turn.impact_force):
                return inner, None
            if turn.within(self.wish, BARS["beam"], CLOSE):
                return inner, ""
            last, inner = (inner, turn), self._corrected(inner, turn, before)
            before = last
            if not low <= inner.free <= high:
                if last[0].free in (low, high):
                    return last[0], None
                inner = inner._replace(free=float(np.clip(inner.free, low, high)))
        return last[0], "" if turn.within(self.wish, BARS["beam"]) else self._why(turn)

    def scan(self, inner: _Inner) -> tuple[_Inner, str]:
        """Simulate over the whole range of the free number: go on between two that enclose the wish, or say that none do."""
        values = np.geomspace(*self.range, SCANNED)
        forces = np.array([self.turn(inner._replace(free=float(value))).impact_force for value in values])
        over, why = np.where(np.isfinite(forces), np.sign(forces - self.wish.impact_force), 0.0), ""
        for k in np.flatnonzero(over[1:] * over[:-1] < 0):
            low, high = float(values[k]), float(values[k + 1])
            found, reason = self.follow(inner._replace(free=float(np.sqrt(low * high))), low, high)
            if reason == "":
                return found, ""
            why = reason or "swing: the slider does not meet the stop"
        unit = {"speed": "rad/s", "mass": "kg", "stiffness": "N/m"}[self.free]
        known = forces[np.isfinite(forces)]
        told = f"impacts from {known.min():.3g} to {known.max():.3g} N" if known.size else "no impact"
        between = "between {:.3g} and {:.3g}".format(*self.range)
        return inner, why or f"{self.free}: {told} {between} {unit}, asked for {self.wish.impact_force:.4g} N"

    def _corrected(self, inner: _Inner, turn: CheckedTurn, before: tuple[_Inner, CheckedTurn] | None) -> _Inner:
        """Next inner wishes: force and angle by what is missing, the free number by the power the last two turns show."""
        errors, power = turn.off(self.wish), 0.7
        if before and abs(step := log(inner.free / before[0].free)) > 1e-3:
            power = float(np.clip(log(turn.impact_force / before[1].impact_force) / step, *POWERS))
        rests = isfinite(turn.settled) and turn.contact_force > 0
        force = inner.force / np.clip(1 + errors["contact_force"], 0.7, 1.4) if rests else inner.force
        angle = inner.angle - float(np.clip(errors["contact_angle"], -0.1, 0.1)) if rests else inner.angle
        free = inner.free * exp(-float(np.clip(log(1 + errors["impact_force"]) / power, -2.5, 2.5)))
        return _Inner(float(force), float(np.clip(angle, 2 * NEAR, 2 * pi - 2 * NEAR)), free)

    def _why(self, turn: CheckedTurn) -> str:
        """Why the corrections led nowhere."""
        if not isfinite(turn.settled):
            return "rest: the slider is in the air at 180 deg"
        contact, impact, angle = turn.off(self.wish).values()
        told = f"{100 * contact:+.2g} %, {100 * impact:+.2g} %, {degrees(angle):+.2g} deg"
        return f"no agreement after {TURNS} turns: contact force, impact force, angle off by {told}"


def for_beam(wish: Wish, given: Given, numerics: StrikeParameters) -> BeamDesign:
    """Design for the beam of `numerics`; wish and given of floats."""
    search = _Search(wish, given, numerics)
    first = float(np.clip(getattr(design(wish, given), search.free), *search.range))
    inner, reason = search.follow(_Inner(wish.contact_force, wish.contact_angle, first), *search.range)
    if reason is None:
        inner, reason = search.scan(inner)
    return BeamDesign(search.made(inner), search.turns, reason)
