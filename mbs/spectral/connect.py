"""Constraints of the compiled solver from the rows of an element (see `elements.rows`), and markers of points by name."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..elements.element import GROUND, Element, place
from ..elements.rows import Along, Distance, Measure, Turn
from ..geometry import rotate
from .builder import Builder, Pair
from .frame_body import FrameBody
from .strut import StrutBody
from .tables import MeasureKind

NOWHERE = (0.0, 0.0)
"""Position of the origin; for a measure without direction, an unused direction."""


def connect(builder: Builder, name: str, element: Element) -> None:
    """Add the rows of a joint, guide, drive or coupling; pins of a strut need none, as its ends are points of its neighbours."""
    for row in element.rows(builder.mechanism):
        if row.start_only:  # holds at t = 0 only: no constraint of the motion
            continue
        terms = [term for factor, measure in row.terms for term in _yield_measure(builder, factor, measure)]
        if terms:
            motion = -1 if row.motion is None else builder.add_motion(row.motion, name)
            builder.add_row(name, [(factor, builder.add_measure(*measure)) for factor, measure in terms], motion)


def _yield_measure(builder: Builder, factor: float, measure: Measure) -> Iterator[tuple[float, tuple[int, int, int, Pair]]]:
    """Yield factor and arguments of `add_measure`; nothing for a distance between equal markers, which is always zero."""
    a, b = (marker_of(builder, end.body, end.point) for end in (measure.first, measure.second))
    if isinstance(measure, Turn):
        yield factor, (MeasureKind.ANGLE, a, b, NOWHERE)
    elif a != b and isinstance(measure, Distance):
        yield factor, (MeasureKind.DISTANCE, a, b, NOWHERE)
    elif a != b and isinstance(measure, Along):
        kind = MeasureKind.TURNING if measure.turns else MeasureKind.FIXED
        yield factor, (kind, a, b, resolve_in_axes(builder, b, measure.direction) if measure.turns else measure.direction)


def resolve_in_axes(builder: Builder, marker: int, direction: Pair) -> tuple[float, float]:
    """Return the components of a direction at t = 0 in the axes of a marker."""
    x, y = rotate(-np.array(builder.angle_of(marker)), direction)
    return float(x), float(y)


def marker_of(builder: Builder, link: str, point: str) -> int:
    """Return the marker of a point on a body; '' is its start. Links with a frame and the ground reach any point."""
    if link == GROUND:
        return builder.add_ground(builder.mechanism.points[point] if point else (0.0, 0.0))
    body = builder.bodies[link]
    points = builder.mechanism.link(link).points
    if not point:
        return builder.marker(link, builder.mechanism.link(link).start)
    if point in points or isinstance(body, StrutBody):
        return builder.marker(link, point)
    if not isinstance(body, FrameBody):
        raise ValueError(f"link '{link}' does not reach point '{point}'")
    return int(body.marker_at(builder, np.array(builder.mechanism.points[point])))


def link_of(builder: Builder, reference: str) -> tuple[str, str]:
    """Return link, or the ground, and point of a reference; the block of a guide stands for the link to which it is pinned."""
    body, point = place(reference)
    if body != GROUND and body not in {link.name for link in builder.mechanism.links}:
        return builder.mechanism.guide(body).link, point
    return body, point


def marker_at(builder: Builder, reference: str) -> int:
    """Return the marker of a point reference. 'ground:ground' is the ground as a body, whose marker is the origin."""
    link, point = link_of(builder, reference)
    if link == GROUND and point == GROUND:
        return builder.add_ground((0.0, 0.0))
    return marker_of(builder, link, point)
