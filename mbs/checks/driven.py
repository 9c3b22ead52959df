"""Self-check of driven linkages: do they keep off dead centres?

All recorded times are checked at once, from places alone (see `mbs.kinematics.linkage`).
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..geometry import Array
from ..kinematics.closing import divides
from ..record.record import Record
from ..record.result import Result
from ..record.run import Run
from ..scene.scene import Scene
from .check import check

SINGULAR = 1e-3
"""Determinant of the constraints, relative to its largest, below which a linkage is at a dead centre."""


def determinant(jacobian: Array) -> Array:
    """Determinant of the constraints at each sample; of redundant ones the volume that their columns span."""
    square = jacobian.shape[1] == jacobian.shape[2]
    return np.linalg.det(jacobian) if square else np.sqrt(np.abs(np.linalg.det(jacobian.mT @ jacobian)))


def _places(record: Record) -> Array:
    """Places of all links' starts and their directions, shape (times, links, 3)."""
    start = Scene.of(record.mechanism).linkage.reference
    rows = [
        np.column_stack([record.links[link.name].point(link.start)[0], record.links[link.name].turn()[0] + at[2]])
        for link, at in zip(record.mechanism.links, start, strict=True)
    ]
    return np.stack(rows, axis=1)


def _not_determined(run: Run, _result: Result) -> str:
    determined = Scene.of(run.record.mechanism).is_determined
    return "" if determined else "not a linkage of which the drives alone decide the motion"


@check("BRANCH", _not_determined)
def off_dead_centres(run: Run, _result: Result) -> Iterator[str]:
    """Check that no dead centre is met, beyond which the motion is not determined.

    The determinant of the constraints keeps its sign: it is zero at a dead centre only, where the motion is not determined, and
    beyond which lies the other way of assembling the linkage. Redundant rows may decide which way a singular pose is left.
    """
    time, places = run.record.time, _places(run.record)
    linkage = Scene.of(run.record.mechanism).linkage.until(float(time[-1]))
    jacobian = linkage.system(places, np.zeros_like(places))[1]
    size = determinant(jacobian)
    low = ~(size * np.sign(size[0]) > SINGULAR * np.abs(size).max())
    for k in np.flatnonzero(low):
        after = np.flatnonzero(~low[k:])
        j = k + int(after[0]) if len(after) else len(low) - 1
        far = float(np.abs(places[j] - places[k]).max())
        if jacobian.shape[1] == jacobian.shape[2] or j == k or divides(linkage, float(time[j]), places[j], far):
            yield f"at t = {time[k]:.4g} s the linkage meets a dead centre: what follows is not determined"
            return
