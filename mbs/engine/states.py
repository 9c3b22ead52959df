"""Loads whose law has states, in the engine: one user element over the node that is pushed and a node of the states.

Each state is the velocity of a coordinate of unit mass on which its rate acts.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from math import cos, sin
from typing import NamedTuple, Protocol

import exudyn.itemInterface as eii
import numpy as np

from ..elements.load import Stateful
from ..geometry import Array
from ..record.record import Record
from . import System
from .guarded import guard
from .placed import History
from .scene import EngineScene


class Pushed(Protocol):
    """Protocol of a node on which a law acts: its number and count of coordinates."""

    @property
    def node(self) -> int: ...  # noqa: D102
    @property
    def size(self) -> int: ...  # noqa: D102

    def arguments(self, q: Array, v: Array) -> tuple[float, ...]:
        """Return the arguments of the law besides time and states."""

    def forces(self, q: Array, values: Sequence[float]) -> list[float]:
        """Generalised forces on the node's coordinates, but for zeros at their end, by the law's values."""


class Turning(NamedTuple):
    """The angle of a node (x, y, theta)."""

    node: int
    size: int = 3

    def arguments(self, q: Array, v: Array) -> tuple[float, ...]:
        """Return angle and speed."""
        return q[2], v[2]

    def forces(self, _places: Array, values: Sequence[float]) -> list[float]:
        """Return a torque."""
        return [0.0, 0.0, values[0]]


class Sliding(NamedTuple):
    """A guide's block, which starts at a place."""

    node: int
    size: int
    at: Array
    along: tuple[float, float]

    def arguments(self, q: Array, v: Array) -> tuple[float, ...]:
        """Return place and velocity."""
        (x, y), (ax, ay) = self.at, self.along
        return x + ax * q[0], y + ay * q[0], ax * v[0], ay * v[0]

    def forces(self, _places: Array, values: Sequence[float]) -> list[float]:
        """Return the component along the guide."""
        return [self.along[0] * values[0] + self.along[1] * values[1]]


class Moving(NamedTuple):
    """A point on an arm from a node (x, y, theta), both as they lie at t = 0; without an arm the node may have no angle."""

    node: int
    size: int
    at: Array
    arm: Array

    def _arm(self, q: Array) -> tuple[float, float]:
        """Rotate the arm with the node."""
        (ax, ay), angle = self.arm, q[2]
        return cos(angle) * ax - sin(angle) * ay, sin(angle) * ax + cos(angle) * ay

    def arguments(self, q: Array, v: Array) -> tuple[float, ...]:
        """Return place and velocity."""
        (x, y), (bx, by) = self.at, self._arm(q)
        return x + q[0] + bx, y + q[1] + by, v[0] - v[2] * by, v[1] + v[2] * bx

    def forces(self, q: Array, values: Sequence[float]) -> list[float]:
        """Return the force and its moment about the node."""
        (fx, fy), (bx, by) = values, self._arm(q)
        return [fx, fy, bx * fy - by * fx]


def add_states(scene: EngineScene, name: str, load: Stateful, pushed: Pushed) -> None:
    """Add a load and its states."""
    initial, size = load.states.initial, pushed.size  # type: ignore[union-attr]
    functions, count, none = [guard(scene, name, each) for each in load.functions()], len(initial), [0.0] * len(initial)
    node = scene.system.AddNode(
        eii.NodeGenericODE2(
            numberOfODE2Coordinates=count, referenceCoordinates=none, initialCoordinates=none, initialCoordinates_t=[*initial]
        )
    )

    def forces(_system: System, t: float, _item: int, q: Array, q_t: Array) -> list[float]:
        """Return the forces on the coordinates, then the rates of the states."""
        values = [function(t, t, *pushed.arguments(q, q_t), *q_t[size:]) for function in functions]
        own = pushed.forces(q, values[: load.law.size])
        return [*own, *[0.0] * (size - len(own)), *values[load.law.size :]]

    masses = np.diag([*[0.0] * size, *[1.0] * count])
    scene.system.AddObject(eii.ObjectGenericODE2(nodeNumbers=[pushed.node, node], massMatrix=masses, forceUserFunction=forces))
    scene.states.append((node, count))
    scene.reads(name, "states", partial(_states, scene, node, count))


def _states(scene: EngineScene, node: int, count: int, run: History, _record: Record) -> Array:
    first = scene.system.GetNodeODE2Index(node)
    return np.hstack([part[:, first : first + count] for part in (run.states.q_t, run.states.q_tt)])
