"""Struts in the engine: springs between their neighbours."""

from __future__ import annotations

from typing import Any

import exudyn.itemInterface as eii

from buckler.mbs.elements.element import Array
from buckler.mbs.elements.link import Link
from buckler.mbs.elements.strut import Strut, StrutLaw


class StrutSpring(StrutLaw):
    """The engine's callback of one strut, and the last state the engine asked it for.

    Attributes
    ----------
    elongation, rate : float
        The engine's last call, m and m/s.
    """

    def __init__(self, strut: Strut, length: float) -> None:
        super().__init__(strut, length)
        self.elongation = self.rate = 0.0

    def __call__(self, _system: Any, _t: float, _item: int, elongation: float, rate: float, *_: float) -> float:
        """Tension, N."""
        self.elongation, self.rate = elongation, rate
        return self.force(elongation, rate)


def add(scene: Any, link: Link, _velocity: Array) -> None:
    """A strut has no body of its own."""


def connect(scene: Any, links: dict[str, Link]) -> None:
    """Add each strut between position markers of its neighbours."""
    for name, link in links.items():
        spring = StrutSpring(link.body, scene.mechanism.length(name))  # type: ignore[arg-type]
        scene.struts[name] = spring
        scene.system.AddObject(
            eii.ObjectConnectorSpringDamper(
                markerNumbers=[_host(scene, link, link.start), _host(scene, link, link.end)],
                referenceLength=spring.length,
                stiffness=1.0,
                springForceUserFunction=spring,
            )
        )


def _host(scene: Any, link: Link, point: str) -> int:
    """Marker of the body a strut's end acts on: its block, or a link or the ground it is pinned to."""
    for guide in scene.mechanism.guides:
        if guide.point == point and guide.link == link.name:
            return int(scene.marker(point, point))
    for joint in scene.mechanism.joints:
        if joint.point == point and link.name in (joint.first, joint.second):
            other = joint.second if joint.first == link.name else joint.first
            if other not in scene.strut_links:
                return int(scene.marker(other, point))
    needed = "a link with mass, a guide or ground"
    raise ValueError(f"link '{link.name}': a Strut is massless, so '{point}' must be pinned to {needed}")
