"""Rigid links in the engine, each one node (x, y, theta) at the centre of mass with added masses."""

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
    """A rigid link in the engine; its recorded mass, inertia and centre of mass are those without added masses."""

    mass: float  # [kg]
    inertia: float  # [kg m^2]
    # from the centre of mass to all points of the mechanism [m], as a point of another body may touch this link; in axes of the
    # ground at t = 0
    arms: dict[str, Array]
    to_centre: Array  # from the node to the centre of mass, likewise [m]

    def motion(self, states: EngineStates) -> RigidMotion:
        """Compute the motion of the centre of mass without added masses from the motion of the node."""
        (columns,) = self.columns()  # of the only node
        # at t = 0 all coordinates of the engine are 0, in the record only the angle
        q = states.q[:, columns] + self.reference[0] * (1.0, 1.0, 0.0)
        q_t, q_tt = states.q_t[:, columns], states.q_tt[:, columns]
        arm, spin, spin_t = rotate(q[:, 2], self.to_centre), q_t[:, 2:3], q_tt[:, 2:3]
        q = np.column_stack([q[:, :2] + arm, q[:, 2]])
        q_tt = np.column_stack([q_tt[:, :2] + spin_t * rotate_left(arm) - spin**2 * arm, q_tt[:, 2]])
        q_t = np.column_stack([q_t[:, :2] + spin * rotate_left(arm), q_t[:, 2]])
        return RigidMotion(self.mass, self.inertia, self.arms, q, q_t, q_tt)

    def add_burden(self, _point: str, _mass: float, _inertia: float, _gravity: Pair) -> None:
        """Do nothing: the link was built with all added masses."""

    def inverse_mass(self, point: str, along: Pair) -> float:
        """Compute the inverse of a point's effective mass [1/kg], 1/mass + (arm x along)^2/inertia; added masses lessen it."""
        (ax, ay), (ux, uy) = self.arms[point], along
        return 1 / self.mass + float(ax * uy - ay * ux) ** 2 / self.inertia

    def find_angle_node(self, point: str) -> tuple[int, Array]:
        """Return the only node of the link and its position at t = 0 [m]."""
        return self.nodes[0], self.reference[0, :2]


def add(scene: EngineScene, link: Link, velocity: Array) -> PlacedRigid:
    """Add a rigid link; `velocity` is (vx, vy, omega) of its start."""
    mechanism, system = scene.mechanism, scene.system
    start, end = (np.array(mechanism.points[p]) for p in (link.start, link.end))
    length = mechanism.length(link.name)
    (dx, dy), along = end - start, (end - start) / length
    direction = float(np.arctan2(dy, dx))
    mass, inertia, centre = link.body.mass_properties(length)
    own_centre = start + centre[0] * along + centre[1] * rotate_left(along)
    total, moment, common_centre = _with_burdens(scene, link, mass, inertia, own_centre)
    arm = common_centre - start
    rates = [*(velocity[:2] + velocity[2] * rotate_left(arm)), velocity[2]]
    reference = np.array([[*common_centre, direction]])
    node = system.AddNode(eii.NodeRigidBody2D(referenceCoordinates=[*reference[0]], initialVelocities=rates))
    body = system.AddObject(eii.ObjectRigidBody2D(mass=total, inertia=moment, nodeNumber=node))
    to_link = np.array([[np.cos(direction), np.sin(direction)], [-np.sin(direction), np.cos(direction)]])
    arms = {point: np.subtract(position, own_centre) for point, position in mechanism.points.items()}
    markers = {}
    for point in link.points:
        position = [*(to_link @ (arms[point] + own_centre - common_centre)), 0.0]  # from the node, in axes of the link
        markers[point] = system.AddMarker(eii.MarkerBodyPosition(bodyNumber=body, localPosition=position))
    return PlacedRigid(
        system, link.name, link.body, nodes=(node,), objects=(body,), reference=reference, markers=markers,
        scales=np.array([[1.0, 1.0, length / 2]]),  # a turn about the middle moves the ends by length/2
        mass=mass, inertia=inertia, arms=arms, to_centre=own_centre - common_centre,
    )  # fmt: skip


def _with_burdens(scene: EngineScene, link: Link, mass: float, inertia: float, centre: Array) -> tuple[float, float, Array]:
    """Compute mass, moment of inertia and centre of mass of a link with its added masses, by Steiner's theorem."""
    parts = [(mass, inertia, centre)]
    for at, added_mass, added_inertia in scene.source.burdens:
        body, point = place(at)  # splits a point reference
        if body == link.name:
            parts.append((added_mass, added_inertia, np.array(scene.mechanism.points[point])))
    if len(parts) == 1:
        return parts[0]
    total = sum(m for m, _, _ in parts)
    common = sum((m * c for m, _, c in parts), np.zeros(2)) / total
    return total, sum(i + m * float((c - common) @ (c - common)) for m, i, c in parts), common
