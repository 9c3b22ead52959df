"""Joints with clearance, pins in bushes, in the engine: a user element computes the forces of all joints with the same laws."""

from __future__ import annotations

from typing import TYPE_CHECKING

import exudyn.itemInterface as eii
import numpy as np

from ..elements.clearance import Clearance
from ..elements.element import GROUND
from ..elements.stop import SLOWEST_ONSET
from ..geometry import Array, find_sign_changes
from ..laws import BristleLaw, NormalLaw
from ..laws.journal import BRISTLE, COLUMNS, MEMORY, ONSET, SINCE, SLIDING, End, Joints
from ..record.lookup import hermite
from . import Callback, System
from .guarded import watch
from .scene import EngineScene

if TYPE_CHECKING:
    from ..laws.contact import Kernel


class ClearanceGroup:
    """Joints with clearance with the same laws, as a user element of the engine without mass.

    The kernel's coordinates are x, y, theta of each node in turn. `indices` (3 nodes,) are those of the coordinates in the
    engine's vector. `memory` (joints, 4) has the columns of `laws.journal.MEMORY` at the last accepted step;
    `updates_memory` is true if a law depends on it. `is_stuck` is true if the engine repeats one step for ever.
    """

    def __init__(self, joints: list[Clearance], ends: list[tuple[End, End]], nodes: list[int]) -> None:
        from ..laws.contact import kernel_of  # loads the compiler, which nothing else in the engine needs

        self.nodes = nodes
        law, friction = joints[0].law, joints[0].friction
        self.kernel: Kernel = kernel_of(law, friction)
        self.joints = tabulate(joints, ends)
        self.memory = np.zeros((len(joints), len(MEMORY)))
        self.memory[:, ONSET] = SLOWEST_ONSET
        self.is_stuck = False
        depth, rate = 1e-6, 0.1  # [m], [m/s]: in compression, where all laws that use the onset speed depend on it
        depends_on_onset = law.force(depth, rate, 1.0) != law.force(depth, rate, 2.0)  # onset speeds [m/s]
        self.updates_memory = isinstance(friction, BristleLaw) or depends_on_onset
        self._out = np.zeros(3 * len(nodes))  # generalised forces [N, N m]
        self._report = np.zeros((len(joints), len(COLUMNS)))
        self._previous: dict[str, Array] | None = None
        self._latest, self._calls = 0.0, 0  # latest time of all calls [s], and number of calls that brought no later time

    def locate(self, system: System) -> None:
        """Find the indices of the coordinates in the assembled system."""
        self.indices = np.add.outer([system.GetNodeODE2Index(node) for node in self.nodes], np.arange(3)).ravel()

    def forces(self, _system: System, t: float, _item: int, q: Array, q_t: Array) -> Array:
        """Compute the generalised forces, as the engine's callback; a RuntimeError ends a run without progress."""
        self._latest, self._calls = (t, 0) if t > self._latest else (self._latest, self._calls + 1)
        # the engine's explicit integrator can reject one step for ever, and meanwhile calls nothing but the forces
        most_calls = 1_000_000 if self.kernel.compiled else 100_000  # they take some 10 s
        if self._calls > most_calls:
            self.is_stuck = True
            raise RuntimeError("the step is rejected again and again: no step is short enough for this law")
        self.kernel.forces(t, np.array(q), np.array(q_t), self.memory, self.joints, self._out)
        return self._out

    def accept(self, q: Array, q_t: Array, t: float) -> Array:
        """Update bristles and onset speeds of new contacts after an accepted step; return a copy of the memory, (joints, 4)."""
        indices, memory = self.indices, self.memory
        self.kernel.report(t, q[indices], q_t[indices], memory, self.joints, self._report)
        report = dict(zip(COLUMNS, self._report.T.copy(), strict=True))
        depth, rate = report["depth"], report["rate"]
        is_free = depth <= 0
        # the onset speed of a contact that closes in the next step, until the rate at the onset is known: the rate now
        memory[is_free, ONSET] = np.maximum(rate[is_free], SLOWEST_ONSET)
        if self._previous is not None:
            h, previous = t - memory[0, SINCE], self._previous  # all joints have the time of the last accepted step
            # the onset is the zero of the cubic of depths at which bisection ends: one, as the sign changes from start to end
            for j in np.flatnonzero(~is_free & (previous["depth"] <= 0)):
                depths, rates = (np.array([previous[column][j], report[column][j]]) for column in ("depth", "rate"))
                onset = find_sign_changes(np.array([0.0, h]), depths, rates)
                _depths, (speed,) = hermite(np.array([0.0, h]), depths, rates, onset)
                memory[j, ONSET] = max(speed, SLOWEST_ONSET)
        memory[:, BRISTLE], memory[:, SLIDING], memory[:, SINCE] = report["bristle"], report["sliding"], t
        self._previous = report
        return memory.copy()


def connect(scene: EngineScene, joints: dict[str, Clearance]) -> None:
    """Add joints with the same laws as one user element on the nodes of their bodies."""
    groups: dict[tuple[NormalLaw, object], list[str]] = {}
    for name, joint in joints.items():
        groups.setdefault((joint.law, joint.friction), []).append(name)
    for names in groups.values():
        nodes: list[int] = []
        alike = [joints[name] for name in names]
        ends = [(_end(scene, joint.first, joint.point, nodes), _end(scene, joint.second, joint.point, nodes)) for joint in alike]
        group = ClearanceGroup(alike, ends, nodes)
        scene.add_with_memory(group, names)
        size = 3 * len(nodes)
        forces: Callback = group.forces
        if not group.kernel.compiled:
            points = ", ".join(f"'{joint.point}'" for joint in alike)
            reason = "it is no plain arithmetic, or Numba is missing"
            slow = f"is called back in Python, some twenty times slower: {reason}"
            scene.notes.append(f"a law of the clearance at {points} {slow}")
            forces = watch(scene, f"a law of the clearance at '{alike[0].point}'", forces)  # Python code may raise exceptions
        item = eii.ObjectGenericODE2(nodeNumbers=nodes, massMatrix=np.zeros((size, size)), forceUserFunction=forces)
        scene.system.AddObject(item)


def _end(scene: EngineScene, body: str, point: str, nodes: list[int]) -> End:
    """Return pin or bush of a joint: `place` of its node and `arm` from there, at t = 0 [m]; add the node to `nodes`."""
    x, y = scene.mechanism.points[point]
    if body == GROUND:
        return End(offset=-1, place=(x, y), arm=(0.0, 0.0))  # -1: no coordinates; the place is the joint itself
    if body in scene.strut_links:
        raise ValueError(f"clearance at '{point}': link '{body}' is a Strut; the contact exerts moments")
    node, position = scene.placed[body].find_angle_node(point)
    node_x, node_y = (float(component) for component in position)
    if node not in nodes:
        nodes.append(node)
    first_coordinate = 3 * nodes.index(node)  # each node has x, y, theta
    return End(offset=first_coordinate, place=(node_x, node_y), arm=(x - node_x, y - node_y))


def tabulate(joints: list[Clearance], ends: list[tuple[End, End]]) -> Joints:
    """Tabulate joints for the kernel from their pins and bushes."""
    offsets = np.array([[pin.offset, bush.offset] for pin, bush in ends], dtype=np.int64).reshape(-1, 2)
    numbers = [
        [*pin.place, *pin.arm, *bush.place, *bush.arm, joint.pin, joint.gap]  # radius of the pin, clearance [m]
        for joint, (pin, bush) in zip(joints, ends, strict=True)
    ]
    return Joints(offsets, np.array(numbers, dtype=float))
