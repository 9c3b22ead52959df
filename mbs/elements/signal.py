"""Signals and energies of elements in a run."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from enum import StrEnum
from typing import NamedTuple, Protocol

import numpy as np

from ..geometry import Array


class Kind(StrEnum):
    """Kind of a signal; it decides how two runs are compared and how samples are interpolated.

    A stretch is a length that axial vibration changes. A reaction is the force of a constraint. A contact signal is a force or
    depth of a contact. An internal force follows from motion or time by a law, as of strips, springs, motors, loads. A state is
    one of a load's law.
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
    """Properties of a signal other than values and unit.

    Signals of one `group` are components of a vector; their size is the largest of them. `rate` names the signal that is the
    rate. `scale` is the size to which errors are relative, if the element gives it, as the clearance of a joint. `period` [s] is
    that of a running mean of the signal `source`; 0 and '' for other signals.
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
    """A named series, `values` (times,); kind, group, rate, scale, period and source as in `Trait`.

    `onsets` (contacts,) are times at which a contact closes or opens [s], where its force jumps or has a kink. `depth` (times,)
    is that of a stop's contact, negative if open [m]; `elastic` maps depths [m] to the elastic force [N].
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
    """Yield the components (times, 2) of a vector: `F.f` gives `F.fx` and `F.fy`; the name of the rate likewise."""
    for axis, letter in enumerate("xy"):
        yield Signal(f"{name}{letter}", values[:, axis], unit, kind, group or name, f"{rate}{letter}" if rate else "")


class Energy(NamedTuple):
    """Energy of shape (times,) [J]: stored ('held'), dissipated since t = 0 ('taken'), or supplied since t = 0 ('given').

    `name` is the entry of the ledger to which it is added: stored `kinetic`, `strain`, `contact`, `weight`, `spring`; dissipated
    `damping`, `friction`, `contact`, `resistance`; supplied `drive`, `load`, `motor`.
    """

    kind: str
    name: str
    values: Array


class Depth(NamedTuple):
    """Largest allowed depth of a contact [m]: name of the signal, depth, and words for a message."""

    signal: str
    allowed: float
    what: str
    where: str


class Moved(Protocol):
    """Motion of a link or block, as elements know it; places and rates each (times, 2), angles and energies (times,)."""

    @property
    def mass(self) -> float:
        """Mass, kg."""

    def point(self, name: str, /) -> tuple[Array, Array]:
        """Place and velocity of a point."""

    def turn(self, name: str, /) -> tuple[Array, Array]:
        """Angle at a point since t = 0, rad, and its rate."""

    def centre(self) -> tuple[Array, Array, Array]:
        """Place, velocity and acceleration of the centre of mass."""

    def kinetic(self) -> Array:
        """Kinetic energy, J."""


class Slid(Moved, Protocol):
    """Motion of a guide's block."""

    @property
    def travel(self) -> Array:
        """Travel along the guide since t = 0, m."""

    @property
    def speed(self) -> Array:
        """Rate of the travel, m/s."""
