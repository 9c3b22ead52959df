"""Signals and energies of elements in a run, and the motions from which elements compute them.

An array (times,) has one value for each sample of the run.
"""

from collections.abc import Callable, Iterator
from enum import StrEnum
from typing import NamedTuple, Protocol

import numpy as np

from ..geometry import Array


class Kind(StrEnum):
    """Kind of a signal; it decides how two runs are compared and how samples are interpolated.

    A stretch is the change of the length of a link or spring: links vibrate axially, a distance has a kink at zero. A
    reaction is the force of a constraint, `CONTACT` the normal force or depth of a contact. `INTERNAL` is what follows from
    motion or time by a law, as the force of a strip, spring, motor or load. A state is a variable of a load's law, integrated
    with the motion. A count is a number.
    """

    PLACE = "place"
    STRETCH = "stretch"
    RATE = "rate"
    ACCELERATION = "acceleration"
    REACTION = "reaction"
    CONTACT = "contact"
    FRICTION = "friction"
    INTERNAL = "internal"
    STATE = "state"
    ENERGY = "energy"
    COUNT = "count"
    UNDETERMINED = "undetermined"
    """Force of redundant constraints, which no equation determines; it has no error and is never compared."""


class Trait(NamedTuple):
    """Properties of a signal other than its values and unit.

    `group` names the vector of which the signal is a component: errors are relative to the largest component of the vector.
    `rate` names the signal of the time derivative. `scale` is the size to which errors are relative, such as a clearance; 0 where
    the element gives none. Only a running mean has a `period` [s] and a `source`, the signal that is averaged.
    """

    kind: Kind
    group: str = ""
    rate: str = ""
    scale: float = 0.0
    period: float = 0.0
    source: str = ""

    @property
    def smooth(self) -> bool:
        """True for a place or a stretch, which cannot jump."""
        return self.kind in (Kind.PLACE, Kind.STRETCH)


class Signal(NamedTuple):
    """A named series of `values` (times,); see `Trait` for the fields from kind to source.

    `contact_events` (n,) [s] are the times at which a contact closes or opens: its force may jump.
    The force of a stop also has the `depth` (times,) [m] of its contact, negative if open. Its `elastic` is a function: the
    force [N] of the elastic part of the law at depths [m].
    """

    name: str
    values: Array
    unit: str
    kind: Kind
    group: str = ""
    rate: str = ""
    scale: float = 0.0
    period: float = 0.0
    source: str = ""
    contact_events: Array = np.empty(0)
    depth: Array = np.empty(0)
    elastic: Callable[[Array], Array] = np.zeros_like

    @property
    def trait(self) -> Trait:
        """Properties of the signal."""
        return Trait(*(getattr(self, name) for name in Trait._fields))


def vector(name: str, values: Array, unit: str, kind: Kind, rate: str = "") -> Iterator[Signal]:
    """Yield the two components of a vector (times, 2): the name `F.f` gives `F.fx` and `F.fy`, as does the name of the rate."""
    for axis, letter in enumerate("xy"):
        yield Signal(f"{name}{letter}", values[:, axis], unit, kind, name, f"{rate}{letter}" if rate else "")


class Energy(NamedTuple):
    """Energy (times,) [J] of the kind 'stored', or 'dissipated' or 'supplied' since t = 0.

    The energy balance adds it to the entry `name`: stored `kinetic`, `strain`, `contact`, `weight`, `spring`; dissipated
    `damping`, `friction`, `contact`, `resistance`; supplied `drive`, `load`, `motor`. The kind 'part' is the share of one element
    in such an entry: it gives a signal of its own and is not added once more.
    """

    kind: str
    name: str
    values: Array


class DepthLimit(NamedTuple):
    """Largest depth `allowed` [m] in a `signal`; the message is "{what} is {depth found} m {where}"."""

    signal: str
    allowed: float
    what: str
    where: str


class MovingBody(Protocol):
    """Motion of a link or a guide's block: places and their rates (times, 2), angles and energies (times,)."""

    @property
    def mass(self) -> float:
        """Mass [kg]."""

    def point(self, name: str, /) -> tuple[Array, Array]:
        """Return place [m] and velocity [m/s] of a point, each (times, 2)."""

    def turn(self, name: str, /) -> tuple[Array, Array]:
        """Return the angle at a point since t = 0 [rad] and its rate [rad/s]."""

    def centre(self) -> tuple[Array, Array, Array]:
        """Return place [m], velocity [m/s] and acceleration [m/s^2] of the centre of mass, each (times, 2)."""

    def kinetic(self) -> Array:
        """Return the kinetic energy [J]."""


class SlidingBlock(MovingBody, Protocol):
    """Motion of a guide's block."""

    @property
    def travel(self) -> Array:
        """Travel along the guide since t = 0 [m]."""

    @property
    def speed(self) -> Array:
        """Rate of the travel [m/s]."""
