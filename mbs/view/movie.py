"""The motion of a run as pictures need it: frames, bent lines and marks over evenly spaced times, as plain arrays.

A `Film` stands in a `Result`. It holds the run's `Record` and makes the `Movie` when first asked for; in files and other
processes it is the movie alone.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import pi
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..geometry import Array
from ..mechanism import Mechanism
from ..record.record import Record, select
from .bands import Band, bent_line
from .drawing import FIXED, MIDDLE, Disc, Label, Mark, Path, Sheet, Span, Strip
from .symbols import draw_marks

FEWEST = 240
"""Least number of pictures of a movie."""
MOST = 1440
"""Largest number of pictures of a movie."""
A_TURN = 180
"""Pictures for a turn of the link that turns most."""
ROUND = np.exp(2j * pi * np.arange(48) / 48)
"""A circle."""


@dataclass(frozen=True, eq=False)
class Movie:
    """Frames, bent lines and marks of a mechanism over time.

    `frames` has place [m] and angle turned since t = 0 [rad], (times, 3), of each frame; `bands` the flexible links, `marks`
    what is drawn in which frame, `unit` the size of a symbol [m]. Each of the mechanism's `points` is a frame, too.
    """

    time: Array
    frames: Mapping[str, Array]
    bands: Mapping[str, Band]
    marks: tuple[Mark, ...]
    unit: float
    points: tuple[str, ...] = ()

    @property
    def box(self) -> tuple[float, float, float, float]:
        """Least and largest x, then y, of all that moves, m."""
        places = [frame[:, :2] for name, frame in self.frames.items() if name]
        places += [band.points.reshape(-1, 2) for band in self.bands.values()]
        places += [to_ground(self.frames[mark.frame][0], mark.points) for mark in self.marks if isinstance(mark, Path)]
        low, high = np.nanmin([p.min(axis=0) for p in places], axis=0), np.nanmax([p.max(axis=0) for p in places], axis=0)
        return float(low[0]), float(high[0]), float(low[1]), float(high[1])


def to_ground(frame: Array, points: ArrayLike) -> Array:
    """Transform points of a frame (x, y, turn) to the ground's axes, (n, 2)."""
    c, s = np.cos(frame[2]), np.sin(frame[2])
    return np.asarray(np.asarray(points) @ np.array([[c, s], [-s, c]]) + frame[:2])


def corners(movie: Movie, mark: Mark, k: int) -> Array:
    """Corners of a mark's line or outline in picture k, (n, 2); of a label its place."""
    match mark:
        case Strip():
            return movie.bands[mark.link].points[k]
        case Span():
            a, b = movie.frames[mark.frame][k, :2], movie.frames[mark.other][k, :2]
            along, points = b - a, np.array(mark.points)
            left = np.array([-along[1], along[0]]) / max(np.hypot(*along), 1e-300)
            return np.asarray(a + points[:, :1] * along + points[:, 1:] * left)
        case Disc():
            local: Any = np.array(mark.centre) + mark.radius * np.column_stack([ROUND.real, ROUND.imag])
        case Label():
            local = [mark.place]
        case Path():
            local = mark.points
        case _:
            raise ValueError(f"{mark}: has no corners")
    return to_ground(movie.frames[mark.frame][k], local)


@dataclass(eq=False)
class Film:
    """The movie of a run, made when first asked for."""

    record: Record | None = None
    kept: Movie | None = field(default=None)

    def movie(self) -> Movie:
        """Return the movie at `pictures` times."""
        if self.kept is None:
            assert self.record is not None
            self.kept = make_movie(self.record)
        return self.kept

    def __reduce__(self) -> Any:
        return Film, (None, self.movie())


def make_movie(record: Record, times: Array | None = None) -> Movie:
    """Make the movie of a record, at `times` or evenly spaced ones; a run that failed, up to its last finite state."""
    record = _finite(record)
    if len(record.time) < 2:
        return still(record.mechanism)
    if times is None:
        times = np.linspace(record.time[0], record.time[-1], pictures(record))
    return _movie(record.at(times), record)


def still(mechanism: Mechanism) -> Movie:
    """Return the mechanism at t = 0 as a movie of one picture."""
    none = Record(mechanism, np.zeros(1), {}, {})
    return _movie(none, none)


def pictures(record: Record) -> int:
    """Count the pictures of a run: `A_TURN` for each turn of the link that turns most, within limits."""
    starts = {name: record.mechanism.link(name).start for name in record.links}
    turns = [np.abs(np.diff(motion.turn(starts[name])[0])).sum() / (2 * pi) for name, motion in record.links.items()]
    return int(np.clip(A_TURN * max(turns, default=0.0), FEWEST, MOST)) + 1


def _finite(record: Record) -> Record:
    """Return the record up to its last finite state."""
    motions = (*record.links.values(), *record.blocks.values())
    fine = [np.isfinite(motion.q).reshape(len(motion.q), -1).all(axis=1) for motion in motions]
    bad = np.flatnonzero(~np.broadcast_to(np.logical_and.reduce(fine, initial=True), record.time.shape))
    if not len(bad):
        return record
    if bad[0] < 2:
        return Record(record.mechanism, record.time[:1], {}, {})
    first = slice(bad[0])
    links, blocks = ({name: select(each, first) for name, each in some.items()} for some in (record.links, record.blocks))
    return Record(record.mechanism, record.time[first], links, blocks)


def _movie(record: Record, source: Record) -> Movie:
    """Return the movie of a record at the movie's times; `source` holds the solver's own."""
    mechanism = record.mechanism
    sheet = Sheet(mechanism, record)
    marks = tuple(draw_marks(sheet))
    for point in mechanism.points:
        sheet.frame(point)
    frames = {name: _frame(record, name, *spec) for name, spec in sheet.frames.items()}
    bands = {}
    for link in mechanism.links:
        shape = bent_line(link.body, record, source, link)
        if shape is not None:
            section, middle = link.body.section, shape[0][:, shape[0].shape[1] // 2]
            bands[link.name] = Band(*shape, section.thickness, section.width, section.material.modulus)
            frames[MIDDLE + link.name] = np.column_stack([middle, np.zeros(len(middle))])
    return Movie(record.time, frames, bands, marks, sheet.unit, tuple(mechanism.points))


def _frame(record: Record, name: str, ref: str, pin: str, factor: float) -> Array:
    """Place and turn of a frame, (times, 3)."""
    if not ref:
        return np.zeros((len(record.time), 3))
    at, turn = record.point(ref)[0], record.turn(ref)[0]
    if pin:
        at = at + factor * (record.point(pin)[0] - at)
    return np.column_stack([at, np.zeros_like(turn) if name.startswith(FIXED) else turn])
