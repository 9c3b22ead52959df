"""From a `Mechanism` to an assembled Exudyn system: only what the mechanism names is built."""

from __future__ import annotations

import os
from collections import Counter
from dataclasses import dataclass, field
from typing import Any

import numpy as np

os.environ.setdefault("EXUDYN_NO_USER_SETTINGS", "1")
import exudyn as exu
import exudyn.itemInterface as eii

from buckler.mbs.elements.journal import End
from buckler.mbs.engine.bodies import Placed, add_link, add_slider
from buckler.mbs.engine.joints import (
    ClearanceGroup,
    StopContact,
    StrutSpring,
    add_clearances,
    add_drive,
    add_friction,
    add_stop,
    add_strut,
    contact_of,
)
from buckler.mbs.engine.modal import PlacedModal, add_anchor
from buckler.mbs.kinematics.closure import Closure
from buckler.mbs.mechanism import GROUND, Beam, Clearance, Link, Mechanism, Rigid, Strut

exu.config.printToConsole = False

Array = np.ndarray[Any, Any]
FLYWHEEL = 1e12
"""Moment of inertia, kg m^2, of a link turned at constant speed in a scene without constraints."""
STIFF = 1e5
"""Decay rate of contact damping, 1/s, from which the implicit integrator is the faster one."""
SPARSE_FROM = 40
"""Coordinates from which the engine's sparse solver is the faster one."""


@dataclass
class Scene:
    """An assembled system with the places of its parts.

    Attributes
    ----------
    system : exudyn.MainSystem
    placed : dict of str to Placed
        Links (not struts) by name and slider blocks by point.
    stops : dict of str to StopContact
        By guided point; a second stop of a point is `<point>.2`.
    struts : dict of str to StrutSpring
        By link.
    clearances : list of ClearanceGroup
        Joints with play, grouped by their laws.
    constraints : dict of str to int
        Engine object numbers: `joint <point>.<first>-<second>`, `guide <point>`, `drive`.
    """

    mechanism: Mechanism
    system: Any
    container: Any
    placed: dict[str, Placed] = field(default_factory=dict)
    stops: dict[str, StopContact] = field(default_factory=dict)
    struts: dict[str, StrutSpring] = field(default_factory=dict)
    clearances: list[ClearanceGroup] = field(default_factory=list)
    constraints: dict[str, int] = field(default_factory=dict)
    parts: Counter[str] = field(default_factory=Counter)

    def summary(self) -> dict[str, int]:
        """What was built, part by part, and how many coordinates, constraints and engine items it has."""
        data = self.system.systemData
        return {
            **self.parts,
            "coordinates": data.ODE2Size(),
            "constraints": data.AEsize(),
            "objects": data.NumberOfObjects(),
            "nodes": data.NumberOfNodes(),
            "loads": data.NumberOfLoads(),
            "sensors": data.NumberOfSensors(),
        }

    @property
    def loose(self) -> bool:
        """True if rigid links hang together by joints with play only: no constraints, so an explicit integrator can run it."""
        return is_loose(self.mechanism)

    def arc_length(self, link: str) -> float:
        """Stress-free length of a link along its arc, m: its chord, or a little more where it is bowed."""
        return self.placed[link].length or self.mechanism.length(link)

    def multipliers(self, name: str) -> Array:
        """Places of a constraint's Lagrange multipliers in the engine's vector."""
        return np.array(self.system.systemData.GetObjectLTGAE(self.constraints[name]))


def build(mechanism: Mechanism) -> Scene:
    """Assemble a mechanism.

    Raises
    ------
    ValueError
        If a strut's end has nothing with mass to act on, or a guide that a strut leans on has no mass.
    KinematicsError
        If the drive cannot move the linkage from where it starts.
    """
    container = exu.SystemContainer()
    scene = Scene(mechanism, container.AddSystem(), container)
    closure = Closure(mechanism)
    rates = closure.start()
    for link in mechanism.links:
        placed = add_link(scene.system, mechanism, link, rates[closure.index[link.name]])
        if placed is not None:
            scene.placed[link.name] = placed
        scene.parts[type(link.body).__name__] += 1
    for guide in mechanism.guides:
        velocity = closure.velocity(guide.link, guide.point, closure.reference, rates)
        scene.placed[guide.point] = add_slider(scene.system, mechanism, guide, float(velocity @ guide.along))
        scene.parts["Guide"] += 1
    _Connector(scene).connect()
    _add_gravity(scene)
    scene.system.Assemble()
    for group in scene.clearances:
        group.locate(scene.system)
    return scene


def is_loose(mechanism: Mechanism) -> bool:
    """True if an explicit integrator suits: rigid links, play in all joints, no stiff damper, constant drive speed."""
    drive = mechanism.drive
    return (
        bool(mechanism.joints)
        and all(isinstance(joint, Clearance) for joint in mechanism.joints)
        and all(isinstance(link.body, Rigid) for link in mechanism.links)
        and not mechanism.guides
        and (drive is None or isinstance(drive.speed, int | float))
        and not stiffly_damped(mechanism)
    )


def stiffly_damped(mechanism: Mechanism) -> bool:
    """True if a joint with play damps the lightest link at a rate beyond `STIFF`; there must be one."""
    lightest = min(link.body.section.mass_per_length * mechanism.length(link.name) for link in mechanism.links)
    depth, speed = 1e-5, 1e-3
    laws = [joint.law for joint in mechanism.joints if isinstance(joint, Clearance)]
    jumps = [law.force(depth, speed, 0.1) - law.force(depth, 0.0, 0.1) for law in laws]
    return max(jumps) / speed / lightest >= STIFF


class _Connector:
    """Adds the connectors of a scene whose bodies stand."""

    def __init__(self, scene: Scene) -> None:
        self.scene, self.system, self.mechanism = scene, scene.system, scene.mechanism
        node = self.system.AddNode(eii.NodePointGround())
        self.ground = self.system.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=node, coordinate=0))
        self.struts = {link.name for link in self.mechanism.links if isinstance(link.body, Strut)}

    def connect(self) -> None:
        self._joints()
        self._clearances()
        self._guides()
        for link in self.mechanism.links:
            if isinstance(link.body, Strut):
                hosts = (self._host(link, link.start), self._host(link, link.end))
                spring = StrutSpring(link.body, self.mechanism.length(link.name))
                self.scene.struts[link.name] = spring
                add_strut(self.system, spring, hosts)
        self._stops()
        self._drive()

    def _marker(self, body: str, point: str) -> int:
        """Position marker of a body (or ground) at a point."""
        if body != GROUND:
            return self.scene.placed[body].ends[point]
        x, y = self.mechanism.points[point]
        node = self.system.AddNode(eii.NodePointGround(referenceCoordinates=[x, y, 0.0]))
        return int(self.system.AddMarker(eii.MarkerNodePosition(nodeNumber=node)))

    def _coordinate(self, body: str, coordinate: int) -> int:
        node = self.scene.placed[body].nodes[0]
        return int(self.system.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=node, coordinate=coordinate)))

    def _revolute(self, name: str, first: int, second: int) -> None:
        item = eii.ObjectJointRevolute2D(markerNumbers=[first, second])
        self.scene.constraints[name] = int(self.system.AddObject(item))

    def _joints(self) -> None:
        for joint in self.mechanism.joints:
            if isinstance(joint, Clearance) or {joint.first, joint.second} & self.struts:
                continue  # those come as groups; a strut acts on its neighbour directly
            name = f"joint {joint.point}.{joint.first}-{joint.second}"
            self._revolute(name, self._marker(joint.first, joint.point), self._marker(joint.second, joint.point))
            self.scene.parts[type(joint).__name__] += 1

    def _clearances(self) -> None:
        groups: dict[tuple[Any, Any], list[Clearance]] = {}
        for joint in self.mechanism.joints:
            if isinstance(joint, Clearance):
                groups.setdefault((joint.law, joint.friction), []).append(joint)
                self.scene.parts["Clearance"] += 1
        for joints in groups.values():
            nodes: list[int] = []
            ends = [(self._end(j.first, j.point, nodes), self._end(j.second, j.point, nodes)) for j in joints]
            group = ClearanceGroup(joints, ends, nodes)
            self.scene.clearances.append(group)
            add_clearances(self.system, group)

    def _end(self, body: str, point: str, nodes: list[int]) -> End:
        """One side of a joint with play; its node joins `nodes`."""
        x, y = self.mechanism.points[point]
        if body == GROUND:
            return End(-1, (x, y), (0.0, 0.0))
        placed = self.scene.placed.get(body)
        if isinstance(placed, PlacedModal):
            node = add_anchor(self.system, placed, point)
            if node not in nodes:
                nodes.append(node)
            return End(3 * nodes.index(node), (x, y), (0.0, 0.0))
        if placed is None or not isinstance(placed.body, Rigid | Beam):
            raise ValueError(f"clearance at '{point}': link '{body}' must be Rigid, Beam or Modal, as the contact exerts moments")
        at_end = isinstance(placed.body, Beam) and point == self.mechanism.link(body).end
        k = -1 if at_end else 0
        node = placed.nodes[k]
        if node not in nodes:
            nodes.append(node)
        px, py = (float(c) for c in placed.reference[k, :2])
        return End(3 * nodes.index(node), (px, py), (x - px, y - py))

    def _guides(self) -> None:
        for guide in self.mechanism.guides:
            if guide.link not in self.struts:
                slider, end = self._marker(guide.point, guide.point), self._marker(guide.link, guide.point)
                self._revolute(f"guide {guide.point}", slider, end)
            elif guide.mass == 0:
                raise ValueError(f"guide of '{guide.point}': mass = 0 kg: must be positive where a Strut leans on it")
            if guide.friction is not None:
                add_friction(self.system, guide, self._coordinate(guide.point, 0), self.ground)
                self.scene.parts["GuideFriction"] += 1

    def _host(self, link: Link, point: str) -> int:
        """Marker of the body a strut's end acts on: its slider block, or a link or the ground it is pinned to."""
        for guide in self.mechanism.guides:
            if guide.point == point and guide.link == link.name:
                return self._marker(point, point)
        for joint in self.mechanism.joints:
            if joint.point == point and link.name in (joint.first, joint.second):
                other = joint.second if joint.first == link.name else joint.first
                if other not in self.struts:
                    return self._marker(other, point)
        needed = "a link with mass, a guide or ground"
        raise ValueError(f"link '{link.name}': a Strut is massless, so '{point}' must be pinned to {needed}")

    def _stops(self) -> None:
        for stop in self.mechanism.stops:
            contact = contact_of(self.mechanism, stop)
            number = 1 + sum(other.stop.point == stop.point for other in self.scene.stops.values())
            self.scene.stops[stop.point if number == 1 else f"{stop.point}.{number}"] = contact
            add_stop(self.system, contact, self._coordinate(stop.point, 0), self.ground)
            self.scene.parts["Stop"] += 1

    def _drive(self) -> None:
        drive = self.mechanism.drive
        if drive is None:
            return
        if self.scene.loose:  # an explicit integrator takes no constraint: constant speed is a flywheel no contact can brake
            body = self.scene.placed[drive.target].objects[0]
            self.system.SetObjectParameter(body, "inertia", FLYWHEEL)
        else:
            coordinate = self._coordinate(drive.target, 2 if drive.target not in self.mechanism.points else 0)
            self.scene.constraints["drive"] = add_drive(self.system, drive, coordinate, self.ground)
        self.scene.parts["Drive"] += 1


def _add_gravity(scene: Scene) -> None:
    """Add weight, and only where gravity lies in the plane."""
    gx, gy = scene.mechanism.gravity
    if gx == gy == 0:
        return
    for placed in scene.placed.values():
        for body in placed.objects:
            marker = scene.system.AddMarker(eii.MarkerBodyMass(bodyNumber=body))
            scene.system.AddLoad(eii.LoadMassProportional(markerNumber=marker, loadVector=[gx, gy, 0.0]))
    scene.parts["gravity"] += 1
