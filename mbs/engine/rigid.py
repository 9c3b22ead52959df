"""Rigid links in the engine."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import exudyn.itemInterface as eii
import numpy as np

from buckler.mbs.elements.element import Array
from buckler.mbs.elements.link import Link
from buckler.mbs.engine.placed import Placed, States
from buckler.mbs.record.motion import RigidMotion


@dataclass(frozen=True)
class PlacedRigid(Placed):
    """A rigid link; its coordinates are the place of its centre of mass and its direction."""

    mass: float
    inertia: float
    arms: dict[str, Array]
    radius: float

    def motion(self, system: Any, states: States) -> RigidMotion:
        """Of its centre of mass."""
        columns = self.columns(system)[0]
        place = states.q[:, columns] + np.array([*self.reference[0, :2], 0.0])
        return RigidMotion(self.mass, self.inertia, self.arms, place, states.q_t[:, columns], states.q_tt[:, columns])

    def weights(self, system: Any) -> Array:
        """Of places 1, of the turn half the link's length."""
        return np.array([[1.0, 1.0, self.radius]])

    def rigid_marker(self, scene: Any, point: str) -> int:
        """On the body, at any point of the mechanism as it lies at t = 0."""
        c, s = np.cos(self.direction(point)), np.sin(self.direction(point))
        local = np.array([[c, s], [-s, c]]) @ self.arms[point]
        return int(scene.system.AddMarker(eii.MarkerBodyRigid(bodyNumber=self.objects[0], localPosition=[*local, 0.0])))

    def direction(self, _point: str) -> float:
        """Of the link."""
        return float(self.reference[0, 2])

    def mobility(self, point: str, along: Any) -> float:
        """Of its mass and inertia."""
        (ax, ay), (ux, uy) = self.arms[point], along
        return 1 / self.mass + float(ax * uy - ay * ux) ** 2 / self.inertia

    def contact_node(self, scene: Any, point: str) -> tuple[int, Array]:
        """Its one node."""
        return self.nodes[0], self.reference[0, :2]


def add(scene: Any, link: Link, velocity: Array) -> PlacedRigid:
    """Add a rigid link; `velocity` is that of its start, (vx, vy, omega)."""
    mechanism, system = scene.mechanism, scene.system
    start, end = (np.array(mechanism.points[p]) for p in (link.start, link.end))
    length = mechanism.length(link.name)
    direction = float(np.arctan2(*(end - start)[::-1]))
    mass, inertia, centre = link.body.inertia(length)
    along = (end - start) / length
    arm = centre[0] * along + centre[1] * np.array([-along[1], along[0]])
    rates = [velocity[0] - velocity[2] * arm[1], velocity[1] + velocity[2] * arm[0], velocity[2]]
    reference = np.array([[*(start + arm), direction]])
    node = system.AddNode(eii.NodeRigidBody2D(referenceCoordinates=[*reference[0]], initialVelocities=rates))
    body = system.AddObject(eii.ObjectRigidBody2D(mass=mass, inertia=inertia, nodeNumber=node))
    turn = np.array([[np.cos(direction), np.sin(direction)], [-np.sin(direction), np.cos(direction)]])
    arms = {point: np.subtract(place, start + arm) for point, place in mechanism.points.items()}
    ends = {
        point: system.AddMarker(eii.MarkerBodyPosition(bodyNumber=body, localPosition=[*(turn @ arms[point]), 0.0]))
        for point in link.points
    }
    return PlacedRigid(link.name, link.body, (node,), (body,), reference, ends, mass, inertia, arms, length / 2)
