"""Stops in the engine."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import exudyn.itemInterface as eii

from buckler.mbs.elements.stop import Stop

SLOWEST_ONSET = 1e-4
"""Approach speed, m/s, below which dissipative laws no longer scale with it: a contact at rest has no impact speed."""
GRAZE = 0.05
"""Share of the fastest approach so far that a stop's slower ones are taken for: after the last tiny rebound of a slider
coming to rest, a law that divides by the approach speed would else let a slow release pull."""


@dataclass
class StopContact:
    """Running state of one stop: where its face lies in the guide's coordinate, and the last approach speed.

    Attributes
    ----------
    face : float
        Travel along the guide at which the point touches, m.
    side : float
        +1 if the face lies ahead of the start in the guide's direction, -1 if behind.
    onset : float
        Approach speed when the present contact began, m/s, or a share of the fastest one so far.
    fastest : float
        Fastest approach so far that ended in contact, m/s.
    """

    stop: Stop
    face: float
    side: float
    onset: float = SLOWEST_ONSET
    fastest: float = SLOWEST_ONSET

    def depth(self, travel: Any) -> Any:
        """Penetration depth, m, positive in contact."""
        return self.side * (travel - self.face)

    def force(self, travel: float, speed: float) -> float:
        """Contact force, N, never negative."""
        depth = self.side * (travel - self.face)
        return self.stop.law.force(depth, self.side * speed, self.onset) if depth > 0 else 0.0

    def accept(self, travel: float, speed: float) -> bool:
        """Take over the state at the end of a step; true in contact."""
        touching = self.side * (travel - self.face) > 0
        if touching:
            self.fastest = max(self.fastest, self.onset)
        else:
            self.onset = max(self.side * speed, SLOWEST_ONSET, GRAZE * self.fastest)
        return touching


def contact_of(mechanism: Any, stop: Stop) -> StopContact:
    """Place a stop in its guide's coordinate."""
    return StopContact(stop, stop.face(mechanism), stop.side(mechanism))


def connect(scene: Any, stops: dict[str, Stop]) -> None:
    """Add each stop on its block's coordinate."""
    for k, (name, stop) in enumerate(stops.items()):
        contact = scene.stops[name] = contact_of(scene.mechanism, stop)
        add_stop(scene.system, contact, scene.coordinate(stop.point, 0), scene.ground)
        scene.reads(name, "force", lambda run, _record, k=k: run.contact[:, k : k + 1])
        scene.parts["Stop"] += 1


def add_stop(system: Any, contact: StopContact, coordinate: int, ground: int) -> int:
    """Add a stop on a slider's coordinate marker."""

    def spring_force(_system: Any, _t: float, _item: int, travel: float, speed: float, *_: float) -> float:
        return contact.side * contact.force(travel, speed)

    return int(
        system.AddObject(
            eii.ObjectConnectorCoordinateSpringDamper(
                markerNumbers=[ground, coordinate], stiffness=1.0, springForceUserFunction=spring_force
            )
        )
    )
