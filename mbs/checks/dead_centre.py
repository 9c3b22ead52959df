"""Self-check of driven linkages: do they keep off their dead centres?"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from buckler.mbs.checks.check import Check
from buckler.mbs.geometry import Array
from buckler.mbs.kinematics.linkage import Linkage, determined
from buckler.mbs.record.record import Record
from buckler.mbs.record.result import Result
from buckler.mbs.record.run import Run

SINGULAR = 1e-3
"""Determinant of the constraints, relative to its largest, below which a linkage is at a dead centre."""


class Followed(NamedTuple):
    """A linkage's loops, places of its links' starts and directions (times, links, 3), and the Jacobian there."""

    linkage: Linkage
    places: Array
    jacobian: Array


def followed(record: Record) -> Followed | None:
    """A driven linkage in its recorded places; None where constraints alone do not decide its motion."""
    if not determined(record.mechanism):
        return None
    linkage, places = Linkage(record.mechanism, float(record.time[-1])), _places(record)
    return Followed(linkage, places, linkage.system(places, np.zeros_like(places))[1])


def dead_centre(known: Followed) -> int | None:
    """The first sample at a dead centre or beyond it.

    The determinant of the constraints keeps its sign: it is zero at a dead centre only, where the motion is not determined, and
    beyond which lies the other way of assembling the linkage.
    """
    jacobian = known.jacobian
    square = jacobian.shape[1] == jacobian.shape[2]
    size = np.linalg.det(jacobian) if square else np.sqrt(np.abs(np.linalg.det(jacobian.mT @ jacobian)))
    low = ~(size * np.sign(size[0]) > SINGULAR * np.abs(size).max())
    return int(np.argmax(low)) if low.any() else None


def _off_dead_centres(run: Run, _result: Result) -> Iterator[str]:
    known = followed(run.record)
    k = None if known is None else dead_centre(known)
    if k is not None:
        yield f"at t = {run.record.time[k]:.4g} s the linkage meets a dead centre: what follows is not determined"


def not_determined(run: Run, _result: Result) -> str:
    """Why there is nothing to look at, where constraints alone do not decide the motion."""
    return "" if determined(run.record.mechanism) else "not a linkage of which the drives alone decide the motion"


def _places(record: Record) -> Array:
    """Places of all links' starts and their directions, shape (times, links, 3)."""
    start = Linkage(record.mechanism).reference
    rows = [
        np.column_stack([record.links[link.name].point(link.start)[0], record.links[link.name].turn()[0] + at[2]])
        for link, at in zip(record.mechanism.links, start, strict=True)
    ]
    return np.stack(rows, axis=1)


CHECK = Check(
    "BRANCH",
    "failed when a driven linkage meets a dead centre, beyond which its motion is not determined",
    _off_dead_centres,
    {"determinant": SINGULAR},
    not_determined,
)
