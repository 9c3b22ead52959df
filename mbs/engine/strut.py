"""Struts in the engine: springs between their neighbours."""

from __future__ import annotations

import exudyn.itemInterface as eii

from buckler.mbs.elements.link import Link
from buckler.mbs.elements.references import holder
from buckler.mbs.engine.forces import StrutSpring
from buckler.mbs.engine.guarded import watched
from buckler.mbs.engine.scene import Scene
from buckler.mbs.geometry import Array
from buckler.mbs.record.status import Status


def add(scene: Scene, link: Link, _velocity: Array) -> None:
    """A strut has no body of its own."""


def connect(scene: Scene, links: dict[str, Link]) -> None:
    """Add each strut between position markers of its neighbours."""
    for name, link in links.items():
        spring = StrutSpring(link.body, scene.mechanism.length(name))  # type: ignore[arg-type]
        scene.struts[name] = spring
        scene.system.AddObject(
            eii.ObjectConnectorSpringDamper(
                markerNumbers=[_host(scene, link, link.start), _host(scene, link, link.end)],
                referenceLength=spring.length,
                stiffness=1.0,
                springForceUserFunction=watched(scene, f"strut '{name}'", spring, Status.STRUT_OUT_OF_RANGE),
            )
        )


def _host(scene: Scene, link: Link, point: str) -> int:
    """Marker of the body a strut's end acts on: a block, a link or the ground it is pinned to, there or through other struts."""
    return int(scene.marker(holder(scene.mechanism, f"{link.name}:{point}"), point))
