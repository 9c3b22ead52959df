"""Forces on points, torques on links, and loads along a strip; `Stateful.push` explains the argument `times`."""

from collections.abc import Callable, Iterator
from typing import ClassVar

import numpy as np

from ..declare import Either, Quantity, Vector, declared, field, flag, names, part, quantity
from ..functions.fields import Law
from ..geometry import Array, cross, rotate
from .element import GROUND, Pair, Parts, Push, Recorded, place
from .load import Load, Stateful, States
from .references import angle_reference, check_link, check_reference, check_turning, holder, holder_reference
from .signal import Energy, Kind, Signal, vector


@declared
class Force(Stateful):
    """A force on a point of a link or a guide's block: constant, or a function of time, or of time, motion and states.

    >>> Force("B", (0.0, -10.0)).key
    'force.B'
    """

    title: ClassVar[str] = "force on '{point}'"  # `Element` explains the fields in braces, also of `label`
    label: ClassVar[str] = "force.{point:point}"
    signature: ClassVar[Law] = Law("t", "N", size=2)
    variables_with_states: ClassVar[str] = "t, x, y, vx, vy"

    point: str = names(doc="'A', or 'coupler:A' as part of that link; at the end of a strut it acts on the body pinned to it")
    value: Pair | Callable[..., Pair] = field(
        Either((Vector("N"), signature)),
        "or a function of the time t, s; a search at each 1e-5 of the run finds its jumps and kinks, but may miss shorter pulses",
    )
    follows: str | None = names(
        doc="link with which the force turns, at `point` or else its start, or 'beam:B'; `value` is that at t = 0", default=None
    )
    through: Pair | None = field(
        Vector("m"), "a fixed place on the line of action (Reut's load), which then has a moment about the point", default=None
    )
    states: States | None = part(
        States, doc="of the law: `value` is then a function of t, the point's x, y, m, vx, vy, m/s, and the states", default=None
    )

    def check(self, mechanism: Parts) -> None:
        """Raise a ValueError unless the force acts on a point of a body, and the link to follow has an angle."""
        check_reference(mechanism, self.point, self.where)
        if holder(mechanism, self.point) == GROUND:
            raise ValueError(f"{self.where}: it acts on the ground; name a point of a link")
        if self.follows is not None:
            check_turning(mechanism, self.follows, self.where)
        if self.through is not None:
            check_turning(mechanism, holder_reference(mechanism, self.point), self.where)  # as its moment acts on an angle
        if self.states is not None and (self.follows is not None or self.through is not None):
            raise ValueError(f"{self.where}: states: a force with states neither follows a link nor goes through a place")
        self.check_states(mechanism)

    def start_motion(self, mechanism: Parts) -> list[float]:
        """Return t, x, y, vx, vy at t = 0, at rest."""
        return [0.0, *mechanism.points[place(self.point).point], 0.0, 0.0]

    def initial_force(self, mechanism: Parts) -> Pair:
        """Return the force [N] at t = 0 on a point at rest."""
        if not callable(self.value):
            return self.value
        components = self.functions()[: self.signature.size]  # `functions` has them first, then rates of states
        fx, fy = (component(*self.start_arguments(mechanism)) for component in components)
        return fx, fy

    def measures(self, record: Recorded) -> tuple[Array, ...]:
        """Return x, y [m], vx, vy [m/s] of the point, each (times,)."""
        position, velocity = record.point(holder_reference(record.mechanism, self.point))
        return *position.T, *velocity.T

    def turns_with(self, mechanism: Parts) -> str | None:
        """Return the point reference whose angle the force follows, or None."""
        return None if self.follows is None else angle_reference(mechanism, self.follows, place(self.point).point)

    def acting(self, name: str, record: Recorded, times: Array) -> Array:
        """Return the force (times, 2) [N]."""
        values, followed = self.evaluate(name, record, times), self.turns_with(record.mechanism)
        if followed is None:
            return values
        angle, _ = record.turn(followed)  # since t = 0
        return rotate(angle, values)

    def push(self, name: str, record: Recorded, times: Array) -> Push:
        """Return the force; if the line of action goes through a fixed place, also the moment about the loaded point."""
        at, force = holder_reference(record.mechanism, self.point), self.acting(name, record, times)
        if self.through is None:
            return Push(at, force, np.zeros_like(record.time))
        position, _ = record.point(at)
        return Push(at, force, cross(np.array(self.through) - position, force))

    def signals(self, name: str, record: Recorded) -> Iterator[Signal]:
        """Yield the components [N], and the states."""
        yield from vector(f"{name}.f", self.acting(name, record, record.time), "N", Kind.INTERNAL)
        yield from self.state_signals(name, record)

    def energies(self, name: str, record: Recorded) -> Iterator[Energy]:
        """Yield the work of the force."""
        if callable(self.value) or self.follows is not None or self.through is not None:
            yield Energy("supplied", "load", self.work_of(name, record))
            return
        position, _ = record.point(holder_reference(record.mechanism, self.point))
        # a constant force: displacement times force is exact, without an integral over time
        yield Energy("supplied", "load", (position - position[0]) @ np.array(self.value))


@declared
class Torque(Stateful):
    """A torque on a link: constant, or a function of time, angle, speed and states.

    >>> Torque("crank", lambda time, angle, speed: -0.01 * speed).key
    'torque.crank'
    """

    title: ClassVar[str] = "torque on '{link}'"
    label: ClassVar[str] = "torque.{link:body}"
    signature: ClassVar[Law] = Law("t, angle, speed", "N m")
    variables_with_states: ClassVar[str] = signature.variables

    link: str = names(doc="any but a Strut; on a flexible link the torque acts at the start; 'beam:B' names another point")
    value: float | Callable[..., float] = field(
        Either((Quantity("N m"), signature)),
        "counter-clockwise, or a function of time (s), angle at that point since t = 0 (rad) and rate of the angle (rad/s)",
    )
    states: States | None = part(States, doc="states of the law: `value` is then a function of them, too", default=None)

    def check(self, mechanism: Parts) -> None:
        """Raise a ValueError unless the link has an angle."""
        check_turning(mechanism, self.link, self.where)
        self.check_states(mechanism)

    def measures(self, record: Recorded) -> tuple[Array, ...]:
        """Return angle [rad] and speed [rad/s], each (times,)."""
        return record.turn(angle_reference(record.mechanism, self.link))

    def push(self, name: str, record: Recorded, times: Array) -> Push:
        """Return the torque."""
        at = angle_reference(record.mechanism, self.link)
        return Push(at, np.zeros((len(times), 2)), self.evaluate(name, record, times))

    def signals(self, name: str, record: Recorded) -> Iterator[Signal]:
        """Yield the torque [N m], and the states."""
        yield Signal(f"{name}.torque", self.evaluate(name, record, record.time), "N m", Kind.INTERNAL)
        yield from self.state_signals(name, record)

    def energies(self, name: str, record: Recorded) -> Iterator[Energy]:
        """Yield the work of the torque."""
        if callable(self.value):
            yield Energy("supplied", "load", self.work_of(name, record))
        else:
            angle, _ = self.measures(record)
            yield Energy("supplied", "load", self.value * angle)


@declared
class LineLoad(Load):
    """A constant force and moment per length along a whole Beam; the force may turn with the sections of the beam.

    >>> LineLoad("strip", force=(0.0, -0.5)).key  # N/m
    'line_load.strip'
    """

    title: ClassVar[str] = "load along '{link}'"
    label: ClassVar[str] = "line_load.{link}"

    link: str = names(doc="a Beam")
    force: tuple[float, float] = field(Vector("N/m"), "per stress-free length, components x and y at t = 0", default=(0.0, 0.0))
    moment: float = quantity("N m/m", doc="per length, counter-clockwise", default=0.0)
    turns: bool = flag(doc="whether the force on each section turns with the section", default=False)

    def check(self, mechanism: Parts) -> None:
        """Raise a ValueError unless the link is a Beam, the only strip of finite elements whose nodes have angles."""
        check_link(mechanism, self.link, self.where)
        body = mechanism.link(self.link).body
        if not (body.meshed and body.has_angles):
            raise ValueError(f"{self.where}: it is a {type(body).__name__}; must be a Beam")

    def pushes(self, name: str, record: Recorded) -> Iterator[Push]:
        """Yield the resultant at the start of the strip, with its moment about that point."""
        start = f"{self.link}:{record.mechanism.link(self.link).start}"
        weights, poses, _ = record.links[self.link].quadrature()  # weights [m], poses (x, y, angle since t = 0)
        force, (origin, _) = rotate(poses[..., 2] * self.turns, self.force), record.point(start)  # (times, sections, 2) [N/m]
        moment = cross(poses[..., :2] - origin[:, None], force) + self.moment  # per length
        yield Push(start, np.einsum("k,tkc->tc", weights, force), moment @ weights)

    def signals(self, name: str, record: Recorded) -> Iterator[Signal]:
        """Yield the components of the resultant force [N]."""
        for push in self.pushes(name, record):
            yield from vector(f"{name}.f", push.force, "N", Kind.INTERNAL)

    def energies(self, name: str, record: Recorded) -> Iterator[Energy]:
        """Yield the work of the load: in closed form, or where the force turns from the power."""
        weights, poses, rates = record.links[self.link].quadrature()
        if not self.turns:
            yield Energy("supplied", "load", np.einsum("k,tkc,c->t", weights, poses - poses[:1], [*self.force, self.moment]))
            return
        by_force = (rotate(poses[..., 2], self.force) * rates[..., :2]).sum(axis=-1)
        yield Energy("supplied", "load", record.work((by_force + self.moment * rates[..., 2]) @ weights))
