"""Diagnosis of a singular pose of a linkage: links in line, or the elements whose constraints are dependent."""

from itertools import combinations

import numpy as np

from ..elements.element import GROUND
from ..geometry import Array
from ..record.errors import Failure, Status
from ..record.record import Record
from ..scene.linkage import Linkage, involved_elements
from ..scene.remarks import independent_rows
from ..scene.scene import Scene


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
    return f"{', '.join(repr(name) for name in names)} hold the linkage"  # as their rows are dependent in this pose


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
    independent = independent_rows(first)
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
