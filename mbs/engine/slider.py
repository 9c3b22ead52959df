"""Sliders and slots in the engine: its prismatic joint, the line's normal on the second body."""

from __future__ import annotations

import exudyn.itemInterface as eii
import numpy as np

from buckler.mbs.elements.element import GROUND
from buckler.mbs.elements.slider import Slot
from buckler.mbs.engine.scene import Reader, Scene


def connect(scene: Scene, joints: dict[str, Slot]) -> None:
    """Add each slider or slot."""
    for name, joint in joints.items():
        (first, leans), (second, turned) = (_marker(scene, body, joint.point) for body in (joint.first, joint.second))
        ax, ay = joint.along
        item = eii.ObjectJointPrismatic2D(
            markerNumbers=[first, second],
            axisMarker0=_local((ax, ay), leans),
            normalMarker1=_local((-ay, ax), turned),
            constrainRotation=joint.keeps_angle,
        )
        scene.constraints[name] = int(scene.system.AddObject(item))
        scene.reads(name, "effort", _effort(scene, name))
        scene.parts[type(joint).__name__] += 1


def _effort(scene: Scene, name: str) -> Reader:
    """Reader of normal force and moment on the second body; the engine's second equation falls as that body turns ahead."""
    signs = np.array([-1.0, 1.0])
    return lambda run, _record: signs * run.multipliers[:, scene.multipliers(name)]


def _marker(scene: Scene, body: str, point: str) -> tuple[int, float]:
    """Rigid marker of a body, or of the ground, at a point, and the direction of its axes at t = 0."""
    if body != GROUND:
        placed = scene.placed[body]
        return placed.rigid_marker(point), placed.direction(point)
    x, y = scene.mechanism.points[point]
    ground = scene.system.AddObject(eii.ObjectGround(referencePosition=[x, y, 0.0]))
    return int(scene.system.AddMarker(eii.MarkerBodyRigid(bodyNumber=ground, localPosition=[0.0, 0.0, 0.0]))), 0.0


def _local(vector: tuple[float, float], angle: float) -> list[float]:
    """A vector in axes turned by an angle."""
    c, s = np.cos(angle), np.sin(angle)
    return [c * vector[0] + s * vector[1], c * vector[1] - s * vector[0], 0.0]
