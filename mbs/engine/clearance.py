"""Joints with clearance in the engine: one user element for all joints with the same laws."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import exudyn.itemInterface as eii
import numpy as np

from ..elements.clearance import Clearance
from ..elements.element import GROUND
from ..elements.stop import SLOWEST_ONSET
from ..geometry import Array, onsets
from ..laws import BristleLaw, FrictionLaw, NormalLaw
from ..laws.journal import BRISTLE, COLUMNS, MEMORY, ONSET, SINCE, SLIDING, End
from ..record.lookup import hermite
from ..record.record import Record
from . import Callback, System
from .guarded import watch
from .placed import History
from .scene import EngineScene

if TYPE_CHECKING:
    from ..laws.contact import Kernel

PATIENCE = 1_000_000
"""Calls without progress of the time after which a step counts as stuck, some 10 s.

The engine's explicit integrator can reject one step for ever, and calls only the forces meanwhile."""
SLOWER = 10
"""Factor by which fewer calls are allowed in plain Python."""
DEPTH, RATE, SPEED, BENT = (COLUMNS.index(name) for name in ("depth", "rate", "sliding", "bristle"))


def kernel_of(law: NormalLaw, friction: FrictionLaw | BristleLaw) -> Kernel:
    """Return the kernel of the contact; the import is here so that only joints with clearance load the compiler."""
    from ..laws.contact import kernel_of as made

    return made(law, friction)


class ClearanceGroup:
    """Joints with clearance with the same laws: one user element of the engine, without mass.

    `columns` (nodes, 3) are indices of the coordinates in the engine's vector. `memory` (joints, 4) has the columns of
    `laws.journal.MEMORY` at the last accepted step; `has_memory` is true if a law depends on it. `latest` (2,) is the latest
    time of all calls [s] and the number of calls since; infinite once there are too many.
    """

    def __init__(self, names: list[str], joints: list[Clearance], ends: list[tuple[End, End]], nodes: list[int]) -> None:
        self.names, self.joints, self.nodes = names, joints, nodes
        law, friction = joints[0].law, joints[0].friction
        self.kernel: Kernel = kernel_of(law, friction)
        self.places, self.numbers = tables(joints, ends)
        self.memory = np.zeros((len(joints), len(MEMORY)))
        self.memory[:, ONSET] = SLOWEST_ONSET
        self.latest = np.zeros(2)
        self.columns = np.empty((0, 3), dtype=int)
        self.has_memory = isinstance(friction, BristleLaw) or law.force(1e-6, 0.1, 1.0) != law.force(1e-6, 0.1, 2.0)
        self._report = np.zeros((len(joints), len(COLUMNS)))
        self._before: Array | None = None

    def locate(self, system: System) -> None:
        """Find the columns of the element's coordinates, once the system is assembled."""
        self.columns = np.add.outer([system.GetNodeODE2Index(node) for node in self.nodes], np.arange(3))

    def accept(self, q: Array, q_t: Array, t: float) -> Array:
        """Update bristles and onset speeds of new contacts after an accepted step; return a copy of the memory, (joints, 4)."""
        flat, memory, now = self.columns.ravel(), self.memory, self._report
        self.kernel.report(t, q[flat], q_t[flat], memory, self.places, self.numbers, now)
        depth, rate = now[:, DEPTH], now[:, RATE]
        free = depth <= 0
        memory[free, ONSET] = np.maximum(rate[free], SLOWEST_ONSET)
        if self._before is not None:
            h, before = t - memory[0, SINCE], self._before
            for j in np.flatnonzero(~free & (before[:, DEPTH] <= 0)):
                speed = _crossing_speed(h, [before[j, DEPTH], depth[j]], [before[j, RATE], rate[j]])
                memory[j, ONSET] = max(speed, SLOWEST_ONSET)
        memory[:, [BRISTLE, SLIDING]], memory[:, SINCE] = now[:, [BENT, SPEED]], t
        self._before = now.copy()
        return memory.copy()


def _crossing_speed(h: float, depths: list[float], rates: list[float]) -> float:
    """Return the speed at which the cubic with depths and rates at both ends of a step crosses zero, m/s."""
    step = np.array([0.0, h]), np.array(depths), np.array(rates)
    return float(hermite(*step, onsets(*step))[1][0])


def connect(scene: EngineScene, joints: dict[str, Clearance]) -> None:
    """Add joints with the same laws as one user element on the nodes of their bodies."""
    groups: dict[tuple[NormalLaw, object], list[str]] = {}
    for name, joint in joints.items():
        groups.setdefault((joint.law, joint.friction), []).append(name)
    for names in groups.values():
        nodes: list[int] = []
        chosen = [joints[name] for name in names]
        ends = [(_end(scene, joint.first, joint.point, nodes), _end(scene, joint.second, joint.point, nodes)) for joint in chosen]
        group = ClearanceGroup(names, chosen, ends, nodes)
        g = len(scene.with_memory)
        scene.with_memory.append(group)
        if not group.kernel.compiled:
            points = ", ".join(f"'{joint.point}'" for joint in chosen)
            scene.notes.append(
                f"a law of the clearance at {points} is called back in Python, some twenty times slower: "
                "it is no plain arithmetic, or Numba is missing"
            )
        add_clearances(scene, group)
        for k, name in enumerate(names):
            scene.reads(name, "memory", partial(_memory, g, k))


def _memory(group: int, k: int, run: History, _record: Record) -> Array:
    """Return the memory of one joint over the run."""
    return run.memory[group][:, k]


def _end(scene: EngineScene, body: str, point: str, nodes: list[int]) -> End:
    """Return one side of a joint with clearance; add its node to `nodes`."""
    x, y = scene.mechanism.points[point]
    if body == GROUND:
        return End(-1, (x, y), (0.0, 0.0))
    if body in scene.strut_links:
        raise ValueError(f"clearance at '{point}': link '{body}' is a Strut; the contact exerts moments")
    node, (px, py) = scene.placed[body].contact_node(point)
    if node not in nodes:
        nodes.append(node)
    return End(3 * nodes.index(node), (float(px), float(py)), (x - float(px), y - float(py)))


def tables(joints: list[Clearance], ends: list[tuple[End, End]]) -> tuple[Array, Array]:
    """Pack ends, radii and constants of laws for the kernel: ints (joints, 2) and floats (joints, columns)."""
    places = np.array([[pin.offset, bush.offset] for pin, bush in ends], dtype=np.int64).reshape(-1, 2)
    numbers = [
        [*pin.place, *pin.arm, *bush.place, *bush.arm, joint.pin, joint.gap, *kernel_of(joint.law, joint.friction).constants]
        for joint, (pin, bush) in zip(joints, ends, strict=True)
    ]
    return places, np.array(numbers, dtype=float)


def add_clearances(scene: EngineScene, group: ClearanceGroup) -> None:
    """Add a group of joints as one user element on the nodes of their bodies."""
    size = 3 * len(group.nodes)
    forces = user_function(group, np.zeros(size))
    if not group.kernel.compiled:
        forces = watch(scene, f"a law of the clearance at '{group.joints[0].point}'", forces)
    item = eii.ObjectGenericODE2(nodeNumbers=group.nodes, massMatrix=np.zeros((size, size)), forceUserFunction=forces)
    scene.system.AddObject(item)


def user_function(group: ClearanceGroup, out: Array) -> Callback:
    """Make the engine's function of time, coordinates and rates of a group; `out` takes the generalised forces."""
    most, latest = PATIENCE if group.kernel.compiled else PATIENCE // SLOWER, group.latest

    def forces(_system: System, t: float, _item: int, q: Array, q_t: Array) -> Array:
        """Return the generalised forces at the engine's state."""
        latest[:] = (t, 0.0) if t > latest[0] else (latest[0], latest[1] + 1.0)
        if latest[1] > most:
            latest[1] = np.inf
            raise RuntimeError("the step is rejected again and again: no step is short enough for this law")
        group.kernel.forces(t, np.array(q), np.array(q_t), group.memory, group.places, group.numbers, out)
        return out

    return forces
