"""Self-check of driven linkages: do they keep off dead centres?

All recorded times are checked at once, from places alone (see `mbs.kinematics.linkage`).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ..geometry import Array
from ..kinematics.closing import divides
from ..record.record import Record
from ..record.result import Result
from ..record.run import Run
from ..scene.linkage import Linkage
from ..scene.scene import Scene
from .check import check

SINGULAR = 1e-3
"""Determinant of the constraints, relative to its largest, below which a linkage is at a dead centre."""


class Followed(NamedTuple):
    """A linkage's loops, places of its links' starts and directions (times, links, 3), the Jacobian there, and times [s]."""

    linkage: Linkage
    places: Array
    jacobian: Array
    time: Array = np.empty(0)


def follow(record: Record) -> Followed | None:
    """Return a driven linkage in its recorded places; None where constraints alone do not decide its motion."""
    scene = Scene.of(record.mechanism)
    if not scene.is_determined:
        return None
    linkage, places = scene.linkage.until(float(record.time[-1])), _places(record)
    return Followed(linkage, places, linkage.system(places, np.zeros_like(places))[1], record.time)


def dead_centre(known: Followed) -> int | None:
    """Return the first sample at a dead centre or beyond it.

    The determinant of the constraints keeps its sign: it is zero at a dead centre only, where the motion is not determined, and
    beyond which lies the other way of assembling the linkage.
    """
    jacobian = known.jacobian
    square = jacobian.shape[1] == jacobian.shape[2]
    size = np.linalg.det(jacobian) if square else np.sqrt(np.abs(np.linalg.det(jacobian.mT @ jacobian)))
    low = ~(size * np.sign(size[0]) > SINGULAR * np.abs(size).max())
    if square:
        return int(np.argmax(low)) if low.any() else None
    return next((k for k in map(int, np.flatnonzero(low)) if _divides(known, k, low)), None)


def _divides(known: Followed, k: int, low: Array) -> bool:
    """True if redundant rows do not decide which way a linkage leaves the singular pose of a sample."""
    after = np.flatnonzero(~low[k:])
    j = k + int(after[0]) if len(after) else len(low) - 1
    far = float(np.abs(known.places[j] - known.places[k]).max())
    return j == k or divides(known.linkage, float(known.time[j]), known.places[j], far)


def _places(record: Record) -> Array:
    """Places of all links' starts and their directions, shape (times, links, 3)."""
    start = Scene.of(record.mechanism).linkage.reference
    rows = [
        np.column_stack([record.links[link.name].point(link.start)[0], record.links[link.name].turn()[0] + at[2]])
        for link, at in zip(record.mechanism.links, start, strict=True)
    ]
    return np.stack(rows, axis=1)


def _not_determined(run: Run, _result: Result) -> str:
    """Why there is nothing to look at, where constraints alone do not decide the motion."""
    return "" if Scene.of(run.record.mechanism).is_determined else "not a linkage of which the drives alone decide the motion"


@check(
    "BRANCH",
    "failed when a driven linkage meets a dead centre, beyond which its motion is not determined",
    {"determinant": SINGULAR},
    _not_determined,
)
def off_dead_centres(run: Run, _result: Result) -> Iterator[str]:
    """Check that the motion stays determined."""
    known = follow(run.record)
    k = None if known is None else dead_centre(known)
    if k is not None:
        yield f"at t = {run.record.time[k]:.4g} s the linkage meets a dead centre: what follows is not determined"
