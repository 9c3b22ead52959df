"""Springs in the engine."""

from __future__ import annotations

from typing import Any

import exudyn.itemInterface as eii

from buckler.mbs.elements.element import place
from buckler.mbs.elements.references import held_at
from buckler.mbs.elements.spring import Spring
from buckler.mbs.elements.torsion_spring import TorsionSpring
from buckler.mbs.engine.guarded import guarded
from buckler.mbs.engine.scene import Scene
from buckler.mbs.engine.system import System


def connect(scene: Scene, loads: dict[str, Spring]) -> None:
    """Join the points; only a law needs a callback."""
    for name, load in loads.items():
        markers = [scene.marker(*place(held_at(scene.mechanism, at))) for at in (load.a, load.b)]
        scene.system.AddObject(
            eii.ObjectConnectorSpringDamper(
                markerNumbers=markers, referenceLength=load.free(scene.mechanism), **pull(scene, name, load)
            )
        )
        scene.parts["Spring"] += 1


def pull(scene: Scene, name: str, load: Spring | TorsionSpring) -> dict[str, Any]:
    """The engine's parameters of what pulls a coordinate back: stiffness and damping, or a law of (value, rate)."""
    if load.law is None:
        return {"stiffness": load.stiffness, "damping": load.damping}
    law = guarded(scene, name, load.law)

    def force(_system: System, t: float, _item: int, value: float, rate: float, *_: float) -> float:
        return law(t, value, rate)

    return {"stiffness": 1.0, "springForceUserFunction": force}
