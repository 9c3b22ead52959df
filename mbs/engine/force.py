"""Forces in the engine."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from math import cos, sin

import exudyn.itemInterface as eii

from buckler.mbs.elements.element import place
from buckler.mbs.elements.force import Force
from buckler.mbs.elements.references import held_at
from buckler.mbs.engine.guarded import guarded
from buckler.mbs.engine.scene import Scene
from buckler.mbs.engine.states import add_states
from buckler.mbs.engine.system import Callback, System
from buckler.mbs.engine.torque import add_torque


def connect(scene: Scene, loads: dict[str, Force]) -> None:
    """Load each point; a constant force needs no callback."""
    for name, load in loads.items():
        at = place(held_at(scene.mechanism, load.point))
        marker, follows = scene.marker(*at), load.turns_with(scene.mechanism)
        if load.states is not None:
            item = eii.LoadForceVector(markerNumber=marker, loadVectorUserFunction=_with_states(scene, name, load, at))
        elif callable(load.value) or follows is not None:
            item = eii.LoadForceVector(markerNumber=marker, loadVectorUserFunction=_function(scene, name, load, follows))
        else:
            item = eii.LoadForceVector(markerNumber=marker, loadVector=[*load.value, 0.0])
        scene.system.AddLoad(item)
        if load.through is not None:
            add_torque(scene, scene.turning(*at), _moment(scene, at, load.through, _function(scene, name, load, follows)))
        scene.parts["Force"] += 1


def _moment(scene: Scene, at: tuple[str, str], through: tuple[float, float], force: Callable[..., list[float]]) -> Callback:
    """About its point, of a force whose line goes through a fixed place; of time and whatever else."""

    def moment(_time: float, t: float, *_: float) -> float:
        fx, fy, _z = force(None, t, None)
        x, y = scene.position(*at)
        return (through[0] - x) * fy - (through[1] - y) * fx

    return moment


def _with_states(scene: Scene, name: str, load: Force, at: tuple[str, str]) -> Callable[..., list[float]]:
    measured = partial(scene.path, *at)
    parts = add_states(scene, name, load, measured)
    return lambda _system, t, _load: [*(part(t, t, *measured()) for part in parts), 0.0]


def _function(scene: Scene, name: str, load: Force, follows: str | None) -> Callable[..., list[float]]:
    value = guarded(scene, name, load.value, 2)

    def vector(_system: System, t: float, _load: object) -> list[float]:
        fx, fy = value(t, t)
        if follows is None:
            return [fx, fy, 0.0]
        angle = scene.angle(*place(follows))
        c, s = cos(angle), sin(angle)
        return [c * fx - s * fy, s * fx + c * fy, 0.0]

    return vector
