"""Belts with stiffness in the engine: a stiffness and a damping matrix of the pulleys' turns."""

from __future__ import annotations

import exudyn.itemInterface as eii
import numpy as np

from buckler.mbs.elements.belt import Belt
from buckler.mbs.elements.element import GROUND
from buckler.mbs.engine import rows
from buckler.mbs.engine.scene import Scene


def connect(scene: Scene, belts: dict[str, Belt]) -> None:
    """Add inextensible belts by their rows, the others as matrices of the turns."""
    rows.connect(scene, {name: belt for name, belt in belts.items() if belt.stiffness is None})
    for belt in belts.values():
        if belt.stiffness is None:
            continue
        shares: dict[int, float] = {}
        for share, measure in belt.shares(scene.mechanism):
            for end, sign in ((measure.first, share), (measure.second, -share)):
                if end.body != GROUND:
                    node = scene.placed[end.body].contact_node(end.point)[0]
                    shares[node] = shares.get(node, 0.0) + sign
        slope = np.array([[0.0, 0.0, share] for share in shares.values()]).ravel()
        square = np.outer(slope, slope)
        item = eii.ObjectGenericODE2(
            nodeNumbers=[*shares], massMatrix=0.0 * square, stiffnessMatrix=belt.stiffness * square,
            dampingMatrix=belt.damping * square,
        )  # fmt: skip
        scene.system.AddObject(item)
        scene.parts["Belt"] += 1
