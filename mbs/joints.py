"""Joints, guides' friction, stops, drives and struts become Exudyn connectors.

User functions are plain Python on floats: the engine calls them a few times a step, and they carry any law.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import exudyn.itemInterface as eii
import numpy as np

from mbs.mechanism import Drive, Guide, Link, Mechanism, Stop, Strut

SLOWEST_ONSET = 1e-4
"""Approach speed, m/s, below which dissipative laws no longer scale with it: a contact at rest has no impact speed."""


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
        Approach speed when the present contact began, m/s.
    """

    stop: Stop
    face: float
    side: float
    onset: float = SLOWEST_ONSET

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
        if not touching:
            self.onset = max(self.side * speed, SLOWEST_ONSET)
        return touching


def contact_of(mechanism: Mechanism, stop: Stop) -> StopContact:
    """Place a stop in its guide's coordinate.

    Raises
    ------
    ValueError
        If the point starts on the stop's face, so that its side is undefined.
    """
    along = np.array(mechanism.guide(stop.point).along)
    start = float(along @ mechanism.points[stop.point])
    if stop.at == start:
        raise ValueError(f"stop at '{stop.point}': at = {stop.at:g} m is where the point starts; it must lie to one side")
    return StopContact(stop, stop.at - start, 1.0 if stop.at > start else -1.0)


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


def add_friction(system: Any, guide: Guide, coordinate: int, ground: int) -> int:
    """Add a guide's friction on its slider's coordinate marker: a native element without a data node."""
    friction = guide.friction
    assert friction is not None
    return int(
        system.AddObject(
            eii.ObjectConnectorCoordinateSpringDamperExt(
                markerNumbers=[ground, coordinate],
                dynamicFrictionForce=friction.dynamic,
                staticFrictionOffsetForce=friction.static_offset,
                viscousFrictionFactor=friction.viscous,
                exponentialDecayStatic=friction.stribeck,
                frictionProportionalZone=friction.regularisation,
            )
        )
    )


def add_drive(system: Any, drive: Drive, coordinate: int, ground: int) -> int:
    """Prescribe a coordinate: its velocity where the speed is constant (no callbacks), else its position and velocity."""
    markers = [ground, coordinate]
    if isinstance(drive.speed, int | float):
        item = eii.CoordinateConstraint(markerNumbers=markers, velocityLevel=True, offset=float(drive.speed))
    else:
        motion = drive.motion
        item = eii.CoordinateConstraint(
            markerNumbers=markers,
            offsetUserFunction=lambda _system, t, _item, _offset: motion.position(t),
            offsetUserFunction_t=lambda _system, t, _item, _offset: motion.speed(t),
        )
    return int(system.AddObject(item))


def strut_force(strut: Strut, length: float) -> Callable[[float], float]:
    """Tension of a strut as a function of its elongation, m -> N.

    Straight: E A/L times the elongation, down to the Euler load. Beyond it the end shortening U is shared between bending,
    u L, and compression, P L/(E A), with P = p(u) E I/L^2; the compression is 1e-7 of U, so one correction suffices.
    """
    section = strut.section
    rigidity, unit = section.axial_stiffness / length, section.bending_stiffness / length**2
    compliance = unit / section.axial_stiffness  # of u per p
    critical = float(strut.load(0.0))
    straight_to = -critical * compliance * length
    load = strut.load

    def force(elongation: float) -> float:
        if elongation >= straight_to:
            return rigidity * elongation
        total = -elongation / length
        u = max(0.0, total - compliance * float(load(max(0.0, total - compliance * critical))))
        return -unit * float(load(u))

    return force


def add_strut(system: Any, mechanism: Mechanism, link: Link, hosts: tuple[int, int]) -> int:
    """Add a massless strut between position markers of its neighbours."""
    length = mechanism.length(link.name)
    force = strut_force(link.body, length)

    def spring_force(_system: Any, _t: float, _item: int, elongation: float, *_: float) -> float:
        return force(elongation)

    return int(
        system.AddObject(
            eii.ObjectConnectorSpringDamper(
                markerNumbers=list(hosts), referenceLength=length, stiffness=1.0, springForceUserFunction=spring_force
            )
        )
    )
