"""Joints with clearance: a pin in a bush, contact and friction between them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from enum import IntEnum
from typing import ClassVar, NamedTuple

import numpy as np

from ..declare import Quantity, declared, field, names, part, quantity
from ..geometry import Array, cross, onsets
from ..laws import BristleLaw, FrictionLaw, NoFriction, NormalLaw
from ..laws.friction import as_bristle_law
from ..laws.journal import BRISTLE, ONSET, SINCE, SLIDING, meet
from .element import GROUND, Parts, Push, Recorded
from .joint import Joint
from .rows import Row, meets
from .signal import Depth, Energy, Kind, Signal

PIERCED = 0.05
"""Depth of a pin in its bush, over the pin's radius, up to which a depth beyond the clearance gives a remark, not SUSPECT."""


@declared
class Clearance(Joint):
    """A pin of the first body in a bush of the second, with clearance between them, contact and friction.

    Examples
    --------
    >>> joint = Clearance("B", "coupler", "rocker", pin=0.01, gap=2e-4, law=Hertz(1e9), friction=Coulomb(0.1))
    >>> joint.key
    'B.coupler-rocker'
    """

    title: ClassVar[str] = "clearance at '{point}'"

    point: str = names(doc="where they meet")
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

    ideal: ClassVar[bool] = False

    @property
    def rubs(self) -> str:
        """Point of the joint, where it has friction."""
        return "" if isinstance(self.friction, NoFriction) else self.point

    def check(self, mechanism: Parts) -> None:
        """Check that the clearance is smaller than what it joins."""
        super().check(mechanism)
        lengths = [mechanism.length(name) for name in (self.first, self.second) if name != GROUND]
        if self.gap >= min(lengths):
            raise ValueError(
                f"gap = {self.gap:g} m at '{self.point}': must be below the length of what it joins, {min(lengths):g} m"
            )

    def rows(self, mechanism: Parts) -> Iterator[Row]:
        """Yield the rows of a pin that is centred in its bush at the start."""
        return meets(self.point, self.first, self.second, start_only=True)

    def depths(self, name: str, mechanism: Parts) -> Iterator[Depth]:
        """Yield the largest allowed depth: the clearance or a share of the pin's radius, whichever is larger."""
        allowed = max(self.gap, PIERCED * self.pin)
        where = f"in its bush, more than {allowed:.3g} m, its clearance or {PIERCED:g} of its radius"
        yield Depth(f"{self.point}.penetration", allowed, f"pin '{self.point}'", where)

    def one_sided(self, name: str) -> Iterator[tuple[str, str]]:
        """Yield the names of normal force and depth."""
        yield f"{self.point}.normal_force", f"{self.point}.penetration"

    def remarks(self, name: str, signals: Mapping[str, Array]) -> Iterator[str]:
        """Yield a remark if the depth exceeds the clearance, beyond the theory of two cylinders."""
        deepest = float(signals[f"{self.point}.penetration"].max(initial=0.0))
        if deepest > self.gap:
            yield (
                f"pin '{self.point}' is {deepest:.3g} m deep in its bush, more than its clearance {self.gap:.3g} m: its law was "
                "followed, but no theory of contact holds so deep"
            )

    def signals(self, name: str, record: Recorded) -> Iterator[Signal]:
        """Yield the force on the second body, N, normal and friction force, N, depth and place of the pin in its bush, m."""
        found, point = self._touch(name, record), self.point
        touched = onsets(record.time, found.depth, found.rate)
        yield Signal(f"{name}.fx", -found.fx, "N", Kind.CONTACT, f"{name}.f", onsets=touched)
        yield Signal(f"{name}.fy", -found.fy, "N", Kind.CONTACT, f"{name}.f")
        yield Signal(f"{point}.normal_force", found.normal, "N", Kind.CONTACT)
        yield Signal(f"{point}.friction_force", found.tangential, "N", Kind.FRICTION)
        yield Signal(f"{point}.penetration", np.maximum(found.depth, 0.0), "m", Kind.CONTACT)
        yield Signal(f"{point}.sliding_speed", found.sliding, "m/s", Kind.RATE)
        yield Signal(f"{point}.journal_x", found.ex, "m", Kind.PLACE, f"{point}.journal", scale=self.gap)
        yield Signal(f"{point}.journal_y", found.ey, "m", Kind.PLACE, f"{point}.journal", scale=self.gap)
        yield Signal(f"{point}.contact_state", contact_state(found.depth), "1", Kind.COUNT)
        touching = found.depth > 0
        yield Signal(f"{point}.contacts", np.cumsum(np.diff(touching, prepend=False) & touching), "1", Kind.COUNT)

    def _touch(self, name: str, record: Recorded) -> Touch:
        memory, time = record.channel(name, "memory"), record.time
        found: Touch = record.once(("touch", name), lambda: contact(self, *states(self, record), memory, time))
        return found

    def pushes(self, name: str, record: Recorded) -> Iterator[Push]:
        """Yield the contact's force on both bodies, with its moment about the centres of pin and bush."""
        pin, bush = states(self, record)
        found = self._touch(name, record)
        force, n = np.column_stack([found.fx, found.fy]), np.column_stack([found.nx, found.ny])
        arm = self.pin * n
        for body, sign, lever in ((self.first, 1.0, arm), (self.second, -1.0, arm + pin.place - bush.place)):
            if body != GROUND:
                yield Push(f"{body}:{self.point}", sign * force, sign * cross(lever, force))

    def energies(self, name: str, record: Recorded) -> Iterator[Energy]:
        """Yield the energy stored in contact and bristles, and that dissipated by damping and by friction.

        Powers are integrated by Simpson's rule. The state in the middle of a step is interpolated by cubic Hermite polynomials;
        the bristle there is the mean of those at the ends.
        """
        pin, bush = states(self, record)
        memory, time = record.channel(name, "memory"), record.time
        ends = self._touch(name, record)
        between = memory[1:].copy()
        between[:, BRISTLE] = (ends.bristle[:-1] + ends.bristle[1:]) / 2
        h = np.diff(time)
        between[:, SINCE] = time[:-1] + h / 2
        middle = contact(self, _half_way(pin, h), _half_way(bush, h), between, between[:, SINCE])

        def work(force: str, speed: str) -> Array:
            """Integrate a power by Simpson's rule."""
            power, half = getattr(ends, force) * getattr(ends, speed), getattr(middle, force) * getattr(middle, speed)
            return np.concatenate([[0.0], np.cumsum(h * (power[:-1] + 4 * half + power[1:]) / 6)])

        elastic, bent = self.law.potential(ends.depth), ends.normal * as_bristle_law(self.friction).stored(ends.bristle)
        yield Energy("held", "contact", elastic + bent)
        lost = work("normal", "rate") - (elastic - elastic[0])
        rubbed = work("tangential", "sliding") - (bent - bent[0])
        yield Energy("taken", "contact", lost)
        yield Energy("taken", "friction", rubbed)
        yield Energy("single", f"{self.point}.taken_contact", lost)
        yield Energy("single", f"{self.point}.taken_friction", rubbed)


def clearances(mechanism: Parts) -> list[Clearance]:
    """Return the joints with clearance of a mechanism."""
    return [joint for joint in mechanism.joints if isinstance(joint, Clearance)]


class Side(NamedTuple):
    """One side of the joint: place and velocity of its centre (times, 2), angle and spin of its body (times,)."""

    place: Array
    velocity: Array
    angle: Array
    spin: Array


def states(joint: Clearance, record: Recorded) -> tuple[Side, Side]:
    """Return the motion of pin and bush."""
    at = [f"{body}:{joint.point}" for body in (joint.first, joint.second)]
    pin, bush = (Side(*record.point(side), *record.turn(side)) for side in at)
    return pin, bush


def _half_way(side: Side, h: Array) -> Side:
    """Interpolate the motion in the middle of each step."""

    def middle(value: Array, rate: Array, step: Array) -> tuple[Array, Array]:
        """Evaluate the cubic through both ends."""
        a, b, va, vb = value[:-1], value[1:], rate[:-1], rate[1:]
        return (a + b) / 2 + step * (va - vb) / 8, 1.5 * (b - a) / step - (va + vb) / 4

    return Side(*middle(side.place, side.velocity, h[:, None]), *middle(side.angle, side.spin, h))


class Touch(NamedTuple):
    """Contact of pin and bush, each (times,)."""

    normal: Array  # [N]
    tangential: Array  # [N]
    depth: Array  # [m]
    rate: Array  # of the depth [m/s]
    sliding: Array  # speed [m/s]
    bristle: Array  # deflection [m]
    fx: Array  # force on the pin [N]
    fy: Array
    nx: Array  # direction from bush to pin
    ny: Array
    ex: Array  # place of the pin in the bush [m]
    ey: Array


def contact(joint: Clearance, pin: Side, bush: Side, memory: Array, time: Array) -> Touch:
    """Compute the contact of pin and bush at many times, from the equations of `buckler.mbs.laws.journal`.

    `memory` (times, 4) has the columns of `journal.MEMORY` at the last accepted step before each time.
    """
    place, speed = (pin.place - bush.place).T, (pin.velocity - bush.velocity).T
    depth, rate, sliding, nx, ny = meet(joint.pin, joint.gap, place, speed, (pin.spin, bush.spin))
    inside = depth > 0
    normal = np.where(inside, joint.law.force(depth, rate, memory[:, ONSET]), 0.0)
    friction, mean, passed = as_bristle_law(joint.friction), 0.5 * (memory[:, SLIDING] + sliding), time - memory[:, SINCE]
    bristle = np.where(inside, friction.after(memory[:, BRISTLE], mean, passed), 0.0)
    drag = friction.coefficient(sliding, bristle) * normal
    fx, fy = -normal * nx + drag * ny, -normal * ny - drag * nx
    return Touch(normal, drag, depth, rate, sliding, bristle, fx, fy, nx, ny, *place)


class ContactState(IntEnum):
    """Contact states of a pin in its bush."""

    FREE = 0
    IMPACT = 1  # up to the first rebound of the depth
    CONTINUOUS = 2  # beyond it


def contact_state(depth: Array) -> Array:
    """Return the contact state at each sample: continuous from the first minimum of the depth within a contact."""
    touching = depth > 0
    dip = np.zeros_like(touching)
    dip[1:-1] = touching[1:-1] & (depth[1:-1] < depth[:-2]) & (depth[1:-1] <= depth[2:]) & touching[:-2] & touching[2:]
    dips = np.cumsum(dip)
    start = np.maximum.accumulate(np.where(touching, 0, dips))  # dips counted before the present contact
    state = np.where(dips > start, ContactState.CONTINUOUS, ContactState.IMPACT)
    return np.where(touching, state, ContactState.FREE).astype(float)
