"""Springs with dampers between two points, and torsion springs between two links."""

from collections.abc import Callable, Iterator
from typing import ClassVar

import numpy as np

from ..declare import declared, field, names, quantity
from ..functions import Argument, Called
from ..functions.edge_search import evaluate, find_edges_between
from ..functions.fields import Function
from ..geometry import Array, unit
from .element import GROUND, Parts, Push, Recorded, place
from .load import Load, on_both, sample
from .references import angle_reference, check_reference, check_turning, distance, holder, holder_reference
from .signal import Energy, Kind, Signal

Law = Callable[[float, float], float]
"""Force or torque of a spring, over its coordinate and the rate of the coordinate."""


def potential(law: Law, values: Array) -> Array:
    """Integrate the force of a law at rest from 0 to each value, (times,) [J], by Gauss quadrature between its edges."""
    low, high = min(0.0, float(values.min())), max(0.0, float(values.max()))
    if not high > low:
        return np.zeros_like(values)
    edges = find_edges_between(low, high, lambda x: evaluate(law, x, np.zeros_like(x)))
    both_sides = np.concatenate([edges, np.nextafter(edges, np.inf)])  # the search returns the last value before a jump
    pieces = np.linspace(low, high, 401)  # enough for rounding where a law is smooth
    grid = np.unique(np.concatenate([pieces, [0.0], both_sides]))

    def integrate(starts: Array, ends: Array) -> Array:
        """Integrate the force over intervals by four Gauss points in each."""
        nodes, weights = np.polynomial.legendre.leggauss(4)
        half = (ends - starts)[:, None] / 2
        x = starts[:, None] + half + half * nodes
        force = sample(law, x.ravel(), np.zeros(x.size)).reshape(x.shape)  # nan where the law raises an error
        return np.asarray((force * weights * half).sum(axis=1))

    work = np.concatenate([[0.0], np.cumsum(integrate(grid[:-1], grid[1:]))])
    piece = np.clip(np.searchsorted(grid, values, side="right") - 1, 0, len(grid) - 2)  # in which each value lies
    return np.asarray(work[piece] + integrate(grid[piece], values) - work[np.searchsorted(grid, 0.0)])


class Elastic(Load):
    """Base of springs. Their coordinate is a distance or an angle, less the distance or angle without force."""

    stiffness: float
    damping: float
    law: Law | None  # replaces stiffness and damping

    def state(self, record: Recorded) -> tuple[Array, Array]:
        """Return the coordinate and its rate, each (times,)."""
        raise NotImplementedError

    def tension(self, value: Array, rate: Array) -> Array:
        """Return the tension [N], or the torque on the first link [N m], (times,); a positive one reduces the coordinate."""
        if self.law is None:
            return self.stiffness * value + self.damping * rate
        return sample(self.law, value, rate)

    def stored_energy(self, value: Array) -> Array:
        """Compute the stored energy (times,) [J]."""
        return 0.5 * self.stiffness * value**2 if self.law is None else potential(self.law, value)

    def dissipated_power(self, value: Array, rate: Array) -> Array:
        """Return the power dissipated by damping (times,) [W]; damping of a law is its force less the force at rate 0."""
        if self.law is None:
            return self.damping * rate**2
        return (sample(self.law, value, rate) - sample(self.law, value, np.zeros_like(rate))) * rate

    def user_functions(self, name: str, record: Recorded) -> Iterator[Called]:
        """Yield the law as a function of time, coordinate and rate, with the course of both."""
        law = self.law
        if law is not None:
            value, rate = self.state(record)
            # the search for edges knows the time, so the list has only the arguments after it
            yield (lambda _time, x, v: law(x, v)), (Argument(value, rates=rate), Argument(rate))

    def energies(self, name: str, record: Recorded) -> Iterator[Energy]:
        """Yield the stored energy, and the energy dissipated by damping."""
        value, rate = self.state(record)
        yield Energy("stored", "spring", self.stored_energy(value))
        yield Energy("dissipated", "damping", record.work(self.dissipated_power(value, rate)))


@declared
class Spring(Elastic):
    """A spring with a damper on the line between two points.

    >>> Spring("A", "B", stiffness=120.0, damping=0.3).key
    'spring.A-B'
    """

    title: ClassVar[str] = "spring from '{a}' to '{b}'"
    label: ClassVar[str] = "spring.{a:point}-{b:point}"

    a: str = names(doc="a point reference: 'A', 'coupler:A' or 'ground:P'")
    b: str = names(doc="point reference of the other end")
    stiffness: float = quantity("N/m", doc="with a law it is not used and may be 0")
    damping: float = quantity("N s/m", low=0, doc="force of the damper over the rate", default=0.0)
    free_length: float | None = quantity("m", low=0, doc="distance without force; by default the distance at t = 0", default=None)
    law: Law | None = field(
        Function("x, v", "N"),
        "tension, which replaces stiffness and damping: a function of elongation (distance less free length), m, and rate, m/s; "
        "its value at rate 0 is the elastic force, the rest is damping",
        default=None,
    )

    def check(self, mechanism: Parts) -> None:
        """Raise a ValueError if both ends are on the ground or the same point, or coincide though the spring has a length."""
        for at in (self.a, self.b):
            check_reference(mechanism, at, self.where)
        if holder(mechanism, self.a) == holder(mechanism, self.b) == GROUND:
            raise ValueError(f"{self.where}: both its ends are on the ground")
        if holder_reference(mechanism, self.a) == holder_reference(mechanism, self.b):
            raise ValueError(f"{self.where}: both its ends are the same point of the same link; name two points or two links")
        if self.free(mechanism) > 0 and distance(mechanism, self.a, self.b) == 0:
            raise ValueError(f"{self.where}: its ends coincide, so it has no direction; only a free length of 0 can start there")

    def free(self, mechanism: Parts) -> float:
        """Return the free length [m]."""
        return distance(mechanism, self.a, self.b) if self.free_length is None else self.free_length

    def stretch(self, record: Recorded) -> tuple[Array, Array, Array]:
        """Return elongation [m], its rate [m/s], each (times,), and the unit vector from a to b, (times, 2)."""
        # a load at a strut's end acts on another body, which `holder` finds
        (a, a_t), (b, b_t) = (record.point(holder_reference(record.mechanism, at)) for at in (self.a, self.b))
        length, direction = unit(b - a)
        return length - self.free(record.mechanism), ((b_t - a_t) * direction).sum(axis=1), direction

    def state(self, record: Recorded) -> tuple[Array, Array]:
        """Return elongation [m] and its rate [m/s], each (times,)."""
        return self.stretch(record)[:2]

    def pushes(self, name: str, record: Recorded) -> Iterator[Push]:
        """Yield the tension on both ends: it pulls `a` towards `b`, and `b` towards `a`."""
        value, rate, direction = self.stretch(record)
        ends = [holder_reference(record.mechanism, at) for at in (self.a, self.b)]
        yield from on_both(ends, self.tension(value, rate)[:, None] * direction, np.zeros_like(value))

    def signals(self, name: str, record: Recorded) -> Iterator[Signal]:
        """Yield tension [N] and elongation [m]."""
        value, rate = self.state(record)
        yield Signal(f"{name}.force", self.tension(value, rate), "N", Kind.INTERNAL)
        yield Signal(f"{name}.elongation", value, "m", Kind.STRETCH)


@declared
class TorsionSpring(Elastic):
    """A torsion spring with a damper between two links, or a link and the ground.

    >>> TorsionSpring("crank", "coupler", stiffness=0.02).key
    'torsion.crank-coupler'
    """

    title: ClassVar[str] = "torsion spring of '{first}' and '{second}'"
    label: ClassVar[str] = "torsion.{first:body}-{second:body}"

    first: str = names(
        doc="any link but a strut, or 'ground'; on a flexible link the torque acts at the joint with `second`, or else at the "
        "link's start; 'beam:B' names another point"
    )
    second: str = names(doc="the other link, given likewise")
    stiffness: float = quantity("N m/rad", doc="with a law it is not used and may be 0")
    damping: float = quantity("N m s/rad", low=0, doc="torque of the damper over the rate", default=0.0)
    free_angle: float | None = quantity(
        "rad", doc="turn since t = 0 of `second` less that of `first` at zero torque; 0 by default", default=None
    )
    law: Law | None = field(
        Function("x, v", "N m"),
        "torque on `first`, and its opposite on `second`, which replaces stiffness and damping: a function of the angle less "
        "`free_angle`, rad, and its rate, rad/s; the torque at rate 0 is elastic, the rest is damping",
        default=None,
    )

    def check(self, mechanism: Parts) -> None:
        """Raise a ValueError unless the ends have an angle, and differ in the body or, on a flexible link, in the point."""
        for at in (self.first, self.second):
            if at.partition(":")[0] != GROUND:
                check_turning(mechanism, at, self.where)
        (first, first_point), (second, second_point) = map(place, self.ends(mechanism))
        if first == second and (first == GROUND or first_point == second_point or not mechanism.link(first).body.flexible):
            raise ValueError(f"{self.where}: two different links, or a link and 'ground', are needed")

    def ends(self, mechanism: Parts) -> tuple[str, str]:
        """Return the point references at which the torques act."""
        bodies = {at.partition(":")[0] for at in (self.first, self.second)}
        shared = next((joint.point for joint in mechanism.joints if {joint.first, joint.second} == bodies), None)
        return angle_reference(mechanism, self.first, shared), angle_reference(mechanism, self.second, shared)

    def state(self, record: Recorded) -> tuple[Array, Array]:
        """Return angle of the second link relative to the first, less the free angle [rad], and rate [rad/s], each (times,)."""
        (first, first_t), (second, second_t) = (record.turn(at) for at in self.ends(record.mechanism))  # since t = 0
        return second - first - (self.free_angle or 0.0), second_t - first_t

    def pushes(self, name: str, record: Recorded) -> Iterator[Push]:
        """Yield the torque on both links."""
        no_force = np.zeros((len(record.time), 2))
        yield from on_both(self.ends(record.mechanism), no_force, self.tension(*self.state(record)))

    def signals(self, name: str, record: Recorded) -> Iterator[Signal]:
        """Yield the torque on the first link [N m], and the angle less the free one [rad]."""
        value, rate = self.state(record)
        yield Signal(f"{name}.torque", self.tension(value, rate), "N m", Kind.INTERNAL)
        yield Signal(f"{name}.angle", value, "rad", Kind.PLACE)
