"""Loop closure of a linkage at given times by Newton's method, and detection and diagnosis of singular poses.

C(q, t) = 0 are the constraints and J = dC/dq. A branch is a family of poses that close the loops as time goes on. The scale of
residuals is the longest link [m], or 1 if that is larger, as residuals of angles are in rad.
"""

from contextlib import suppress
from itertools import combinations
from typing import NamedTuple

import numpy as np

from ..elements.element import GROUND
from ..geometry import Array
from ..record.errors import Failure, Status
from ..record.record import Record
from ..scene.linkage import Linkage, independent_rows, invert, involved_elements
from ..scene.scene import Scene

CLOSED = 1e-9
"""Largest residual of closed loops over the scale; a larger one means that redundant rows contradict others."""


class Course(NamedTuple):
    """Motion of a linkage of n links: times [s]; x, y, theta, rates, second rates (times, n, 3); Jacobian (times, rows, 3 n)."""

    time: Array
    q: Array
    q_t: Array
    q_tt: Array
    jacobian: Array


def close_loops(linkage: Linkage, times: Array, q: Array) -> Course | None:
    """Close the loops at each time by Newton's method from guesses q (times, links, 3); return None if it fails."""
    drive_travel, scale = linkage.drive_travel(times), max(1.0, linkage.size)
    previous = np.inf
    with suppress(np.linalg.LinAlgError):  # of a singular Jacobian
        for _ in range(30):  # Newton steps; from a good guess some five are enough
            residual, jacobian = linkage.system(q)
            residual = residual - drive_travel  # 0 in rows without a drive
            gap = float(np.abs(residual).max(initial=0.0))
            if not np.isfinite(gap) or gap > 1e3 * scale:  # far beyond the links' reach: Newton's method diverges
                return None
            is_exact = gap < 2e-15 * scale  # chosen: nine roundings of the scale
            is_stalled = previous < CLOSED * scale and gap >= previous  # rounding lets it decrease no further
            if is_exact or is_stalled:
                return _complete_course(linkage, times, q, jacobian) if gap < CLOSED * scale else None
            previous = gap
            if jacobian.shape[1] == jacobian.shape[2]:
                step = np.linalg.solve(jacobian, residual[..., None])
            else:  # redundant rows: by least squares
                step = invert(jacobian) @ residual[..., None]
            q = q - step.reshape(q.shape)
    return None


def _complete_course(linkage: Linkage, times: Array, q: Array, jacobian: Array) -> Course | None:
    """Compute rates and second rates of closed loops; return None if they are not finite, raise if the Jacobian is singular."""
    inverse = invert(jacobian)  # of redundant rows the Moore-Penrose inverse
    q_t = (inverse @ linkage.drive_travel(times, order=1)[..., None])[..., 0].reshape(q.shape)
    # J q_tt = gamma - C_tt, gamma the convective term; C is a measure less the travel of a drive, so that -C_tt is travel_tt
    right = linkage.convective(q, q_t) + linkage.drive_travel(times, order=2)
    q_tt = (inverse @ right[..., None])[..., 0].reshape(q.shape)
    return Course(times, q, q_t, q_tt, jacobian) if np.isfinite(q_tt).all() else None


def choose_independent_rows(jacobian: Array) -> Array:
    """Choose as many rows as columns, well conditioned, by QR with column pivoting (doi 10.1007/BF01436084)."""
    rows, columns = jacobian.shape
    if rows == columns:
        return np.arange(rows)
    from scipy.linalg import qr  # loading takes longer than the run of a rigid mechanism

    return np.sort(qr(jacobian.T, mode="r", pivoting=True)[1][:columns])


def passes_singularity(linkage: Linkage, before: Course, after: Course) -> bool:
    """Return True if a singular pose, beyond which the motion is not determined, lies in a step of a linkage with redundant rows.

    Each end is a course of one time. In a singular pose the determinant of independent rows changes its sign. But the chosen rows
    may become dependent in a pose where all rows together still have full rank. All rows may be dependent in a pose from which
    only one branch goes on. So the pose counts as singular only if a second branch, which meets the first there, is found.
    """
    rows = choose_independent_rows(before.jacobian[0])
    if np.prod([np.linalg.det(course.jacobian[0][rows]) for course in (before, after)]) > 0:
        return False
    distance = float(np.abs(after.q - before.q).max())  # in m or rad: a rough size of the step is enough
    direction = np.linalg.svd(after.jacobian[0])[2][-1].reshape(after.q.shape)  # singular vector of the least singular value
    direction *= distance / np.abs(direction).max()
    for factor in (-4.0, -2.0, -1.0, 1.0, 2.0, 4.0):  # to both sides, as the distance of the other branch is unknown
        other = close_loops(linkage, after.time, after.q + factor * direction)
        if other is not None and np.abs(other.q - after.q).max() > 1e-3 * distance:  # 1e-3, chosen: nearer it is the same pose
            return True
    return False


def explain_singularity(linkage: Linkage, q: Array, rows: Array) -> str:
    """Explain a singular pose in words: links in line, a link square to a guide, or elements whose rows are dependent there."""
    mechanism, found = linkage.mechanism, []
    joined = {frozenset((joint.first, joint.second)) for joint in mechanism.joints}
    for first, second in combinations([link.name for link in mechanism.links], 2):
        angle = q[linkage.index[first], 2] - q[linkage.index[second], 2]
        if frozenset((first, second)) in joined:
            found.append((abs(np.sin(angle)), f"{first} and {second} in line"))
    for guide in mechanism.guides:
        angle = q[linkage.index[guide.link], 2] - np.arctan2(guide.along[1], guide.along[0])
        found.append((abs(np.cos(angle)), f"{guide.link} square to the guide of {guide.point}"))
    least, description = min(found, default=(np.inf, ""))
    if least < 0.3:  # chosen, as a run ends shortly before the pose
        return description
    # `rows` are independent in other poses; the weights are those of a sum of them that nearly vanishes in this one
    weights = np.linalg.svd(linkage.jacobian(q)[rows])[0][:, -1]
    large = np.where(np.abs(weights) > 0.05 * np.abs(weights).max(), weights, 0.0)  # the message leaves out the others
    names = involved_elements([linkage.names[k] for k in rows], large)
    # their rows are dependent in this pose: forces of these elements in the ratio of `weights` balance without a load
    return f"{', '.join(repr(name) for name in names)} hold the linkage"


def diagnose_last_pose(record: Record) -> Failure | None:
    """Diagnose the last pose of a failed run by the least singular value of its rigid links' Jacobian; None if it is regular."""
    mechanism = record.mechanism
    linkage = Scene.of(mechanism).linkage
    rigid = [i for i, link in enumerate(mechanism.links) if not link.body.flexible and link.name in record.links]
    q = linkage.reference.copy()  # flexible links keep their pose at t = 0
    for i in rigid:
        link = mechanism.links[i]
        motion = record.links[link.name]
        places, angles = motion.point(link.start)[0], motion.turn(link.start)[0]  # [0]: without rates; angles since t = 0
        q[i, :2], q[i, 2] = places[-1], q[i, 2] + angles[-1]
    among = {GROUND, *(mechanism.links[i].name for i in rigid)}
    rows = [k for k in linkage.permanent_rows if linkage.rows[k].bodies <= among]  # that hold throughout a run
    columns = [3 * i + axis for i in rigid for axis in range(3)]
    unit = np.tile([1.0, 1.0, linkage.size], len(rigid))  # columns of angles become derivatives by angle times longest link
    first, last = (linkage.jacobian(pose)[np.ix_(rows, columns)] / unit for pose in (linkage.reference, q))
    independent = independent_rows(first)  # may be fewer than columns; `choose_independent_rows` takes as many as columns
    if not len(independent) or not np.isfinite(last).all():
        return None
    at_start, at_end = (np.linalg.svd(matrix[independent], compute_uv=False)[-1] for matrix in (first, last))
    # entries are about 1. The least value is zero in a singular pose, but the run ends before: 0.05 is chosen.
    # 0.2, chosen: that of a regular linkage may be small from the start
    if at_end > min(0.05, 0.2 * at_start):
        return None
    t, where = float(record.time[-1]), explain_singularity(linkage, q, np.array(rows)[independent])
    if mechanism.drives:
        return Failure(Status.LOCKED, f"the linkage locks at t = {t:.6g} s ({where})")
    singular = f"the linkage is in a singular pose at t = {t:.6g} s ({where}): what follows is not determined"
    return Failure(Status.SINGULAR, singular)
