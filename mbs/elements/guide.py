"""Guides: slider blocks on lines of the ground, and their friction."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from buckler.mbs.elements.element import GROUND, Array, Element, Energy, Recorded, Signal, known, reaches
from buckler.mbs.elements.journal import BRISTLE
from buckler.mbs.elements.link import weight
from buckler.mbs.elements.rows import Row, on_line
from buckler.mbs.laws import BristleLaw, FrictionLaw
from buckler.mbs.validate import direction, follows, non_negative, number, positive


@dataclass(frozen=True)
class GuideFriction:
    """Dry and viscous friction of a guide, regularised near zero speed (Stribeck).

    F = dynamic + (static - dynamic) exp(-(|v| - v_r)/v_s) + viscous (|v| - v_r) beyond the regularisation speed v_r, and
    linear through zero below it, so a resting slider creeps instead of sticking.

    Parameters
    ----------
    dynamic, static : float
        Friction forces, N, not negative; `static` at least `dynamic` (default: equal).
    viscous : float
        N s/m, not negative.
    regularisation, stribeck : float
        Speeds v_r and v_s, m/s, positive.
    """

    dynamic: float
    static: float | None = None
    viscous: float = 0.0
    regularisation: float = 1e-3
    stribeck: float = 1e-2

    def __post_init__(self) -> None:
        non_negative("dynamic", self.dynamic, "N")
        if self.static is not None:
            number("static", self.static, self.dynamic, float("inf"), "N")
        non_negative("viscous", self.viscous, "N s/m")
        positive("regularisation", self.regularisation, "m/s")
        positive("stribeck", self.stribeck, "m/s")

    def force(self, speed: Array) -> Array:
        """Friction force along the speed, N; odd in it."""
        size = np.abs(speed)
        beyond = np.maximum(size - self.regularisation, 0.0)
        sliding = self.dynamic + self.static_offset * np.exp(-beyond / self.stribeck) + self.viscous * beyond
        creeping = (self.dynamic + self.static_offset) * size / self.regularisation
        return np.sign(speed) * np.where(size <= self.regularisation, creeping, sliding)

    @property
    def static_offset(self) -> float:
        """Static minus dynamic friction, N."""
        return 0.0 if self.static is None else self.static - self.dynamic

    @classmethod
    def of_weight(cls, coefficient: float, mass: float, gravity: float = 9.81, **kw: float) -> GuideFriction:
        """Coulomb friction of a slider lying on its guide, gravity normal to the plane of motion: mu m g."""
        non_negative("coefficient", coefficient, "1")
        return cls(coefficient * mass * gravity, **kw)


@dataclass(frozen=True)
class Guide(Element):
    """A slider block pinned to a link's point, free to move along a straight line through the point's initial place.

    Parameters
    ----------
    point, link : str
        The guided point and the link whose end (or carried point) it is.
    along : (float, float)
        Direction of the line; need not be a unit vector.
    mass : float
        Of the block, kg, not negative.
    friction : GuideFriction, FrictionLaw or BristleLaw, optional
        Given forces, or a law of `buckler.mbs.laws`, as joints have: its coefficient times the guide's own lateral reaction.
    """

    point: str
    link: str
    along: tuple[float, float] = (1.0, 0.0)
    mass: float = 0.0
    friction: GuideFriction | FrictionLaw | BristleLaw | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "along", direction(f"guide of '{self.point}': along", self.along))
        non_negative("mass", self.mass, "kg")
        if self.friction is not None and not isinstance(self.friction, GuideFriction):
            rubs = BristleLaw if hasattr(self.friction, "after") else FrictionLaw
            follows(f"guide of '{self.point}': friction", self.friction, rubs, "GuideFriction(2.0) or Coulomb(0.1)")

    @property
    def key(self) -> str:
        """'guide' and its point."""
        return f"guide {self.point}"

    def check(self, mechanism: Any) -> None:
        """A point of its link, with no other guide."""
        where = f"guide of '{self.point}'"
        known("point", self.point, mechanism.points, where)
        reaches(mechanism, self.link, self.point, where)
        if sum(guide.point == self.point for guide in mechanism.guides) > 1:
            raise ValueError(f"{where}: a point has at most one guide")

    def rows(self, mechanism: Any) -> Iterator[Row]:
        """Yield that the point stays on the line."""
        return on_line(self.point, self.link, GROUND, self.along)

    def reactions(self, multipliers: Array) -> dict[str, Array]:
        """Return the guide's lateral force."""
        return {"reaction": multipliers}

    @property
    def rubs_on_reaction(self) -> bool:
        """Whether its friction is a law of the reaction."""
        return self.friction is not None and not isinstance(self.friction, GuideFriction)

    def pushes(self, name: str, record: Recorded) -> Iterator[tuple[str, Array, Array]] | None:
        """Return its friction; None if that follows the reaction, which nobody knows before."""
        if self.friction is None:
            return iter(())
        if not isinstance(self.friction, GuideFriction):
            return None
        drag = self.friction.force(record.blocks[self.point].speed)
        return iter([(f"{self.link}:{self.point}", np.outer(-drag, self.along), np.zeros_like(drag))])

    def energies(self, name: str, record: Recorded) -> Iterator[Energy]:
        """Yield the block's kinetic energy and weight, and what friction took."""
        block = record.blocks[self.point]
        yield Energy("held", "kinetic", block.kinetic())
        yield from weight(block, record)
        if self.friction is not None:
            held = self._held(name, record)
            yield Energy("held", "contact", held)
            rubbed = record.work(self._drag(name, record) * block.speed)
            yield Energy("taken", "friction", rubbed - (held - held[0]))

    def signals(self, name: str, record: Recorded) -> Iterator[Signal]:
        """Yield the guide's force on the block to the left of its direction, friction against the speed, and its limit, N."""
        reaction = record.channel(name, "reaction")
        if reaction.size:
            yield Signal(f"{self.point}.guide_force", reaction[:, 0], "N")
        if self.friction is None:
            return
        owner = self.point if not self._shared(record.mechanism) else name
        yield Signal(f"{owner}.friction_force", self._drag(name, record), "N")
        limit = getattr(self.friction, "limit", None)
        if limit is not None:
            yield Signal(f"{owner}.friction_limit", limit(record.blocks[self.point].speed) * np.abs(reaction[:, 0]), "N")

    def _shared(self, mechanism: Any) -> bool:
        """Whether a joint at the point has friction of its own, whose signals bear the point's name."""
        return any(joint.point == self.point and not joint.ideal for joint in mechanism.joints)

    def _drag(self, name: str, record: Recorded) -> Array:
        """Friction force against the speed, N."""
        friction, speed = self.friction, record.blocks[self.point].speed
        if isinstance(friction, GuideFriction):
            return friction.force(speed)
        normal = np.abs(record.channel(name, "reaction")[:, 0])
        if isinstance(friction, BristleLaw):
            found: Array = friction.coefficient(speed, record.channel(name, "memory")[:, BRISTLE]) * normal
        else:
            found = friction.coefficient(speed) * normal  # type: ignore[union-attr]
        return found

    def _held(self, name: str, record: Recorded) -> Array:
        """Energy of a bent bristle, J."""
        if not isinstance(self.friction, BristleLaw):
            return np.zeros_like(record.time)
        held: Array = np.abs(record.channel(name, "reaction")[:, 0]) * self.friction.stored(
            record.channel(name, "memory")[:, BRISTLE]
        )
        return held
