"""Flexible links over time: their lines, bending and axial strain, by the kind of their bodies."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache, singledispatch
from typing import Any

import numpy as np

from buckler.elastica import pinned

from ..elements import Body, Link, Modal, Strut
from ..elements.beam import Flexible
from ..geometry import Array
from ..record.record import Record, select

STATIONS = 25
"""Places along a massless strip."""
Bent = tuple[Array, Array, Array]
"""Line (times, stations, 2), bending and axial strain (times, stations)."""


@dataclass(frozen=True, eq=False)
class Band:
    """A flexible link over time: places [m] (times, stations, 2), curvature less the stress-free one [1/m], axial strain.

    `thickness` and `width` are in m, `modulus` in Pa.
    """

    points: Array
    bending: Array
    axial: Array
    thickness: float
    width: float
    modulus: float

    @property
    def stress(self) -> Array:
        """Largest normal stress over the thickness, Pa, (times, stations)."""
        return self.modulus * (np.abs(self.bending) * self.thickness / 2 + np.abs(self.axial))

    @property
    def axial_force(self) -> Array:
        """Elastic normal force, N, tension positive, (times, stations)."""
        return self.modulus * self.width * self.thickness * self.axial


@singledispatch
def bent_line(_body: Body, _record: Record, _source: Record, _link: Link) -> Bent | None:
    """Line, bending and axial strain of a link that bends; None for one that does not."""
    return None


@bent_line.register
def _(body: Flexible, record: Record, source: Record, link: Link) -> Bent:
    motion = record.links.get(link.name)
    if motion is not None:
        return _strip(motion, source.links[link.name], source.time, record.time)
    return _rest(record, link, body.curve(record.mechanism.length(link.name)).places(np.linspace(0.0, 1.0, 33)))


def _strip(motion: Any, recorded: object, time: Array, times: Array) -> Bent:
    """Line and strains of elements or polynomials, strains taken from the integration points to the line's stations.

    Strains are those of the solver's own times, linear between them: a strip is so stiff along its line that the small errors
    of interpolated places would be seen in its axial force.
    """
    per = max(2, min(8, round(32 / (len(motion.arcs(1)) - 1))))
    line = motion.line(per)
    k = np.clip(np.searchsorted(time, times, side="right") - 1, 0, len(time) - 2)
    share = ((times - time[k]) / (time[k + 1] - time[k]))[:, None]
    rows, where = np.unique(np.concatenate([k, k + 1]), return_inverse=True)
    strains = select(recorded, rows).strains()
    stations = motion.arcs(per)

    def spread(strain: Any) -> Array:
        """Return the strain at the stations, linear in arc and time."""
        weights = strain.weights.ravel()
        middles = np.cumsum(weights) - weights / 2
        unit = np.array([np.interp(stations, middles, row) for row in np.eye(len(middles))])
        values = strain.value.reshape(len(rows), -1) @ unit
        return np.asarray((1 - share) * values[where[: len(k)]] + share * values[where[len(k) :]])

    return line, spread(strains[-1]), spread(strains[0])


@bent_line.register
def _(_body: Modal, record: Record, _source: Record, link: Link) -> Bent:
    motion = record.links.get(link.name)
    if motion is None:
        return _rest(record, link, np.array([[0.0, 0.0], [record.mechanism.length(link.name), 0.0]]))
    line = motion.line()  # its bending follows by differences along the line
    undeformed = motion.model.line[:, 0]
    c, s = np.cos(motion.q[:, 2])[:, None], np.sin(motion.q[:, 2])[:, None]
    x, y = line[..., 0] - motion.q[:, None, 0], line[..., 1] - motion.q[:, None, 1]
    bending = np.gradient(np.gradient(c * y - s * x, undeformed, axis=1), undeformed, axis=1)
    bending[:, [0, 1, -2, -1]] = bending[:, [2, 2, -3, -3]]  # one-sided differences of differences are rough
    return line, bending, np.zeros_like(bending)


def _rest(record: Record, link: Link, local: Array) -> Bent:
    """Return a link's stress-free line between its ends at t = 0."""
    start, end = (np.array(record.mechanism.points[p]) for p in (link.start, link.end))
    along = (end - start) / np.hypot(*(end - start))
    line = start + local[:, :1] * along + local[:, 1:] * np.array([-along[1], along[0]])
    line = np.tile(line, (len(record.time), 1, 1))
    return line, np.zeros(line.shape[:2]), np.zeros(line.shape[:2])


@lru_cache
def _elasticas() -> tuple[Array, Array]:
    """Roots of end shortenings over the length; x, y, curvature times length of the exact elastica, (cases, stations, 3)."""
    roots, arc = np.linspace(0.0, 1.0, 41), np.linspace(0.0, 1.0, STATIONS)
    x, y, theta = pinned.shape(roots[:, None] ** 2, arc[None])
    return roots, np.stack([x, y, np.gradient(theta, arc, axis=1)], axis=-1)


@bent_line.register
def _(_body: Strut, record: Record, _source: Record, link: Link) -> Bent:
    # A massless strip between its ends: the exact elastica, drawn on the left of its chord as the model knows no side.
    length = record.mechanism.length(link.name)
    start, end = record.point(link.start)[0], record.point(link.end)[0]
    chord = end - start
    span = np.hypot(*chord.T)
    along = chord / np.maximum(span, 1e-300)[:, None]
    roots, shapes = _elasticas()
    root = np.sqrt(np.clip(1 - span / length, 0.0, 1.0))
    k = np.minimum((root * (len(roots) - 1)).astype(int), len(roots) - 2)
    share = (root * (len(roots) - 1) - k)[:, None, None]
    x, y, bend = np.moveaxis((1 - share) * shapes[k] + share * shapes[k + 1], -1, 0)
    x = x * (span / length / np.maximum(x[:, -1], 1e-9))[:, None]  # so that it ends where it ends
    left = np.stack([-along[:, 1], along[:, 0]], axis=-1)
    line = start[:, None] + length * (x[..., None] * along[:, None] + y[..., None] * left[:, None])
    axial = np.maximum(span / length - 1, 0.0)[:, None] * np.ones(STATIONS)
    return line, bend / length, axial
