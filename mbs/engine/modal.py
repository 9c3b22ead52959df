"""Modal links in the engine: a native body with a floating frame of reference, constrained to the plane.

The engine gets no mesh, but inertia integrals and, at each joint, a virtual mesh point that moves with the joint's section. So
forces and energies are exactly those of `PlanarModel`, and the cost of a step does not depend on the mesh.
"""

from dataclasses import dataclass, field
from typing import Any, cast

import exudyn as exu
import exudyn.itemInterface as eii
import numpy as np

from ..elements import Link, Modal
from ..elements.element import Pair
from ..geometry import Array, rotate_left
from ..modal.planar import STATIONS, ModalHistory, PlanarModel
from . import System
from .placed import EngineBody, EngineStates
from .scene import EngineScene

ENDS = STATIONS[:2]
"""Stations of the two joints, 'start' and 'end', each with a virtual mesh point."""
IN_PLANE = (0, 1, 5)
"""Planar coordinates x, y, theta among those of the engine's frame node: x, y, z and three Tait-Bryan angles."""


@dataclass(frozen=True)
class PlacedModal(EngineBody):
    """A modal link in the engine, with coordinates x, y, theta of the frame at the centre of mass, then those of m modes.

    Arrays of an `EngineBody` treat it as one node with 3 + m coordinates.
    """

    model: PlanarModel
    velocity: Array  # (vx, vy, omega) of the frame at t = 0
    stations: dict[str, str]  # 'start' or 'end' for each point
    places: dict[str, Array]  # positions of the points at t = 0 [m]
    anchors: dict[str, int] = field(default_factory=dict)  # nodes (x, y, theta) at points, for joints that act on nodes

    def columns(self) -> Array:
        """Return the indices of the coordinates in the engine's vector, shape (1, 3 + m)."""
        frame = self.system.GetNodeODE2Index(self.nodes[0])
        modal = self.system.GetNodeODE2Index(self.nodes[1]) + np.arange(len(self.model))
        return np.concatenate([frame + np.array(IN_PLANE), modal])[None]

    def motion(self, states: EngineStates) -> ModalHistory:
        """Return the motion of the link from the engine's coordinates."""
        q, q_t, q_tt = (values[:, 0] for values in self.total(states))
        return ModalHistory(self.model, q, q_t, q_tt, self.stations, float(self.reference[0, 2]))

    def inverse_mass(self, point: str, _along: Pair) -> float:
        """Return an upper bound [1/kg] of the inverse of the effective mass of a point in any direction; modal masses are 1."""
        station = self.stations[point]
        arm, shape = self.model.place(station), self.model.shapes[STATIONS.index(station)]
        return float(1 / self.model.mass + arm @ arm / self.model.inertia + (shape[:2] ** 2).sum())

    def find_angle_node(self, point: str) -> tuple[int, Array]:
        """Return a node without mass that moves with the end's cross-section, and the position of the point at t = 0 [m]."""
        if point not in self.anchors:
            self.anchors[point] = _add_anchor(self, point)
        return self.anchors[point], self.places[point]


def add(scene: EngineScene, link: Link, rates: Array) -> PlacedModal:
    """Add a modal link, initially undeformed in rigid motion; `rates` is the velocity (vx, vy, omega) of its start."""
    mechanism, system = scene.mechanism, scene.system
    model = cast(Modal, link.body).planar(mechanism.length(link.name))
    if not len(model):  # the solver `Spectral` takes such a link, as rigid in the plane
        raise ValueError(f"links.{link.name}: modes: none moves in the plane; use Rigid, or Spectral()")
    start, end = (np.array(mechanism.points[p]) for p in (link.start, link.end))
    along = (end - start) / mechanism.length(link.name)
    arm = model.centre[0] * along + model.centre[1] * rotate_left(along)
    reference = np.array([*(start + arm), np.arctan2(along[1], along[0]), *np.zeros(len(model))])
    velocity = np.array([*(rates[:2] + rates[2] * rotate_left(arm)), rates[2]])
    nodes, body = _add_flexible(system, model, reference, velocity)
    stations = {link.start: "start", link.end: "end"}
    markers = {}
    for point, station in stations.items():
        item = eii.MarkerSuperElementPosition(bodyNumber=body, meshNodeNumbers=[ENDS.index(station)], weightingFactors=[1.0])
        markers[point] = int(system.AddMarker(item))
    sizes = np.linalg.norm(model.line_shapes, axis=1).max(axis=0, initial=0.0)  # of the modes, (m,)
    scales = np.array([1.0, 1.0, model.length / 2, *sizes])  # how far points move per unit of each coordinate [m]
    return PlacedModal(
        system, link.name, link.body, nodes, objects=(body,), reference=reference[None], markers=markers, scales=scales[None],
        model=model, velocity=velocity, stations=stations, places={link.start: start, link.end: end},
    )  # fmt: skip


def _add_anchor(placed: PlacedModal, point: str) -> int:
    """Add a node (x, y, theta) without mass that moves with an end's cross-section, for joints that act on nodes.

    A pin constrains the node's position. A linear constraint sets the node's angle to that of the frame + sum psi_k q_k, where
    psi_k is the rotation of the section in mode k.
    """
    system = placed.system
    rates = np.concatenate([placed.velocity, np.zeros(len(placed.model))])[None]  # at t = 0 the modes are at rest
    start = placed.model.motion(placed.stations[point], placed.reference, rates, np.zeros_like(rates))
    place, velocity = [*start.position[0], *start.angle], [*start.velocity[0], *start.spin]
    node = system.AddNode(eii.NodeRigidBody2D(referenceCoordinates=place, initialVelocities=velocity))
    pin = system.AddMarker(eii.MarkerNodePosition(nodeNumber=node))
    system.AddObject(eii.ObjectJointRevolute2D(markerNumbers=[placed.markers[point], pin]))
    rotations = placed.model.shapes[STATIONS.index(placed.stations[point]), 2]
    section_angle = [0.0, 0.0, 0.0, 0.0, 0.0, 1.0, *rotations]  # factors of the frame's six coordinates, then of the modal ones
    body = system.AddMarker(eii.MarkerObjectODE2Coordinates(objectNumber=placed.objects[0]))
    anchor = system.AddMarker(eii.MarkerNodeCoordinates(nodeNumber=node))
    system.AddObject(eii.ObjectConnectorCoordinateVector(
        markerNumbers=[body, anchor], scalingMarker0=np.array([section_angle]), scalingMarker1=np.array([[0.0, 0.0, 1.0]])
    ))  # fmt: skip
    return int(node)


def _add_flexible(system: System, model: PlanarModel, place: Array, velocity: Array) -> tuple[tuple[int, ...], int]:
    """Add a body with a floating frame and modes; constrain its three motions out of the plane."""
    reference, rates = ([*xy_theta[:2], 0.0, 0.0, 0.0, xy_theta[2]] for xy_theta in (place, velocity))
    frame = system.AddNode(eii.NodeRigidBodyRxyz(referenceCoordinates=reference, initialVelocities=rates))
    zeros, m = np.zeros(len(model)), len(model)
    modal = system.AddNode(eii.NodeGenericODE2(
        referenceCoordinates=zeros, initialCoordinates=zeros, initialCoordinates_t=zeros, numberOfODE2Coordinates=m
    ))  # fmt: skip
    body = system.AddObject(eii.ObjectFFRFreducedOrder(nodeNumbers=[frame, modal], **_integrals(model), **_virtual_points(model)))
    ground = system.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=system.AddNode(eii.NodePointGround()), coordinate=0))
    for coordinate in (k for k in range(6) if k not in IN_PLANE):
        marker = system.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=frame, coordinate=coordinate))
        system.AddObject(eii.ObjectConnectorCoordinate(markerNumbers=[ground, marker]))
    return (frame, modal), body


def _integrals(model: PlanarModel) -> dict[str, Any]:
    """Return the engine's inertia integrals with in-plane parts only, so that the link stays in the plane.

    The engine writes the modes phi_k as Psi and the matrix S(a), with S(a) b = a x b, as Tilde. For vectors in the plane
    S(a)^T b = -(a x b) is along z, and the zz component of S(a)^T S(b) is a . b; other components are left out. X is the place
    in the undeformed link. `PlanarModel` has the integrals over the mass: `gyration` of phi_i x phi_j, `gram` of phi_i . phi_j
    and `radial` of X . phi_i.
    """
    m, about_z = len(model), np.diag([0.0, 0.0, 1.0])
    container: Any = exu.MatrixContainer  # its stubs lack the argument
    return {
        "massMatrixReduced": container(np.eye(m)),
        "stiffnessMatrixReduced": container(np.diag(model.stiffness)),
        "dampingMatrixReduced": container(np.diag(2 * model.damping * model.frequency)),  # ratios, rad/s
        "mass": model.mass,
        "inertia": model.inertia * np.eye(3),  # the engine does not use it about x and y
        "centerOfMass": [0.0, 0.0, 0.0],
        "mPsiTildePsi": np.kron(-model.gyration, [[0.0], [0.0], [1.0]]),  # S(phi_i)^T phi_j
        "mPsiTildePsiTilde": np.kron(model.gram, about_z),  # S(phi_i)^T S(phi_j)
        # of phi_k and of X x phi_k, Phit being translations: modes are orthogonal to rigid motions
        "mPhitTPsi": np.zeros((3, m)),
        "mPhitTPsiTilde": np.zeros((3, 3 * m)),
        "mXRefTildePsi": np.zeros((3, m)),
        "mXRefTildePsiTilde": np.kron(model.radial, about_z),  # S(X)^T S(phi_i)
    }


def _virtual_points(model: PlanarModel) -> dict[str, Any]:
    """Return the virtual points at both joints, and their displacements in each mode, in the engine's format."""
    places = np.array([[*model.place(station), 0.0] for station in ENDS])
    displacements = model.shapes[: len(ENDS)] * [[1.0], [1.0], [0.0]]  # (points, 3, m); the third row has rotations, not z
    return {
        "referencePositions": places.ravel(),
        "modeBasis": displacements.reshape(-1, len(model)),
        "outputVariableModeBasis": [],
        "outputVariableTypeModeBasis": 0,
    }
