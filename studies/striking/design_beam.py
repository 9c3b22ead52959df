"""The striking slider-crank designed for a coupler with inertia: closed form first, then corrected by simulated turns.

The closed form of `studies.striking.inverse` is about a massless strip. A beam buckles late and strikes harder, and a bow
takes some of its contact force. Each simulated turn tells by how much; contact force, angle and the free number (speed,
mass or stiffness of the stop) are corrected until the beam does what was wished. Thickness or width go with the contact force and
the place of the stop with the angle, one to one; the impact goes with a power of the free number, found on the way. Where
that leaves its range, the range is scanned: either two of its turns enclose the wish, or none do, and that is said.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import degrees, exp, isfinite, log
from typing import Any, NamedTuple

import numpy as np

from buckler.studies.striking.design_check import CheckedTurn, Numerics, check
from buckler.studies.striking.inverse import Design, Given, Wish, design
from buckler.studies.striking.inverse_limits import DEEP, NEAR, limits

BARS = {"contact_force": 5e-3, "impact_force": 5e-2, "contact_angle": np.radians(0.5)}
"""How far a beam may be off its wish: relative for the forces, rad for the angle."""
CLOSE = {"contact_force": 1e-3, "impact_force": 5e-3, "contact_angle": np.radians(0.05)}
"""How close the corrections come."""
TURNS, SCANNED = 14, 9
"""Turns that may be simulated, and values of the free number that are scanned if they lead out of its range."""
POWERS = 0.15, 2.5
"""Least and largest power of the free number that the impact force is taken to go with."""
STIFFEST = 1e8
"""Of a stop, N/m."""
ALWAYS = ("dead centre", "shortening", "slenderness", "yield")
"""Limits of the closed form that any strip must keep; the simulated turn shows what the others are about."""


@dataclass(frozen=True)
class BeamDesign:
    """A design for the beam, or why there is none.

    Attributes
    ----------
    design : Design
        Its `wish` is the one asked for.
    outcome : CheckedTurn or None
        The last simulated turn; None if none was.
    turns : int
        How many were simulated.
    reason : str
        Why no strip does it, beginning with a name; empty if this one does.
    """

    design: Design
    outcome: CheckedTurn | None
    turns: int
    reason: str


class _Inner(NamedTuple):
    """What the closed form is asked for so that the beam does as wished, and the free number."""

    force: float
    angle: float
    free: float


def free_name(given: Given) -> str:
    """Which of speed, mass and stiffness is solved for."""
    return next(name for name in ("speed", "mass", "stiffness") if getattr(given, name) is None)


def free_range(wish: Wish, given: Given) -> tuple[float, float]:
    """Least and largest value of the free number; a stop must not be pressed in by more than a share of the length."""
    return {
        "speed": (given.slowest, given.fastest),
        "mass": (given.lightest, given.heaviest),
        "stiffness": (wish.impact_force / (DEEP * given.coupler), STIFFEST),
    }[free_name(given)]


def off(wish: Wish, turn: CheckedTurn) -> dict[str, float]:
    """How far a simulated turn is off the wish: relative for the forces, rad for the angle."""
    return {
        "contact_force": turn.contact_force / wish.contact_force - 1,
        "impact_force": turn.impact_force / wish.impact_force - 1,
        "contact_angle": turn.contact_angle - wish.contact_angle,
    }


def within(wish: Wish, turn: CheckedTurn, bars: Any = None) -> bool:
    """Whether a simulated turn does as wished, at rest against the stop at the dead centre."""
    return isfinite(turn.settled) and all(abs(off(wish, turn)[name]) <= bar for name, bar in (bars or BARS).items())


def for_beam(wish: Wish, given: Given, numerics: Numerics) -> BeamDesign:
    """Design for the beam of `numerics`.

    Parameters
    ----------
    wish, given : of floats
    numerics : Numerics
    """
    name, (low, high) = free_name(given), free_range(wish, given)
    first = float(np.clip(getattr(design(wish, given), name), low, high))
    search = _Search(wish, given, numerics)
    found = search.follow(_Inner(wish.contact_force, wish.contact_angle, first), low, high)
    return found if found is not None else search.scan(low, high)


class _Search:
    """The turns simulated on the way to one wish."""

    def __init__(self, wish: Wish, given: Given, numerics: Numerics) -> None:
        self.wish, self.given, self.numerics = wish, given, numerics
        self.turns = 0
        self.inner = _Inner(wish.contact_force, wish.contact_angle, 1.0)

    def turn(self, inner: _Inner) -> tuple[Design, CheckedTurn]:
        """Simulate one."""
        self.turns, self.inner = self.turns + 1, inner
        made = _made(self.wish, self.given, inner)
        return made, check("beam", made, self.numerics)

    def follow(self, inner: _Inner, low: float, high: float) -> BeamDesign | None:
        """Correct from here until the beam does as wished; None if the free number would leave its range."""
        seen: list[tuple[float, float]] = []
        made, turn, wish = _made(self.wish, self.given, inner), None, self.wish
        for _ in range(TURNS):
            if broken := [x for x in limits(_made(wish, self.given, inner)) if x.name in ALWAYS and x.use > 1.0]:
                return BeamDesign(made, turn, self.turns, str(broken[0]))
            made, turn = self.turn(inner)
            if not isfinite(turn.impact_force):
                return None
            if within(wish, turn, CLOSE):
                return BeamDesign(made, turn, self.turns, "")
            seen.append((inner.free, turn.impact_force))
            inner = _corrected(wish, inner, turn, seen)
            if not low <= inner.free <= high:
                if seen[-1][0] in (low, high):
                    return None
                inner = inner._replace(free=float(np.clip(inner.free, low, high)))
        assert turn is not None
        return BeamDesign(made, turn, self.turns, "" if within(wish, turn) else _why(wish, turn))

    def scan(self, low: float, high: float) -> BeamDesign:
        """Simulate over the whole range of the free number: go on between two that enclose the wish, or say that none do."""
        values = np.geomspace(low, high, SCANNED)
        turns = [self.turn(self.inner._replace(free=float(value))) for value in values]
        forces = np.array([turn.impact_force for _, turn in turns])
        why = ""
        over = np.where(np.isfinite(forces), np.sign(forces - self.wish.impact_force), 0.0)
        for k in np.flatnonzero(over[1:] * over[:-1] < 0):
            ends = float(values[k]), float(values[k + 1])
            found = self.follow(self.inner._replace(free=float(np.sqrt(ends[0] * ends[1]))), *ends)
            if found is not None and not found.reason:
                return found
            why = found.reason if found is not None else "swing: the slider does not meet the stop"
        name = free_name(self.given)
        unit = {"speed": "rad/s", "mass": "kg", "stiffness": "N/m"}[name]
        known = forces[np.isfinite(forces)]
        told = f"impacts from {known.min():.3g} to {known.max():.3g} N" if known.size else "no impact"
        reason = why or f"{name}: {told} between {low:.3g} and {high:.3g} {unit}, asked for {self.wish.impact_force:.4g} N"
        return BeamDesign(*turns[0], self.turns, reason)


def _made(wish: Wish, given: Given, inner: _Inner) -> Design:
    """The mechanism of inner wishes; its closed forms are told the free number, its wish is the one asked for."""
    made = design(Wish(inner.force, wish.impact_force, inner.angle), given)
    found: dict[str, Any] = {free_name(given): inner.free}
    return replace(made, wish=wish, **found)


def _corrected(wish: Wish, inner: _Inner, turn: CheckedTurn, seen: Sequence[tuple[float, float]]) -> _Inner:
    """Next inner wishes: force and angle by what is missing, the free number by the power the last two turns show."""
    errors = off(wish, turn)
    power = 0.7
    if len(seen) > 1:
        (x0, f0), (x1, f1) = seen[-2:]
        if abs(log(x1 / x0)) > 1e-3:
            power = float(np.clip(log(f1 / f0) / log(x1 / x0), *POWERS))
    rests = isfinite(turn.settled) and turn.contact_force > 0
    force = inner.force / np.clip(1 + errors["contact_force"], 0.7, 1.4) if rests else inner.force
    angle = inner.angle - float(np.clip(errors["contact_angle"], -0.1, 0.1)) if rests else inner.angle
    free = inner.free * exp(-float(np.clip(log(1 + errors["impact_force"]) / power, -2.5, 2.5)))
    return _Inner(float(force), float(np.clip(angle, 2 * NEAR, 2 * np.pi - 2 * NEAR)), free)


def _why(wish: Wish, turn: CheckedTurn) -> str:
    """Why the corrections led nowhere."""
    if not isfinite(turn.settled):
        return "rest: the slider is in the air at 180 deg"
    errors = off(wish, turn)
    forces = ", ".join(f"{100 * errors[name]:+.2g} %" for name in ("contact_force", "impact_force"))
    told = f"{forces}, {degrees(errors['contact_angle']):+.2g} deg"
    return f"no agreement after {TURNS} turns: contact force, impact force, angle off by {told}"
