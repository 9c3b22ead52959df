"""Masses of the links and of what they carry, as rigid bodies."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from buckler.mbs.elements.element import place
from buckler.mbs.geometry import Array
from buckler.mbs.kinematics.linkage import Linkage


class Part(NamedTuple):
    """A mass, kg, with its inertia, kg m^2, on a link, by number, at an arm from the link's start at t = 0, m."""

    link: int
    mass: float
    inertia: float
    arm: complex


def carried(linkage: Linkage) -> Iterator[Part]:
    """Yield the links' own masses, the blocks of guides, and what elements put on links."""
    mechanism = linkage.mechanism
    for link in mechanism.links:
        i = linkage.index[link.name]
        mass, inertia, centre = link.body.inertia(mechanism.length(link.name))
        yield Part(i, mass, inertia, complex(*centre) * np.exp(1j * linkage.reference[i, 2]))
    blocks = {guide.point: guide.link for guide in mechanism.guides}
    extra = [(f"{guide.link}:{guide.point}", guide.mass, 0.0) for guide in mechanism.guides]
    for element in mechanism.elements().values():
        extra += element.burdens(mechanism)
    for at, mass, inertia in extra:
        body, point = place(at)
        i = linkage.index[blocks.get(body, body)]
        yield Part(i, mass, inertia, complex(*mechanism.points[point]) - complex(*linkage.reference[i, :2]))


def mass_matrix(linkage: Linkage, q: Array) -> Array:
    """Mass matrix by the coordinates of the links' starts, q (..., links, 3) -> (..., 3 links, 3 links)."""
    n = len(linkage.index)
    matrix = np.zeros((*q.shape[:-2], n, 3, n, 3))
    for part in carried(linkage):
        i = part.link
        arm = part.arm * np.exp(1j * (q[..., i, 2] - linkage.reference[i, 2]))
        for axis, lever in ((0, -arm.imag), (1, arm.real)):
            matrix[..., i, axis, i, axis] += part.mass
            matrix[..., i, axis, i, 2] += part.mass * lever
            matrix[..., i, 2, i, axis] += part.mass * lever
        matrix[..., i, 2, i, 2] += part.inertia + part.mass * np.abs(arm) ** 2
    return matrix.reshape(*q.shape[:-2], 3 * n, 3 * n)
