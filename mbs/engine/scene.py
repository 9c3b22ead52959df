"""An Exudyn system with the numbers of its items, and the conversion of its history to a record."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import exudyn.itemInterface as eii
import numpy as np
from exudyn import SystemContainer

from ..elements.element import GROUND
from ..elements.signal import MovingBody
from ..geometry import Array
from ..mechanism import Mechanism
from ..record.errors import Failure
from ..record.record import Record
from ..scene.scene import Scene
from . import System
from .forces import StopContact, StrutSpring
from .placed import EngineBody, EngineStates, History, WithMemory

SPARSE_FROM = 40
"""Number of coordinates from which the engine's sparse solver is faster than the dense one."""


@dataclass
class EngineScene:
    """An Exudyn system with the numbers of its items, used for one run."""

    mechanism: Mechanism
    system: System
    container: SystemContainer
    ground: int = -1  # marker of a coordinate of the ground
    placed: dict[str, EngineBody] = field(default_factory=dict)  # links by name, without struts; blocks by the guided point
    stops: dict[str, StopContact] = field(default_factory=dict)
    struts: dict[str, StrutSpring] = field(default_factory=dict)
    # forces that depend on the last accepted step: joints with clearance and the same laws; guides' friction by their reaction
    with_memory: list[WithMemory] = field(default_factory=list)
    constraints: dict[str, int] = field(default_factory=dict)  # object numbers by names of elements
    # true if a guide's friction acts at t = 0: the engine computes the multipliers there without friction
    initial_multipliers_lack_friction: bool = False
    notes: list[str] = field(default_factory=list)  # sentences for the result
    stopped: Failure | None = None  # first failure of a user's function
    # functions that compute a channel (times, columns), by element and channel, in the order of computation
    readers: dict[tuple[str, str], Callable[[History, Record], Array]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.strut_links = {link.name for link in self.mechanism.links if link.body.massless}
        self.source = Scene.of(self.mechanism)

    def summary(self) -> dict[str, int]:
        """Count elements, coordinates, constraints and items of the engine."""
        data = self.system.systemData
        return {
            **self.source.counts,
            **({"gravity": 1} if any(self.mechanism.gravity) else {}),
            "coordinates": data.ODE2Size(),
            "constraints": data.AEsize(),
            "objects": data.NumberOfObjects(),
            "nodes": data.NumberOfNodes(),
            "loads": data.NumberOfLoads(),
            "sensors": data.NumberOfSensors(),
        }

    def marker(self, body: str, point: str) -> int:
        """Return the position marker of a body at a point, or add one on the ground."""
        if body != GROUND:
            return self.placed[body].markers[point]
        x, y = self.mechanism.points[point]
        node = self.system.AddNode(eii.NodePointGround(referenceCoordinates=[x, y, 0.0]))
        return int(self.system.AddMarker(eii.MarkerNodePosition(nodeNumber=node)))

    def coordinate_marker(self, body: str, coordinate: int) -> int:
        """Add a marker of a coordinate of a body's first node."""
        node = self.placed[body].nodes[0]
        return int(self.system.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=node, coordinate=coordinate)))

    def angle_marker(self, body: str, point: str) -> int:
        """Add a marker of the angle of a body at a point, or return that of the ground."""
        if body == GROUND:
            return self.ground
        node, _position = self.placed[body].find_angle_node(point)
        return int(self.system.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=node, coordinate=2)))  # of (x, y, theta)

    def present_motion(self, body: str) -> MovingBody:
        """Return the motion of a body at one time, the engine's current one, as if it was at rest."""
        q = self.system.systemData.GetODE2Coordinates()[None]
        rest = np.zeros_like(q)
        return self.placed[body].motion(EngineStates(q=q, q_t=rest, q_tt=rest))

    def add_with_memory(self, force: WithMemory, names: list[str]) -> None:
        """Add forces to `with_memory`, and the rows of their memory as channels of the elements of these names."""
        k = len(self.with_memory)
        self.with_memory.append(force)
        for row, name in enumerate(names):
            self.readers[name, "memory"] = lambda run, _record, row=row: run.memory[k][:, row]  # type: ignore[misc]

    def multiplier_indices(self, name: str) -> Array:
        """Return the indices of a constraint's Lagrange multipliers in the engine's vector of all multipliers."""
        return np.array(self.system.systemData.GetObjectLTGAE(self.constraints[name]))

    def record(self, run: History) -> Record:
        """Convert the engine's history into plain arrays of links, blocks and elements."""
        motions: dict[str, Any] = {name: placed.motion(run.states) for name, placed in self.placed.items()}
        blocks = {guide.point: motions.pop(guide.point) for guide in self.mechanism.guides}
        channels: dict[str, dict[str, Array]] = {}
        record = Record(self.mechanism, run.time, motions, blocks, channels, undetermined=self.source.undetermined)
        for (element, channel), read in self.readers.items():  # some read the channels before theirs in the record
            channels.setdefault(element, {})[channel] = read(run, record)
        return record
