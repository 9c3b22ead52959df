"""Jobs written directly for the engine, as its users write them: hand-tuned runs with which Buckler's run times are compared.

No result of Buckler comes from here. Reduced integration 2 (the others lock) and the sparse solver are the best settings found
for these jobs; a static run has the default tolerances, a motion modified Newton and the tolerances that a work gives.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import suppress
from itertools import pairwise
from typing import Any

import numpy as np

from buckler.mbs.geometry import Array

os.environ.setdefault("EXUDYN_NO_USER_SETTINGS", "1")
import exudyn as exu
import exudyn.itemInterface as eii

from buckler.mbs.elements import Cable, Rigid, Section
from buckler.mbs.laws import KelvinVoigt
from buckler.mbs.mechanism import Mechanism

exu.config.printToConsole = False
POSITION = exu.OutputVariableType.Position
"""Output that sensors of motions record."""
OPTIONS: dict[str, Any] = {"useReducedOrderIntegration": 2, "strainIsRelativeToReference": 1.0}
"""Options of cables: an integration that does not lock; stress-free as they lie."""
STORED: dict[str, Any] = {"storeInternal": True, "writeToFile": False}
"""Options of sensors: they keep their records in memory."""


class _System:
    """An engine system with the few items that the jobs share."""

    def __init__(self) -> None:
        self.container = exu.SystemContainer()
        self.system = self.container.AddSystem()
        self.ground = self.marker(self.system.AddNode(eii.NodePointGround()), 0)

    def add(self, item: object) -> int:
        """Add an item and return its number."""
        return int(self.system.AddObject(item))

    def marker(self, node: int, coordinate: int) -> int:
        """Add a marker of a node's coordinate."""
        return int(self.system.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=node, coordinate=coordinate)))

    def at_node(self, node: int) -> int:
        """Add a marker at a node."""
        return int(self.system.AddMarker(eii.MarkerNodePosition(nodeNumber=node)))

    def on_body(self, body: int, x: float) -> int:
        """Add a marker on a body at its local place x [m]."""
        return int(self.system.AddMarker(eii.MarkerBodyPosition(bodyNumber=body, localPosition=[x, 0, 0])))

    def fix(self, node: int, coordinate: int, **motion: object) -> int:
        """Fix a coordinate of a node, or prescribe its motion."""
        markers = [self.ground, self.marker(node, coordinate)]
        return self.add(eii.CoordinateConstraint(markerNumbers=markers, **motion))

    def pin(self, *markers: int) -> None:
        """Pin two markers together."""
        self.add(eii.ObjectJointRevolute2D(markerNumbers=list(markers)))

    def weigh(self, body: int, gravity: tuple[float, float]) -> None:
        """Apply gravity [m/s^2] to a body."""
        if any(gravity):
            marker = self.system.AddMarker(eii.MarkerBodyMass(bodyNumber=body))
            self.system.AddLoad(eii.LoadMassProportional(markerNumber=marker, loadVector=[*gravity, 0.0]))

    def strip(self, section: Section, length: float, nodes: list[int], gravity: tuple[float, float] = (0.0, 0.0)) -> None:
        """Add cables between nodes, stress-free as they lie."""
        stiff: dict[str, Any] = {"bendingStiffness": section.bending_stiffness, "axialStiffness": section.axial_stiffness}
        stiff["bendingDamping"] = section.bending_stiffness * section.material.bending_damping
        given = {"length": length / (len(nodes) - 1), "massPerLength": section.mass_per_length}
        for pair in pairwise(nodes):
            cable = eii.ObjectANCFCable2D(nodeNumbers=list(pair), **OPTIONS, **stiff, **given)
            self.weigh(self.add(cable), gravity)

    def watch(self, node: int) -> int:
        """Record the place of a node."""
        return int(self.system.AddSensor(eii.SensorNode(nodeNumber=node, outputVariableType=POSITION, **STORED)))

    def solve(self, duration: float, steps: int, relative: float, absolute: float) -> None:
        """Assemble and integrate in equal steps, a sample a step."""
        self.system.Assemble()
        settings = _settings()
        settings.solution.sensors.writePeriod = duration / steps
        integration = settings.timeIntegration
        integration.endTime, integration.numberOfSteps, integration.verboseMode = duration, steps, 0
        integration.newton.useModifiedNewton = True
        integration.newton.relativeTolerance, integration.newton.absoluteTolerance = relative, absolute
        with suppress(exu.ExudynError):  # what it gave up is nan, see `seen`
            self.system.SolveDynamic(settings)

    def read_sensor(self, sensor: int, times: Array) -> Array:
        """Places that a sensor kept, shape (times, 2); nan after the end of a run that failed."""
        t, *places = np.asarray(self.system.GetSensorStoredData(sensor)).T
        found = np.stack([np.interp(times, t, place) for place in places[:2]], axis=1)
        found[times > t[-1] * (1 + 1e-9)] = np.nan
        return found


def _settings() -> Any:
    settings = exu.SimulationSettings()
    settings.solution.file.write = False
    settings.linearSolver.solverType = exu.LinearSolverType.EigenSparse
    return settings


# --- statics ----------------------------------------------------------------------------------------------------------


def buckled_strip(section: Section, length: float, shortenings: Array, elements: int) -> Array:
    """Force of the pinned strip at rising end shortenings, N, one static solution for each, starting from the one before.

    The first starts from a half-sine of about the right height, or it would stay on the straight branch.
    """
    job = _System()
    nodes = _half_sine_nodes(job, length, float(shortenings[0]), elements)
    job.strip(section, length, nodes)
    for node, coordinate in ((nodes[0], 0), (nodes[0], 1), (nodes[-1], 1)):
        job.fix(node, coordinate)
    span = [0.0, 0.0]

    def travel(_system: object, t: float, _item: int, _offset: float) -> float:
        return -length * (span[0] + (span[1] - span[0]) * t)

    constraint = job.fix(nodes[-1], 0, offsetUserFunction=travel)
    kind = exu.OutputVariableType.Force
    force = job.system.AddSensor(eii.SensorObject(objectNumber=constraint, outputVariableType=kind, writeToFile=False))
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
    """Nodes of a straight strip, displaced to a half-sine of that end shortening."""
    height = 2 / np.pi * np.sqrt(shortening) * length
    nodes = []
    for s in np.linspace(0.0, length, elements + 1):
        slope = height * np.pi / length * np.cos(np.pi * s / length)
        moved = [-shortening * s, height * np.sin(np.pi * s / length), np.cos(slope) - 1, np.sin(slope)]
        nodes.append(job.system.AddNode(eii.NodePoint2DSlope1(referenceCoordinates=[s, 0, 1, 0], initialCoordinates=moved)))
    return nodes


# --- slider-crank -----------------------------------------------------------------------------------------------------


def slider_crank(mechanism: Mechanism, times: Array, steps: int, relative: float, absolute: float) -> Array:
    """Deflection of the coupler's middle in `buckler.mbs.library.slider_crank` with a `Cable` of even elements, m.

    Its crank turns at constant speed; a stop has a `KelvinVoigt` law, whose force is the only callback.
    """
    job = _System()
    nodes = _moving_strip(job, mechanism)
    _add_crank(job, mechanism, nodes[0])
    _add_slider(job, mechanism, nodes[-1])
    sensors = [job.watch(nodes[k]) for k in (0, len(nodes) // 2, -1)]
    job.solve(float(times[-1]), steps, relative, absolute)
    start, middle, end = (job.read_sensor(sensor, times) for sensor in sensors)
    chord, middle = end - start, middle - start
    return np.asarray((chord[:, 0] * middle[:, 1] - chord[:, 1] * middle[:, 0]) / np.hypot(*chord.T))


def _speed(mechanism: Mechanism) -> float:
    speed = mechanism.drives[0].speed
    assert isinstance(speed, int | float)
    return speed


def _moving_strip(job: _System, mechanism: Mechanism) -> list[int]:
    """The coupler from the crank pin along negative x, with its bow and the velocity of the rigid mechanism."""
    body, length, radius = mechanism.link("coupler").body, mechanism.length("coupler"), mechanism.length("crank")
    assert isinstance(body, Cable) and isinstance(body.section, Section)
    height, speed = body.imperfection, _speed(mechanism)
    turning = speed * radius / length
    nodes = []
    for s in np.linspace(0.0, length, body.count + 1):
        slope = height * np.pi / length * np.cos(np.pi * s / length)
        place = np.array([radius - s, -height * np.sin(np.pi * s / length)])
        along = np.array([-np.cos(slope), -np.sin(slope)])
        velocity = [-turning * place[1], speed * radius - turning * s, -turning * along[1], turning * along[0]]
        nodes.append(job.system.AddNode(eii.NodePoint2DSlope1(referenceCoordinates=[*place, *along], initialVelocities=velocity)))
    job.strip(body.section, length, nodes)
    return nodes


def _add_crank(job: _System, mechanism: Mechanism, pin: int) -> None:
    """A rigid crank about the origin whose speed is prescribed; its mass does not matter."""
    speed = _speed(mechanism)
    node = job.system.AddNode(eii.NodeRigidBody2D(referenceCoordinates=[0, 0, 0], initialVelocities=[0, 0, speed]))
    body = job.add(eii.ObjectRigidBody2D(mass=0.1, inertia=1e-3, nodeNumber=node))
    for coordinate in (0, 1):
        job.fix(node, coordinate)
    job.fix(node, 2, offset=speed, velocityLevel=True)
    job.pin(job.on_body(body, mechanism.length("crank")), job.at_node(pin))


def _add_slider(job: _System, mechanism: Mechanism, end: int) -> None:
    """A mass on the x axis with its stop, if there is one."""
    guide, (start, _) = mechanism.guide("B"), mechanism.points["B"]
    node = job.system.AddNode(eii.NodePoint2D(referenceCoordinates=[start, 0]))
    job.add(eii.ObjectMassPoint2D(mass=guide.mass, nodeNumber=node))
    for fixed in (node, end):
        job.fix(fixed, 1)
    along = job.marker(node, 0)
    job.add(eii.CoordinateConstraint(markerNumbers=[along, job.marker(end, 0)]))
    for stop in mechanism.stops:
        assert isinstance(stop.law, KelvinVoigt)
        given: Any = {"stiffness": 1.0, "springForceUserFunction": _stopping(stop.law, stop.at - start)}
        job.add(eii.ObjectConnectorCoordinateSpringDamper(markerNumbers=[job.ground, along], **given))


def _stopping(law: KelvinVoigt, face: float) -> Callable[..., float]:
    def force(_system: object, _time: float, _item: int, x: float, v: float, *_: float) -> float:
        return -max(0.0, law.stiffness * (face - x) - law.damping * v) if x < face else 0.0

    return force


# --- chains -----------------------------------------------------------------------------------------------------------


def chain(mechanism: Mechanism, times: Array, steps: int, relative: float, absolute: float) -> Array:
    """Places of the last bar's centre or the last cable's end in a chain of like links on the x axis, shape (times, 2), m."""
    job, body, gravity = _System(), mechanism.links[0].body, mechanism.gravity
    end = job.on_body(job.add(eii.ObjectGround()), 0.0)
    for link in mechanism.links:
        x, length = mechanism.points[link.start][0], mechanism.length(link.name)
        if isinstance(body, Rigid):
            mass, inertia, _ = body.mass_properties(length)
            node = job.system.AddNode(eii.NodeRigidBody2D(referenceCoordinates=[x + length / 2, 0, 0]))
            bar = job.add(eii.ObjectRigidBody2D(mass=mass, inertia=inertia, nodeNumber=node))
            job.weigh(bar, gravity)
            start, middle, other = (job.on_body(bar, place) for place in (-length / 2, 0.0, length / 2))
        else:
            assert isinstance(body, Cable) and isinstance(body.section, Section)
            places = [[x + s, 0, 1, 0] for s in np.linspace(0.0, length, body.count + 1)]
            nodes = [int(job.system.AddNode(eii.NodePoint2DSlope1(referenceCoordinates=place))) for place in places]
            job.strip(body.section, length, nodes, gravity)
            start, other = job.at_node(nodes[0]), job.at_node(nodes[-1])
            middle = other
        job.pin(end, start)
        end = other
    sensor = int(job.system.AddSensor(eii.SensorMarker(markerNumber=middle, outputVariableType=POSITION, **STORED)))
    job.solve(float(times[-1]), steps, relative, absolute)
    return job.read_sensor(sensor, times)
