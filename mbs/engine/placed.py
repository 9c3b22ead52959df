"""Links and blocks in the engine, and the history of its steps before it becomes a record."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import exudyn.itemInterface as eii
import numpy as np

from ..elements.element import Pair
from ..elements.signal import Moved
from ..geometry import Array
from . import System


class States(NamedTuple):
    """The engine's coordinates over time: displacements from the reference and their rates, each (times, coordinates)."""

    q: Array
    q_t: Array
    q_tt: Array


@dataclass(frozen=True)
class Placed:
    """A link or block in the engine: the numbers of its `nodes` and `objects`, and a position marker of each point in `ends`.

    `reference` (nodes, coordinates a node) are the coordinates of the undeformed link.
    """

    system: System
    name: str
    body: Any
    nodes: tuple[int, ...]
    objects: tuple[int, ...]
    reference: Array
    ends: dict[str, int]

    def columns(self) -> Array:
        """Places of the coordinates in the engine's vector, shape as `reference`."""
        first = [self.system.GetNodeODE2Index(node) for node in self.nodes]
        return np.add.outer(np.array(first), np.arange(self.reference.shape[1]))

    def total(self, states: States) -> States:
        """Coordinates and rates of this link alone, each (times, nodes, coordinates a node)."""
        columns = self.columns()
        return States(states.q[:, columns] + self.reference, states.q_t[:, columns], states.q_tt[:, columns])

    def motion(self, states: States) -> Moved:
        """Return its motion, as the record keeps it."""
        raise NotImplementedError

    def weights(self) -> Array:
        """Return the displacement of the link by one unit of each coordinate, m, shape as `columns`: a norm for step errors."""
        raise NotImplementedError

    def attach(self, point: str, mass: float, inertia: float) -> bool:
        """Add a mass, kg, with a moment of inertia, kg m^2, at a point; false if the body was built with it.

        It is a constant block of a node's mass matrix.
        """
        if inertia:
            node, size = self.contact_node(point)[0], 3
        else:
            node, size, _ = self.place_node(point)
        attached = np.diag([mass, mass, inertia, 0.0][:size])
        self.system.AddObject(eii.ObjectGenericODE2(nodeNumbers=[node], massMatrix=attached))
        return True

    def place_node(self, point: str) -> tuple[int, int, Array]:
        """Node that moves with a point, how many coordinates it has (x, y first), and that node's reference place."""
        node, place = self.contact_node(point)
        return node, 3, place

    def mobility(self, _point: str, _along: Pair) -> float:
        """Acceleration of a point along a unit vector by unit force on it, nothing joined to the body, 1/kg."""
        raise NotImplementedError

    def contact_node(self, point: str) -> tuple[int, Array]:
        """Node (x, y, theta) that moves with the body at a point, and its reference place; ValueError if the body has none."""
        raise ValueError(f"'{point}' of '{self.name}' has no angle, and what is to act there exerts a moment")


@dataclass(frozen=True)
class History:
    """History of the engine's steps: multipliers (times, constraints), contact forces [N] (times, stops).

    `memory` has an array (times, joints, 4) of what `journal.MEMORY` names for each of the scene's `remembering`.
    """

    time: Array
    states: States
    multipliers: Array
    contact: Array
    memory: list[Array]


class Remembering(Protocol):
    """Protocol of forces with a memory from one accepted step to the next."""

    memory: Array
    remembers: bool
    latest: Array
    """Latest time it was asked for, and how often since: infinite once that was too often."""

    def locate(self, system: System) -> None:
        """Take down where its coordinates lie, once the system is assembled."""

    def accept(self, q: Array, q_t: Array, t: float) -> Array:
        """Take over an accepted step; a copy of the memory."""
