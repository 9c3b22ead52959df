"""Torques in the engine."""

from __future__ import annotations

from functools import partial

import exudyn.itemInterface as eii

from buckler.mbs.elements.element import place
from buckler.mbs.elements.torque import Torque
from buckler.mbs.engine.guarded import guarded
from buckler.mbs.engine.scene import Scene
from buckler.mbs.engine.states import add_states
from buckler.mbs.engine.system import Callback, System


def connect(scene: Scene, loads: dict[str, Torque]) -> None:
    """Load the angle of each link; a constant torque needs no callback."""
    for name, load in loads.items():
        at = place(load.at(scene.mechanism))
        marker = scene.turning(*at)
        if load.states is not None:
            add_torque(scene, marker, *add_states(scene, name, load, partial(scene.turn, *at)))
        elif callable(load.value):
            add_torque(scene, marker, guarded(scene, name, load.value))
        else:
            scene.system.AddLoad(eii.LoadCoordinate(markerNumber=marker, load=load.value))
        scene.parts["Torque"] += 1


def add_torque(scene: Scene, marker: int, torque: Callback) -> None:
    """Add a torque of (t, t, angle, speed) on an angle: the engine's connectors, unlike its loads, enter the Jacobian."""

    def resisting(_system: System, t: float, _item: int, angle: float, speed: float, *_: float) -> float:
        return -float(torque(t, t, angle, speed))

    scene.system.AddObject(
        eii.ObjectConnectorCoordinateSpringDamper(
            markerNumbers=[scene.ground, marker], stiffness=1.0, springForceUserFunction=resisting
        )
    )
