"""The same jobs written straight on the engine, as its users write them: what Buckler's run times are held against.

Not a part of Buckler: no study takes its results from here. The settings are the best found for these jobs: reduced
integration 2 (the others lock), the sparse solver; for the static run the default tolerances (looser ones cost accuracy
and save 10 %, modified Newton costs time); for the dynamic run modified Newton and a tolerance as loose as stays
stable.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from functools import singledispatch
from itertools import pairwise
from math import nan
from time import perf_counter
from typing import Any

import numpy as np

from buckler.mbs.geometry import Array

os.environ.setdefault("EXUDYN_NO_USER_SETTINGS", "1")
import exudyn as exu
import exudyn.itemInterface as eii

from buckler.mbs.elements import Cable, GuideFriction, Motor, Rigid, Section
from buckler.mbs.engine.build import build
from buckler.mbs.engine.solve import explicit_settings, implicit_settings
from buckler.mbs.laws import KelvinVoigt
from buckler.mbs.mechanism import Mechanism
from buckler.mbs.solvers import Exudyn

exu.config.printToConsole = False

STORED: dict[str, Any] = {"storeInternal": True, "writeToFile": False}


@dataclass(frozen=True)
class Plain:
    """What a plain run gives: end shortening over length and strip force, N; or time, s, and contact force, N; or, without a
    stop, time, s, and deflection of the coupler's middle from its chord, m; all of shape (values,).

    Further what the engine said, if it failed, its work, and the angle, rad, of a crank that a motor turns.
    """  # fmt: skip

    x: Array
    force: Array
    message: str = ""
    work: dict[str, float] = field(default_factory=dict)
    angle: Array | None = None

    def at(self, times: Array) -> Array:
        """The second at values of the first; nan of a run that failed."""
        return np.interp(times, self.x, self.force) if self.x.size else np.full(len(times), np.nan)


class _System:
    """An engine system with the few items both jobs share."""

    def __init__(self) -> None:
        self.container = exu.SystemContainer()
        self.system = self.container.AddSystem()
        ground = self.system.AddNode(eii.NodePointGround())
        self.ground = self.marker(ground, 0)

    def marker(self, node: int, coordinate: int) -> int:
        return self.system.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=node, coordinate=coordinate))

    def fix(self, node: int, coordinate: int, **motion: object) -> int:
        markers = [self.ground, self.marker(node, coordinate)]
        return self.system.AddObject(eii.CoordinateConstraint(markerNumbers=markers, **motion))

    def sense(self, sensor: object) -> int:
        return int(self.system.AddSensor(sensor))

    def stored(self, sensor: int) -> Array:
        return np.asarray(self.system.GetSensorStoredData(sensor))

    def place(self, body: int, x: float) -> int:
        return self.system.AddMarker(eii.MarkerBodyPosition(bodyNumber=body, localPosition=[x, 0, 0]))

    def pin(self, *markers: int) -> None:
        self.system.AddObject(eii.ObjectJointRevolute2D(markerNumbers=list(markers)))

    def weight(self, body: int, gravity: tuple[float, float]) -> None:
        if any(gravity):
            marker = self.system.AddMarker(eii.MarkerBodyMass(bodyNumber=body))
            self.system.AddLoad(eii.LoadMassProportional(markerNumber=marker, loadVector=[*gravity, 0.0]))

    def cable(self, section: Section, length: float, nodes: list[int], **more: object) -> list[int]:
        stiff = {"bendingStiffness": section.bending_stiffness, "axialStiffness": section.axial_stiffness}
        given = {"length": length / (len(nodes) - 1), "massPerLength": section.mass_per_length, **stiff, **more}
        return [
            self.system.AddObject(eii.ObjectANCFCable2D(nodeNumbers=list(pair), useReducedOrderIntegration=2, **given))
            for pair in pairwise(nodes)
        ]


def _settings() -> Any:
    settings = exu.SimulationSettings()
    settings.solution.file.write = False
    settings.linearSolver.solverType = exu.LinearSolverType.EigenSparse
    return settings


# --- post-buckling ----------------------------------------------------------------------------------------------------


def buckled_strip(section: Section, length: float, shortenings: Array, elements: int) -> Plain:
    """Force of the pinned strip at rising end shortenings, one static solution a value, each starting from the last.

    The first starts from a half-sine of about the right height, or it would stay on the straight branch.
    """
    job = _System()
    nodes = _half_sine_nodes(job, length, float(shortenings[0]), elements)
    job.cable(section, length, nodes)
    for node, coordinate in ((nodes[0], 0), (nodes[0], 1), (nodes[-1], 1)):
        job.fix(node, coordinate)
    span = [0.0, 0.0]

    def travel(_system: object, t: float, _item: int, _offset: float) -> float:
        return -length * (span[0] + (span[1] - span[0]) * t)

    constraint = job.fix(nodes[-1], 0, offsetUserFunction=travel)
    force = job.sense(
        eii.SensorObject(objectNumber=constraint, outputVariableType=exu.OutputVariableType.Force, writeToFile=False)
    )
    job.system.Assemble()
    settings = _settings()
    settings.staticSolver.verboseMode = 0
    settings.staticSolver.numberOfLoadSteps = 1
    forces, iterations = [], 0
    for value in shortenings:
        span[:] = span[1], value
        try:
            job.system.SolveStatic(settings, updateInitialValues=True)
        except exu.ExudynError as error:
            return Plain(shortenings, np.full(len(shortenings), np.nan), str(error).strip())
        iterations += job.system.sys["staticSolver"].it.newtonStepsCount
        forces.append(float(np.abs(job.system.GetSensorValues(force))))
    return Plain(shortenings, np.array(forces), work={"newton_iterations": float(iterations)})


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


def slider_crank(mechanism: Mechanism, duration: float, steps: int, newton: float) -> Plain:
    """Contact force of `buckler.mbs.library.slider_crank` with a `Cable` coupler, in uniform steps, all of them sampled.

    Its stop has a `HysteresisLaw` of exponent 1; its force is the only callback. The crank turns at constant speed, or by a motor
    of constant voltage. `newton` is the relative and absolute tolerance of Newton's method.
    """
    job = _System()
    crank, _, contact = _slider_crank(job, mechanism)
    force = job.sense(eii.SensorObject(objectNumber=contact, outputVariableType=exu.OutputVariableType.Force, **STORED))
    turned = job.sense(eii.SensorNode(nodeNumber=crank, outputVariableType=exu.OutputVariableType.Coordinates, **STORED))
    failure, work = _solve(job, duration, steps, newton, newton)
    if failure:
        return Plain(np.empty(0), np.empty(0), failure)
    time, forces = job.stored(force).T
    return Plain(time, np.abs(forces), work=work, angle=None if mechanism.drives else job.stored(turned)[:, 3])


def smooth_slider_crank(mechanism: Mechanism, duration: float, steps: int, relative: float, absolute: float) -> Plain:
    """Deflection of the coupler's middle in the same mechanism, a sample a step; without a stop there is no callback at all."""
    job = _System()
    _, coupler, _ = _slider_crank(job, mechanism)
    ends = (coupler[k] for k in (0, len(coupler) // 2, -1))
    kind = exu.OutputVariableType.Position
    places = [job.sense(eii.SensorNode(nodeNumber=node, outputVariableType=kind, **STORED)) for node in ends]
    failure, work = _solve(job, duration, steps, relative, absolute)
    if failure:
        return Plain(np.empty(0), np.empty(0), failure)
    start, middle, end = (job.stored(place) for place in places)
    chord, middle = end[:, 1:3] - start[:, 1:3], middle[:, 1:3] - start[:, 1:3]
    deflection = (chord[:, 0] * middle[:, 1] - chord[:, 1] * middle[:, 0]) / np.hypot(*chord.T)
    return Plain(start[:, 0], deflection, work=work)


def _slider_crank(job: _System, mechanism: Mechanism) -> tuple[int, list[int], int]:
    """Add all items: nodes of crank and coupler, and the object added last, which is the stop if there is one."""
    speed = float(mechanism.drives[0].speed if mechanism.drives else mechanism.velocities["crank"])  # type: ignore[arg-type]
    coupler = _moving_strip(job, mechanism, speed)
    crank = (_add_crank if mechanism.drives else _add_motor)(job, mechanism, speed, coupler[0])
    return crank, coupler, _add_slider(job, mechanism, coupler[-1])


def same_items(mechanism: Mechanism, duration: float, solver: Exudyn) -> tuple[float, float]:
    """Seconds that the items and settings of a run of `Exudyn` take in all, and a step, where nothing is called in a step.

    Callbacks of laws stay. Both are nan if the run fails.
    """
    begin = perf_counter()
    scene = build(mechanism)
    engine: Any = (exu.MainSolverExplicit if scene.loose else exu.MainSolverImplicitSecondOrder)()
    settings = (explicit_settings if scene.loose else implicit_settings)(scene, solver, duration)
    built = perf_counter()
    try:
        done = engine.SolveSystem(scene.system, settings)
    except exu.ExudynError:
        done = False
    end = perf_counter()
    return (end - begin, (end - built) / engine.it.currentStepIndex) if done else (nan, nan)


def _solve(job: _System, duration: float, steps: int, relative: float, absolute: float) -> tuple[str, dict[str, float]]:
    """Assemble and integrate in uniform steps: what the engine said if it failed, and the work."""
    job.system.Assemble()
    settings = _settings()
    settings.solution.sensors.writePeriod = duration / steps
    integration = settings.timeIntegration
    integration.endTime, integration.numberOfSteps, integration.verboseMode = duration, steps, 0
    integration.newton.useModifiedNewton = True
    integration.newton.relativeTolerance, integration.newton.absoluteTolerance = relative, absolute
    try:
        job.system.SolveDynamic(settings)
    except exu.ExudynError as error:
        return str(error).strip() or "failed", {}
    count = job.system.sys["dynamicSolver"].it
    iterations = {"newton_iterations": float(count.newtonStepsCount), "jacobians": float(count.newtonJacobiCount)}
    return "", {"steps": float(steps), **iterations}


def _moving_strip(job: _System, mechanism: Mechanism, speed: float) -> list[int]:
    """The coupler from the crank pin along negative x, with its bow and the velocity of the rigid mechanism."""
    body, length = mechanism.link("coupler").body, mechanism.length("coupler")
    assert isinstance(body, Cable) and isinstance(body.section, Section)
    radius, height = mechanism.length("crank"), body.imperfection
    turning = speed * radius / length
    nodes = []
    for s in np.linspace(0.0, length, body.count + 1):
        slope = height * np.pi / length * np.cos(np.pi * s / length)
        place = np.array([radius - s, -height * np.sin(np.pi * s / length)])
        along = np.array([-np.cos(slope), -np.sin(slope)])
        velocity = [-turning * place[1], speed * radius - turning * s, -turning * along[1], turning * along[0]]
        nodes.append(job.system.AddNode(eii.NodePoint2DSlope1(referenceCoordinates=[*place, *along], initialVelocities=velocity)))
    damping = body.section.bending_stiffness * body.section.material.bending_damping
    for part in job.cable(body.section, length, nodes, bendingDamping=damping, strainIsRelativeToReference=1.0):
        job.weight(part, mechanism.gravity)
    return nodes


def _add_motor(job: _System, mechanism: Mechanism, speed: float, pin: int) -> int:
    """A crank with mass, turned by a torque that falls in proportion to its speed and is 0 at `speed`; its node."""
    (motor,) = (load for load in mechanism.loads if isinstance(load, Motor))
    crank, radius = mechanism.link("crank").body, mechanism.length("crank")
    assert isinstance(crank, Rigid)
    mass, inertia, (centre, _) = crank.inertia(radius)
    velocity = [0, speed * centre, speed]
    node = job.system.AddNode(eii.NodeRigidBody2D(referenceCoordinates=[centre, 0, 0], initialVelocities=velocity))
    body = job.system.AddObject(eii.ObjectRigidBody2D(mass=mass, inertia=inertia + motor.inertia, nodeNumber=node))
    job.weight(body, mechanism.gravity)
    ground = job.system.AddObject(eii.ObjectGround())
    job.pin(job.place(ground, 0.0), job.place(body, -centre))
    job.pin(job.place(body, radius - centre), job.system.AddMarker(eii.MarkerNodePosition(nodeNumber=pin)))
    slope = motor.constant**2 / motor.resistance
    turning = job.marker(node, 2)
    job.system.AddObject(eii.ObjectConnectorCoordinateSpringDamper(markerNumbers=[job.ground, turning], damping=slope))
    job.system.AddLoad(eii.LoadCoordinate(markerNumber=turning, load=slope * speed))
    return int(node)


def _add_crank(job: _System, mechanism: Mechanism, speed: float, pin: int) -> int:
    """A rigid crank about the origin whose speed is prescribed; its mass does not matter. Its node."""
    node = job.system.AddNode(eii.NodeRigidBody2D(referenceCoordinates=[0, 0, 0], initialVelocities=[0, 0, speed]))
    body = job.system.AddObject(eii.ObjectRigidBody2D(mass=0.1, inertia=1e-3, nodeNumber=node))
    for coordinate in (0, 1):
        job.fix(node, coordinate)
    job.fix(node, 2, offset=speed, velocityLevel=True)
    job.pin(job.place(body, mechanism.length("crank")), job.system.AddMarker(eii.MarkerNodePosition(nodeNumber=pin)))
    return int(node)


def _add_slider(job: _System, mechanism: Mechanism, end: int) -> int:
    """A mass on the x axis with friction and its stop, if there is one; the object number of what was added last."""
    guide = mechanism.guide("B")
    start, _ = mechanism.points["B"]
    node = job.system.AddNode(eii.NodePoint2D(referenceCoordinates=[start, 0]))
    job.weight(job.system.AddObject(eii.ObjectMassPoint2D(mass=guide.mass, nodeNumber=node)), (mechanism.gravity[0], 0.0))
    for fixed in (node, end):
        job.fix(fixed, 1)
    along = job.marker(node, 0)
    added = job.system.AddObject(eii.CoordinateConstraint(markerNumbers=[along, job.marker(end, 0)]))
    if isinstance(guide.friction, GuideFriction):
        friction = {"dynamicFrictionForce": guide.friction.dynamic, "frictionProportionalZone": guide.friction.regularisation}
        job.system.AddObject(eii.ObjectConnectorCoordinateSpringDamperExt(markerNumbers=[job.ground, along], **friction))
    for stop in mechanism.stops:
        law: Any = {"stiffness": 1.0, "springForceUserFunction": _stop_force(stop.law, stop.at - start)}
        added = job.system.AddObject(eii.ObjectConnectorCoordinateSpringDamper(markerNumbers=[job.ground, along], **law))
    return int(added)


@singledispatch
def _stop_force(law: Any, face: float) -> Any:
    """Force of a stop as a callback: max(0, K d (1 + chi d'/v0)), v0 the last speed before contact; of a law of exponent 1."""
    stiffness, chi, onset = law.stiffness, law.chi, [1e-4]

    def force(_system: Any, _t: float, _item: int, travel: float, speed: float, *_: float) -> float:
        depth = face - travel
        if depth <= 0:
            onset[0] = max(-speed, 1e-4)
            return 0.0
        return -max(0.0, stiffness * depth * (1 - chi * speed / onset[0]))

    return force


@_stop_force.register
def _(law: KelvinVoigt, face: float) -> Any:
    """max(0, K d + c d')."""
    return lambda _system, _t, _item, travel, speed, *_: (
        -max(0.0, law.stiffness * (face - travel) - law.damping * speed) if travel < face else 0.0
    )
