"""Links become Exudyn nodes and objects; each remembers where its coordinates lie.

Also the only place that knows the elements' nodal layout: (x, y, theta) for rigid links and geometrically exact beams,
(x, y, dx/ds, dy/ds) for ANCF cables.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import exudyn as exu
import exudyn.itemInterface as eii
import numpy as np

from buckler.mbs.elements.section import Section
from buckler.mbs.mechanism import Beam, Cable, Guide, Link, Mechanism, Rigid, Strut
from buckler.mbs.modal.spec import Modal

Array = np.ndarray[Any, Any]


@dataclass(frozen=True)
class Placed:
    """A link or slider in the engine: its nodes, its reference coordinates and, once assembled, their places.

    Attributes
    ----------
    nodes : tuple of int
        Engine node numbers.
    objects : tuple of int
        Engine object numbers.
    reference : array, shape (nodes, coordinates a node)
        Coordinates of the undeformed link.
    length : float
        Stress-free length of a flexible link, m: all its elements are equally long.
    ends : dict of str to int
        Position marker of each point.
    """

    name: str
    body: Any
    nodes: tuple[int, ...]
    objects: tuple[int, ...]
    reference: Array
    ends: dict[str, int]
    origin: tuple[float, float] = (0.0, 0.0)
    along: tuple[float, float] = (1.0, 0.0)
    length: float = 0.0

    def columns(self, system: Any) -> Array:
        """Places of the coordinates in the engine's vector, shape as `reference`."""
        first = [system.GetNodeODE2Index(node) for node in self.nodes]
        return np.add.outer(np.array(first), np.arange(self.reference.shape[1]))


def arc(length: float, bow: float, stations: Array) -> tuple[Array, Array, Array, float]:
    """Stress-free half-sine bow of a strip with the given chord: positions and directions at stations in [0, 1].

    The direction is theta = A cos(pi s/l) along the arc, so |r'| = 1 exactly; bow = A l/pi at mid-span to order A^2.

    Returns
    -------
    x, y, theta : arrays, shape (stations,)
        Relative to the chord, m and rad.
    arc_length : float
        l, m.
    """
    amplitude = np.pi * bow / length
    nodes, weights = np.polynomial.legendre.leggauss(12)
    half = np.diff(stations)[:, None] / 2
    s = (stations[:-1, None] + half) + half * nodes
    theta = amplitude * np.cos(np.pi * s)
    x = np.concatenate([[0.0], np.cumsum((np.cos(theta) * weights * half).sum(axis=1))])
    y = np.concatenate([[0.0], np.cumsum((np.sin(theta) * weights * half).sum(axis=1))])
    arc_length = length / x[-1]
    return x * arc_length, y * arc_length, amplitude * np.cos(np.pi * stations), float(arc_length)


def _stress_free(beam: Beam, chord: float, x: Array, y: Array, theta: Array) -> tuple[Array, Array, Array, float]:
    """Move a beam's nodes so that no element, all equally long, has a strain at its integration points.

    The interpolated slope has length 1 there if the element is as long as its chord c (2 nodes), or sqrt(c^2 + 16/3 d^2)
    with its middle node d above mid-chord (3 nodes); the curvature is constant if the middle direction is the mean one.
    """
    place, step = x + 1j * y, beam.nodes - 1
    ends = place[::step]
    sag = np.zeros(beam.elements)
    if step == 2:
        theta = theta.copy()
        theta[1::2] = (theta[:-2:2] + theta[2::2]) / 2
        sag = ((place[1::2] - (ends[:-1] + ends[1:]) / 2) / np.diff(ends)).imag  # d/c
    chords = np.diff(ends) / np.abs(np.diff(ends)) / np.sqrt(1 + 16 / 3 * sag**2)
    ends = np.concatenate([[0.0], np.cumsum(chords)])
    place = np.zeros(len(x), dtype=complex)
    place[::step] = ends
    if step == 2:
        place[1::2] = (ends[:-1] + ends[1:]) / 2 + 1j * sag * chords
    scale = chord / float(ends[-1].real)
    return place.real * scale, place.imag * scale, theta, beam.elements * scale


def add_link(system: Any, mechanism: Mechanism, link: Link, rates: Array) -> Placed | None:
    """Add one link; a `Strut` has no body of its own and gives None.

    Parameters
    ----------
    rates : array, shape (3,)
        Initial velocity (vx, vy, omega) of the link's start.
    """
    match link.body:
        case Strut():
            return None
        case Rigid():
            return _add_rigid(system, mechanism, link, rates)
        case Beam() | Cable() as body:
            return _add_flexible(system, mechanism, link, body, rates)
        case Modal():
            from buckler.mbs.engine.modal import add_modal  # it is built on this module, and brings the sparse solvers

            return add_modal(system, mechanism, link, rates)


def _add_rigid(system: Any, mechanism: Mechanism, link: Link, rates: Array) -> Placed:
    start, end = (np.array(mechanism.points[p]) for p in (link.start, link.end))
    centre, length = (start + end) / 2, mechanism.length(link.name)
    direction = np.arctan2(*(end - start)[::-1])
    arm = centre - start
    velocity = [rates[0] - rates[2] * arm[1], rates[1] + rates[2] * arm[0], rates[2]]
    reference = np.array([[*centre, direction]])
    node = system.AddNode(eii.NodeRigidBody2D(referenceCoordinates=[*reference[0]], initialVelocities=velocity))
    section = link.body.section
    mass = section.mass_per_length * length
    inertia = mass * (length**2 + section.thickness**2) / 12
    body = system.AddObject(eii.ObjectRigidBody2D(mass=mass, inertia=inertia, nodeNumber=node))
    turn = np.array([[np.cos(direction), np.sin(direction)], [-np.sin(direction), np.cos(direction)]])
    ends = {}
    for point in link.points:
        local = turn @ (np.array(mechanism.points[point]) - centre)
        ends[point] = system.AddMarker(eii.MarkerBodyPosition(bodyNumber=body, localPosition=[*local, 0.0]))
    return Placed(link.name, link.body, (node,), (body,), reference, ends)


def _add_flexible(system: Any, mechanism: Mechanism, link: Link, body: Beam | Cable, rates: Array) -> Placed:
    start, end = (np.array(mechanism.points[p]) for p in (link.start, link.end))
    along = (end - start) / mechanism.length(link.name)
    count = body.elements * (body.nodes - 1 if isinstance(body, Beam) else 1) + 1
    x, y, theta, arc_length = arc(mechanism.length(link.name), body.imperfection, np.linspace(0.0, 1.0, count))
    if isinstance(body, Beam):
        x, y, theta, arc_length = _stress_free(body, mechanism.length(link.name), x, y, theta)
    across = np.array([-along[1], along[0]])
    places = start + np.outer(x, along) + np.outer(y, across)
    directions = theta + np.arctan2(along[1], along[0])
    arms = places - start
    speeds = rates[:2] + rates[2] * np.column_stack([-arms[:, 1], arms[:, 0]])
    layout = (places, directions, speeds, float(rates[2]), arc_length / body.elements)
    if isinstance(body, Beam):
        nodes, objects, reference = _add_beam(system, body, *layout)
    else:
        nodes, objects, reference = _add_cable(system, body, *layout)
    ends = {
        point: system.AddMarker(eii.MarkerNodePosition(nodeNumber=node))
        for point, node in ((link.start, nodes[0]), (link.end, nodes[-1]))
    }
    return Placed(link.name, body, tuple(nodes), tuple(objects), reference, ends, length=arc_length)


def _add_beam(
    system: Any, body: Beam, places: Array, directions: Array, speeds: Array, turning: float, length: float
) -> tuple[list[int], list[int], Array]:
    section = body.section
    reference = np.column_stack([places, directions])
    nodes = [
        system.AddNode(eii.NodeRigidBody2D(referenceCoordinates=[*row], initialVelocities=[*v, turning]))
        for row, v in zip(reference, speeds, strict=True)
    ]
    step = body.nodes - 1
    objects = []
    for e in range(body.elements):
        ends = slice(e * step, e * step + body.nodes)
        curvature = (directions[ends][-1] - directions[ends][0]) / length
        objects.append(
            system.AddObject(
                eii.ObjectBeamGeometricallyExact2D(
                    nodeNumbers=nodes[ends],
                    length=length,
                    massPerLength=section.mass_per_length,
                    crossSectionInertia=section.inertia_per_length,
                    shearStiffness=section.shear_stiffness,
                    referenceCurvature=curvature,  # a bowed reference alone is not stress-free
                    **_stiffness(section),
                )
            )
        )
    return nodes, objects, reference


def _add_cable(
    system: Any, body: Cable, places: Array, directions: Array, speeds: Array, turning: float, length: float
) -> tuple[list[int], list[int], Array]:
    tangents = np.column_stack([np.cos(directions), np.sin(directions)])
    reference = np.column_stack([places, tangents])
    spins = turning * np.column_stack([-tangents[:, 1], tangents[:, 0]])
    nodes = [
        system.AddNode(eii.NodePoint2DSlope1(referenceCoordinates=[*row], initialVelocities=[*v, *w]))
        for row, v, w in zip(reference, speeds, spins, strict=True)
    ]
    objects = [
        system.AddObject(
            eii.ObjectANCFCable2D(
                nodeNumbers=nodes[e : e + 2],
                length=length,
                massPerLength=body.section.mass_per_length,
                strainIsRelativeToReference=1.0,
                useReducedOrderIntegration=2,  # the only choice that does not lock when thin and coarse
                **_stiffness(body.section),
            )
        )
        for e in range(body.elements)
    ]
    return nodes, objects, reference


def _stiffness(section: Section) -> dict[str, float]:
    return {
        "bendingStiffness": section.bending_stiffness,
        "axialStiffness": section.axial_stiffness,
        "bendingDamping": section.bending_stiffness * section.material.bending_damping,
        "axialDamping": section.axial_stiffness * section.material.axial_damping,
    }


def add_slider(system: Any, mechanism: Mechanism, guide: Guide, speed: float) -> Placed:
    """Add a slider block: one coordinate, its travel along the guide since t = 0, whatever the guide's direction."""
    x, y = mechanism.points[guide.point]
    ax, ay = guide.along
    node = system.AddNode(eii.Node1D(referenceCoordinates=[0.0], initialVelocities=[speed]))
    body = system.AddObject(
        eii.ObjectMass1D(
            mass=guide.mass,
            nodeNumber=node,
            referencePosition=[x, y, 0.0],
            referenceRotation=np.array([[ax, -ay, 0.0], [ay, ax, 0.0], [0.0, 0.0, 1.0]]),
        )
    )
    ends = {guide.point: system.AddMarker(eii.MarkerBodyPosition(bodyNumber=body, localPosition=[0.0, 0.0, 0.0]))}
    return Placed(guide.point, guide, (node,), (body,), np.zeros((1, 1)), ends, (x, y), guide.along)


def engine_version() -> str:
    """Version of the engine."""
    return str(exu.__version__)
