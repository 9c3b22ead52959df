"""Strips in the engine: geometrically exact beams, and cables of the absolute nodal coordinate formulation (ANCF).

Nodal coordinates are (x, y, theta) for beams, (x, y, dx/ds, dy/ds) for cables, with the arc length s.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, NamedTuple, cast

import exudyn.itemInterface as eii
import numpy as np

from ..elements import Link
from ..elements.beam import Flexible
from ..elements.element import Pair
from ..geometry import Array, rotate_left
from ..record.strips import BeamMotion, CableMotion
from . import System
from .placed import EngineBody, EngineStates
from .scene import EngineScene


@dataclass(frozen=True)
class PlacedStrip(EngineBody):
    """A strip in the engine; `reference` is (nodes, 3) for a beam and (nodes, 4) for a cable."""

    pieces: Array  # stress-free lengths of the elements [m]
    at: dict[str, int]  # index of each point in `nodes` and in the rows of `reference`
    anchors: dict[str, int] = field(default_factory=dict)  # further nodes (x, y, theta) of a cable, for joints that act on angles

    def motion(self, states: EngineStates) -> BeamMotion | CableMotion:
        """Return the motion of the strip from the engine's coordinates."""
        motion, (q, q_t, q_tt) = BeamMotion if self.body.has_angles else CableMotion, self.total(states)
        return motion(self.body, self.pieces, self.reference, self.at, q, q_t, q_tt)

    def find_angle_node(self, point: str) -> tuple[int, Array]:
        """Return the node (x, y, theta) at a point, and its place at t = 0 [m].

        A cable's nodes have slopes. There it is a node that turns with the slope, added at the first call.
        """
        node, _size, place = self.find_node(point)
        if self.body.has_angles:
            return node, place
        if point not in self.anchors:
            self.anchors[point] = _add_anchor(self.system, node, self.markers[point], self.reference[self.at[point]])
        return self.anchors[point], place

    def find_node(self, point: str) -> tuple[int, int, Array]:
        """Return the node at a point, its number of coordinates and its place at t = 0."""
        node = self.at[point]
        return self.nodes[node], self.reference.shape[1], self.reference[node, :2]

    def inverse_mass(self, point: str, _along: Pair) -> float:
        """Return 1/m [1/kg], with half the mass of the elements that meet at the point's node as its effective mass m."""
        arcs = np.cumsum(np.concatenate([[0.0], self.pieces]))  # of the ends of elements, where all points are
        k = self.at[point] // self.body.node_stride  # number of the end of an element
        length = arcs[min(k + 1, len(self.pieces))] - arcs[max(k - 1, 0)]
        return float(1 / (0.5 * self.body.section.mass_per_length * length))


def _add_anchor(system: System, node: int, marker: int, reference: Array) -> int:
    """Add a node (x, y, theta) without mass at a node of a cable, joined by a pin and (cos theta, sin theta) x r' = 0.

    r' = (dx/ds, dy/ds) is the slope of the cable; q = (x, y, dx/ds, dy/ds, x, y, theta) are the coordinates of both nodes.
    """
    vx, vy, slope_vx, slope_vy = system.GetNode(node)["initialVelocities"]
    tx, ty = reference[2:]
    start = [*reference[:2], float(np.arctan2(ty, tx))]
    velocity = [vx, vy, tx * slope_vy - ty * slope_vx]  # |r'| = 1 in the reference configuration
    anchor = system.AddNode(eii.NodeRigidBody2D(referenceCoordinates=start, initialVelocities=velocity))
    system.AddObject(
        eii.ObjectJointRevolute2D(markerNumbers=[marker, system.AddMarker(eii.MarkerNodePosition(nodeNumber=anchor))])
    )

    def gradient(q: Array) -> Array:
        """Compute the derivative of the residual, (1, 7); q are total coordinates, which include those at t = 0."""
        slope_x, slope_y, theta = q[2], q[3], q[6]
        c, s = np.cos(theta), np.sin(theta)
        return np.array([[0.0, 0.0, -s, c, 0.0, 0.0, -(c * slope_x + s * slope_y)]])

    def residual(_system: System, _time: float, _item: int, q: Array, q_t: Array, velocity_level: bool) -> list[float]:
        """Return the residual, or its rate where the engine solves for velocities."""
        if velocity_level:
            return [float((gradient(q) @ np.array(q_t))[0])]
        slope_x, slope_y, theta = q[2], q[3], q[6]
        return [np.cos(theta) * slope_y - np.sin(theta) * slope_x]

    system.AddObject(eii.ObjectConnectorCoordinateVector(
        markerNumbers=[system.AddMarker(eii.MarkerNodeCoordinates(nodeNumber=number)) for number in (node, anchor)],
        scalingMarker0=np.zeros((1, 7)),  # of it the engine reads the number of equations alone
        constraintUserFunction=residual,
        jacobianUserFunction=lambda _system, _time, _item, q, _q_t, _velocity_level: gradient(q),
    ))  # fmt: skip
    return int(anchor)


class Mesh(NamedTuple):
    """Nodes of a stress-free strip in axes of its chord: places (nodes, 2) [m] and directions of the tangent (nodes,) [rad].

    `pieces` are the lengths of the elements [m], `at` maps points to nodes.
    """

    places: Array
    directions: Array
    pieces: Array
    at: dict[str, int]


def mesh(link: Link, chord: float) -> Mesh:
    """Divide a strip into elements with a node at each of its points."""
    body = cast(Flexible, link.body)
    step = body.node_stride  # from the first to the last node of an element
    inner = sorted((fraction, point) for point, fraction in cast(Mapping[str, float], link.carries).items())
    cuts = [0.0, *(fraction for fraction, _ in inner), 1.0]  # points, as fractions of the length
    counts = _distribute(np.diff(cuts), body.count)  # numbers of elements
    edges = _subdivide(cuts, counts)  # ends of elements, as fractions of the length
    stations = _subdivide(edges, [step] * len(edges[1:]))  # all nodes
    curve = body.curve(chord)
    places, directions, pieces = curve.places(stations), curve.direction(stations), curve.length * np.diff(edges)
    nodes = np.concatenate([[0], step * np.cumsum(counts)])  # numbers of the nodes at points
    if body.has_angles:  # a beam, whose strains must vanish in the reference; those of a cable are relative to the reference
        given = places[:, 0] + 1j * places[:, 1]  # places as complex numbers
        fixed = [0j, *(complex(*body.place_at(chord, fraction)) for fraction, _ in inner), complex(chord)]
        for (a, b), (start, end) in zip(pairwise(nodes), pairwise(fixed), strict=True):
            part = slice(a // step, b // step)  # elements between two points
            built = _remove_strain(given[a : b + 1], pieces[part])
            factor = (end - start) / built[-1]  # rotates and scales
            moved = start + built * factor
            places[a : b + 1] = np.column_stack([moved.real, moved.imag])
            pieces[part] *= abs(factor)
        if step == 2:  # then the curvature is constant in an element
            directions[1::2] = (directions[:-2:2] + directions[2::2]) / 2
    at = {link.start: 0, link.end: len(stations) - 1}
    return Mesh(places, directions, pieces, at | {point: int(node) for (_, point), node in zip(inner, nodes[1:-1], strict=True)})


def _subdivide(places: Array | list[float], counts: list[int]) -> Array:
    """Divide each interval between neighbouring places into a number of equal parts; return the ends of all parts."""
    parts = [np.linspace(a, b, n + 1)[1:] for (a, b), n in zip(pairwise(places), counts, strict=True)]
    return np.concatenate([places[:1], *parts])


def _distribute(parts: Array, count: int) -> list[int]:
    """Distribute `count` elements over parts of a strip by their lengths; more in sum if each part's one at least exceeds it."""
    numbers = np.maximum(1, np.floor(parts * count + 1e-9)).astype(int)  # 1e-9: rounding must not lose an element
    while numbers.sum() < count:
        numbers[np.argmax(parts / numbers)] += 1
    return [int(n) for n in numbers]


def _remove_strain(places: Array, lengths: Array) -> Array:
    """Return complex places of a beam's nodes, from 0, without strain at the integration points, near given places.

    Elements have the `lengths`. The derivative of the place by arc length must have the length 1 at the integration points. So
    the length of an element with 2 nodes is its chord c. With 3 nodes, at xi = -1, 0, 1, let d be the distance of the middle node
    from mid-chord. The derivative by xi is then c/2 along the chord and -2 xi d normal to it. At xi = 1/sqrt(3) this is half of
    sqrt(c^2 + 16/3 d^2), which is the length of the element. Directions of nodes do not matter: in the reference the engine's
    beams have no shear strain.
    """
    step = (len(places) - 1) // len(lengths)  # number of nodes of an element, less 1
    ends = places[::step]
    chords = np.diff(ends)
    directions = chords / np.abs(chords)
    if step == 1:
        return np.concatenate([[0.0], np.cumsum(directions * lengths)])
    sag = ((places[1::2] - (ends[:-1] + ends[1:]) / 2) / chords).imag  # d/c, positive to the left of the chord
    chords = directions * lengths / np.sqrt(1 + 16 / 3 * sag**2)
    built = np.zeros(len(places), dtype=complex)
    built[2::2] = np.cumsum(chords)
    built[1::2] = (built[:-2:2] + built[2::2]) / 2 + 1j * sag * chords
    return built


def add(scene: EngineScene, link: Link, velocity: Array) -> PlacedStrip:
    """Add a beam or cable; `velocity` is (vx, vy, omega) of its start."""
    mechanism, system, body = scene.mechanism, scene.system, cast(Flexible, link.body)
    start, end = (np.array(mechanism.points[p]) for p in (link.start, link.end))
    chord = mechanism.length(link.name)
    along = (end - start) / chord
    grid = mesh(link, chord)
    x, y = grid.places.T
    places = start + np.outer(x, along) + np.outer(y, rotate_left(along))
    directions = grid.directions + np.arctan2(along[1], along[0])
    speeds = np.column_stack([velocity[:2] + velocity[2] * rotate_left(places - start), np.full(len(x), velocity[2])])
    # velocities of bending at t = 0 [m/s, rad/s], interpolated over x, or its largest value so far if the strip doubles back
    chordwise = np.maximum.accumulate(x)
    speeds += scene.source.start.interpolate(link, {point: chordwise[node] for point, node in grid.at.items()}, chordwise)
    if body.has_angles:
        node_type, reference, rates = eii.NodeRigidBody2D, np.column_stack([places, directions]), speeds
    else:
        tangents = np.column_stack([np.cos(directions), np.sin(directions)])
        slope_rates = speeds[:, 2:] * np.column_stack([-tangents[:, 1], tangents[:, 0]])
        node_type = eii.NodePoint2DSlope1
        reference, rates = np.column_stack([places, tangents]), np.column_stack([speeds[:, :2], slope_rates])
    states = zip(reference, rates, strict=True)
    nodes = [system.AddNode(node_type(referenceCoordinates=[*row], initialVelocities=[*rate])) for row, rate in states]
    objects = []
    for e, length in enumerate(grid.pieces):
        part = slice(e * body.node_stride, (e + 1) * body.node_stride + 1)  # nodes of the element
        objects.append(system.AddObject(_make_element(body, nodes[part], directions[part], length)))
    markers = {point: system.AddMarker(eii.MarkerNodePosition(nodeNumber=nodes[node])) for point, node in grid.at.items()}
    scales = np.zeros_like(reference)
    scales[:, :2] = 1.0  # not of angles and slopes: steps are judged by the error of the nodes' places
    return PlacedStrip(
        system, link.name, body, nodes=tuple(nodes), objects=tuple(objects), reference=reference, markers=markers, scales=scales,
        pieces=grid.pieces, at=grid.at,
    )  # fmt: skip


def _make_element(body: Flexible, nodes: list[int], directions: Array, length: float) -> Any:
    """Make the engine's element of a strip from its nodes, and the directions of the tangent there [rad]."""
    section = body.section
    common = {
        "nodeNumbers": nodes, "length": length, "massPerLength": section.mass_per_length,
        "bendingStiffness": section.bending_stiffness, "axialStiffness": section.axial_stiffness,
        "bendingDamping": section.bending_stiffness * section.material.bending_damping,
        "axialDamping": section.axial_stiffness * section.material.axial_damping,
    }  # fmt: skip
    if body.has_angles:
        curvature = (directions[-1] - directions[0]) / length  # of the reference, which is not stress-free without it
        inertia, shear = section.inertia_per_length, section.shear_stiffness
        return eii.ObjectBeamGeometricallyExact2D(
            crossSectionInertia=inertia, shearStiffness=shear, referenceCurvature=curvature, **common
        )
    # reduced integration: without it, thin strips of few elements lock; 2 means that of the axial strain at 3 Lobatto points and
    # of the bending strain at 2 Gauss points, as in `CableMotion.strains`
    return eii.ObjectANCFCable2D(strainIsRelativeToReference=1.0, useReducedOrderIntegration=2, **common)
