"""Loads, springs, struts, masses and drives as native items of the engine; only users' functions and laws need callbacks.

`place` splits a point reference, as `crank:A`, into its `body` and its `point`.
"""

from functools import partial
from math import cos, sin
from typing import Any, cast

import exudyn.itemInterface as eii
import numpy as np

from ..elements import Drive, Force, LineLoad, Link, Motor, Spring, Torque, TorsionSpring
from ..elements.element import Pair, Place, place
from ..elements.references import angle_reference, holder, holder_reference
from ..geometry import Array, cross
from ..record.errors import Status
from ..record.record import Record
from ..record.strips import nodal_lengths
from ..scene.scene import Scene
from . import Callback, System
from .forces import StrutSpring
from .guarded import guard, watch
from .placed import History
from .scene import EngineScene
from .strip import PlacedStrip


def add_forces(scene: EngineScene, loads: dict[str, Force]) -> None:
    """Add forces on points. A force whose line of action goes `through` another place has a moment about its point, too."""
    for name, load in loads.items():
        point = place(holder_reference(scene.mechanism, load.point))
        marker, follows = scene.marker(*point), load.turns_with(scene.mechanism)
        _refuse_states(load)
        value = guard(scene, name, load.value, size=2)  # a function, also of a constant force
        force = partial(_compute_force, scene, value, follows)
        if callable(load.value) or follows is not None:
            item = eii.LoadForceVector(markerNumber=marker, loadVectorUserFunction=force)
        else:
            item = eii.LoadForceVector(markerNumber=marker, loadVector=[*load.value, 0.0])
        scene.system.AddLoad(item)
        if load.through is not None:
            add_coordinate_force(scene, scene.angle_marker(*point), partial(_compute_moment, scene, point, load, force))


def _refuse_states(load: Force | Torque) -> None:
    """Raise a ValueError for a load with states of its own, for which the engine has no coordinates."""
    if load.states is not None:
        raise ValueError(f"{load.where}: states = {load.states!r}: the compiled solver alone integrates states; use Spectral()")


def _compute_moment(scene: EngineScene, at: Place, load: Force, force: Callback, _time: float, t: float, *_: float) -> float:
    """Compute the moment [N m] about the point `at` of a force at the time t."""
    fx, fy, _fz = force(None, t, None)  # the function uses neither the system nor the load's number
    positions, _velocities = scene.present_motion(at.body).point(at.point)
    (x, y), (through_x, through_y) = positions[0], cast(Pair, load.through)
    return (through_x - x) * fy - (through_y - y) * fx


def _compute_force(
    scene: EngineScene, value: Callback, follows: str | None, _system: System, t: float, _load: object
) -> list[float]:
    """Compute x, y and z of a force [N]; with the point reference `follows` it turns with that section from t = 0 on."""
    fx, fy = value(t, t)  # time for messages, and argument of the user's function
    if follows is None:
        return [fx, fy, 0.0]
    body, point = place(follows)
    (angle,), _rates = scene.present_motion(body).turn(point)  # since t = 0
    c, s = cos(angle), sin(angle)
    return [c * fx - s * fy, s * fx + c * fy, 0.0]


def add_line_loads(scene: EngineScene, loads: dict[str, LineLoad]) -> None:
    """Add the distributed loads of beams as loads on nodes, fixed to the node if they turn with the section."""
    for load in loads.values():
        strip = cast(PlacedStrip, scene.placed[load.link])
        lengths = nodal_lengths(strip.body, strip.pieces)
        for node, length, (_, _, angle) in zip(strip.nodes, lengths, strip.reference, strict=True):
            fx, fy = (length * component for component in load.force)
            c, s = (cos(angle), sin(angle)) if load.turns else (1.0, 0.0)
            marker = scene.system.AddMarker(eii.MarkerNodeRigid(nodeNumber=node))
            # in the axes of the node, from those of the ground at t = 0
            vector = [c * fx + s * fy, -s * fx + c * fy, 0.0]
            scene.system.AddLoad(eii.LoadForceVector(markerNumber=marker, loadVector=vector, bodyFixed=load.turns))
            if load.moment:
                scene.system.AddLoad(eii.LoadTorqueVector(markerNumber=marker, loadVector=[0.0, 0.0, length * load.moment]))


def add_torques(scene: EngineScene, loads: dict[str, Torque]) -> None:
    """Add torques on links."""
    for name, load in loads.items():
        _refuse_states(load)
        marker = scene.angle_marker(*place(angle_reference(scene.mechanism, load.link)))
        if callable(load.value):
            add_coordinate_force(scene, marker, guard(scene, name, load.value))
        else:
            scene.system.AddLoad(eii.LoadCoordinate(markerNumber=marker, load=load.value))


def add_coordinate_force(scene: EngineScene, marker: int, force: Callback) -> None:
    """Add a torque [N m] on an angle, or a force [N] on a travel, as a spring, as springs enter the engine's Jacobian.

    `force` has the arguments (time for messages, time, coordinate, its rate), as a function of `guard`.
    """
    scene.system.AddObject(eii.ObjectConnectorCoordinateSpringDamper(
        markerNumbers=[scene.ground, marker],
        # for the engine a spring's force is positive against the coordinate
        springForceUserFunction=lambda _system, t, _item, coordinate, rate, *_: -float(force(t, t, coordinate, rate)),
    ))  # fmt: skip


def add_motors(scene: EngineScene, loads: dict[str, Motor]) -> None:
    """Add the torque of each motor to its link."""
    for name, load in loads.items():
        torque = partial(_compute_motor_torque, load, guard(scene, name, load.voltage))
        add_coordinate_force(scene, scene.angle_marker(*place(angle_reference(scene.mechanism, load.link))), torque)


def _compute_motor_torque(motor: Motor, voltage: Callback, _time: float, t: float, _angle: float, speed: float) -> float:
    return float(motor.torque(voltage(t, t), speed))


def add_springs(scene: EngineScene, loads: dict[str, Spring]) -> None:
    """Add springs between points."""
    for name, load in loads.items():
        markers = [scene.marker(*place(holder_reference(scene.mechanism, at))) for at in (load.a, load.b)]
        options = _make_spring_parameters(scene, name, load)
        length = load.free(scene.mechanism)
        scene.system.AddObject(eii.ObjectConnectorSpringDamper(markerNumbers=markers, referenceLength=length, **options))


def _make_spring_parameters(scene: EngineScene, name: str, load: Spring | TorsionSpring, free: float = 0.0) -> dict[str, Any]:
    """Return the engine's parameters of a spring: stiffness and damping, or a callback for a law of (value - free, rate)."""
    if load.law is None:
        return {"stiffness": load.stiffness, "damping": load.damping}
    law = guard(scene, name, load.law)
    # the value is the elongation of a spring, with `free` = 0, or the angle of a torsion spring, which has no torque at `free`
    return {"springForceUserFunction": lambda _system, t, _item, value, rate, *_: law(t, value - free, rate)}


def add_torsion_springs(scene: EngineScene, loads: dict[str, TorsionSpring]) -> None:
    """Add torsion springs between the angles of two bodies."""
    for name, load in loads.items():
        free = load.free_angle or 0.0
        options = _make_spring_parameters(scene, name, load, free)
        if load.law is None:
            options["offset"] = free
        markers = [scene.angle_marker(*place(end)) for end in load.ends(scene.mechanism)]
        scene.system.AddObject(eii.ObjectConnectorCoordinateSpringDamper(markerNumbers=markers, **options))


def join_struts(scene: EngineScene, links: dict[str, Link]) -> None:
    """Add struts as springs between the bodies at their ends."""
    for name, link in links.items():
        spring = StrutSpring(link.body, scene.mechanism.length(name))  # type: ignore[arg-type]
        scene.struts[name] = spring
        # the bodies at its ends: blocks, other links or the ground
        ends = [(holder(scene.mechanism, f"{name}:{point}"), point) for point in (link.start, link.end)]
        scene.system.AddObject(eii.ObjectConnectorSpringDamper(
            markerNumbers=[scene.marker(*end) for end in ends], referenceLength=spring.length,
            springForceUserFunction=watch(scene, f"strut '{name}'", spring, Status.STRUT_OUT_OF_RANGE),
        ))  # fmt: skip


def add_drives(scene: EngineScene, drives: dict[str, Drive]) -> None:
    """Prescribe each driven coordinate by a constraint; a constant velocity needs no callbacks."""
    for name, drive in drives.items():
        if scene.source.is_explicit_in_exudyn:  # it has no constraints: a huge inertia keeps the initial speed
            (rigid_body,) = scene.placed[drive.target].objects
            scene.system.SetObjectParameter(rigid_body, "inertia", 1e12)  # kg m^2: chosen far above that of any link
            scene.readers[name, "effort"] = partial(_compute_effort, drive)
            continue
        is_block = drive.target in scene.mechanism.points  # a block has the name of its point
        number = 0 if is_block else 2  # of the travel of a block, of the angle of a link
        markers = [scene.ground, scene.coordinate_marker(drive.target, number)]
        if isinstance(drive.speed, int | float):
            item = eii.CoordinateConstraint(markerNumbers=markers, velocityLevel=True, offset=float(drive.speed))
        else:
            functions, what = (drive.motion.position, drive.motion.speed), f"the motion of the drive of '{drive.target}'"
            position, speed = (watch(scene, what, lambda _system, t, _item, _offset, f=f: f(t)) for f in functions)
            item = eii.CoordinateConstraint(markerNumbers=markers, offsetUserFunction=position, offsetUserFunction_t=speed)
        scene.constraints[name] = int(scene.system.AddObject(item))
        # the force or torque on the driven body is the constraint's multiplier with opposite sign, (times, 1)
        indices = partial(scene.multiplier_indices, name)  # known in the assembled system
        scene.readers[name, "effort"] = lambda run, _record, get=indices: -run.multipliers[:, get()]  # type: ignore[misc]


def _compute_effort(drive: Drive, _run: History, record: Record) -> Array:
    """Return the torque [N m], (times, 1), with which contacts and loads on a link of constant speed are in balance."""
    total = np.zeros_like(record.time)
    centre, _velocity, _acceleration = record.links[drive.target].centre()  # moments about it change the speed of rotation
    for name, element in Scene.of(record.mechanism).elements.items():
        for point, force, torque in element.pushes(name, record) or ():
            if place(point).body == drive.target:
                position, _velocity = record.point(point)
                total = total - cross(position - centre, force) - torque
    return total[:, None]
