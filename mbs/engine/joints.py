"""Joints, guides' friction, stops, drives and struts become Exudyn connectors.

User functions are plain Python on floats: the engine calls them a few times a step, and they carry any law.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import exudyn.itemInterface as eii
import numpy as np

from buckler.mbs.elements.journal import BRISTLE, COLUMNS, MEMORY, ONSET, SINCE, SLIDING, End, Kernel, has_bristle, kernel, tables
from buckler.mbs.mechanism import Clearance, Drive, Guide, Mechanism, Stop, Strut

SLOWEST_ONSET = 1e-4
"""Approach speed, m/s, below which dissipative laws no longer scale with it: a contact at rest has no impact speed."""
GRAZE = 0.05
"""Share of the fastest approach so far that a stop's slower ones are taken for: after the last tiny rebound of a slider
coming to rest, a law that divides by the approach speed would else let a slow release pull."""

DEPTH, RATE, SPEED, BENT = (COLUMNS.index(name) for name in ("depth", "rate", "sliding", "bristle"))


@dataclass
class StopContact:
    """Running state of one stop: where its face lies in the guide's coordinate, and the last approach speed.

    Attributes
    ----------
    face : float
        Travel along the guide at which the point touches, m.
    side : float
        +1 if the face lies ahead of the start in the guide's direction, -1 if behind.
    onset : float
        Approach speed when the present contact began, m/s, or a share of the fastest one so far.
    fastest : float
        Fastest approach so far that ended in contact, m/s.
    """

    stop: Stop
    face: float
    side: float
    onset: float = SLOWEST_ONSET
    fastest: float = SLOWEST_ONSET

    def depth(self, travel: Any) -> Any:
        """Penetration depth, m, positive in contact."""
        return self.side * (travel - self.face)

    def force(self, travel: float, speed: float) -> float:
        """Contact force, N, never negative."""
        depth = self.side * (travel - self.face)
        return self.stop.law.force(depth, self.side * speed, self.onset) if depth > 0 else 0.0

    def accept(self, travel: float, speed: float) -> bool:
        """Take over the state at the end of a step; true in contact."""
        touching = self.side * (travel - self.face) > 0
        if touching:
            self.fastest = max(self.fastest, self.onset)
        else:
            self.onset = max(self.side * speed, SLOWEST_ONSET, GRAZE * self.fastest)
        return touching


def contact_of(mechanism: Mechanism, stop: Stop) -> StopContact:
    """Place a stop in its guide's coordinate.

    Raises
    ------
    ValueError
        If the point starts on the stop's face, so that its side is undefined.
    """
    along = np.array(mechanism.guide(stop.point).along)
    start = float(along @ mechanism.points[stop.point])
    if stop.at == start:
        raise ValueError(f"stop at '{stop.point}': at = {stop.at:g} m is where the point starts; it must lie to one side")
    return StopContact(stop, stop.at - start, 1.0 if stop.at > start else -1.0)


def add_stop(system: Any, contact: StopContact, coordinate: int, ground: int) -> int:
    """Add a stop on a slider's coordinate marker."""

    def spring_force(_system: Any, _t: float, _item: int, travel: float, speed: float, *_: float) -> float:
        return contact.side * contact.force(travel, speed)

    return int(
        system.AddObject(
            eii.ObjectConnectorCoordinateSpringDamper(
                markerNumbers=[ground, coordinate], stiffness=1.0, springForceUserFunction=spring_force
            )
        )
    )


def add_friction(system: Any, guide: Guide, coordinate: int, ground: int) -> int:
    """Add a guide's friction on its slider's coordinate marker: a native element without a data node."""
    friction = guide.friction
    assert friction is not None
    return int(
        system.AddObject(
            eii.ObjectConnectorCoordinateSpringDamperExt(
                markerNumbers=[ground, coordinate],
                dynamicFrictionForce=friction.dynamic,
                staticFrictionOffsetForce=friction.static_offset,
                viscousFrictionFactor=friction.viscous,
                exponentialDecayStatic=friction.stribeck,
                frictionProportionalZone=friction.regularisation,
            )
        )
    )


def add_drive(system: Any, drive: Drive, coordinate: int, ground: int) -> int:
    """Prescribe a coordinate: its velocity where the speed is constant (no callbacks), else its position and velocity."""
    markers = [ground, coordinate]
    if isinstance(drive.speed, int | float):
        item = eii.CoordinateConstraint(markerNumbers=markers, velocityLevel=True, offset=float(drive.speed))
    else:
        motion = drive.motion
        item = eii.CoordinateConstraint(
            markerNumbers=markers,
            offsetUserFunction=lambda _system, t, _item, _offset: motion.position(t),
            offsetUserFunction_t=lambda _system, t, _item, _offset: motion.speed(t),
        )
    return int(system.AddObject(item))


class StrutSpring:
    """Force law of one strut, and the last state the engine asked it for.

    Straight: E A/L times the elongation, down to the Euler load. Beyond it the end shortening U is shared between bending,
    u L, and compression, P L/(E A), with P = p(u) E I/L^2; the compression is 1e-7 of U, so one correction suffices. A taut
    strut also resists with the material's axial damping.

    Attributes
    ----------
    kink : float
        Elongation at the Euler load, m, negative.
    rigidity : float
        E A/L, N/m.
    elongation, rate : float
        The engine's last call, m and m/s.
    """

    def __init__(self, strut: Strut, length: float) -> None:
        section = strut.section
        self.load, self.length = strut.load, length
        self.rigidity, self.unit = section.axial_stiffness / length, section.bending_stiffness / length**2
        self.damping = self.rigidity * section.material.axial_damping
        self._compliance = self.unit / section.axial_stiffness  # of u per p
        self._critical = float(self.load(0.0))
        self.kink = -self._critical * self._compliance * length
        self.elongation = self.rate = 0.0

    def elastic(self, elongation: float) -> float:
        """Tension without damping, N."""
        if elongation >= self.kink:
            return self.rigidity * elongation
        total = -elongation / self.length
        bending = max(0.0, total - self._compliance * self._critical)
        u = max(0.0, total - self._compliance * float(self.load(bending)))
        return -self.unit * float(self.load(u))

    def damping_power(self, elongation: Any, rate: Any) -> Any:
        """Power taken by the axial damping of the taut strut, W."""
        force = np.where(elongation > 0, self.damping * rate, 0.0)
        return np.maximum(force, -self.rigidity * np.maximum(elongation, 0.0)) * rate

    def __call__(self, _system: Any, _t: float, _item: int, elongation: float, rate: float, *_: float) -> float:
        """Engine callback: tension, N; a taut strut never pushes."""
        self.elongation, self.rate = elongation, rate
        if elongation > 0:
            return max(0.0, self.rigidity * elongation + self.damping * rate)
        return self.elastic(elongation)


def add_strut(system: Any, spring: StrutSpring, hosts: tuple[int, int]) -> int:
    """Add a massless strut between position markers of its neighbours."""
    return int(
        system.AddObject(
            eii.ObjectConnectorSpringDamper(
                markerNumbers=list(hosts), referenceLength=spring.length, stiffness=1.0, springForceUserFunction=spring
            )
        )
    )


class ClearanceGroup:
    """Joints with play that share their laws: one user element of the engine, moment-exact and without mass.

    Attributes
    ----------
    joints : list of Clearance
    columns : array, shape (nodes, 3)
        Places of the element's coordinates in the engine's vector, once assembled.
    memory : array, shape (joints, 4)
        What `clearance.MEMORY` names, of the last accepted step.
    remembers : bool
        True if a law asks for anything of that.
    """

    def __init__(self, joints: list[Clearance], ends: list[tuple[End, End]], nodes: list[int]) -> None:
        self.joints, self.nodes = joints, nodes
        law, friction = joints[0].law, joints[0].friction
        self.kernel: Kernel = kernel(law, friction)
        self.places, self.numbers = tables(joints, ends)
        self.memory = np.zeros((len(joints), len(MEMORY)))
        self.memory[:, ONSET] = SLOWEST_ONSET
        self.columns = np.empty((0, 3), dtype=int)
        self.remembers = has_bristle(friction) or law.force(1e-6, 0.1, 1.0) != law.force(1e-6, 0.1, 2.0)
        self._report = np.zeros((len(joints), len(COLUMNS)))
        self._before: np.ndarray[Any, Any] | None = None

    def locate(self, system: Any) -> None:
        """Take down where the element's coordinates lie, once the system is assembled."""
        self.columns = np.add.outer([system.GetNodeODE2Index(node) for node in self.nodes], np.arange(3))

    def accept(self, q: Any, q_t: Any, t: float) -> Any:
        """Take over an accepted step where a law remembers: bristles, onset speeds of contacts that have just begun.

        Returns
        -------
        array, shape (joints, 4)
            A copy of the memory.
        """
        flat, memory, now = self.columns.ravel(), self.memory, self._report
        self.kernel.report(t, q[flat], q_t[flat], memory, self.places, self.numbers, now)
        depth, rate = now[:, DEPTH], now[:, RATE]
        free = depth <= 0
        memory[free, ONSET] = np.maximum(rate[free], SLOWEST_ONSET)
        if self._before is not None:
            h, before = t - memory[0, SINCE], self._before
            for j in np.flatnonzero(~free & (before[:, DEPTH] <= 0)):
                speed = _crossing_speed(h, before[j, DEPTH], before[j, RATE], depth[j], rate[j])
                memory[j, ONSET] = max(speed, SLOWEST_ONSET)
        memory[:, [BRISTLE, SLIDING]], memory[:, SINCE] = now[:, [BENT, SPEED]], t
        self._before = now.copy()
        return memory.copy()


def _crossing_speed(h: float, d0: float, v0: float, d1: float, v1: float) -> float:
    """Speed at which a cubic Hermite depth with these ends crosses zero: bisection, the crossing is bracketed."""

    def depth(s: float) -> float:
        return (1 + 2 * s) * (1 - s) ** 2 * d0 + s * (1 - s) ** 2 * h * v0 + s * s * (3 - 2 * s) * d1 + s * s * (s - 1) * h * v1

    low, high = 0.0, 1.0
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if depth(middle) <= 0 else (low, middle)
    s = 0.5 * (low + high)
    return 6 * s * (1 - s) * (d1 - d0) / h + (1 - s) * (1 - 3 * s) * v0 + s * (3 * s - 2) * v1


def add_clearances(system: Any, group: ClearanceGroup) -> int:
    """Add joints with play as one user element over their bodies' nodes."""
    size = 3 * len(group.nodes)
    return int(
        system.AddObject(
            eii.ObjectGenericODE2(
                nodeNumbers=group.nodes,
                massMatrix=np.zeros((size, size)),
                forceUserFunction=group.kernel.callback(group.memory, group.places, group.numbers, size),
            )
        )
    )
