"""Remarks on a mechanism: redundant constraints, undetermined forces, too many drives, and joints that seem to be missing."""

import re
from collections.abc import Iterator
from math import sqrt

import numpy as np

from ..elements.element import GROUND
from ..mechanism import Mechanism
from .linkage import Linkage, rank
from .start import name_surplus_drives

SLOWEST_WAVE = 1.0
"""Speed of axial waves [m/s] below which a link is softer than any gel: its modulus was probably meant in GPa. Chosen."""


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
    for link in mechanism.links:
        section = link.body.section if link.body.flexible else None
        wave = sqrt(section.axial_stiffness / section.mass_per_length) if section and section.mass_per_length else SLOWEST_WAVE
        if wave < SLOWEST_WAVE:
            found.append(f"links.{link.name}: so soft that waves run along it at {wave:.2g} m/s; is its modulus given in Pa?")
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
