"""What every element has in common: a name, signals, energies; and how an element names a point.

An element answers from plain arrays. It sees a run through `Recorded`, which both solvers' records are.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple, Protocol

import numpy as np

Array = np.ndarray[Any, Any]
GROUND = "ground"


class Signal(NamedTuple):
    """A named series: values of shape (times,), unit."""

    name: str
    values: Array
    unit: str


class Energy(NamedTuple):
    """An energy, J, of shape (times,).

    Attributes
    ----------
    kind : str
        'held' now, 'taken' from the mechanism since t = 0, or 'given' to it since t = 0.
    name : str
        What it is added to in the ledger: `kinetic`, `strain`, `contact`, `weight`, `spring`; `damping`, `friction`, `contact`;
        `drive`, `load`.
    values : array, shape (times,)
    """

    kind: str
    name: str
    values: Array


class Motion(Protocol):
    """What a link or block did, as plain arrays."""

    @property
    def mass(self) -> float:
        """Kg."""

    def point(self, name: str) -> tuple[Array, Array]:
        """Place and velocity of one of its points, each (times, 2), m and m/s."""

    def turn(self, name: str) -> tuple[Array, Array]:
        """Angle turned there since t = 0 and its rate, each (times,), rad and rad/s."""

    def centre(self) -> tuple[Array, Array, Array]:
        """Place, velocity and acceleration of the centre of mass, each (times, 2)."""

    def kinetic(self) -> Array:
        """Kinetic energy, J, (times,)."""


class Recorded(Protocol):
    """A record, as elements see it."""

    @property
    def mechanism(self) -> Any:
        """The mechanism that ran."""

    @property
    def time(self) -> Array:
        """s, (times,)."""

    @property
    def links(self) -> Mapping[str, Any]:
        """Motion of each link that has coordinates of its own."""

    @property
    def blocks(self) -> Mapping[str, Any]:
        """Motion of each guide's block, by point."""

    def channel(self, element: str, name: str) -> Array:
        """What the solver recorded of an element."""

    def point(self, at: str) -> tuple[Array, Array]:
        """Place and velocity of a point reference."""

    def turn(self, at: str) -> tuple[Array, Array]:
        """Angle turned since t = 0 of the body at a point reference, and its rate."""


class Element:
    """A kind of thing a mechanism is made of."""

    def signals(self, name: str, record: Recorded) -> Iterator[Signal]:
        """Yield its signals in a run; none by default."""
        yield from ()

    def energies(self, name: str, record: Recorded) -> Iterator[Energy]:
        """Yield its energies in a run; none by default."""
        yield from ()


class Place(NamedTuple):
    """A point reference: '' for whatever link carries the point, a link's name, or 'ground'."""

    body: str
    point: str


def place(at: str) -> Place:
    """Read a point reference: 'A', 'coupler:A' or 'ground:A'."""
    body, colon, point = at.rpartition(":")
    return Place(body if colon else "", point)


def since_start(time: Array, power: Array) -> Array:
    """Work, J, of a power, W, since t = 0, by the trapezoidal rule."""
    steps = np.diff(time) * (power[1:] + power[:-1]) / 2
    return np.concatenate([[0.0], np.cumsum(steps)])


def turned(angle: Array, vector: Any) -> Array:
    """A fixed vector (2,) turned by angles (times,): (times, 2)."""
    c, s = np.cos(angle), np.sin(angle)
    return np.column_stack([c * vector[0] - s * vector[1], s * vector[0] + c * vector[1]])


def left(vectors: Array) -> Array:
    """Vectors (..., 2) turned a quarter to the left."""
    return np.stack([-vectors[..., 1], vectors[..., 0]], axis=-1)
