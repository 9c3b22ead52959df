"""Rigid links in the engine."""

from __future__ import annotations

from dataclasses import dataclass

import exudyn.itemInterface as eii
import numpy as np

from ..elements.element import Pair, place
from ..elements.link import Link
from ..geometry import Array, rotate, rotate_left
from ..record.record import RigidMotion
from .placed import EngineBody, EngineStates
from .scene import EngineScene


@dataclass(frozen=True)
class PlacedRigid(EngineBody):
    """A rigid link; its coordinates are place of the centre of mass, added masses included, and direction.

    `mass` [kg] and `inertia` [kg m^2] are the link's alone; `arms` lead from the link's own centre of mass to all points at
    t = 0, `own` from the node to that centre [m]. `radius` is half the length [m].
    """

    mass: float
    inertia: float
    arms: dict[str, Array]
    radius: float
    own: Array

    def motion(self, states: EngineStates) -> RigidMotion:
        """Compute the motion of the link's own centre of mass."""
        columns = self.columns()[0]
        q = states.q[:, columns] + np.array([*self.reference[0, :2], 0.0])
        q_t, q_tt = states.q_t[:, columns], states.q_tt[:, columns]
        if self.own.any():
            arm = rotate(q[:, 2], self.own)
            spin, spin_t = q_t[:, 2:3], q_tt[:, 2:3]
            q = np.column_stack([q[:, :2] + arm, q[:, 2]])
            q_tt = np.column_stack([q_tt[:, :2] + spin_t * rotate_left(arm) - spin**2 * arm, q_tt[:, 2]])
            q_t = np.column_stack([q_t[:, :2] + spin * rotate_left(arm), q_t[:, 2]])
        return RigidMotion(self.mass, self.inertia, self.arms, q, q_t, q_tt)

    def weights(self) -> Array:
        """Return 1 for places and half the link's length for the angle."""
        return np.array([[1.0, 1.0, self.radius]])

    def attach(self, _point: str, _mass: float, _inertia: float) -> bool:
        """Return False: the body was built with all added masses."""
        return False

    def mobility(self, point: str, along: Pair) -> float:
        """Compute the inverse of the effective mass from mass and inertia."""
        (ax, ay), (ux, uy) = self.arms[point], along
        return 1 / self.mass + float(ax * uy - ay * ux) ** 2 / self.inertia

    def contact_node(self, point: str) -> tuple[int, Array]:
        """Return the only node."""
        return self.nodes[0], self.reference[0, :2]


def add(scene: EngineScene, link: Link, velocity: Array) -> PlacedRigid:
    """Add a rigid link; `velocity` is that of its start, (vx, vy, omega)."""
    mechanism, system = scene.mechanism, scene.system
    start, end = (np.array(mechanism.points[p]) for p in (link.start, link.end))
    length = mechanism.length(link.name)
    direction = float(np.arctan2(*(end - start)[::-1]))
    mass, inertia, centre = link.body.mass_properties(length)
    along = (end - start) / length
    own = start + centre[0] * along + centre[1] * np.array([-along[1], along[0]])
    total, moment, middle = _with_burdens(scene, link, mass, inertia, own)
    arm = middle - start
    rates = [velocity[0] - velocity[2] * arm[1], velocity[1] + velocity[2] * arm[0], velocity[2]]
    reference = np.array([[*middle, direction]])
    node = system.AddNode(eii.NodeRigidBody2D(referenceCoordinates=[*reference[0]], initialVelocities=rates))
    body = system.AddObject(eii.ObjectRigidBody2D(mass=total, inertia=moment, nodeNumber=node))
    turn = np.array([[np.cos(direction), np.sin(direction)], [-np.sin(direction), np.cos(direction)]])
    arms = {point: np.subtract(at, own) for point, at in mechanism.points.items()}
    ends = {
        point: system.AddMarker(
            eii.MarkerBodyPosition(bodyNumber=body, localPosition=[*(turn @ (arms[point] + own - middle)), 0.0])
        )
        for point in link.points
    }
    parts = mass, inertia, arms, length / 2, own - middle
    return PlacedRigid(system, link.name, link.body, (node,), (body,), reference, ends, *parts)


def _with_burdens(scene: EngineScene, link: Link, mass: float, inertia: float, centre: Array) -> tuple[float, float, Array]:
    """Return mass, inertia and centre of mass of a link with added masses, by Steiner's theorem."""
    parts = [(mass, inertia, centre)]
    for at, more, turning in scene.source.burdens:
        body, point = place(at)
        if body == link.name:
            parts.append((more, turning, np.array(scene.mechanism.points[point])))
    if len(parts) == 1:
        return parts[0]
    total = sum(part[0] for part in parts)
    middle = sum((part[0] * part[2] for part in parts), np.zeros(2)) / total
    moment = sum(part[1] + part[0] * float((part[2] - middle) @ (part[2] - middle)) for part in parts)
    return total, moment, middle
