"""Ideal pins in the engine."""

from __future__ import annotations

from typing import Any

from buckler.mbs.elements.revolute import Revolute


def connect(scene: Any, joints: dict[str, Revolute]) -> None:
    """Add each pin; a strut acts on its neighbour directly."""
    for name, joint in joints.items():
        if {joint.first, joint.second} & scene.strut_links:
            continue
        scene.constrain(name, scene.marker(joint.first, joint.point), scene.marker(joint.second, joint.point))
        scene.reads(name, "force", scene.multiplier(name))
        scene.parts["Revolute"] += 1
