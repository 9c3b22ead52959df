"""Self-checks of linkages from recorded poses: residuals of constraints, and dead centres."""

from collections.abc import Iterable, Iterator

import numpy as np

from ..elements.element import GROUND
from ..geometry import Array
from ..kinematics.determined import Follower, UnclosedError
from ..record.record import Record
from ..record.result import Result
from ..record.run import Run
from ..scene.scene import Scene
from .check import check

GAP = 1e-5
"""Largest residual of a constraint [m or rad]; for a longest link above 1 m it is multiplied by this length in m. It is a hundred
times the residual of a run with the coarsest steps."""
LEFT = 1e-2
"""Largest distance of a recorded pose from exact loop closure, over the longest link or in rad: chosen. A larger one is another
assembly. At a tenth of it runs with coarse steps would be suspect; at ten times it assemblies that stay close would be missed."""


def determinant(jacobian: Array) -> Array:
    """Compute the determinant of a Jacobian at each sample; with redundant rows, the volume spanned by its columns."""
    square = jacobian.shape[1] == jacobian.shape[2]
    return np.linalg.det(jacobian) if square else np.sqrt(np.abs(np.linalg.det(jacobian.mT @ jacobian)))


def _places(record: Record, indices: Iterable[int]) -> Array:
    """Return x, y of the start [m] and the angle [rad] of links, (times, links, 3); links not in `indices` stay as at t = 0."""
    places = np.repeat(Scene.of(record.mechanism).linkage.reference[None], len(record.time), axis=0)
    for i in indices:
        link = record.mechanism.links[i]
        motion = record.links[link.name]
        places[:, i, :2], _velocity = motion.point(link.start)
        turn_since_start, _rate = motion.turn()
        places[:, i, 2] += turn_since_start
    return places


@check(
    "BRANCH", lambda run: Scene.of(run.record.mechanism).is_determined,
    "not a linkage of which the drives alone decide the motion",
)  # fmt: skip
def check_dead_centres(run: Run, _result: Result) -> Iterator[str]:
    """Check that the linkage passes no dead centre, beyond which it may move in another assembly.

    The determinant of the Jacobian vanishes there. If it may vanish between samples, exact loop closure is followed from the
    start: it ends at a dead centre, and otherwise tells the poses, also past a dead centre that is missed by little.
    """
    record = run.record
    time, places = record.time, _places(record, range(len(record.mechanism.links)))
    linkage = Scene.of(record.mechanism).linkage.limit_drives(float(time[-1]))  # no drive's speed is asked for after the run
    if not _may_vanish(time, determinant(linkage.jacobian(places))):
        return
    follower = Follower(record.mechanism, float(time[-1]))
    if follower.failure is not None:
        yield follower.failure.message
        return
    try:
        exact = follower.at(time).q
    except UnclosedError as error:
        yield str(error)
        return
    distance = np.abs((places - exact) / (linkage.size, linkage.size, 1.0)).max(axis=(1, 2))
    if distance.max() > LEFT:
        left = float(time[np.argmax(distance > LEFT)])
        yield f"at t = {left:.4g} s the run has left its assembly, near a dead centre: lower the tolerance or the longest step"


def _may_vanish(time: Array, values: Array) -> bool:
    """Return True if samples of a function allow it a zero: its sign changes, or the slopes of steps nearby would reach zero."""
    steps = np.diff(time)
    slopes = np.abs(np.diff(values)) / steps
    steepest, longest = (np.maximum(np.append(x, 0.0), np.append(0.0, x)) for x in (slopes, steps))  # at each sample
    return not (values * np.sign(values[0]) > steepest * longest).all()  # True for nan as well


def _rigid_links(run: Run) -> list[int]:
    """Return the indices of recorded rigid links."""
    links = run.record.mechanism.links
    return [i for i, link in enumerate(links) if not link.body.flexible and link.name in run.record.links]


def _rigid_rows(run: Run) -> list[int]:
    """Return the rows of constraints between recorded rigid links and the ground, that hold throughout; none of drives."""
    linkage = Scene.of(run.record.mechanism).linkage
    among = {GROUND, *(run.record.mechanism.links[i].name for i in _rigid_links(run))}
    return [k for k in linkage.permanent_rows if k not in linkage.motions and linkage.rows[k].bodies <= among]


@check("CONSTRAINTS", _rigid_rows, "no constraint between rigid links")
def check_constraints(run: Run, _result: Result) -> Iterator[str]:
    """Check that the residuals of constraints between rigid links are small."""
    linkage = Scene.of(run.record.mechanism).linkage
    rows = _rigid_rows(run)
    residuals, _jacobian = linkage.system(_places(run.record, _rigid_links(run)))
    gaps = np.abs(residuals[:, rows])  # [m or rad], (times, rows)
    k, row = np.unravel_index(int(np.argmax(gaps)), gaps.shape)
    gap = float(gaps[k, row])
    if gap > GAP * max(1.0, linkage.size):  # the size is the longest link [m]
        yield f"'{linkage.names[rows[row]]}' is apart by {gap:.3g} m (or rad) at t = {run.record.time[k]:.4g} s"
