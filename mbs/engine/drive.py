"""Drives in the engine."""

from __future__ import annotations

from typing import Any

import exudyn.itemInterface as eii

from buckler.mbs.elements.clearance import moment_on
from buckler.mbs.elements.drive import Drive

FLYWHEEL = 1e12
"""Moment of inertia, kg m^2, of a link turned at constant speed in a scene without constraints."""


def connect(scene: Any, drives: dict[str, Drive]) -> None:
    """Prescribe each driven coordinate."""
    for name, drive in drives.items():
        if scene.loose:  # an explicit integrator takes no constraint: constant speed is a flywheel no contact can brake
            scene.system.SetObjectParameter(scene.placed[drive.target].objects[0], "inertia", FLYWHEEL)
            scene.reads(name, "effort", lambda _run, record, drive=drive: -moment_on(record, drive.target)[:, None])
        else:
            coordinate = scene.coordinate(drive.target, 2 if drive.target not in scene.mechanism.points else 0)
            scene.constraints[name] = add_drive(scene.system, drive, coordinate, scene.ground)
            scene.reads(name, "effort", scene.multiplier(name))
        scene.parts["Drive"] += 1


def add_drive(system: Any, drive: Drive, coordinate: int, ground: int) -> int:
    """Prescribe a coordinate: its velocity where the speed is constant (no callbacks), else its position and velocity."""
    markers = [ground, coordinate]
    if isinstance(drive.speed, int | float):
        item = eii.CoordinateConstraint(markerNumbers=markers, velocityLevel=True, offset=float(drive.speed))
    else:
        motion = drive.motion
        item = eii.CoordinateConstraint(
            markerNumbers=markers,
            offsetUserFunction=lambda _system, t, _item, _offset: motion.position(t),
            offsetUserFunction_t=lambda _system, t, _item, _offset: motion.speed(t),
        )
    return int(system.AddObject(item))
