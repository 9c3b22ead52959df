"""Guides: slider blocks on lines fixed in the ground, and their friction."""

from collections.abc import Iterator
from typing import ClassVar

import numpy as np

from ..declare import Declared, declared, direction, names, part, quantity
from ..geometry import Array
from ..laws import BristleLaw, FrictionLaw
from ..laws.friction import as_bristle_law
from ..laws.journal import BRISTLE
from .element import GROUND, GuideBase, Parts, Push, Recorded
from .link import yield_weight_energy
from .references import check_known, check_point_of
from .rows import Row, yield_line
from .signal import Energy, Kind, Signal


@declared
class GuideFriction(Declared):
    """Dry and viscous friction of a guide, regularised near zero speed (Stribeck).

    The speeds are v_r (`regularisation`) and v_s (`stribeck`). Above v_r the size of the force is
    F = dynamic + (static - dynamic) exp(-(|v| - v_r)/v_s) + viscous (|v| - v_r).
    Below v_r it is linear through zero, so a resting slider creeps instead of sticking.

    >>> GuideFriction(dynamic=0.1, static=0.15).regularisation  # m/s
    0.001
    """

    dynamic: float = quantity("N", low=0, doc="friction force of sliding")
    static: float | None = quantity("N", low="dynamic", doc="friction force at rest; `dynamic` by default", default=None)
    viscous: float = quantity("N s/m", low=0, doc="growth with the speed", default=0.0)
    regularisation: float = quantity("m/s", above=0, doc="v_r, speed below which the force is linear", default=1e-3)
    stribeck: float = quantity("m/s", above=0, doc="v_s, speed over which static friction decays", default=1e-2)

    def force(self, speed: Array) -> Array:
        """Return the friction force [N], with the sign of the speed [m/s]."""
        size = np.abs(speed)
        beyond = np.maximum(size - self.regularisation, 0.0)
        sliding = self.dynamic + self.static_offset * np.exp(-beyond / self.stribeck) + self.viscous * beyond
        creeping = (self.dynamic + self.static_offset) * size / self.regularisation
        return np.sign(speed) * np.where(size <= self.regularisation, creeping, sliding)

    @property
    def static_offset(self) -> float:
        """Static minus dynamic friction [N]."""
        return 0.0 if self.static is None else self.static - self.dynamic


@declared
class Guide(GuideBase):
    """A slider block pinned to a link's point, free to move along a straight line through the point's initial place.

    >>> Guide("B", "coupler", along=(1, 0), mass=0.3, friction=Coulomb(0.1)).mass  # of its block, kg
    0.3
    """

    title: ClassVar[str] = "guide of '{point}'"  # in messages
    label: ClassVar[str] = "guide {point}"  # in names of signals

    point: str = names(doc="the guided point")
    link: str = names(doc="the link that the point belongs to, as an end or a carried point")
    along: tuple[float, float] = direction(doc="direction of the line, which is normalised", default=(1.0, 0.0))
    mass: float = quantity("kg", low=0, doc="mass of the block", default=0.0)
    friction: GuideFriction | FrictionLaw | BristleLaw | None = part(
        GuideFriction, FrictionLaw, BristleLaw, example="GuideFriction(2.0) or Coulomb(0.1)", default=None,
        doc="friction forces, or a law of `buckler.mbs.laws` as for joints: its coefficient times the guide's lateral reaction",
    )  # fmt: skip
    through: str | None = names(doc="another point of the line, if the guided point's place is computed, not given", default=None)

    def check(self, mechanism: Parts) -> None:
        """Raise a ValueError unless the link has the point, no other guide guides it, and `through` is on the line."""
        check_known("point", self.point, mechanism.points, self.where)
        check_point_of(mechanism, self.link, self.point, self.where)
        if sum(guide.point == self.point for guide in mechanism.guides) > 1:
            raise ValueError(f"{self.where}: a point has at most one guide")
        if self.through is not None:  # the guided point's place is known by now: it was given, or `assemble` has computed it
            check_known("point", self.through, mechanism.points, self.where)
            (x0, y0), (x1, y1) = mechanism.points[self.through], mechanism.points[self.point]
            distance = abs((y1 - y0) * self.along[0] - (x1 - x0) * self.along[1])
            if distance > 1e-9 * max(map(abs, (x0, y0, x1, y1))):  # more than rounding
                raise ValueError(f"{self.where}: through = '{self.through}': lies {distance:.3g} m beside its line")

    def rows(self, mechanism: Parts) -> Iterator[Row]:
        """Yield the row that keeps the point on the line."""
        return yield_line(self.point, self.link, GROUND, self.along)

    def reactions(self, multipliers: Array) -> dict[str, Array]:
        """Return the lateral force of the guide on the block [N]."""
        return {"reaction": multipliers}

    @property
    def friction_at(self) -> str:
        """Name of the guided point if friction acts there, else ''."""
        return self.point if self.friction is not None else ""

    @property
    def friction_needs_reaction(self) -> bool:
        """True if the friction depends on the lateral reaction, so that the motion alone does not give it."""
        return self.friction is not None and not isinstance(self.friction, GuideFriction)

    def pushes(self, name: str, record: Recorded) -> Iterator[Push] | None:
        """Return the friction, a force without a torque; None if the motion alone does not give the friction."""
        if self.friction is None:
            return iter(())
        if not isinstance(self.friction, GuideFriction):
            return None
        drag = self.friction.force(record.blocks[self.point].speed)
        return iter([Push(f"{self.link}:{self.point}", np.outer(-drag, self.along), np.zeros_like(drag))])

    def energies(self, name: str, record: Recorded) -> Iterator[Energy]:
        """Yield kinetic energy and potential energy of gravity of the block, stored and dissipated energy of friction."""
        block = record.blocks[self.point]
        yield Energy("stored", "kinetic", block.kinetic())
        yield from yield_weight_energy(block, record)
        if self.friction is None:
            return
        stored = np.zeros_like(record.time)  # elastic energy of the bristles
        if isinstance(self.friction, BristleLaw):
            normal, bristle = self._reaction_and_bristle(name, record)
            stored = np.asarray(normal * self.friction.stored(bristle))
        yield Energy("stored", "contact", stored)
        lost = record.work(self._drag(name, record) * block.speed) - (stored - stored[0])
        is_stuck = isinstance(self.friction, BristleLaw) and self._is_stuck(name, record)
        yield Energy("dissipated", "friction", np.zeros_like(lost) if is_stuck else lost)

    def signals(self, name: str, record: Recorded) -> Iterator[Signal]:
        """Yield lateral force on the block, positive to the left of `along`, friction and its limit [N]."""
        reaction = record.channel(name, "reaction")
        if reaction.size:  # the solver has recorded it, as all do where a friction law needs it
            yield Signal(f"{self.point}.guide_force", reaction[:, 0], "N", Kind.REACTION)
        if self.friction is None:
            return
        has_clearance = any(joint.point == self.point and not joint.ideal for joint in record.mechanism.joints)
        prefix = name if has_clearance else self.point  # the signals of a joint with clearance begin with the point's name
        yield Signal(f"{prefix}.friction_force", self._drag(name, record), "N", Kind.FRICTION)
        limit = getattr(self.friction, "limit", None)  # of bristle laws: coefficient of steady sliding at a speed
        if limit is not None:
            largest = limit(record.blocks[self.point].speed) * np.abs(reaction[:, 0])
            yield Signal(f"{prefix}.friction_limit", largest, "N", Kind.FRICTION)

    def _reaction_and_bristle(self, name: str, record: Recorded) -> tuple[Array, Array]:
        """Return the magnitude of the lateral reaction [N] and the deflection of the bristles [m], each (times,)."""
        memory = record.channel(name, "memory")
        bristle = memory[:, BRISTLE] if memory.size else np.zeros_like(record.time)
        return np.abs(record.channel(name, "reaction")[:, 0]), bristle

    def _drag(self, name: str, record: Recorded) -> Array:
        """Return the friction force [N], (times,): positive for a positive speed, against which the force acts."""
        speed = record.blocks[self.point].speed
        if isinstance(self.friction, GuideFriction):
            return self.friction.force(speed)
        assert self.friction is not None  # callers have checked that there is one
        normal, bristle = self._reaction_and_bristle(name, record)
        return np.asarray(as_bristle_law(self.friction).coefficient(speed, bristle) * normal)

    def _is_stuck(self, name: str, record: Recorded) -> bool:
        """Return True if the friction only bends the bristles, and steps do not resolve the vibration of the block on them.

        The travel is then below 1e-4 of the longest link, and a period has fewer than 20 steps; both are chosen. With 200 steps
        instead the dissipated energy of well resolved vibrations would count as zero, too.
        """
        longest, block = max(record.mechanism.length(link.name) for link in record.mechanism.links), record.blocks[self.point]
        _, bristle = self._reaction_and_bristle(name, record)
        force, deflection = np.abs(self._drag(name, record)).max(), np.abs(bristle).max()
        mass = block.mass + (record.links[self.link].mass if self.link in record.links else 0.0)  # a strut has no motion
        period = 2 * np.pi * np.sqrt(mass * deflection / force) if force > 0 else 0.0  # on bristles of stiffness force/deflection
        return bool(np.ptp(block.travel) < 1e-4 * longest and 20 * np.diff(record.time).max() > period)
