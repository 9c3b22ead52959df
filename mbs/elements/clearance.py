"""Joints with clearance: a pin in a bush, contact and friction between them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import ClassVar, NamedTuple

import numpy as np

from ..declare import Quantity, Several, declared, field, names, part, quantity
from ..geometry import Array, cross, left, onsets
from ..laws import BristleLaw, FrictionLaw, NoFriction, NormalLaw
from ..laws.friction import remembering
from ..validate import short
from .element import GROUND, Parts, Push, Recorded
from .joint import Joint
from .journal import BRISTLE, HARMONICS, ONSET, SINCE, SLIDING, meet, profile
from .rows import Row, meets
from .signal import Depth, Energy, Kind, Signal

ROUND_ABOUT = np.linspace(0.0, 2 * np.pi, 721)
"""Directions, rad, in which the least clearance is looked for."""
PROFILE = (
    "cosine and sine amplitude of each harmonic of what it lacks of a circle, over the angle from the x axis while the body "
    "lies as at t = 0; the clearance in a direction is `gap` and both profiles there"
)
PIERCED = 0.05
"""Depth of a pin in its bush, relative to its radius, up to which a depth beyond the clearance is remarked, not suspected."""


class Harmonics(Several):
    """Amplitudes of harmonics."""

    words = f"cosine and sine amplitudes, m, of at most {HARMONICS} harmonics"


HARMONIC = Harmonics(Quantity("m"), 0, 2 * HARMONICS)


@declared
class Clearance(Joint):
    """A pin of the first body in a bush of the second, with clearance between them, contact and friction."""

    title: ClassVar[str] = "clearance at '{point}'"

    point: str = names(doc="where they meet")
    first: str = names(doc="link with the pin, or 'ground'")
    second: str = names(doc="link with the bush, or 'ground'")
    pin: float = quantity("m", above=0, doc="radius of the pin")
    gap: float = quantity(
        "m", above=0, doc="radial clearance: bush radius minus pin radius", hint="a joint without clearance is a Revolute"
    )
    law: NormalLaw = part(NormalLaw, example="Impact(...)", doc="contact law of `buckler.mbs.laws`")
    friction: FrictionLaw | BristleLaw = part(
        FrictionLaw, BristleLaw, example="Coulomb(0.1)", doc="of `buckler.mbs.laws`; none by default", default_factory=NoFriction
    )
    bush_profile: tuple[float, ...] = field(HARMONIC, f"of the bush: {PROFILE}", default=())
    pin_profile: tuple[float, ...] = field(HARMONIC, f"of the pin: {PROFILE}", default=())

    ideal: ClassVar[bool] = False

    def agree(self) -> None:
        """Cosines and sines in pairs; clearance all round."""
        for key in ("bush_profile", "pin_profile"):
            if len(getattr(self, key)) % 2:
                raise ValueError(f"{key} = {short(getattr(self, key))}: must be {HARMONIC.words}")
        least = self.gap
        if not self.round:
            least += sum(float(profile(side, 0, ROUND_ABOUT)[0].min()) for side in self.profiles)
        if least <= 0:
            raise ValueError(f"{self.where}: gap and profiles = {least:.3g} m at the least: must be positive")

    @property
    def profiles(self) -> tuple[Array, Array]:
        """Of bush and pin, with as many harmonics as the equations take, m."""
        bush, pin = (np.pad(np.array(side), (0, 2 * HARMONICS - len(side))) for side in (self.bush_profile, self.pin_profile))
        return bush, pin

    def shape(self) -> tuple[float, ...]:
        """Return radius, clearance, 1 if all is round, and the harmonics, as the equations read them."""
        return (self.pin, self.gap, float(self.round), *np.concatenate(self.profiles).tolist())

    @property
    def rubs(self) -> str:
        """Its point, where it has friction."""
        return "" if isinstance(self.friction, NoFriction) else self.point

    @property
    def round(self) -> bool:
        """Whether both pin and bush are."""
        return not (any(self.bush_profile) or any(self.pin_profile))

    def check(self, mechanism: Parts) -> None:
        """As any joint; and a clearance smaller than what it joins."""
        super().check(mechanism)
        lengths = [mechanism.length(name) for name in (self.first, self.second) if name != GROUND]
        if self.gap >= min(lengths):
            raise ValueError(
                f"gap = {self.gap:g} m at '{self.point}': must be below the length of what it joins, {min(lengths):g} m"
            )

    def rows(self, mechanism: Parts) -> Iterator[Row]:
        """Yield that the pin is centred in its bush at the start."""
        return meets(self.point, self.first, self.second, start_only=True)

    def depths(self, name: str, mechanism: Parts) -> Iterator[Depth]:
        """Yield its depth, and the clearance or a share of the pin, whichever is more."""
        allowed = max(self.gap, PIERCED * self.pin)
        where = f"in its bush, more than {allowed:.3g} m, its clearance or {PIERCED:g} of its radius"
        yield Depth(f"{self.point}.penetration", allowed, f"pin '{self.point}'", where)

    def one_sided(self, name: str) -> Iterator[tuple[str, str]]:
        """Yield its normal force and its depth."""
        yield f"{self.point}.normal_force", f"{self.point}.penetration"

    def remarks(self, name: str, signals: Mapping[str, Array]) -> Iterator[str]:
        """Yield that the pin is deeper than its clearance, where the theory of two cylinders has ended."""
        deepest = float(signals[f"{self.point}.penetration"].max(initial=0.0))
        if deepest > self.gap:
            yield (
                f"pin '{self.point}' is {deepest:.3g} m deep in its bush, more than its clearance {self.gap:.3g} m: its law was "
                "followed, but no theory of contact holds so deep"
            )

    def signals(self, name: str, record: Recorded) -> Iterator[Signal]:
        """Yield the force on the second body, what contact and friction exert, N, and where the pin is in its bush."""
        found, point = contact(self, *states(self, record), record.channel(name, "memory"), record.time), self.point
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

    def pushes(self, name: str, record: Recorded) -> Iterator[Push]:
        """Yield the contact's force on both bodies, with its moment about the centres of pin and bush."""
        pin, bush = states(self, record)
        found = contact(self, pin, bush, record.channel(name, "memory"), record.time)
        force, n = np.column_stack([found.fx, found.fy]), np.column_stack([found.nx, found.ny])
        arm = self.pin * n - found.shift[:, None] * left(n)
        for body, sign, lever in ((self.first, 1.0, arm), (self.second, -1.0, arm + pin.place - bush.place)):
            if body != GROUND:
                yield Push(f"{body}:{self.point}", sign * force, sign * cross(lever, force))

    def energies(self, name: str, record: Recorded) -> Iterator[Energy]:
        """Yield what contact and bristles hold, and what they took by damping and by friction.

        Powers are integrated by Simpson's rule, the state at half a step from the cubic Hermite interpolation of the places; the
        bristle half-way is the mean of those at the ends.
        """
        pin, bush = states(self, record)
        memory, time = record.channel(name, "memory"), record.time
        ends = contact(self, pin, bush, memory, time)
        between = memory[1:].copy()
        between[:, BRISTLE] = (ends.bristle[:-1] + ends.bristle[1:]) / 2
        h = np.diff(time)
        between[:, SINCE] = time[:-1] + h / 2
        middle = contact(self, _half_way(pin, h), _half_way(bush, h), between, between[:, SINCE])

        def work(force: str, speed: str) -> Array:
            power, half = getattr(ends, force) * getattr(ends, speed), getattr(middle, force) * getattr(middle, speed)
            return np.concatenate([[0.0], np.cumsum(h * (power[:-1] + 4 * half + power[1:]) / 6)])

        elastic, bent = self.law.potential(ends.depth), ends.normal * remembering(self.friction).stored(ends.bristle)
        yield Energy("held", "contact", elastic + bent)
        lost = work("normal", "rate") - (elastic - elastic[0])
        rubbed = work("tangential", "sliding") - (bent - bent[0])
        yield Energy("taken", "contact", lost)
        yield Energy("taken", "friction", rubbed)
        yield Energy("single", f"{self.point}.taken_contact", lost)
        yield Energy("single", f"{self.point}.taken_friction", rubbed)


def clearances(mechanism: Parts) -> list[Clearance]:
    """Joints with clearance of a mechanism."""
    return [joint for joint in mechanism.joints if isinstance(joint, Clearance)]


class Side(NamedTuple):
    """One side of the joint: place and velocity of its centre (times, 2), angle and spin of its body (times,)."""

    place: Array
    velocity: Array
    angle: Array
    spin: Array


def states(joint: Clearance, record: Recorded) -> tuple[Side, Side]:
    """What pin and bush did."""
    at = [f"{body}:{joint.point}" for body in (joint.first, joint.second)]
    pin, bush = (Side(*record.point(side), *record.turn(side)) for side in at)
    return pin, bush


def _half_way(side: Side, h: Array) -> Side:
    """The state half a step on."""

    def middle(value: Array, rate: Array, step: Array) -> tuple[Array, Array]:
        a, b, va, vb = value[:-1], value[1:], rate[:-1], rate[1:]
        return (a + b) / 2 + step * (va - vb) / 8, 1.5 * (b - a) / step - (va + vb) / 4

    return Side(*middle(side.place, side.velocity, h[:, None]), *middle(side.angle, side.spin, h))


class Touch(NamedTuple):
    """What the contact does, each (times,): N, N, m, m/s, m/s, m, force on the pin, direction of contact from bush to pin, way of
    the contact along an unround pin, m, place of the pin in the bush, m.
    """

    normal: Array
    tangential: Array
    depth: Array
    rate: Array
    sliding: Array
    bristle: Array
    fx: Array
    fy: Array
    nx: Array
    ny: Array
    shift: Array
    ex: Array
    ey: Array


def contact(joint: Clearance, pin: Side, bush: Side, memory: Array, time: Array) -> Touch:
    """Contact of pin and bush at many times, from the equations of `buckler.mbs.elements.journal`.

    Parameters
    ----------
    memory : array, shape (times, 4)
        What `journal.MEMORY` names, of the last accepted step before each time.
    """
    place, speed = (pin.place - bush.place).T, (pin.velocity - bush.velocity).T
    profiles = None if joint.round else np.concatenate(joint.profiles)
    ends = (pin.spin, pin.angle), (bush.spin, bush.angle)
    depth, rate, sliding, nx, ny, s, shift = meet(joint.pin, joint.gap, profiles, place, speed, *ends)
    inside = depth > 0
    normal = np.where(inside, joint.law.force(depth, rate, memory[:, ONSET]), 0.0)
    friction, mean, passed = remembering(joint.friction), 0.5 * (memory[:, SLIDING] + sliding), time - memory[:, SINCE]
    bristle = np.where(inside, friction.after(memory[:, BRISTLE], mean, passed), 0.0)
    drag = friction.coefficient(sliding, bristle) * normal
    fx, fy = -normal * s * nx + drag * ny, -normal * s * ny - drag * nx
    return Touch(normal, drag, depth, rate, sliding, bristle, fx, fy, nx, ny, shift, *place)


FREE, IMPACT, CONTINUOUS = 0.0, 1.0, 2.0
"""Contact states: apart; in touch, going in and out once; in touch beyond the first rebound of the depth."""


def contact_state(depth: Array) -> Array:
    """FREE, IMPACT or CONTINUOUS at each sample: continuous from the first minimum of the depth within a contact on."""
    touching = depth > 0
    dip = np.zeros_like(touching)
    dip[1:-1] = touching[1:-1] & (depth[1:-1] < depth[:-2]) & (depth[1:-1] <= depth[2:]) & touching[:-2] & touching[2:]
    dips = np.cumsum(dip)
    start = np.maximum.accumulate(np.where(touching, 0, dips))  # dips counted before the present contact
    return np.where(touching, np.where(dips > start, CONTINUOUS, IMPACT), FREE)
