"""Diagnosis of a linkage in a pose: links in line, redundant and contradicting constraints."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

import numpy as np

from ..elements.element import GROUND
from ..geometry import Array
from ..mechanism import Mechanism
from ..record.errors import Status
from ..record.record import Record
from .linkage import ROUNDING, Linkage, involved_elements, rank
from .start import jacobian, overdriven

FLAT = 0.05
"""Smallest singular value of the constraints of a regular pose."""
WORSE = 0.2
"""Smallest ratio of that value to the one at the start of a regular pose."""
SHARE = 1e-6
"""Part of a row in a vector that no force balances, above which its force counts as shared."""
IN_LINE = 0.3
"""Sine of the angle between two links up to which they may be called in line: a run stops short of the pose itself."""


def explain_singularity(linkage: Linkage, q: Array, rows: Array | None = None) -> str:
    """Explain a singular pose in words: links in line, a link square to a guide, or the elements that hold it."""
    mechanism, found = linkage.mechanism, []
    joined = {frozenset((joint.first, joint.second)) for joint in mechanism.joints} - {GROUND}
    for one, two in combinations([link.name for link in mechanism.links], 2):
        angle = q[linkage.index[one], 2] - q[linkage.index[two], 2]
        if frozenset((one, two)) in joined and abs(np.sin(angle)) < IN_LINE:
            found.append((abs(np.sin(angle)), f"{one} and {two} in line"))
    for guide in mechanism.guides:
        angle = q[linkage.index[guide.link], 2] - np.arctan2(guide.along[1], guide.along[0])
        if abs(np.cos(angle)) < IN_LINE:
            found.append((abs(np.cos(angle)), f"{guide.link} square to the guide of {guide.point}"))
    if found:
        return min(found)[1]
    matrix = linkage.system(q, np.zeros_like(q))[1]
    kept = np.arange(len(matrix)) if rows is None else rows
    weights = np.linalg.svd(matrix[kept])[0][:, -1]
    large = np.where(np.abs(weights) > 0.05 * np.abs(weights).max(), weights, 0.0)
    names = involved_elements([linkage.names[k] for k in kept], large)
    return f"{', '.join(repr(name) for name in names)} hold it"


def redundancies(mechanism: Mechanism) -> list[str]:
    """Elements whose rows say nothing that others do not, in poses in general position; flexible links being flexible."""
    _, names, matrix = _constraints(mechanism)
    kept = independent_rows(matrix)
    return list(dict.fromkeys(name for k, name in enumerate(names) if k not in kept))


def find_undetermined(mechanism: Mechanism) -> list[str]:
    """Find the elements whose forces no equation determines: redundant ones share them, in poses in general position."""
    _, names, matrix = _constraints(mechanism)
    left, values, _ = np.linalg.svd(matrix)
    shares = left[:, int((values > ROUNDING * values.max(initial=1.0)).sum()) :]
    free = np.abs(shares).max(axis=1, initial=0.0) > SHARE
    return list(dict.fromkeys(name for name, each in zip(names, free, strict=True) if each))


def _constraints(mechanism: Mechanism) -> tuple[Linkage, list[str], Array]:
    """Linkage, and names and derivatives of all lasting rows in general position; rows of drives come first."""
    linkage = Linkage(mechanism)
    _, rigid, loose = jacobian(mechanism, linkage.general_pose())
    unit = np.tile([1.0, 1.0, linkage.size], len(linkage.index))
    order = sorted(linkage.lasting, key=lambda k: linkage.named_rows[k][1].motion is None)
    matrix = np.hstack([rigid / unit, loose / (np.abs(loose).max(initial=0.0) or 1.0)])[order]
    return linkage, [linkage.names[k] for k in order], matrix


def stuck(record: Record) -> tuple[Status, str] | None:
    """Diagnose the pose in which a run of rigid links stopped, by the rank of its constraints; None if nothing is wrong."""
    mechanism = record.mechanism
    linkage = Linkage(mechanism)
    rigid = [i for i, link in enumerate(mechanism.links) if not link.body.flexible and link.name in record.links]
    q = linkage.reference.copy()
    for i in rigid:
        link = mechanism.links[i]
        motion = record.links[link.name]
        q[i, :2], q[i, 2] = motion.point(link.start)[0][-1], q[i, 2] + motion.turn(link.start)[0][-1]
    among = {GROUND, *(mechanism.links[i].name for i in rigid)}
    rows = [k for k, (_, row) in enumerate(linkage.named_rows) if not row.start_only and row.bodies <= among]
    columns = [3 * i + axis for i in rigid for axis in range(3)]
    unit = np.tile([1.0, 1.0, linkage.size], len(rigid))  # a turn as far as it moves the longest link
    before, now = (linkage.system(at, np.zeros_like(q))[1][np.ix_(rows, columns)] / unit for at in (linkage.reference, q))
    kept = independent_rows(before)
    if not len(kept) or not np.isfinite(now).all():
        return None
    least = [np.linalg.svd(matrix[kept], compute_uv=False)[-1] for matrix in (before, now)]
    if least[1] > min(FLAT, WORSE * least[0]):
        return None
    t, where = float(record.time[-1]), explain_singularity(linkage, q, np.array(rows)[kept])
    if mechanism.drives:
        return Status.LOCKED, f"the linkage locks at t = {t:.6g} s ({where})"
    return Status.SINGULAR, f"the linkage is in a singular pose at t = {t:.6g} s ({where}): what follows is not determined"


def independent_rows(matrix: Array) -> list[int]:
    """Rows that say what those before do not."""
    kept: list[int] = []
    basis = np.empty((0, matrix.shape[1]))
    for k, row in enumerate(matrix):
        rest = row - basis.T @ (basis @ row)
        rest = rest - basis.T @ (basis @ rest)
        if float(np.linalg.norm(rest)) > ROUNDING * max(1.0, float(np.linalg.norm(row))):
            basis = np.vstack([basis, rest / np.linalg.norm(rest)])
            kept.append(k)
    return kept


def remarks(mechanism: Mechanism, redundant_ones: list[str]) -> list[str]:
    """List remarks on a mechanism, in sentences: redundant constraints, too many drives, and what looks forgotten."""
    found = []
    if redundant_ones:
        shared = ", ".join(map(repr, find_undetermined(mechanism)))
        found.append(f"redundant: {', '.join(map(repr, redundant_ones))}; no equation determines the forces of {shared}")
    if len(mechanism.drives) > 1 and (too_many := overdriven(mechanism)):
        found.append(too_many)
    held = _groups(mechanism)
    for drive in mechanism.drives:
        if drive.target not in mechanism.points and GROUND not in held[drive.target]:
            found.append(f"nothing ties the driven link '{drive.target}' to the ground: no joint, no guide")
    found += _free_links(mechanism)
    spoken = " ".join(repr(element) for element in (*mechanism.loads, *mechanism.stops))
    for point in mechanism.points:
        links = [link.name for link in mechanism.links if point in link.points]
        apart = [name for name in links[1:] if name not in _groups(mechanism, point)[links[0]]]
        if apart and f"{point}'" not in spoken:
            found.append(
                f"links '{links[0]}' and '{apart[0]}' share the point '{point}' without a joint there: they pass each other"
            )
    reach = sum(mechanism.length(link.name) for link in mechanism.links)
    for stop in mechanism.stops:
        if stop.carrier == GROUND and abs(stop.face(mechanism)) > 2 * reach:
            found.append(f"the stop of '{stop.point}' lies farther than the links reach: nothing can touch it")
    return found


def _free_links(mechanism: Mechanism) -> Iterator[str]:
    """Yield links that nothing joins to the rest, and those that can move although the drives are fixed."""
    tied, acted = _groups(mechanism), " ".join(repr(each) for each in (*mechanism.loads, *mechanism.stops, mechanism.velocities))
    for link in mechanism.links:
        spoken = any(f"{mark}{name}'" in acted for name in (*link.points, link.name) for mark in "':")
        if tied[link.name] == {link.name} and len(mechanism.links) > 1 and not spoken:
            yield f"links.{link.name}: nothing joins it to another link or the ground, and nothing acts on it"
    if not mechanism.drives:
        return
    linkage = Linkage(mechanism)
    jacobian = linkage.system(linkage.reference, np.zeros_like(linkage.reference))[1]
    free = jacobian.shape[1] - rank(jacobian)
    if free:
        ways = np.abs(np.linalg.svd(jacobian)[2][-free:]).max(axis=0).reshape(-1, 3).max(axis=1)
        moving = [link.name for link, way in zip(mechanism.links, ways, strict=True) if way > ROUNDING]
        count = "1 way" if free == 1 else f"{free} ways"
        driven = len(mechanism.drives)
        yield (
            f"mobility {free + driven}, {driven} driven: with the drives held the linkage can move in {count} "
            f"({', '.join(f'links.{name}' for name in moving)}); forces decide how"
        )


def _groups(mechanism: Mechanism, point: str | None = None) -> dict[str, set[str]]:
    """Bodies that joints and guides tie to each body, everywhere or at one point only."""
    groups = {name: {name} for name in (GROUND, *(link.name for link in mechanism.links))}
    ties = [(joint.first, joint.second) for joint in mechanism.joints if point in (None, joint.point)]
    ties += [(guide.link, GROUND) for guide in mechanism.guides if point is None]
    for first, second in ties:
        together = groups[first] | groups[second]
        for name in together:
            groups[name] = together
    return groups
