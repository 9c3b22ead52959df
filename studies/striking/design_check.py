"""A design of the striking slider-crank simulated; and one that a coupler with inertia does.

`strut`, the coupler a massless exact elastica, is the model of the closed form. `beam` gives the coupler its inertia: it
buckles late and strikes harder, and a bow takes some of its contact force. `buckler.mbs.optimise` therefore chooses what the
closed form is asked for, contact force and angle, and the number it would solve for (speed, mass or stiffness of the stop),
from simulated turns that begin at the closed form's design, until the beam does what was wished.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from math import degrees, exp, isfinite, isnan, log, nan, pi
from typing import Any, NamedTuple

import numpy as np

from buckler.mbs import Controlled, Exudyn, Material, Mechanism, Section, Spectral, optimise
from buckler.mbs.elements.section import STEEL

from .assumptions import StrikeParameters
from .impact import ModelRun, read
from .impact_models import COUPLERS, coupler, simulated, striking
from .inverse import Design, Given, Wish, design
from .inverse_limits import DEEP, NEAR, Limit, feasible, limits

AFTER_RELEASE = np.radians(2.0)
"""How far the crank turns on after the release, rad."""
BARS: dict[str, dict[str, float]] = {
    "strut": {"contact_force": 5e-3, "impact_force": 2e-2, "contact_angle": float(np.radians(0.5))},
    "beam": {"contact_force": 5e-3, "impact_force": 5e-2, "contact_angle": float(np.radians(0.5))},
}
"""How far a model may be off a wish that the design is to hold for: relative for the forces, rad for the angle."""
CLOSE, TURNS = 0.2, 40
"""How close a search comes, in parts of the bars; turns that it may simulate."""
FACTOR, SHIFTED = 2.0, 0.35
"""What the closed form may be asked for instead: forces within a factor, angles within so many rad of the wish."""
STIFFEST = 1e8
"""Of a stop, N/m."""
ALWAYS = ("dead centre", "shortening", "slenderness", "yield")
"""Limits of the closed form that any strip must keep; the simulated turn shows what the others are about."""
FORCE, TOP = "B.contact_force", "when(crank.angle, pi, 1)"
RESTS = f"0*sqrt(({TOP} - begins({FORCE}, -1))*(ends({FORCE}, -1) - {TOP}))"
"""Of a slider at rest at the dead centre, in its last contact; without a value of one that comes again."""
READINGS = {
    "contact_force": f"at({FORCE}, {TOP}) + {RESTS}",
    "impact_force": f"peak({FORCE}, 1)",
    "contact_angle": f"at(crank.angle, ends({FORCE}, -1)) - at(crank.angle, begins({FORCE}, 1)) + {RESTS}",
}
"""What a turn does, read off its run."""


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
        return _off(self._asdict(), wish)

    def within(self, wish: Wish, bars: Mapping[str, float]) -> bool:
        """Whether it does as wished, at rest against the stop at the dead centre."""
        return isfinite(self.settled) and _within(self.off(wish), bars)


def _off(found: Mapping[str, Any], wish: Wish) -> dict[str, float]:
    return {name: (found[name] - getattr(wish, name)) / _unit(wish, name) for name in READINGS}


def _unit(wish: Wish, name: str) -> float:
    """What a bar is relative to."""
    return 1.0 if name == "contact_angle" else float(getattr(wish, name))


def _within(off: Mapping[str, float], bars: Mapping[str, float]) -> bool:
    return all(abs(x) <= bars[name] for name, x in off.items())


def mechanism(model: str, design: Design, numerics: StrikeParameters, elements: int | None = None) -> Mechanism:
    """The slider-crank of a design."""
    p, given = numerics, design.given
    section = Section(design.width, design.thickness, Material(float(given.modulus), STEEL.density))
    return striking(
        coupler(COUPLERS[model], section, float(given.coupler), p.damping, p.imperfection, elements or p.elements),
        p,
        stiffness=design.stiffness,
        restitution=float(given.restitution),
        mass=design.mass,
        friction=float(given.friction),
        speed=design.speed,
        stop=design.stop,
        lengths=given.lengths,
    )


def check(model: str, design: Design, numerics: StrikeParameters | None = None, finer: bool = False) -> CheckedTurn:
    """Simulate a designed slider-crank by the engine, from crank angle 0 until it has left the stop, and read it.

    Parameters
    ----------
    model : {"strut", "beam"}
    design : Design, of floats
    numerics : StrikeParameters, optional
    finer : with twice the elements and a hundredth of the tolerance
    """
    p = StrikeParameters() if numerics is None else numerics
    elements, tolerance = (2 * p.elements, p.tolerance / 100) if finer else (p.elements, p.tolerance)
    solver = Exudyn(Controlled(tolerance=tolerance, max_step=pi / 180 / design.speed))
    made = mechanism(model, design, p, elements)
    lasts = float((2 * pi - design.angle + AFTER_RELEASE) / design.speed)  # a turn has left the stop by then
    return CheckedTurn.of(simulated(model, made, lasts, solver, p.timeout))


def random_wishes(around: Design, count: int, seed: int) -> list[Design]:
    """So many designs, or fewer where hardly any can be had, of random wishes that keep all limits, everything given as it is."""
    wishes = drawn_wishes(around.wish, 200 * count, seed)
    drawn = (np.array([getattr(w, name) for w in wishes]) for name in READINGS)
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

    `reason` is why none was found, beginning with a name; empty if this one does as wished.
    """

    design: Design
    turns: int
    reason: str


def for_beam(wish: Wish, given: Given, numerics: StrikeParameters) -> BeamDesign:
    """Design for the beam of `numerics`; wish and given of floats."""
    first, (name, low, high, unit) = design(wish, given), _solved(wish, given)

    def designed(force: float, angle: float, number: float) -> Design:
        asked: dict[str, Any] = {name: exp(number)}
        return replace(design(Wish(force, wish.impact_force, angle), given), wish=wish, **asked)

    def made(**numbers: float) -> Mechanism:
        found = designed(**numbers)
        if broken := _never(found):
            raise ValueError(broken[0])
        return mechanism("beam", found, numerics)

    if broken := _never(first):
        return BeamDesign(first, 0, str(broken[0]))
    force, angle, ends = wish.contact_force, wish.contact_angle, (log(low), log(high))
    found = optimise(
        made, _turn,
        free={"force": (force / FACTOR, force * FACTOR), "number": ends,
              "angle": (max(2 * NEAR, angle - SHIFTED), min(2 * pi - 2 * NEAR, angle + SHIFTED))},
        start={"force": force, "angle": angle, "number": float(np.clip(log(getattr(first, name)), *ends))},
        readings=READINGS, subject_to=[_band(wish, each, CLOSE * bar) for each, bar in BARS["beam"].items()],
        starts=1, budget=TURNS, solver=Spectral(Controlled(tolerance=numerics.tolerance)),
    )  # fmt: skip
    best, off = designed(**found.values), _off(found.readings, wish)
    if _within(off, BARS["beam"]):
        return BeamDesign(best, found.runs, "")
    if isnan(off["contact_force"]):
        return BeamDesign(best, found.runs, "rest: the slider is in the air at 180 deg")
    at_end = any(each.startswith("number = ") for each in found.binding)
    where = f"{name}: at its end, {getattr(best, name):.3g} {unit}" if at_end else f"no agreement after {found.runs} turns"
    contact, impact, turned = off.values()
    missed = f"{100 * contact:+.2g} %, {100 * impact:+.2g} %, {degrees(turned):+.2g} deg"
    return BeamDesign(best, found.runs, f"{where}: contact force, impact force, angle off by {missed}")


def _turn(made: Mechanism) -> float:
    """Time of a turn, s."""
    speed = made.drives[0].speed if made.drives else made.velocities["crank"]
    assert isinstance(speed, float)  # `mechanism` has seen to it
    return 2 * pi / speed


def _solved(wish: Wish, given: Given) -> tuple[str, float, float, str]:
    """The number that is solved for with the impact: its name, range and unit."""
    ranges = (
        ("speed", given.slowest, given.fastest, "rad/s"),
        ("mass", given.lightest, given.heaviest, "kg"),
        ("stiffness", wish.impact_force / (DEEP * given.coupler), STIFFEST, "N/m"),
    )
    return next(each for each in ranges if getattr(given, each[0]) is None)


def _band(wish: Wish, name: str, share: float) -> tuple[str, float, float]:
    """What a reading may be."""
    value, width = getattr(wish, name), share * _unit(wish, name)
    return name, value - width, value + width


def _never(found: Design) -> list[Limit]:
    """Limits that no strip may break."""
    return [limit for limit in limits(found) if limit.name in ALWAYS and limit.use > 1.0]
