"""States of loads' laws in the engine: each is the velocity of a coordinate of unit mass on which its rate acts."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import exudyn.itemInterface as eii
import numpy as np

from buckler.mbs.elements.states import Stateful
from buckler.mbs.engine import Callback, System
from buckler.mbs.engine.guarded import guarded
from buckler.mbs.engine.placed import History
from buckler.mbs.engine.scene import Scene
from buckler.mbs.geometry import Array
from buckler.mbs.record.record import Record


def add_states(scene: Scene, name: str, load: Stateful, measured: Callable[[], Sequence[float]]) -> list[Callback]:
    """Add the states of a load; what is measured now decides their rates.

    Returns
    -------
    list of callable
        Components of the load's value, of the time, for messages, of the time again and of what is measured; the states are
        those of now.
    """
    initial = load.states.initial  # type: ignore[union-attr]
    functions, count, none = [guarded(scene, name, each) for each in load.functions()], len(initial), [0.0] * len(initial)
    node = scene.system.AddNode(
        eii.NodeGenericODE2(
            numberOfODE2Coordinates=count, referenceCoordinates=none, initialCoordinates=none, initialCoordinates_t=[*initial]
        )
    )

    def rates(_system: System, t: float, _item: int, _integrals: Array, states: Sequence[float]) -> list[float]:
        return [rate(t, t, *measured(), *states) for rate in functions[load.law.size :]]

    scene.system.AddObject(eii.ObjectGenericODE2(nodeNumbers=[node], massMatrix=np.eye(count), forceUserFunction=rates))
    scene.states.append((node, count))
    scene.reads(name, "states", partial(_states, scene, node, count))

    def component(function: Callback, *values: float) -> float:
        first = scene.system.GetNodeODE2Index(node)
        return function(*values, *scene.system.systemData.GetODE2Coordinates_t()[first : first + count])

    return [partial(component, each) for each in functions[: load.law.size]]


def _states(scene: Scene, node: int, count: int, run: History, _record: Record) -> Array:
    first = scene.system.GetNodeODE2Index(node)
    return np.hstack([part[:, first : first + count] for part in (run.states.q_t, run.states.q_tt)])
