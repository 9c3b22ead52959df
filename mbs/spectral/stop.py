"""A stop for the compiled solver: a contact force along a line of the ground or of a link."""

from __future__ import annotations

from typing import Any

from buckler.mbs.spectral import tables as k
from buckler.mbs.spectral.builder import GROUND, Builder
from buckler.mbs.spectral.laws import add_normal


def add_stop(builder: Builder, stop: Any) -> None:
    """Add the contact of a point against a face; it is kept on the side on which it starts."""
    guides = {guide.point: guide for guide in builder.mechanism.guides}
    link, on = getattr(stop, "link", None), getattr(stop, "on", None) or GROUND
    along = getattr(stop, "along", None) or guides[stop.point].along
    point = stop.point.split(":")[-1]
    link = link or (stop.point.split(":")[0] if ":" in stop.point else None)
    if link is None:
        link = guides[point].link if point in guides else next(li.name for li in builder.mechanism.links if point in li.points)
    x, y = builder.mechanism.points[point]
    face = stop.at - (x * along[0] + y * along[1])
    if face == 0:
        raise ValueError(f"stop at '{stop.point}': at = {stop.at:g} m is where the point starts; it must lie to one side")
    a, b = builder.marker(link, point), marker_beside(builder, on, point)
    kind = k.FIXED if on == GROUND else k.TURNING
    measure = builder.add_measure(kind, a, b, along)
    number = 1 + sum(f.kind == k.CONTACT and f.name.split(".")[0] == point for f in builder.forces)
    name = point if number == 1 else f"{point}.{number}"
    law = add_normal(builder, stop.law)
    builder.add_force(name, k.CONTACT, measure, law=law, numbers=(1.0 if face > 0 else -1.0, face))


def marker_beside(builder: Builder, link: str, point: str) -> int:
    """Marker of a link where a point is at t = 0, which need not be on the link; of a rigid link or the ground."""
    if link == GROUND:
        return builder.ground(builder.mechanism.points[point])
    body: Any = builder.bodies[link]
    if hasattr(body, "centre"):
        import numpy as np

        return int(body.marker_at(builder, np.array(builder.mechanism.points[point])))
    return builder.marker(link, point)
