"""Drives in the engine."""

from __future__ import annotations

from functools import partial

import exudyn.itemInterface as eii
import numpy as np

from buckler.mbs.elements.drive import Drive
from buckler.mbs.elements.element import place
from buckler.mbs.engine.guarded import watched
from buckler.mbs.engine.history import History
from buckler.mbs.engine.scene import Scene
from buckler.mbs.engine.system import System
from buckler.mbs.geometry import Array, cross
from buckler.mbs.record.record import Record

FLYWHEEL = 1e12
"""Moment of inertia, kg m^2, of a link turned at constant speed in a scene without constraints."""


def connect(scene: Scene, drives: dict[str, Drive]) -> None:
    """Prescribe each driven coordinate."""
    for name, drive in drives.items():
        if scene.loose:  # an explicit integrator takes no constraint: constant speed is a flywheel no contact can brake
            scene.system.SetObjectParameter(scene.placed[drive.target].objects[0], "inertia", FLYWHEEL)
            scene.reads(name, "effort", partial(_effort, drive))
        else:
            coordinate = scene.coordinate(drive.target, 2 if drive.target not in scene.mechanism.points else 0)
            scene.constraints[name] = add_drive(scene.system, drive, coordinate, scene.ground, scene)
            scene.reads(name, "effort", scene.multiplier(name))
        scene.parts["Drive"] += 1


def _effort(drive: Drive, _run: History, record: Record) -> Array:
    """Torque that keeps a flywheel's speed against contacts and loads, N m, (times, 1)."""
    total, centre = np.zeros_like(record.time), record.links[drive.target].centre()[0]
    for name, element in record.mechanism.elements().items():
        for at, force, torque in element.pushes(name, record) or ():
            if place(at).body == drive.target:
                total = total - cross(record.point(at)[0] - centre, force) - torque
    return total[:, None]


def add_drive(system: System, drive: Drive, coordinate: int, ground: int, scene: Scene | None = None) -> int:
    """Prescribe a coordinate: its velocity where the speed is constant (no callbacks), else its position and velocity.

    A scene, if there is one, is told what the motion raises.
    """
    markers = [ground, coordinate]
    if isinstance(drive.speed, int | float):
        item = eii.CoordinateConstraint(markerNumbers=markers, velocityLevel=True, offset=float(drive.speed))
    else:
        motion, who = drive.motion, f"the motion of the drive of '{drive.target}'"
        asked = [
            watched(scene, who, lambda _system, t, _item, _offset, ask=ask: ask(t)) for ask in (motion.position, motion.speed)
        ]
        item = eii.CoordinateConstraint(markerNumbers=markers, offsetUserFunction=asked[0], offsetUserFunction_t=asked[1])
    return int(system.AddObject(item))
