"""Remarks on a mechanism: redundant constraints, undetermined forces, too many drives, and joints that seem to be missing."""

import re
from collections.abc import Iterator

import numpy as np

from ..elements.element import GROUND
from ..geometry import Array
from ..mechanism import Mechanism
from .linkage import DEPENDENT, Linkage, rank
from .start import compute_jacobians, name_surplus_drives


def remarks(linkage: Linkage, redundant: list[str], undetermined: list[str]) -> list[str]:
    """List remarks on a mechanism, in sentences: redundant constraints, too many drives, joints that seem to be missing."""
    mechanism, found = linkage.mechanism, []
    if redundant:
        shared = ", ".join(map(repr, undetermined))
        found.append(f"redundant: {', '.join(map(repr, redundant))}; no equation determines the forces of {shared}")
    if len(mechanism.drives) > 1 and (too_many := name_surplus_drives(linkage)):
        found.append(too_many)
    groups, with_forces = _groups(mechanism), _named_places(mechanism.loads, mechanism.stops)
    for drive in mechanism.drives:
        if drive.target not in mechanism.points and GROUND not in groups[drive.target]:
            found.append(f"nothing ties the driven link '{drive.target}' to the ground: no joint, no guide")
    found += _free_links(linkage)
    for point in mechanism.points:
        links = [link.name for link in mechanism.links if point in link.points]
        unjoined = [name for name in links[1:] if name not in _groups(mechanism, point)[links[0]]]
        if unjoined and point not in with_forces:  # a load there may be a spring, which connects these links, as a stop may
            pair = f"links '{links[0]}' and '{unjoined[0]}'"
            found.append(f"{pair} share the point '{point}' without a joint there: they pass each other")
    reach = 2 * sum(mechanism.length(link.name) for link in mechanism.links)  # diameter of the circle that they reach in line
    for stop in mechanism.stops:
        if stop.carrier == GROUND and abs(stop.distance_to_face(mechanism)) > reach:
            found.append(f"the stop of '{stop.point}' lies farther than the links reach: nothing can touch it")
    return found


def _named_places(*parts: object) -> set[str]:
    """Return the names of points and links in the printed form of elements, in quotes and split at colons."""
    # the printed form has all references, of any element; a point with the name of any other quoted text counts as named, too
    return {name for text in re.findall(r"'([^']*)'", repr(parts)) for name in text.split(":")}


def _free_links(linkage: Linkage) -> Iterator[str]:
    """Yield remarks on links joined to nothing, free to turn in a guide, or free to move although drives are held."""
    mechanism = linkage.mechanism
    groups = _groups(mechanism)
    with_effects = _named_places(mechanism.loads, mechanism.stops, mechanism.velocities)
    for link in mechanism.links:
        has_effect = not with_effects.isdisjoint({*link.points, link.name})
        if groups[link.name] == {link.name} and len(mechanism.links) > 1 and not has_effect:
            yield f"links.{link.name}: nothing joins it to another link or the ground, and nothing acts on it"
        joints = [joint.point for joint in mechanism.joints if link.name in (joint.first, joint.second)]
        guides = [guide.point for guide in mechanism.guides if guide.link == link.name]
        if guides and len({*joints, *guides}) == 1 and not has_effect:
            yield f"links.{link.name}: the guide of '{guides[0]}' leaves its angle free; a Slider or a second guide keeps it"
    if not mechanism.drives:
        return
    jacobian, free = linkage.jacobian(linkage.reference), linkage.count_free_motions()
    if free:
        mobility = jacobian.shape[1] - rank(np.delete(jacobian, list(linkage.motions), axis=0))  # without the rows of drives
        # orthonormal motions (free, 3 links) that all rows allow at t = 0; along them forces decide the motion
        free_motions = np.linalg.svd(jacobian)[2][-free:]
        of_links = np.abs(free_motions).max(axis=0).reshape(-1, 3).max(axis=1)
        moving = [link.name for link, size in zip(mechanism.links, of_links, strict=True) if size > 1e-9]  # above rounding
        count = "1 way" if free == 1 else f"{free} ways"
        can_move = f"with the drives held the linkage can move in {count} ({', '.join(f'links.{name}' for name in moving)})"
        yield f"mobility {mobility}, {len(mechanism.drives)} driven: {can_move}; forces decide how"


def _groups(mechanism: Mechanism, point: str | None = None) -> dict[str, set[str]]:
    """Return for each body the bodies that joints and guides connect to it; with a point, joints at that point only."""
    groups = {name: {name} for name in (GROUND, *(link.name for link in mechanism.links))}
    ties = [(joint.first, joint.second) for joint in mechanism.joints if point in (None, joint.point)]
    ties += [(guide.link, GROUND) for guide in mechanism.guides if point is None]
    for first, second in ties:
        joined = groups[first] | groups[second]
        for name in joined:
            groups[name] = joined
    return groups


def find_redundant(linkage: Linkage) -> list[str]:
    """Find the elements whose rows depend on other rows in a pose in general position; flexible links may deform."""
    names, matrix = _constraints(linkage)
    independent = independent_rows(matrix)
    return list(dict.fromkeys(name for k, name in enumerate(names) if k not in independent))


def find_undetermined(linkage: Linkage) -> list[str]:
    """Find the elements whose forces no equation determines: their rows occur in a null vector of the transposed Jacobian."""
    names, matrix = _constraints(linkage)
    left, values, _ = np.linalg.svd(matrix)
    count = int((values > DEPENDENT * values.max(initial=1.0)).sum())  # of independent rows; relative to the largest value, or 1
    shares = np.abs(left[:, count:]).max(axis=1, initial=0.0)  # largest component of the null vectors in each row
    # 1e-6: rounding changes components by up to 1e-16 over the least singular value above zero, at least DEPENDENT = 1e-9
    return list(dict.fromkeys(name for name, share in zip(names, shares, strict=True) if share > 1e-6))


def _constraints(linkage: Linkage) -> tuple[list[str], Array]:
    """Return elements and scaled derivatives, in general position, of the rows that hold throughout a run.

    Rows of drives come first: where a drive and a joint depend on each other, the joint is redundant. Columns are for places and
    angles (times the longest link) of links, and for deformations of flexible ones, whose scale has no effect on the rank.
    """
    rigid, flexible = compute_jacobians(linkage, linkage.general_pose)
    unit = np.tile([1.0, 1.0, linkage.size], len(linkage.index))  # d/d(angle L) = d/d(angle)/L for the longest link L
    order = sorted(linkage.permanent_rows, key=lambda k: linkage.rows[k].motion is None)
    matrix = np.hstack([rigid / unit, flexible / (np.abs(flexible).max(initial=0.0) or 1.0)])[order]
    return [linkage.names[k] for k in order], matrix


def independent_rows(matrix: Array) -> list[int]:
    """Find the rows that do not depend on rows before them, by Gram-Schmidt orthogonalisation, repeated against rounding."""
    independent: list[int] = []
    basis = np.empty((0, matrix.shape[1]))
    for k, row in enumerate(matrix):
        rest = row - basis.T @ (basis @ row)
        rest = rest - basis.T @ (basis @ rest)
        if float(np.linalg.norm(rest)) > DEPENDENT * max(1.0, float(np.linalg.norm(row))):
            basis = np.vstack([basis, rest / np.linalg.norm(rest)])
            independent.append(k)
    return independent
