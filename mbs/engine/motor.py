"""Motors in the engine; the rotor's inertia is a burden of the link."""

from __future__ import annotations

from buckler.mbs.elements.element import place
from buckler.mbs.elements.motor import Motor
from buckler.mbs.engine.guarded import guarded
from buckler.mbs.engine.scene import Scene
from buckler.mbs.engine.system import Callback
from buckler.mbs.engine.torque import add_torque


def connect(scene: Scene, loads: dict[str, Motor]) -> None:
    """Let each motor turn its link."""
    for name, load in loads.items():
        voltage = guarded(scene, name, load.voltage)

        def torque(t: float, _u: float, _angle: float, speed: float, load: Motor = load, voltage: Callback = voltage) -> float:
            return float(load.torque(voltage(t, t), speed))

        add_torque(scene, scene.turning(*place(load.at(scene.mechanism))), torque)
        scene.parts["Motor"] += 1
