"""Self-checks of linkages from recorded poses: residuals of constraints, and dead centres."""

from collections.abc import Iterable, Iterator

import numpy as np

from ..elements.element import GROUND
from ..geometry import Array
from ..kinematics.closing import has_other_branch
from ..record.record import Record
from ..record.result import Result
from ..record.run import Run
from ..scene.linkage import Linkage
from ..scene.scene import Scene
from .check import check, without

GAP = 1e-5
"""Largest residual of a constraint [m or rad]; for a longest link above 1 m it is multiplied by this length in m. It is a hundred
times the residual of a run with the coarsest steps."""


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


def _determined_linkages(run: Run) -> list[Linkage]:
    """Return the linkage of a run if its drives alone decide the motion."""
    scene = Scene.of(run.record.mechanism)
    return [scene.linkage] if scene.is_determined else []


@check("BRANCH", without(_determined_linkages, "not a linkage of which the drives alone decide the motion"))
def check_dead_centres(run: Run, _result: Result) -> Iterator[str]:
    """Check that the linkage passes no dead centre, beyond which it may move in another assembly.

    The determinant of the Jacobian is zero at a dead centre and changes its sign from one assembly to the other. Redundant rows
    may determine the motion even there. Then a second pose that closes the loops, searched close to the next regular pose, shows
    that they do not.
    """
    time, places = run.record.time, _places(run.record, range(len(run.record.mechanism.links)))
    linkage = Scene.of(run.record.mechanism).linkage.limit_drives(float(time[-1]))  # no drive's speed is asked for after the run
    jacobian = linkage.jacobian(places)
    values = determinant(jacobian)
    # at a dead centre the determinant is below a thousandth of its largest in the run: chosen; true for nan as well
    singular = ~(values * np.sign(values[0]) > 1e-3 * np.abs(values).max())
    has_redundant_rows = jacobian.shape[1] != jacobian.shape[2]
    for k in np.flatnonzero(singular):
        regular = np.flatnonzero(~singular[k:])
        j = k + int(regular[0]) if len(regular) else len(singular) - 1  # next regular sample, else the last one
        ends_here = j == k  # no later pose can show that the motion is determined
        distance = float(np.abs(places[j] - places[k]).max())  # largest change of a coordinate: where to search [m or rad]
        if not has_redundant_rows or ends_here or has_other_branch(linkage, float(time[j]), places[j], distance):
            yield f"at t = {time[k]:.4g} s the linkage meets a dead centre: what follows is not determined"
            return


def _rigid_links(run: Run) -> list[int]:
    """Return the indices of recorded rigid links."""
    links = run.record.mechanism.links
    return [i for i, link in enumerate(links) if not link.body.flexible and link.name in run.record.links]


def _rigid_rows(run: Run) -> list[int]:
    """Return the rows of constraints between recorded rigid links and the ground, that hold throughout; none of drives."""
    linkage = Scene.of(run.record.mechanism).linkage
    among = {GROUND, *(run.record.mechanism.links[i].name for i in _rigid_links(run))}
    return [k for k in linkage.permanent_rows if k not in linkage.motions and linkage.rows[k].bodies <= among]


@check("CONSTRAINTS", without(_rigid_rows, "no constraint between rigid links"))
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
