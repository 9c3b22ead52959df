"""Base class of links and blocks that are placed in the engine, and the history of its steps, from which a record is made."""

from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import exudyn.itemInterface as eii
import numpy as np

from ..elements.element import Pair
from ..elements.signal import MovingBody
from ..geometry import Array
from . import System


class EngineStates(NamedTuple):
    """The engine's displacements from the reference, velocities and accelerations over time, each (times, coordinates)."""

    q: Array
    q_t: Array
    q_tt: Array


@dataclass(frozen=True)
class EngineBody:
    """A link or block in the engine."""

    system: System
    name: str
    body: Any  # the link's body, or the guide
    nodes: tuple[int, ...]  # numbers of the engine's nodes
    objects: tuple[int, ...]  # numbers of the engine's objects
    reference: Array  # undeformed coordinates at t = 0, (nodes, coordinates of a node)
    markers: dict[str, int]  # position markers at all points of the body
    scales: Array  # how far the body moves per unit of each coordinate [m], shape as `reference`: for errors of steps in m

    def columns(self) -> Array:
        """Return the indices of the coordinates in the engine's vector, shape as `reference`."""
        starts = [self.system.GetNodeODE2Index(node) for node in self.nodes]
        return np.add.outer(np.array(starts), np.arange(self.reference.shape[1]))

    def total(self, states: EngineStates) -> EngineStates:
        """Return coordinates and rates of this link, each (times, nodes, coordinates of a node)."""
        columns = self.columns()
        return EngineStates(states.q[:, columns] + self.reference, states.q_t[:, columns], states.q_tt[:, columns])

    def motion(self, states: EngineStates) -> MovingBody:
        """Return the motion for the record."""
        raise NotImplementedError

    def add_burden(self, point: str, mass: float, inertia: float, gravity: Pair) -> None:
        """Add mass [kg] and moment of inertia [kg m^2] to the node at a point, and the weight of the mass."""
        if inertia:
            node, _position = self.find_angle_node(point)
            masses = [mass, mass, inertia]  # of (x, y, theta)
        else:
            node, size, _position = self.find_node(point)
            masses = [mass, mass, 0.0, 0.0][:size]  # an angle or the slopes of a cable have none
        self.system.AddObject(eii.ObjectGenericODE2(nodeNumbers=[node], massMatrix=np.diag(masses)))
        weight = [mass * gravity[0], mass * gravity[1], 0.0]
        if any(weight):
            self.system.AddLoad(eii.LoadForceVector(markerNumber=self.markers[point], loadVector=weight))

    def find_node(self, point: str) -> tuple[int, int, Array]:
        """Return the node at a point, even one without an angle, the number of its coordinates, and its position at t = 0 [m]."""
        node, place = self.find_angle_node(point)
        return node, 3, place

    def inverse_mass(self, _point: str, _along: Pair) -> float:
        """Return the inverse of the effective mass [1/kg] of a point along a unit vector, as if the body had no joints."""
        raise NotImplementedError

    def find_angle_node(self, point: str) -> tuple[int, Array]:
        """Return the node (x, y, theta) at a point, and its position at t = 0 [m]; a ValueError if the body has no angle."""
        raise ValueError(f"'{point}' of '{self.name}' has no angle, and what is to act there exerts a moment")


@dataclass(frozen=True)
class History:
    """Values at the accepted steps: times, coordinates, multipliers (times, constraints), `contact` forces [N] (times, stops).

    `memory` has an array (times, joints, 4) for each of the scene's `with_memory`: a group of joints with the same laws, or one
    guide. Its columns are those of `laws.journal.MEMORY`.
    """

    time: Array
    states: EngineStates
    multipliers: Array
    contact: Array
    memory: list[Array]


class WithMemory(Protocol):
    """Protocol of forces that may depend on values of the last accepted step, the `memory`; see `History`."""

    memory: Array
    updates_memory: bool  # false if the forces do not depend on the memory, which then stays as it is
    is_stuck: bool  # true if the force was called too often without progress in time, as in a step that is repeated for ever

    def locate(self, system: System) -> None:
        """Find the indices of the coordinates in the assembled system."""

    def accept(self, q: Array, q_t: Array, t: float) -> Array:
        """Update the memory after an accepted step; return a copy."""
