"""Masses and rotors in the engine: what elements add to the mass matrix of bodies."""

from __future__ import annotations

from typing import Any

import exudyn.itemInterface as eii
import numpy as np

from buckler.mbs.elements.element import Burden, place
from buckler.mbs.elements.rigid import Rigid


def connect(scene: Any, masses: dict[str, Any]) -> None:
    """They are built with the bodies."""
    scene.parts["Mass"] += len(masses)


def attach(scene: Any, burden: Burden) -> None:
    """Add a burden to a node of a flexible link, or to a block: a constant block of the mass matrix."""
    body, point = place(burden.at)
    placed = scene.placed[body]
    if isinstance(placed.body, Rigid):
        return  # the link was built with it
    node, size = placed.bearing(scene, point, turns=burden.inertia > 0)
    diagonal = [burden.mass, burden.mass, burden.inertia, 0.0][:size]
    scene.system.AddObject(eii.ObjectGenericODE2(nodeNumbers=[node], massMatrix=np.diag(diagonal)))
    gx, gy = (burden.mass * g for g in scene.mechanism.gravity)
    if gx or gy:
        scene.system.AddLoad(eii.LoadForceVector(markerNumber=placed.ends[point], loadVector=[gx, gy, 0.0]))
