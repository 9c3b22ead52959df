"""Constraints of the compiled solver from the rows of an element (`elements.rows`), and markers of point references.

A marker is a point of a body with an angle; a measure is a length or an angle between two markers.
"""

import numpy as np

from ..elements.element import GROUND, Element, place
from ..elements.rows import Distance, Measure, Turn
from ..geometry import rotate
from .builder import Builder, Pair
from .tables import MeasureKind


def connect(builder: Builder, name: str, element: Element) -> None:
    """Add the rows of a joint, guide, drive or coupling. A pin of a strut has none: a strut ends at a point of its neighbour."""
    for row in element.rows(builder.mechanism):
        if row.start_only:  # holds at t = 0 only: no constraint of the motion
            continue
        measures = [index for factor, measure in row.terms if (index := _add_measure(builder, factor, measure)) is not None]
        if measures:
            builder.add_row(name, measures, -1 if row.motion is None else builder.add_motion(row.motion, name))


def _add_measure(builder: Builder, factor: float, measure: Measure) -> int | None:
    """Add a measure of a row; return its index, or None for a length between equal markers, which is always zero."""
    a, b = (builder.marker(end.body, end.point) for end in (measure.first, measure.second))
    if isinstance(measure, Turn):
        return builder.add_measure(MeasureKind.ANGLE, a, b, factor=factor)
    if a == b:
        return None
    if isinstance(measure, Distance):
        return builder.add_measure(MeasureKind.DISTANCE, a, b, factor=factor)
    if measure.turns:
        return builder.add_measure(MeasureKind.TURNING, a, b, resolve_in_axes(builder, b, measure.direction), factor)
    return builder.add_measure(MeasureKind.FIXED, a, b, measure.direction, factor)


def resolve_in_axes(builder: Builder, marker: int, direction: Pair) -> tuple[float, float]:
    """Return the components of a direction at t = 0 in the axes of a marker."""
    x, y = rotate(-np.array(builder.angle_of(marker)), direction)
    return float(x), float(y)


def link_of(builder: Builder, reference: str) -> tuple[str, str]:
    """Return the link, or the ground, and the point of a reference; a guide's block is replaced by the link pinned to it."""
    body, point = place(reference)
    if body != GROUND and body not in {link.name for link in builder.mechanism.links}:
        return builder.mechanism.guide(body).link, point
    return body, point


def marker_at(builder: Builder, reference: str) -> int:
    """Return the marker of a point reference; that of 'ground:', the ground as a body, is the origin."""
    return builder.marker(*link_of(builder, reference))
