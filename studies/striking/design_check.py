"""A design of the striking slider-crank held against full simulations, and what is read off them.

`strut` is the model the closed form is about: slider, guide friction, stop and drive together, the coupler a massless exact
elastica. `beam` gives the coupler its inertia, as a geometrically exact beam.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import nan, pi
from typing import Any

import numpy as np

from buckler import mbs
from buckler.mbs import Beam, GuideFriction, Material, Mechanism, Section, Strut, slider_crank
from buckler.mbs.laws import CarvalhoMartins
from buckler.studies.striking.assumptions import StrikeAssumptions, crank_angle
from buckler.studies.striking.impact_models import AXIAL_DAMPING
from buckler.studies.striking.inverse import Design, Wish, design
from buckler.studies.striking.inverse_limits import feasible
from buckler.studies.striking.strikes import strikes

Array = np.ndarray[Any, Any]
MODELS = ("strut", "beam")
DENSITY = 7850.0
"""Of the strip, kg/m^3; only the beam has inertia."""

AFTER_RELEASE = np.radians(2.0)
"""How far the crank turns on after the release, rad."""


@dataclass(frozen=True)
class Numerics:
    """How a design is simulated: beam and accuracy.

    Attributes
    ----------
    damping : damping ratio of the strip's first bending mode (beam)
    imperfection : bow of the unloaded strip over its length, to the side its inertia bends it (beam)
    elements : of the beam
    tolerance : position error allowed a step, over the length
    timeout : s
    assumptions : gravity and motor
    """

    damping: float = 0.05
    imperfection: float = 1e-4
    elements: int = 8
    tolerance: float = 1e-5
    timeout: float = 120.0
    assumptions: StrikeAssumptions = field(default_factory=StrikeAssumptions)


@dataclass(frozen=True)
class CheckedTurn:
    """What a simulated turn of the crank did; nan where it did not happen.

    Attributes
    ----------
    status, message : as of `buckler.mbs.Result`
    contact_force : force on the stop at the dead centre, N
    impact_force : largest force of the first impact, until it first returns to zero, N
    contact_angle : from first contact to release, rad
    settled : crank angle from which the slider rests against the stop, rad; nan if it is off it at the dead centre
    energy_balance : largest ledger error over the energy put through
    wall_s : run time, s
    angle, force : arrays, shape (samples,), crank angle, rad, and force on the stop, N
    """

    model: str
    status: str
    message: str
    contact_force: float
    impact_force: float
    contact_angle: float
    settled: float
    energy_balance: float
    wall_s: float
    angle: Array
    force: Array


def mechanism(model: str, design: Design, numerics: Numerics) -> Mechanism:
    """The designed slider-crank, its coupler a `strut` or a `beam`."""
    given = design.given
    material = Material(modulus=float(given.modulus), density=DENSITY, axial_damping=AXIAL_DAMPING)
    section, length = Section(design.width, design.thickness, material), float(given.coupler)
    coupler: Strut | Beam = Strut(section)
    if model == "beam":
        taut = Section(design.width, design.thickness, replace(material, axial_damping=0.0)).damped(numerics.damping, length)
        coupler = Beam(taut, elements=numerics.elements, imperfection=-numerics.imperfection * length)
    made = slider_crank(
        coupler,
        law=CarvalhoMartins(design.stiffness, float(given.restitution), exponent=1.0),
        mass=design.mass,
        speed=design.speed,
        friction=GuideFriction(float(given.friction)) if given.friction else None,
        stop=design.stop,
        lengths=given.lengths,
    )
    return numerics.assumptions.under(made)


def check(model: str, design: Design, numerics: Numerics | None = None) -> CheckedTurn:
    """Simulate a designed slider-crank from crank angle 0 until it has left the stop, and read it."""
    numerics = Numerics() if numerics is None else numerics
    result = mbs.simulate(
        mechanism(model, design, numerics),
        (2 * pi - design.angle + AFTER_RELEASE) / design.speed,
        solver=mbs.Exudyn(mbs.Controlled(tolerance=numerics.tolerance, max_step=pi / 180 / design.speed)),
        ledger=True,
        timeout=numerics.timeout,
    )
    signals = result.signals
    angle, force = crank_angle(result.signals), signals["B.contact_force"]
    return CheckedTurn(
        model, str(result.status), result.message, **_read(angle, force),
        energy_balance=result.energy_balance, wall_s=result.work["wall_s"], angle=angle, force=force,
    )  # fmt: skip


def _read(angle: Array, force: Array) -> dict[str, float]:
    found = strikes(force)
    if not found:
        return dict.fromkeys(("contact_force", "impact_force", "contact_angle", "settled"), nan)
    one, last = found[0], found[-1].last
    rests = np.interp(pi, angle, force, right=nan) > 0 and angle[last] > pi
    start = [strike.first for strike in found if strike is one or angle[strike.before] < pi][-1]
    return {
        "contact_force": float(np.interp(pi, angle, force, right=nan)),
        "impact_force": one.peak(force),
        "contact_angle": float(angle[last] - angle[one.first]),
        "settled": float(angle[start]) if rests else nan,
    }


def random_wishes(around: Design, count: int, seed: int, spread: float = 4.0) -> list[Design]:
    """Designs of random wishes that keep all limits, everything given as it is.

    Parameters
    ----------
    around : Design, of floats
    count : int
        How many; fewer come back where hardly any wish can be had.
    seed : int
    spread : float
        The forces are within this factor of those of `around`, the contact angle within its square root.
    """
    if not count:
        return []
    wishes = drawn_wishes(around.wish, 200 * count, seed, spread)
    force, impact, angle = np.array([(w.contact_force, w.impact_force, w.contact_angle) for w in wishes]).T
    kept = np.flatnonzero(feasible(design(Wish(force, impact, angle), around.given)))[:count]
    return [design(wishes[i], around.given) for i in kept]


def drawn_wishes(wish: Wish, count: int, seed: int, spread: float = 4.0) -> list[Wish]:
    """Wishes drawn around one: forces within a factor, the angle within its square root."""
    generator = np.random.default_rng(seed)
    factors = np.exp(generator.uniform(-1, 1, (3, count)) * np.log(spread) * np.array([[1], [1], [0.5]]))
    angles = np.minimum(wish.contact_angle * factors[2], 2 * pi - 1e-3)
    forces, impacts = wish.contact_force * factors[0], wish.impact_force * factors[1]
    return [Wish(float(f), float(i), float(a)) for f, i, a in zip(forces, impacts, angles, strict=True)]
