"""Loads along beams in the engine: forces and torques at its nodes, by the shares of length that the elements' functions give."""

from __future__ import annotations

from math import cos, sin
from typing import cast

import exudyn.itemInterface as eii

from buckler.mbs.elements.line_load import LineLoad
from buckler.mbs.engine.scene import Scene
from buckler.mbs.engine.strip import PlacedStrip
from buckler.mbs.record.strips import shares


def connect(scene: Scene, loads: dict[str, LineLoad]) -> None:
    """Load each node; a force that turns with the section is fixed in its node."""
    for load in loads.values():
        strip = cast(PlacedStrip, scene.placed[load.link])
        for node, length, (_, _, turn) in zip(strip.nodes, shares(strip.body.step, strip.pieces), strip.reference, strict=True):
            fx, fy = (length * each for each in load.force)
            c, s = (cos(turn), sin(turn)) if load.turns else (1.0, 0.0)
            marker = scene.system.AddMarker(eii.MarkerNodeRigid(nodeNumber=node))
            vector = [c * fx + s * fy, -s * fx + c * fy, 0.0]
            scene.system.AddLoad(eii.LoadForceVector(markerNumber=marker, loadVector=vector, bodyFixed=load.turns))
            if load.moment:
                scene.system.AddLoad(eii.LoadTorqueVector(markerNumber=marker, loadVector=[0.0, 0.0, length * load.moment]))
        scene.parts["LineLoad"] += 1
