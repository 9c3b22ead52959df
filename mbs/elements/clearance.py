"""Joints with clearance: a pin in a bush, with contact and friction between them by the equations of `laws.journal`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import ClassVar, NamedTuple

import numpy as np

from ..declare import Quantity, declared, field, names, part, quantity
from ..geometry import Array, cross, find_sign_changes
from ..laws import BristleLaw, FrictionLaw, NoFriction, NormalLaw
from ..laws.friction import as_bristle_law
from ..laws.journal import BRISTLE, ONSET, SINCE, SLIDING, locate_contact
from .element import GROUND, Parts, Push, Recorded
from .joint import Joint
from .rows import Row, yield_pin
from .signal import DepthLimit, Energy, Kind, Signal

PIERCED = 0.05
"""Depth of a pin in its bush over the pin's radius, chosen: a run is suspect if the depth exceeds this and the clearance."""


@declared
class Clearance(Joint):
    """A pin of the first body in a bush of the second, with clearance between them, contact and friction.

    >>> joint = Clearance("B", "coupler", "rocker", pin=0.01, gap=2e-4, law=Hertz(1e9), friction=Coulomb(0.1))
    >>> joint.key
    'B.coupler-rocker'
    """

    title: ClassVar[str] = "clearance at '{point}'"

    point: str = names(doc="common point of the two bodies: centre of pin and bush at t = 0")
    first: str = names(doc="link with the pin, or 'ground'")
    second: str = names(doc="link with the bush, or 'ground'")
    pin: float = quantity("m", above=0, doc="radius of the pin")
    gap: float = field(
        Quantity("m", 0.0, open_low=True, hint="a joint without clearance is a Revolute"),
        "radial clearance: bush radius minus pin radius",
    )
    law: NormalLaw = part(NormalLaw, example="Impact(...)", doc="contact law of `buckler.mbs.laws`")
    friction: FrictionLaw | BristleLaw = part(
        FrictionLaw, BristleLaw, example="Coulomb(0.1)", doc="of `buckler.mbs.laws`; none by default", default_factory=NoFriction
    )

    ideal: ClassVar[bool] = False  # the contact is a force, and no constraint

    @property
    def friction_at(self) -> str:
        """Name of the joint's point if friction acts there, else ''."""
        return "" if isinstance(self.friction, NoFriction) else self.point

    def check(self, mechanism: Parts) -> None:
        """Raise a ValueError unless the joint fits its bodies and the clearance is below their lengths."""
        super().check(mechanism)
        lengths = [mechanism.length(name) for name in (self.first, self.second) if name != GROUND]
        if self.gap >= min(lengths):
            raise ValueError(f"gap = {self.gap:g} m at '{self.point}': must be below the length of its links, {min(lengths):g} m")

    def rows(self, mechanism: Parts) -> Iterator[Row]:
        """Yield the rows of a pin that is centred in its bush at t = 0."""
        return yield_pin(self.point, self.first, self.second, start_only=True)  # later the contact law holds the pin

    def depths(self, name: str, mechanism: Parts) -> Iterator[DepthLimit]:
        """Yield the largest allowed depth: the clearance, or `PIERCED` times the pin's radius if that is larger."""
        allowed = max(self.gap, PIERCED * self.pin)
        where = f"in its bush, more than {allowed:.3g} m, its clearance or {PIERCED:g} of its radius"
        yield DepthLimit(f"{self.point}.penetration", allowed, f"pin '{self.point}'", where)

    def unilateral_forces(self, name: str) -> Iterator[tuple[str, str]]:
        """Yield the name of the normal force, which must not be negative, and the name of its depth."""
        yield f"{self.point}.normal_force", f"{self.point}.penetration"

    def remarks(self, name: str, signals: Mapping[str, Array]) -> Iterator[str]:
        """Yield a remark if the depth exceeds the clearance, where no theory of two cylinders in contact holds."""
        deepest = float(signals[f"{self.point}.penetration"].max(initial=0.0))
        if deepest > self.gap:
            why = "its law was followed, but no theory of contact holds so deep"
            yield f"pin '{self.point}' is {deepest:.3g} m deep in its bush, more than its clearance {self.gap:.3g} m: {why}"

    def signals(self, name: str, record: Recorded) -> Iterator[Signal]:
        """Yield force on the second body, normal and friction force [N], depth and place of the pin in its bush [m]."""
        found, point = self._contact(name, record), self.point
        events = find_sign_changes(record.time, found.depth, found.rate)
        # a comparison of runs takes the times of contacts from one signal of each joint
        yield Signal(f"{name}.fx", -found.force[:, 0], "N", Kind.CONTACT, group=f"{name}.f", contact_events=events)
        yield Signal(f"{name}.fy", -found.force[:, 1], "N", Kind.CONTACT, group=f"{name}.f")
        yield Signal(f"{point}.normal_force", found.normal, "N", Kind.CONTACT)
        yield Signal(f"{point}.friction_force", found.tangential, "N", Kind.FRICTION)
        yield Signal(f"{point}.penetration", np.maximum(found.depth, 0.0), "m", Kind.CONTACT)
        yield Signal(f"{point}.sliding_speed", found.sliding, "m/s", Kind.RATE)
        yield Signal(f"{point}.journal_x", found.place[:, 0], "m", Kind.PLACE, group=f"{point}.journal", scale=self.gap)
        yield Signal(f"{point}.journal_y", found.place[:, 1], "m", Kind.PLACE, group=f"{point}.journal", scale=self.gap)
        yield Signal(f"{point}.contact_state", contact_state(found.depth), "1", Kind.COUNT)
        touching = found.depth > 0
        is_onset = touching & ~np.append(False, touching[:-1])
        yield Signal(f"{point}.contacts", np.cumsum(is_onset), "1", Kind.COUNT)

    def _contact(self, name: str, record: Recorded) -> PinContact:
        memory, time = record.channel(name, "memory"), record.time
        return record.once(("contact", name), lambda: compute_contact(self, *read_motions(self, record), memory, time))

    def pushes(self, name: str, record: Recorded) -> Iterator[Push]:
        """Yield the contact force on both bodies, with its moments about the centres of pin and bush."""
        pin, bush = read_motions(self, record)
        found = self._contact(name, record)
        force, arm = found.force, self.pin * found.outward
        for body, sign, lever in ((self.first, 1.0, arm), (self.second, -1.0, arm + pin.place - bush.place)):
            if body != GROUND:
                yield Push(f"{body}:{self.point}", sign * force, sign * cross(lever, force))

    def energies(self, name: str, record: Recorded) -> Iterator[Energy]:
        """Yield the energy stored in contact and bristles, and the energies dissipated by damping and by friction."""
        pin, bush = read_motions(self, record)
        ends, steps = self._contact(name, record), np.diff(record.time)
        middle_time = record.time[:-1] + steps / 2
        memory = record.channel(name, "memory")[1:].copy()  # used in the steps that end there, with one onset speed
        memory[:, BRISTLE] = (ends.bristle[:-1] + ends.bristle[1:]) / 2  # mean of both ends of a step
        memory[:, SINCE] = middle_time  # with an elapsed time of 0 the law leaves the bristle at this mean
        middle = compute_contact(self, _at_middle(pin, steps), _at_middle(bush, steps), memory, middle_time)

        def integrate(power: Array, middle_power: Array) -> Array:
            """Integrate a power, given at the ends and in the middle of the steps [W], by Simpson's rule."""
            return np.concatenate([[0.0], np.cumsum(steps * (power[:-1] + 4 * middle_power + power[1:]) / 6)])

        elastic = self.law.potential(ends.depth)
        bristle = ends.normal * as_bristle_law(self.friction).stored(ends.bristle)  # `stored` is per unit of normal force
        yield Energy("stored", "contact", elastic + bristle)
        normal_work = integrate(ends.normal * ends.rate, middle.normal * middle.rate)
        sliding_work = integrate(ends.tangential * ends.sliding, middle.tangential * middle.sliding)
        dissipated = {"contact": normal_work - (elastic - elastic[0]), "friction": sliding_work - (bristle - bristle[0])}
        for entry, energy in dissipated.items():
            yield Energy("dissipated", entry, energy)
            yield Energy("part", f"{self.point}.taken_{entry}", energy)  # a signal of this joint's share


class Side(NamedTuple):
    """Motion of a pin or bush: place and velocity of the centre (times, 2), angle of the body and its rate (times,)."""

    place: Array
    velocity: Array
    angle: Array
    spin: Array


def read_motions(joint: Clearance, record: Recorded) -> tuple[Side, Side]:
    """Return the motion of pin and bush, each a side of the joint."""
    references = [f"{body}:{joint.point}" for body in (joint.first, joint.second)]
    pin, bush = (Side(*record.point(at), *record.turn(at)) for at in references)
    return pin, bush


def _at_middle(side: Side, steps: Array) -> Side:
    """Interpolate the motion in the middle of steps (times - 1,) [s]."""

    def middle(value: Array, rate: Array, step: Array) -> tuple[Array, Array]:
        """Evaluate the cubic Hermite polynomial and its rate from values and rates at both ends."""
        a, b, va, vb = value[:-1], value[1:], rate[:-1], rate[1:]
        return (a + b) / 2 + step * (va - vb) / 8, 1.5 * (b - a) / step - (va + vb) / 4

    return Side(*middle(side.place, side.velocity, steps[:, None]), *middle(side.angle, side.spin, steps))


class PinContact(NamedTuple):
    """Contact of pin and bush, each (times,) if no other shape is given."""

    normal: Array  # [N]
    tangential: Array  # [N]
    depth: Array  # [m]
    rate: Array  # of the depth [m/s]
    sliding: Array  # speed [m/s]
    bristle: Array  # deflection [m]
    force: Array  # on the pin (times, 2) [N]
    outward: Array  # unit vector from the bush's centre to the pin's (times, 2)
    place: Array  # of the pin's centre in the bush (times, 2) [m]


def compute_contact(joint: Clearance, pin: Side, bush: Side, memory: Array, time: Array) -> PinContact:
    """Compute the contact at many times by `laws.journal`; `memory` (times, 4) has the columns `journal.MEMORY`."""
    place, velocity = (pin.place - bush.place).T, (pin.velocity - bush.velocity).T
    depth, rate, sliding, nx, ny = locate_contact(joint.pin, joint.gap, place, velocity, (pin.spin, bush.spin))
    inside = depth > 0
    normal = np.where(inside, joint.law.force(depth, rate, memory[:, ONSET]), 0.0)
    friction, mean_speed = as_bristle_law(joint.friction), 0.5 * (memory[:, SLIDING] + sliding)
    bristle = np.where(inside, friction.after(memory[:, BRISTLE], mean_speed, time - memory[:, SINCE]), 0.0)
    drag = friction.coefficient(sliding, bristle) * normal
    fx, fy = -normal * nx + drag * ny, -normal * ny - drag * nx  # on the pin, whose surface slides along (-ny, nx)
    force, outward = np.column_stack([fx, fy]), np.column_stack([nx, ny])
    return PinContact(normal, drag, depth, rate, sliding, bristle, force, outward, place.T)


def contact_state(depth: Array) -> Array:
    """Return the contact state at each sample, as a float: 0 free, 1 impact, 2 continuous.

    An impact lasts from the onset to the separation, or until the depth has its first minimum within the contact. From this
    minimum on the contact is continuous: the pin has rebounded once without separation.
    """
    touching = depth > 0
    is_minimum = np.zeros_like(touching)
    within = touching[:-2] & touching[1:-1] & touching[2:]
    is_minimum[1:-1] = within & (depth[1:-1] < depth[:-2]) & (depth[1:-1] <= depth[2:])
    minima = np.cumsum(is_minimum)
    earlier = np.maximum.accumulate(np.where(touching, 0, minima))  # minima before the present contact
    return np.where(touching, np.where(minima > earlier, 2.0, 1.0), 0.0)
