"""Stops: straight faces that a point may touch and not pass."""

from collections.abc import Iterator, Mapping
from typing import ClassVar

import numpy as np

from ..declare import declared, direction, names, part, quantity
from ..geometry import Array, cross, find_sign_changes, rotate, rotate_left
from ..laws import BristleLaw, FrictionLaw, NoFriction, NormalLaw
from .element import GROUND, Element, Parts, Push, Recorded, place
from .references import check_known, check_link, check_no_strut, check_point_of
from .signal import DepthLimit, Energy, Kind, Signal

NEAREST = 1e-9
"""Least initial distance of a point from the face, over the extent of the mechanism; below it rounding would decide the side."""
PIERCED = 0.2
"""Depth in a stop, over the largest length of `Stop.depths`, beyond which a run is suspect; soft buffers stay below."""

SLOWEST_ONSET = 1e-4
"""Least approach speed in dissipative laws [m/s]: they divide by the speed, which is 0 for a contact from rest."""
GRAZE = 0.05
"""Least approach speed of an impact, over the largest approach speed so far; chosen.

After the last tiny rebound of a slider, a law that divides by the approach speed would otherwise pull as the contact opens.
The `share` of finer runs is smaller, so that the difference of two runs shows the effect."""


@declared
class Stop(Element):
    """A straight face that limits the travel of a point, fixed to the ground or to a link.

    At t = 0 the face is the line of all places whose dot product with its unit normal `along` is `at`. The contact force acts on
    both bodies at the point. Friction, the law's coefficient times this force, opposes the sliding of the point along the face.

    >>> Stop("B", at=-0.355, law=Hertz(1e9)).on
    'ground'
    """

    title: ClassVar[str] = "stop at '{point}'"
    label: ClassVar[str] = "{point}"

    point: str = names(doc="a guided point, or any point of a link")
    at: float = quantity("m", low=-1e6, high=1e6, doc="place along the normal; the point stays on the side where it starts")
    law: NormalLaw = part(NormalLaw, example="CarvalhoMartins(...)", doc="contact law of `buckler.mbs.laws`")
    along: tuple[float, float] | None = direction(doc="normal at t = 0; by default along the point's guide", default=None)
    link: str | None = names(doc="link of the point; by default the guided link, or the first that has the point", default=None)
    on: str = names(doc="body with the face: 'ground', a rigid link, or 'link:point' on a flexible link", default=GROUND)
    friction: FrictionLaw = part(
        FrictionLaw, example="Coulomb(0.1)", doc="law of the face, without memory; none by default", default_factory=NoFriction
    )

    @property
    def friction_at(self) -> str:
        """Name of the point if friction acts there, else ''."""
        return "" if isinstance(self.friction, NoFriction) else self.point

    @property
    def is_in_guide(self) -> bool:
        """True if the face is normal to the point's guide, so that the block's travel alone gives the depth."""
        return self.along is None and self.link is None and self.on == GROUND

    @property
    def carrier(self) -> str:
        """Name of the body that carries the face."""
        return place(self.on).body or self.on  # 'link' alone has no body in front of a colon

    def check(self, mechanism: Parts) -> None:
        """Raise a ValueError unless the face has a normal and belongs to another body than the point."""
        where = self.where
        check_known("point", self.point, mechanism.points, where)
        if self.along is None and self.point not in {guide.point for guide in mechanism.guides}:
            raise ValueError(f"{where}: along: must be given where the point has no guide: normal to the face, as (1, 0)")
        if isinstance(self.friction, BristleLaw):
            kind = type(self.friction).__name__
            raise ValueError(f"{where}: friction = {kind}: a face keeps no bristle; give a law without memory, as Coulomb")
        if self.is_in_guide and self.friction_at:
            raise ValueError(f"{where}: friction: the point cannot slide along the face; give it to the guide, or give `along`")
        if self.is_in_guide:
            return
        check_point_of(mechanism, self.body(mechanism), self.point, where)
        check_no_strut(mechanism, (self.body(mechanism), self.carrier), where)
        if self.carrier == GROUND:
            return
        check_link(mechanism, self.carrier, f"{where}: on")
        if self.carrier == self.body(mechanism):
            raise ValueError(f"{where}: on = '{self.on}': must be another body than the point's")
        if not mechanism.link(self.carrier).body.flexible:
            return
        if not place(self.on).body:
            raise ValueError(f"{where}: on = '{self.on}': the angle of a flexible link varies; give a point, as 'link:point'")
        check_point_of(mechanism, self.carrier, place(self.on).point, f"{where}: on")

    def remarks(self, name: str, signals: Mapping[str, Array]) -> Iterator[str]:
        """Yield a remark if there was no contact, with the least distance from a face of known place."""
        if (signals[f"{name}.penetration"] > 0).any():
            return
        near = ""
        if self.along is not None and self.on == GROUND:
            position = signals[f"{self.point}.x"] * self.along[0] + signals[f"{self.point}.y"] * self.along[1]
            near = f"; it came within {float(abs(position - self.at).min(initial=np.inf)):.3g} m"
        yield f"'{self.point}' never reached its stop{near}"

    def body(self, mechanism: Parts) -> str:
        """Return the name of the link of the point; '' if there is none."""
        if self.link is not None:
            return self.link
        names = [guide.link for guide in mechanism.guides if guide.point == self.point]
        names += [link.name for link in mechanism.links if self.point in link.points]
        return str(names[0]) if names else ""

    def origin(self, mechanism: Parts) -> str:
        """Return the reference of a point fixed in the face's body: at the face on a flexible link, the start of a rigid link."""
        if self.carrier == GROUND:
            return f"{GROUND}:{self.point}"
        return self.on if place(self.on).body else f"{self.carrier}:{mechanism.link(self.carrier).start}"

    def face_normal(self, mechanism: Parts) -> tuple[float, float]:
        """Return the unit vector normal to the face at t = 0."""
        return mechanism.guide(self.point).along if self.along is None else self.along

    def side(self, mechanism: Parts) -> float:
        """Return +1 if the normal leads from the point's start to the face, -1 if it leads away from the face."""
        return 1.0 if self.at > self._start(mechanism) else -1.0

    def distance_to_face(self, mechanism: Parts) -> float:
        """Return the distance [m] from the point's start to the face, with the sign of `side`; ValueError if it starts there."""
        distance = self.at - self._start(mechanism)
        extent = float(np.ptp(list(mechanism.points.values()), axis=0).max(initial=0.0))
        if abs(distance) <= NEAREST * max(extent, abs(self.at)):
            why = f"it must lie to one side, by {NEAREST:g} of the mechanism's extent at least"
            raise ValueError(f"{self.where}: at = {self.at:g} m is where the point starts, to rounding; {why}")
        return distance

    def _start(self, mechanism: Parts) -> float:
        """Return the coordinate of the point along the normal at t = 0 [m]."""
        return float(np.dot(self.face_normal(mechanism), mechanism.points[self.point]))

    def approach(self, record: Recorded) -> tuple[Array, Array]:
        """Return depth [m], positive in contact, and its rate [m/s], each (times,)."""
        mechanism = record.mechanism
        side, distance = self.side(mechanism), self.distance_to_face(mechanism)
        if self.is_in_guide:
            block = record.blocks[self.point]
            travel, rate = block.travel, block.speed
        else:
            travel, rate = self._travel(record, self.face_normal(mechanism))
        return side * (travel - distance), side * rate

    def _travel(self, record: Recorded, line: tuple[float, float]) -> tuple[Array, Array]:
        """Return the travel since t = 0 [m] along a direction that turns with the face, and its rate [m/s], each (times,)."""
        mechanism, origin = record.mechanism, self.origin(record.mechanism)
        (p, p_t), (o, o_t) = record.point(f"{self.body(mechanism)}:{self.point}"), record.point(origin)
        angle, spin = record.turn(origin)
        direction, arm = rotate(angle, line), p - o
        initial = np.subtract(mechanism.points[self.point], mechanism.points[place(origin).point]) @ np.asarray(line)
        travel = (arm * direction).sum(axis=1) - float(initial)
        return travel, ((p_t - o_t) * direction).sum(axis=1) + spin * (arm * rotate_left(direction)).sum(axis=1)

    def pushes(self, name: str, record: Recorded) -> Iterator[Push]:
        """Yield contact force and friction on the point, and their opposites on the body with the face."""
        mechanism, at = record.mechanism, f"{self.body(record.mechanism)}:{self.point}"
        angle, _ = record.turn(self.origin(mechanism))
        normal = rotate(angle, self.face_normal(mechanism))
        force = -self.side(mechanism) * normal * record.channel(name, "force")  # (times, 1): the contact force
        if self.friction_at:
            drag, _ = self._drag(name, record)
            force = force - rotate_left(normal) * drag[:, None]
        yield Push(at, force, np.zeros(len(force)))
        if self.carrier != GROUND:
            (position, _), (origin, _) = record.point(at), record.point(self.origin(mechanism))
            arm = position - origin
            yield Push(self.origin(mechanism), -force, cross(force, arm))

    def _drag(self, name: str, record: Recorded) -> tuple[Array, Array]:
        """Return friction [N], which opposes the sliding, and sliding speed to the left of the normal [m/s], each (times,)."""
        x, y = self.face_normal(record.mechanism)
        _, sliding = self._travel(record, (-y, x))
        return np.asarray(self.friction.coefficient(sliding) * record.channel(name, "force")[:, 0]), sliding

    def depths(self, name: str, mechanism: Parts) -> Iterator[DepthLimit]:
        """Yield the largest allowed depth: `PIERCED` times the longest link, distance to the face or extent of all points."""
        lengths = [mechanism.length(link.name) for link in mechanism.links]
        extents = np.ptp(list(mechanism.points.values()), axis=0)
        longest = max(abs(self.distance_to_face(mechanism)), *lengths, *extents)
        where = "inside its stop; the stop is too soft for this motion"
        yield DepthLimit(f"{name}.penetration", PIERCED * longest, f"'{name}'", where)

    def unilateral_forces(self, name: str) -> Iterator[tuple[str, str]]:
        """Yield the name of the contact force, which must not be negative, and the name of its depth."""
        yield f"{name}.contact_force", f"{name}.penetration"

    def signals(self, name: str, record: Recorded) -> Iterator[Signal]:
        """Yield contact force [N] and depth [m]; with friction also friction force [N] and sliding speed [m/s]."""
        depth, rate = self.approach(record)
        force = record.channel(name, "force")[:, 0]
        events = find_sign_changes(record.time, depth, rate)
        yield Signal(
            f"{name}.contact_force", force, "N", Kind.CONTACT, contact_events=events, depth=depth, elastic=self.law.elastic
        )
        yield Signal(f"{name}.penetration", np.maximum(depth, 0.0), "m", Kind.CONTACT)
        if self.friction_at:
            drag, sliding = self._drag(name, record)
            yield Signal(f"{name}.friction_force", drag, "N", Kind.FRICTION)
            yield Signal(f"{name}.sliding_speed", sliding, "m/s", Kind.RATE)

    def energies(self, name: str, record: Recorded) -> Iterator[Energy]:
        """Yield the elastic potential, and the energies dissipated by damping and friction."""
        depth, rate = self.approach(record)
        potential = self.law.potential(depth)
        work = record.work(record.channel(name, "force")[:, 0] * rate)
        yield Energy("stored", "contact", potential)
        yield Energy("dissipated", "contact", work - (potential - potential[0]))
        if self.friction_at:
            drag, sliding = self._drag(name, record)
            yield Energy("dissipated", "friction", record.work(drag * sliding))
