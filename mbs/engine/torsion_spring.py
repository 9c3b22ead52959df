"""Torsion springs in the engine."""

from __future__ import annotations

import exudyn.itemInterface as eii

from buckler.mbs.elements.element import place
from buckler.mbs.elements.torsion_spring import TorsionSpring
from buckler.mbs.engine.scene import Scene
from buckler.mbs.engine.spring import pull


def connect(scene: Scene, loads: dict[str, TorsionSpring]) -> None:
    """Join the angles."""
    for name, load in loads.items():
        free = load.free_angle or 0.0
        given = pull(scene, name, load)
        if "springForceUserFunction" in given:
            law = given["springForceUserFunction"]  # it gets the whole angle, whatever the offset
            given["springForceUserFunction"] = lambda s, t, i, value, *rest, law=law, free=free: law(s, t, i, value - free, *rest)
        else:
            given["offset"] = free
        markers = [scene.turning(*place(at)) for at in load.ends(scene.mechanism)]
        scene.system.AddObject(eii.ObjectConnectorCoordinateSpringDamper(markerNumbers=markers, **given))
        scene.parts["TorsionSpring"] += 1
