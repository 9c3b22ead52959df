"""The motion of a run for pictures: frames, bent lines and marks at evenly spaced times, as plain arrays.

A frame is a system of axes that moves with a body; a picture shows one time. Frames and marks are those of `drawing`; the frame
'' is the ground.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import pi
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from buckler.elastica import pinned

from ..elements import Link
from ..elements.beam import Flexible
from ..geometry import Array, rotate, rotate_left
from ..mechanism import Mechanism
from ..modal.planar import ModalHistory
from ..record.record import Record, select
from .drawing import MIDDLE, Disc, FrameSource, Label, Mark, Outline, Sheet, Span, StripMark, arc_points
from .symbols import draw_marks

STATIONS = 25
"""Number of points of the line of a massless strip; chosen by the look, as `INTERVALS`."""
INTERVALS = 32
"""Approximate number of intervals between the points of the line of a strip that bends."""
Bent = tuple[Array, Array, Array]
"""Bent line of a flexible link: places [m] (times, stations, 2); bending [1/m] and axial strain [1], each (times, stations).

Bending is the curvature less that of the stress-free line. Stations are the points of the line."""


@dataclass(frozen=True, eq=False)
class Band:
    """A flexible link over time: the arrays of a `Bent` line, `thickness` and `width` [m], Young's modulus [Pa]."""

    points: Array
    bending: Array
    axial: Array
    thickness: float
    width: float
    modulus: float

    @property
    def stress(self) -> Array:
        """Largest absolute normal stress over the thickness [Pa], shape (times, stations)."""
        return self.modulus * (np.abs(self.bending) * self.thickness / 2 + np.abs(self.axial))

    @property
    def axial_force(self) -> Array:
        """Elastic normal force [N], tension positive, shape (times, stations)."""
        return self.modulus * self.width * self.thickness * self.axial


def bent_line(record: Record, source: Record, link: Link) -> Bent | None:
    """Return the bent line of a flexible link at the times of `record`, with strains of `source`; None for other links."""
    body, motion = link.body, record.links.get(link.name)
    if body.massless:
        return _strut(record, link)
    if not body.flexible:
        return None
    if motion is None:
        return _repeat_start(record, link)
    return _strip(motion, source.links[link.name], source.time, record.time) if body.meshed else _modal(motion)


def _strip(motion: Any, recorded: object, time: Array, times: Array) -> Bent:
    """Compute the line of a strip from its `motion` at the `times` of the pictures, and its strains.

    Strains are interpolated from `recorded`, the motion at the `time` of each step of the solver: a strip is so stiff along its
    line that small errors of interpolated places would make large axial forces.
    """
    elements = len(motion.arcs(1)) - 1  # `arcs(1)` are the arc lengths at the ends of elements
    per_element = max(2, min(8, round(INTERVALS / elements)))  # intervals of an element; 2 and 8 are chosen
    line = motion.line(per_element)
    k = np.clip(np.searchsorted(time, times, side="right") - 1, 0, len(time) - 2)  # last recorded time before each picture
    fraction = ((times - time[k]) / (time[k + 1] - time[k]))[:, None]  # of the interval to the next recorded time
    rows, positions = np.unique(np.concatenate([k, k + 1]), return_inverse=True)  # recorded times beside pictures, each once
    before, after = positions[: len(k)], positions[len(k) :]  # of each picture, in `rows`
    axial, *_, bending = select(recorded, rows).strains()  # between them shear, if the strip has it
    stations = motion.arcs(per_element)

    def interpolate(strain: Any) -> Array:
        """Interpolate a `Strain` at integration points linearly to the stations and times."""
        weights = strain.weights.ravel()  # lengths [m] of all points, element by element
        arcs = np.cumsum(weights) - weights / 2  # middles of the parts of the line that the points stand for
        matrix = np.array([np.interp(stations, arcs, row) for row in np.eye(len(arcs))])
        values = strain.value.reshape(len(rows), -1) @ matrix
        return np.asarray((1 - fraction) * values[before] + fraction * values[after])

    return line, interpolate(bending), interpolate(axial)


def _modal(motion: ModalHistory) -> Bent:
    """Compute the line of a modal link, which is straight without stress, and its bending."""
    line = motion.line()
    undeformed = motion.model.line[:, 0]  # abscissas in the floating frame
    deflection = rotate(-motion.q[:, 2:3], line - motion.q[:, None, :2])[..., 1]  # in the floating frame (x, y, angle)
    bending = np.gradient(np.gradient(deflection, undeformed, axis=1), undeformed, axis=1)
    bending[:, [0, 1, -2, -1]] = bending[:, [2, 2, -3, -3]]  # one-sided second differences are inaccurate
    return line, bending, np.zeros_like(bending)  # no axial strain: the line alone does not give it


def _repeat_start(record: Record, link: Link) -> Bent:
    """Return the bent line of a strip or modal link that was not recorded: that at t = 0, unstrained."""
    start, end = (np.array(record.mechanism.points[p]) for p in (link.start, link.end))
    chord = float(np.hypot(*(end - start)))
    along, fractions = (end - start) / chord, np.linspace(0.0, 1.0, INTERVALS + 1)
    x, y = chord * fractions, np.zeros_like(fractions)  # a modal link is straight
    if link.body.meshed:
        x, y = cast(Flexible, link.body).curve(chord).places(fractions).T
    line = np.tile(start + np.outer(x, along) + np.outer(y, rotate_left(along)), (len(record.time), 1, 1))
    return line, np.zeros(line.shape[:2]), np.zeros(line.shape[:2])


def _strut(record: Record, link: Link) -> Bent:
    """Compute the elastica between the ends of a strut, bent to the left: the model does not know the side."""
    length = record.mechanism.length(link.name)
    start, end = record.point(link.start)[0], record.point(link.end)[0]
    chord = end - start
    span = np.hypot(*chord.T)
    along = chord / np.maximum(span, 1e-300)[:, None]
    stretch = np.maximum(span / length, 1.0)[:, None]  # only a span above the length stretches the strut
    arc = np.linspace(0.0, 1.0, STATIONS)
    x, y, theta = pinned.shape(np.maximum(1 - span / length, 0.0)[:, None], arc)
    line = start[:, None] + length * ((stretch * x)[..., None] * along[:, None] + y[..., None] * rotate_left(along)[:, None])
    return line, np.gradient(theta, arc, axis=1) / length, (stretch - 1) * np.ones(STATIONS)


@dataclass(frozen=True, eq=False)
class Movie:
    """Frames, bent lines and marks of a mechanism over time.

    `frames` maps the name of a frame to x, y [m] and the angle turned since t = 0 [rad], (times, 3); `bands` maps the name of a
    flexible link to its band. `marks` are drawn from first to last; `unit` is the size of a symbol [m]. `points` names those
    frames that are points of the mechanism.
    """

    time: Array
    frames: Mapping[str, Array]
    bands: Mapping[str, Band]
    marks: tuple[Mark, ...]
    unit: float
    points: tuple[str, ...] = ()

    @property
    def box(self) -> tuple[float, float, float, float]:
        """Least and largest x, then y [m], of frames, bent lines and outlines, outlines at their first picture."""
        places = [frame[:, :2] for name, frame in self.frames.items() if name != ""]
        places += [band.points.reshape(-1, 2) for band in self.bands.values()]
        places += [to_ground(self.frames[mark.frame][0], mark.points) for mark in self.marks if isinstance(mark, Outline)]
        low, high = np.nanmin([p.min(axis=0) for p in places], axis=0), np.nanmax([p.max(axis=0) for p in places], axis=0)
        return float(low[0]), float(high[0]), float(low[1]), float(high[1])


def to_ground(frame: Array, points: ArrayLike) -> Array:
    """Transform points (n, 2) of a frame (x, y, angle) to the axes of the ground, (n, 2)."""
    c, s = np.cos(frame[2]), np.sin(frame[2])
    return np.asarray(np.asarray(points) @ np.array([[c, s], [-s, c]]) + frame[:2])


def corners(movie: Movie, mark: Mark, k: int) -> Array:
    """Return the corners of a mark in picture number k, (n, 2) [m]; of a label, the one place of its text."""
    match mark:
        case StripMark():
            return movie.bands[mark.link].points[k]
        case Span():
            a, b = movie.frames[mark.frame][k, :2], movie.frames[mark.other][k, :2]
            along, points = b - a, np.array(mark.points)
            left = np.array([-along[1], along[0]]) / max(np.hypot(*along), 1e-300)
            return np.asarray(a + points[:, :1] * along + points[:, 1:] * left)
        case Disc():
            local = arc_points(mark.centre, mark.radius, 0.0, 2 * pi, 48)
        case Label():
            local = (mark.place,)
        case Outline():
            local = mark.points
        case _:
            raise ValueError(f"{mark}: has no corners")
    return to_ground(movie.frames[mark.frame][k], local)


@dataclass(eq=False)
class Film:
    """The movie of a run, made from the record when it is first asked for; a pickled film has the movie and no record."""

    record: Record | None = None
    made: Movie | None = None

    def movie(self) -> Movie:
        """Return the movie, made at the first call."""
        if self.made is None:
            assert self.record is not None
            self.made = make_movie(self.record)
        return self.made

    def __reduce__(self) -> Any:
        return Film, (None, self.movie())


def make_movie(record: Record, times: Array | None = None) -> Movie:
    """Make the movie of a record up to its last finite state, at `times` [s] or at evenly spaced times.

    These are one for every 2 degrees of the link that turns most, 241 at least and 1441 at most.
    """
    record = _finite(record)
    if len(record.time) < 2:
        return still(record.mechanism)
    if times is None:
        starts = {name: record.mechanism.link(name).start for name in record.links}
        angles = [motion.turn(starts[name])[0] for name, motion in record.links.items()]  # [rad], without their rates
        turns = [np.abs(np.diff(angle)).sum() / (2 * pi) for angle in angles]
        intervals = int(np.clip(180 * max(turns, default=0.0), 240, 1440))
        times = np.linspace(record.time[0], record.time[-1], intervals + 1)
    return _movie(record.at(times), record)


def still(mechanism: Mechanism) -> Movie:
    """Return the mechanism at t = 0 as a movie of one picture."""
    motionless = Record(mechanism, np.zeros(1), {}, {})
    return _movie(motionless, motionless)


def _finite(record: Record) -> Record:
    """Return the record up to its last finite state."""
    coordinates = [motion.q.reshape(len(motion.q), -1) for motion in (*record.links.values(), *record.blocks.values())]
    is_finite = np.isfinite(np.hstack([record.time[:, None], *coordinates])).all(axis=1)
    if is_finite.all():
        return record
    kept = slice(int(np.argmin(is_finite)))  # up to the first state that is not finite
    links, blocks = ({name: select(motion, kept) for name, motion in group.items()} for group in (record.links, record.blocks))
    return Record(record.mechanism, record.time[kept], links, blocks)


def _movie(record: Record, source: Record) -> Movie:
    """Make the movie of `record`, at the times of the pictures; `source` is the same motion at the times of the solver."""
    mechanism = record.mechanism
    sheet = Sheet(mechanism, record)
    marks = tuple(draw_marks(sheet))  # it adds the frames that marks need to `sheet.frames`
    sources = sheet.frames | {point: FrameSource(point) for point in mechanism.points}
    frames = {name: _frame(record, frame) for name, frame in sources.items()}
    bands = {}
    for link in mechanism.links:
        bent = bent_line(record, source, link)
        if bent is not None:
            section, (points, _, _) = link.body.section, bent
            middle = points[:, points.shape[1] // 2]
            bands[link.name] = Band(*bent, section.thickness, section.width, section.material.modulus)
            frames[MIDDLE + link.name] = np.column_stack(
                [middle, np.zeros(len(middle))]
            )  # of the link's name, which stays upright
    return Movie(record.time, frames, bands, marks, sheet.unit, tuple(mechanism.points))


def _frame(record: Record, frame: FrameSource) -> Array:
    """Compute x, y [m] and the angle [rad] of a frame, (times, 3)."""
    if not frame.reference:
        return np.zeros((len(record.time), 3))
    place, _velocity = record.point(frame.reference)
    angle, _rate = record.turn(frame.reference)
    if frame.pin:  # `place` is the centre of the bush, from which the pin is drawn at an enlarged distance
        pin, _velocity = record.point(frame.pin)
        place = place + frame.factor * (pin - place)
    return np.column_stack([place, angle if frame.turns else np.zeros_like(angle)])
