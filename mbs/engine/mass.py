"""Masses and rotors in the engine: what elements add to the mass matrix of bodies."""

from __future__ import annotations

import exudyn.itemInterface as eii

from buckler.mbs.elements.element import Burden, place
from buckler.mbs.elements.mass import Mass
from buckler.mbs.engine.scene import Scene


def connect(scene: Scene, masses: dict[str, Mass]) -> None:
    """They are built with the bodies."""
    if masses:
        scene.parts["Mass"] += len(masses)


def attach(scene: Scene, burden: Burden) -> None:
    """Add a burden to a body, with its weight where the body's own weight does not count it in."""
    body, point = place(burden.at)
    placed = scene.placed[body]
    if not placed.attach(point, burden.mass, burden.inertia):
        return
    gx, gy = (burden.mass * g for g in scene.mechanism.gravity)
    if gx or gy:
        scene.system.AddLoad(eii.LoadForceVector(markerNumber=placed.ends[point], loadVector=[gx, gy, 0.0]))
