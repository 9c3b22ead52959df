"""Clamped joints in the engine: a pin, and one turn for both bodies."""

from __future__ import annotations

from typing import Any

import exudyn.itemInterface as eii

from buckler.mbs.elements.weld import Weld


def connect(scene: Any, joints: dict[str, Weld]) -> None:
    """Add each clamp."""
    for name, joint in joints.items():
        bodies = (joint.first, joint.second)
        turn = f"{name}: turn"
        scene.constrain(name, *(scene.marker(body, joint.point) for body in bodies))
        markers = [scene.turning(body, joint.point) for body in bodies]
        scene.constraints[turn] = int(scene.system.AddObject(eii.CoordinateConstraint(markerNumbers=markers)))
        scene.reads(name, "force", scene.multiplier(name))
        scene.reads(name, "moment", scene.multiplier(turn))
        scene.parts["Weld"] += 1
