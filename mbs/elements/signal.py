"""Signals and energies of elements in a run."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from enum import StrEnum
from typing import NamedTuple, Protocol

import numpy as np

from ..geometry import Array


class Kind(StrEnum):
    """Kind of a signal, by which two runs are compared and values between samples are found.

    A stretch is a length that axial strain changes, and that vibrates with it. A reaction is the force of a constraint. A
    contact signal is a force or depth while a contact is closed. An internal force follows by a law from a state or from time:
    strips, springs, motors, loads. A state belongs to a load's own law.
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
    """A force that redundant constraints share: no equation determines it, so that it has no error and is never compared."""


class Trait(NamedTuple):
    """Properties of a signal besides its values and unit.

    Signals of one `group` are components of a vector, measured by the largest of them; by default it is alone. `rate` names the
    signal that is its rate. `scale` is what its errors are relative to, where the element knows it: the clearance of a joint.
    `period` [s] is that of a mean, of the signal `source`; 0 and '' of a signal as computed.
    """

    kind: Kind
    group: str = ""
    rate: str = ""
    scale: float = 0.0
    period: float = 0.0
    source: str = ""

    @property
    def smooth(self) -> bool:
        """True if it is a length or an angle, which cannot jump."""
        return self.kind in (Kind.PLACE, Kind.STRETCH)


class Signal(NamedTuple):
    """A named series, `values` (times,), and what it is; kind, group, rate, scale, period and source as in `Trait`.

    `onsets` (contacts,) are times at which a contact closes or opens [s]: its force jumps or has a kink there. `depth` (times,)
    is that of a stop's contact, negative where open [m]; `elastic` the force [N] of its law at rest in depths [m].
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
    onsets: Array = np.empty(0)
    depth: Array = np.empty(0)
    elastic: Callable[[Array], Array] = np.zeros_like

    @property
    def trait(self) -> Trait:
        """Properties of the signal."""
        return Trait(*self[3:9])


def vector(name: str, values: Array, unit: str, kind: Kind, group: str = "", rate: str = "") -> Iterator[Signal]:
    """Yield the components (times, 2) of a vector: `F.f` gives `F.fx` and `F.fy`; likewise of the vector that is its rate."""
    for axis, letter in enumerate("xy"):
        yield Signal(f"{name}{letter}", values[:, axis], unit, kind, group or name, f"{rate}{letter}" if rate else "")


class Energy(NamedTuple):
    """An energy of shape (times,) [J]: 'held' now, 'taken' from the mechanism since t = 0, or 'given' to it since t = 0.

    `name` is what it is added to in the ledger: `kinetic`, `strain`, `contact`, `weight`, `spring`; `damping`, `friction`,
    `contact`, `resistance`; `drive`, `load`, `motor`.
    """

    kind: str
    name: str
    values: Array


class Depth(NamedTuple):
    """Largest depth of a contact: signal, depth, m, beyond which its law does not hold, what is so deep, and in what."""

    signal: str
    allowed: float
    what: str
    where: str


class Moved(Protocol):
    """Motion of a link or block, as its elements see it; places and rates each (times, 2), angles and energies (times,)."""

    @property
    def mass(self) -> float:
        """Mass, kg."""

    def point(self, name: str, /) -> tuple[Array, Array]:
        """Place and velocity of a point on it."""

    def turn(self, name: str, /) -> tuple[Array, Array]:
        """Angle turned since t = 0 there, rad, and its rate."""

    def centre(self) -> tuple[Array, Array, Array]:
        """Place, velocity and acceleration of the centre of mass."""

    def kinetic(self) -> Array:
        """Kinetic energy, J."""


class Slid(Moved, Protocol):
    """Motion of a guide's block."""

    @property
    def travel(self) -> Array:
        """Way along the guide since t = 0, m."""

    @property
    def speed(self) -> Array:
        """Rate of the travel, m/s."""
