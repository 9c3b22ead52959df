"""Constraints of the compiled solver from the rows of an element (`elements.rows`), and markers of point references.

A marker is a point of a body with an angle; a measure is a length or an angle between two markers.
"""

from collections.abc import Iterator

import numpy as np

from ..elements.element import GROUND, Element, place
from ..elements.rows import Along, Distance, Measure, Turn
from ..geometry import rotate
from .builder import Builder
from .table_rows import Pair
from .tables import MeasureKind


def connect(builder: Builder, name: str, element: Element) -> None:
    """Add the rows of a joint, guide, drive or coupling. A pin of a strut has none: a strut ends at a point of its neighbour."""
    for row in element.rows(builder.mechanism):
        if row.start_only:  # holds at t = 0 only: no constraint of the motion
            continue
        terms = [term for factor, measure in row.terms for term in _yield_measure(builder, factor, measure)]
        if terms:
            motion = -1 if row.motion is None else builder.add_motion(row.motion, name)
            builder.add_row(name, [(factor, builder.add_measure(*measure)) for factor, measure in terms], motion)


def _yield_measure(builder: Builder, factor: float, measure: Measure) -> Iterator[tuple[float, tuple[int, int, int, Pair]]]:
    """Yield factor and arguments of `add_measure`; nothing for a length between equal markers, which is always zero."""
    a, b = (builder.marker(end.body, end.point) for end in (measure.first, measure.second))
    no_direction = (0.0, 0.0)
    if isinstance(measure, Turn):
        yield factor, (MeasureKind.ANGLE, a, b, no_direction)
    elif a != b and isinstance(measure, Distance):
        yield factor, (MeasureKind.DISTANCE, a, b, no_direction)
    elif a != b and isinstance(measure, Along) and measure.turns:
        yield factor, (MeasureKind.TURNING, a, b, resolve_in_axes(builder, b, measure.direction))
    elif a != b and isinstance(measure, Along):
        yield factor, (MeasureKind.FIXED, a, b, measure.direction)


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
