"""Constraints of the compiled solver from the rows by which an element says what it asks of the bodies' places."""

from __future__ import annotations

from typing import Any

import numpy as np

from buckler.mbs.elements.element import GROUND
from buckler.mbs.elements.rows import Along
from buckler.mbs.spectral import tables as k
from buckler.mbs.spectral.builder import Builder
from buckler.mbs.spectral.strut import StrutBody


def connect(builder: Builder, name: str, element: Any) -> None:
    """Add the rows of a joint, guide or drive; a strut leans on its neighbour and needs none of its pins."""
    for row in element.rows(builder.mechanism):
        if row.start_only:
            continue
        a, b = (marker_of(builder, end.body, end.point) for end in (row.first, row.second))
        if a == b and isinstance(row, Along):
            continue
        motion = -1 if row.motion is None else builder.add_motion(row.motion, name)
        if not isinstance(row, Along):
            builder.add_row(name, builder.add_measure(k.ANGLE, a, b), motion)
            continue
        if row.frame.body == GROUND:
            measure = builder.add_measure(k.FIXED, a, b, row.direction)
        else:
            frame = marker_of(builder, row.frame.body, row.frame.point)
            if frame != b:
                raise ValueError(f"'{name}': a direction that turns with another body than the second is not known here")
            measure = builder.add_measure(k.TURNING, a, b, turned_back(builder, b, row.direction))
        builder.add_row(name, measure, motion)


def turned_back(builder: Builder, marker: int, direction: Any) -> tuple[float, float]:
    """A direction at t = 0 as seen from a marker that has an angle then."""
    angle = builder.angle_of(marker)
    c, s = np.cos(angle), np.sin(angle)
    x, y = direction
    return float(c * x + s * y), float(-s * x + c * y)


def marker_of(builder: Builder, link: str, point: str) -> int:
    """Marker of a point as part of a body; of rigid links and the ground also of points that are not theirs, as at t = 0."""
    if link == GROUND:
        return builder.ground(builder.mechanism.points[point] if point else (0.0, 0.0))
    body: Any = builder.bodies[link]
    points = builder.mechanism.link(link).points
    if not point:
        return builder.marker(link, builder.mechanism.link(link).start)
    if point in points or isinstance(body, StrutBody):
        return builder.marker(link, point)
    if not hasattr(body, "marker_at") or not hasattr(body, "centre"):
        raise ValueError(f"link '{link}' does not reach point '{point}'")
    return int(body.marker_at(builder, np.array(builder.mechanism.points[point])))
