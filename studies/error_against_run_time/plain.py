"""Mechanisms written directly for the engine, as users of Exudyn write them: hand-tuned runs to compare with Buckler's.

No result of Buckler comes from here. Reduced integration of kind 2 and the sparse solver are the best settings found: with other
kinds thin elements lock, that is, they are too stiff. Static runs have default tolerances; motions have a modified Newton method,
whose tolerances are arguments.
"""

import os
from collections.abc import Callable
from contextlib import suppress
from itertools import pairwise
from typing import Any

import numpy as np

from buckler.mbs.geometry import Array

os.environ.setdefault("EXUDYN_NO_USER_SETTINGS", "1")  # so that runs do not depend on a file in the home directory
import exudyn as exu
import exudyn.itemInterface as eii

from buckler.mbs.elements import Cable, Rigid, Section
from buckler.mbs.laws import KelvinVoigt
from buckler.mbs.mechanism import Mechanism

exu.config.printToConsole = False


class _System:
    """System of the engine, with functions that add items and return their numbers."""

    def __init__(self) -> None:
        self.container = exu.SystemContainer()
        self.system = self.container.AddSystem()
        self.ground = self.mark_coordinate(self.system.AddNode(eii.NodePointGround()), 0)

    def add(self, item: object) -> int:
        """Add an object."""
        return int(self.system.AddObject(item))

    def mark_coordinate(self, node: int, coordinate: int) -> int:
        """Add a marker of a coordinate of a node."""
        return int(self.system.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=node, coordinate=coordinate)))

    def mark_node(self, node: int) -> int:
        """Add a marker of the position of a node."""
        return int(self.system.AddMarker(eii.MarkerNodePosition(nodeNumber=node)))

    def mark_body(self, body: int, x: float) -> int:
        """Add a marker on a body at its local coordinate x [m]."""
        return int(self.system.AddMarker(eii.MarkerBodyPosition(bodyNumber=body, localPosition=[x, 0, 0])))

    def fix(self, node: int, coordinate: int, **motion: object) -> int:
        """Fix a coordinate of a node, or prescribe its motion."""
        markers = [self.ground, self.mark_coordinate(node, coordinate)]
        return self.add(eii.CoordinateConstraint(markerNumbers=markers, **motion))

    def pin(self, *markers: int) -> None:
        """Join two markers of positions by a revolute joint."""
        self.add(eii.ObjectJointRevolute2D(markerNumbers=list(markers)))

    def add_weight(self, body: int, gravity: tuple[float, float]) -> None:
        """Apply gravity [m/s^2] to a body."""
        if any(gravity):
            marker = self.system.AddMarker(eii.MarkerBodyMass(bodyNumber=body))
            self.system.AddLoad(eii.LoadMassProportional(markerNumber=marker, loadVector=[*gravity, 0.0]))

    def strip(self, section: Section, length: float, nodes: list[int], gravity: tuple[float, float] = (0.0, 0.0)) -> None:
        """Add cables of equal length between neighbouring nodes."""
        options: dict[str, Any] = {"bendingStiffness": section.bending_stiffness, "axialStiffness": section.axial_stiffness}
        options["bendingDamping"] = section.bending_stiffness * section.material.bending_damping
        options |= {"length": length / (len(nodes) - 1), "massPerLength": section.mass_per_length}
        options |= {"useReducedOrderIntegration": 2, "strainIsRelativeToReference": 1.0}  # no locking; no stress as created
        for pair in pairwise(nodes):
            cable = eii.ObjectANCFCable2D(nodeNumbers=list(pair), **options)
            self.add_weight(self.add(cable), gravity)

    def add_sensor(self, marker: int) -> int:
        """Add a sensor of the position of a marker, whose record is kept in memory."""
        options: dict[str, Any] = {"outputVariableType": exu.OutputVariableType.Position, "storeInternal": True}
        return int(self.system.AddSensor(eii.SensorMarker(markerNumber=marker, **options, writeToFile=False)))

    def solve(self, duration: float, steps: int, relative: float, absolute: float) -> None:
        """Assemble and integrate in equal steps, each of which is recorded; the tolerances are those of Newton's method."""
        self.system.Assemble()
        settings = _settings()
        settings.solution.sensors.writePeriod = duration / steps
        integration = settings.timeIntegration
        integration.endTime, integration.numberOfSteps, integration.verboseMode = duration, steps, 0
        integration.newton.useModifiedNewton = True
        integration.newton.relativeTolerance, integration.newton.absoluteTolerance = relative, absolute
        with suppress(exu.ExudynError):  # the times that a failed run does not reach are nan in `read_sensor`
            self.system.SolveDynamic(settings)

    def read_sensor(self, sensor: int, times: Array) -> Array:
        """Return the positions that a sensor has recorded, shape (times, 2) [m]; nan after the end of a run that failed."""
        t, *rows = np.asarray(self.system.GetSensorStoredData(sensor)).T
        found = np.stack([np.interp(times, t, row) for row in rows[:2]], axis=1)
        found[times > t[-1] * (1 + 1e-9)] = np.nan
        return found


def _settings() -> Any:
    settings = exu.SimulationSettings()
    settings.solution.file.write = False
    settings.linearSolver.solverType = exu.LinearSolverType.EigenSparse
    return settings


def buckled_strip(section: Section, length: float, shortenings: Array, elements: int) -> Array:
    """Compute the force of the pinned strip [N] at rising end shortenings; each static solution starts from the one before.

    The first one starts from a half-sine of approximate height: a straight strip would stay straight. If one
    solution fails, all forces are nan.
    """
    job = _System()
    nodes = _half_sine_nodes(job, length, float(shortenings[0]), elements)
    job.strip(section, length, nodes)
    for node, coordinate in ((nodes[0], 0), (nodes[0], 1), (nodes[-1], 1)):
        job.fix(node, coordinate)
    span = [0.0, 0.0]  # end shortenings at the start and the end of a load step

    def travel(_system: object, t: float, _item: int, _offset: float) -> float:
        """Return the displacement of the pressed end [m] at a share t of the load step."""
        return -length * (span[0] + (span[1] - span[0]) * t)

    constraint = job.fix(nodes[-1], 0, offsetUserFunction=travel)
    output = {"outputVariableType": exu.OutputVariableType.Force, "writeToFile": False}
    force = job.system.AddSensor(eii.SensorObject(objectNumber=constraint, **output))
    job.system.Assemble()
    settings = _settings()
    settings.staticSolver.verboseMode = 0
    settings.staticSolver.numberOfLoadSteps = 1
    found = []
    for value in shortenings:
        span[:] = span[1], value
        try:
            job.system.SolveStatic(settings, updateInitialValues=True)
        except exu.ExudynError:
            return np.full(len(shortenings), np.nan)
        found.append(float(np.abs(job.system.GetSensorValues(force))))
    return np.array(found)


def _half_sine_nodes(job: _System, length: float, shortening: float, elements: int) -> list[int]:
    """Add the nodes of a straight strip, displaced to a half-sine of an end shortening; return their numbers.

    A half-sine of height h shortens a strip of length L by the share (pi h / (2 L))^2. The coordinates of a node are x, y and the
    components of its slope vector, (1, 0) in the straight strip. The slope is taken as the angle, as this is a first guess only.
    """
    height = 2 / np.pi * np.sqrt(shortening) * length
    nodes = []
    for s in np.linspace(0.0, length, elements + 1):
        slope = height * np.pi / length * np.cos(np.pi * s / length)
        change = [-shortening * s, height * np.sin(np.pi * s / length), np.cos(slope) - 1, np.sin(slope)]
        nodes.append(job.system.AddNode(eii.NodePoint2DSlope1(referenceCoordinates=[s, 0, 1, 0], initialCoordinates=change)))
    return nodes


def slider_crank(mechanism: Mechanism, times: Array, steps: int, relative: float, absolute: float) -> Array:
    """Compute the deflection of the coupler's middle [m] in a slider-crank of the library whose coupler is a `Cable`.

    The number of elements is even and the crank's speed constant. A stop has a `KelvinVoigt` law, by a Python function.
    """
    job = _System()
    speed = mechanism.drives[0].speed
    assert isinstance(speed, int | float)
    nodes = _moving_strip(job, mechanism, speed)
    _add_crank(job, mechanism.length("crank"), speed, nodes[0])
    _add_slider(job, mechanism, nodes[-1])
    sensors = [job.add_sensor(job.mark_node(nodes[k])) for k in (0, len(nodes) // 2, -1)]
    job.solve(float(times[-1]), steps, relative, absolute)
    start, middle, end = (job.read_sensor(sensor, times) for sensor in sensors)
    chord, middle = end - start, middle - start
    return np.asarray((chord[:, 0] * middle[:, 1] - chord[:, 1] * middle[:, 0]) / np.hypot(*chord.T))


def _moving_strip(job: _System, mechanism: Mechanism, speed: float) -> list[int]:
    """Add the bowed coupler, from the crank pin along negative x, with the velocity of a rigid coupler; return its nodes."""
    body, length, radius = mechanism.link("coupler").body, mechanism.length("coupler"), mechanism.length("crank")
    assert isinstance(body, Cable) and isinstance(body.section, Section)
    height = body.imperfection  # bow [m]
    turning = speed * radius / length  # angular velocity [rad/s] of the coupler, whose end at the slider is at rest
    nodes = []
    for s in np.linspace(0.0, length, body.count + 1):
        slope = height * np.pi / length * np.cos(np.pi * s / length)
        place = np.array([radius - s, -height * np.sin(np.pi * s / length)])
        tangent = np.array([-np.cos(slope), -np.sin(slope)])
        velocity = [-turning * place[1], speed * radius - turning * s, -turning * tangent[1], turning * tangent[0]]
        node = eii.NodePoint2DSlope1(referenceCoordinates=[*place, *tangent], initialVelocities=velocity)
        nodes.append(job.system.AddNode(node))
    job.strip(body.section, length, nodes)
    return nodes


def _add_crank(job: _System, length: float, speed: float, pin: int) -> None:
    """Add a rigid crank about the origin; as its speed is prescribed, its mass and inertia have no effect on the coupler."""
    node = job.system.AddNode(eii.NodeRigidBody2D(referenceCoordinates=[0, 0, 0], initialVelocities=[0, 0, speed]))
    body = job.add(eii.ObjectRigidBody2D(mass=0.1, inertia=1e-3, nodeNumber=node))
    for coordinate in (0, 1):
        job.fix(node, coordinate)
    job.fix(node, 2, offset=speed, velocityLevel=True)
    job.pin(job.mark_body(body, length), job.mark_node(pin))


def _add_slider(job: _System, mechanism: Mechanism, end: int) -> None:
    """Add the slider, a mass on the x axis at the mechanism's point B, and its stop if the mechanism has one."""
    guide, (start, _) = mechanism.guide("B"), mechanism.points["B"]
    node = job.system.AddNode(eii.NodePoint2D(referenceCoordinates=[start, 0]))
    job.add(eii.ObjectMassPoint2D(mass=guide.mass, nodeNumber=node))
    for each in (node, end):  # both stay on the x axis and have the same x: the coupler's end is pinned to the slider
        job.fix(each, 1)
    position = job.mark_coordinate(node, 0)
    job.add(eii.CoordinateConstraint(markerNumbers=[position, job.mark_coordinate(end, 0)]))
    for stop in mechanism.stops:
        assert isinstance(stop.law, KelvinVoigt)
        options: Any = {"springForceUserFunction": _stop_force(stop.law, stop.at - start)}
        job.add(eii.ObjectConnectorCoordinateSpringDamper(markerNumbers=[job.ground, position], **options))


def _stop_force(law: KelvinVoigt, face: float) -> Callable[..., float]:
    """Make the engine's function for the force of a stop at negative x; `face` is the slider's displacement at contact [m]."""

    def force(_system: object, _time: float, _item: int, x: float, v: float, *_: float) -> float:
        """Compute the force [N] with the engine's sign of a spring: negative where it pushes the slider to positive x."""
        depth, depth_rate = face - x, -v
        return -max(0.0, law.stiffness * depth + law.damping * depth_rate) if depth > 0 else 0.0

    return force


def chain(mechanism: Mechanism, times: Array, steps: int, relative: float, absolute: float) -> Array:
    """Compute the path of the last bar's centre, or of the last cable's end, in a chain of equal links, (times, 2) [m].

    The chain is pinned to the origin and lies along the x axis at t = 0.
    """
    job, body, gravity = _System(), mechanism.links[0].body, mechanism.gravity
    previous_end = job.mark_body(job.add(eii.ObjectGround()), 0.0)
    for link in mechanism.links:
        x, length = mechanism.points[link.start][0], mechanism.length(link.name)
        if isinstance(body, Rigid):
            mass, inertia, _ = body.mass_properties(length)
            node = job.system.AddNode(eii.NodeRigidBody2D(referenceCoordinates=[x + length / 2, 0, 0]))
            bar = job.add(eii.ObjectRigidBody2D(mass=mass, inertia=inertia, nodeNumber=node))
            job.add_weight(bar, gravity)
            start, sensed, end = (job.mark_body(bar, place) for place in (-length / 2, 0.0, length / 2))
        else:
            assert isinstance(body, Cable) and isinstance(body.section, Section)
            places = [[x + s, 0, 1, 0] for s in np.linspace(0.0, length, body.count + 1)]
            nodes = [int(job.system.AddNode(eii.NodePoint2DSlope1(referenceCoordinates=place))) for place in places]
            job.strip(body.section, length, nodes, gravity)
            start, end = job.mark_node(nodes[0]), job.mark_node(nodes[-1])
            sensed = end
        job.pin(previous_end, start)
        previous_end = end
    sensor = job.add_sensor(sensed)
    job.solve(float(times[-1]), steps, relative, absolute)
    return job.read_sensor(sensor, times)
