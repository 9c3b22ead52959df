"""Derivatives of readings by the numbers of a mechanism, each with its error.

Each reading is taken on runs that share their steps (`frozen`), at the number as it is and a little more; and a little less,
over a wider difference, on steps twice as long, with strips of lower degree. The finer difference is the derivative; how far the
coarser one is from it tells what is left of width, steps and degree. Where they disagree visibly, both sides of both are taken.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf, isfinite, nan
from typing import NamedTuple

import numpy as np

from ..geometry import Array
from ..mechanism import Mechanism
from ..record.run import Run
from ..solvers import Spectral
from ..validate import listed, positive, short
from .curve import Smooth
from .frozen import DEGREES, TIGHT, Steps, needs_compiler
from .numbers import DURATION, Family, Source
from .reading import check, measure, statical
from .table import Derivative, Sensitivities

Evaluate = Callable[[Mechanism, float | None], tuple[Array, list[str], float]]
Reading = str | Callable[[Mechanism], float]
DEGREE = 8
"""Of strips' polynomials, where the solver names none."""
WIDER = 4.0
"""Than the finer difference is the other."""


class Way(NamedTuple):
    """How differences are taken: width of the finer one, relative to the number; rounding of a reading, relative; by how much
    the coarser derivative errs more than the finer one, less one.
    """

    width: float
    rounding: float
    better: float


MOVING, RESTING = Way(3e-7, 1e-15, 3.0), Way(1e-3, 1e-13, 15.0)
"""Of runs, whose errors are the same where they share their steps, with an order in the steps' length between that of forces, 3,
and of what follows impacts, 1; and of states of rest, whose coarser differences are four times as wide."""
GRAZING = 100.0
"""Times the width: where a number changes nothing that is read, contacts are looked for that begin on one side only."""
NOISE = 3.5
"""A reading's noise changes second differences by so many times what it changes central ones by, over their width."""
SMALL = 1e-2
"""Relative change of the reading by a relative change of the number below which an uncertain derivative is as good as none."""
KINKED = 0.5
"""Derivatives from below and above differ by half as much at a quarter of the width where the reading is smooth: that is by less
than this share."""
VISIBLE = 1e-3
"""Of the derivative, by which they must differ to be told as a kink."""


def sensitivities(
    mechanism: Source,
    duration: float | None = None,
    *,
    by: Sequence[str] | Mapping[str, float],
    of: str | Sequence[str] | Mapping[str, Reading],
    solver: Spectral | None = None,
    at: Mapping[str, float] | None = None,
) -> Sensitivities:
    """Derivatives of readings by numbers of a mechanism.

    Parameters
    ----------
    mechanism : Mechanism, mapping or callable
        Or the content of its file, or a function that makes one of the arguments in `at`.
    duration : float, optional
        s, positive; without it readings are of states of rest.
    by : sequence of str, or mapping of str to float
        Numbers by their paths, as in files (`links.coupler.body.section.thickness`), or "duration"; with the standard
        deviation of each, SI, to have the spread of readings. A number that is zero needs one.
    of : str, sequence of str, or mapping
        What is read off, as 'max(B.contact_force)' or 'frequency(1)' (see `buckler.mbs.sensitivity.reading`); or by a name of
        one's own such a text, or a function of the mechanism that returns a number.
    solver : Spectral, optional
        What chooses the steps; by default with a tolerance of 1e-7.
    at : mapping of str to float, optional
        Arguments of the function that makes the mechanism.

    Returns
    -------
    Sensitivities

    Raises
    ------
    ValueError
        On a wrong path or reading, before anything runs.
    RunFailedError
        If a run does not end.

    References
    ----------
    H. G. Bock, in: Numerical treatment of inverse problems in differential and integral equations, Birkhäuser 1983, 95-121,
    doi 10.1007/978-1-4684-7324-7_7.
    """
    needs_compiler()
    if duration is not None:
        duration = float(positive("duration", duration, "s"))
    readings = readings_of(of, moving=duration is not None)
    family = Family.of(mechanism, by, at or {})
    units = family.units | {DURATION: "s"}
    given = by.items() if isinstance(by, Mapping) else ()
    spreads = {name: float(positive(f"standard deviation of {name}", value, units[name])) for name, value in given}
    points = family.values | ({DURATION: float(duration)} if DURATION in by and duration else {})
    if DURATION in by and duration is None:
        raise ValueError("by = duration: give the duration, too")
    scales = {name: _scale(name, points[name], spreads) for name in by}
    fixed = {} if isinstance(mechanism, Mechanism | Mapping) else dict(at or {})
    moving = {name: each for name, each in readings.items() if isinstance(each, str) and not statical(each)}
    resting = {name: each for name, each in readings.items() if name not in moving}
    rows: list[Derivative] = []
    for group, way in ((moving, MOVING), (resting, RESTING)):
        if group:
            levels = _levels(family.make(fixed | family.values), duration, solver, group)
            rows += _rows(_Turned(family, points, fixed, scales, duration), levels, list(group), way)
    return Sensitivities(rows, spreads)


class _Turned(NamedTuple):
    """What is turned: numbers by name with their values, other arguments, what counts as a large change, the run's length."""

    family: Family
    points: dict[str, float]
    fixed: dict[str, float]
    scales: dict[str, float]
    duration: float | None

    def evaluated(self, evaluate: Evaluate, **changes: float) -> tuple[Array, list[str], float]:
        """Readings with other values of some numbers."""
        found = {**self.points, **changes}
        span = found.pop(DURATION, self.duration)
        return evaluate(self.family.make(self.fixed | found), span)


def _rows(turned: _Turned, levels: Sequence[Evaluate], readings: Sequence[str], way: Way) -> list[Derivative]:
    """Derivatives of some readings; of each reading the largest first."""
    turned.evaluated(levels[0])  # leaves the tape that the next one goes by
    starts = [turned.evaluated(evaluate) for evaluate in levels]
    values, units, _ = starts[1]
    sides = {name: _sides(turned, name, levels, starts, way) for name in turned.scales}
    rows = []
    for i, reading in enumerate(readings):
        rounding, unlike = way.rounding * abs(float(values[i])) / way.width, abs(float(values[i] - starts[0][0][i])) / way.better
        made = []
        for name, scale in turned.scales.items():
            units_of = units[i], turned.family.units.get(name, "s")
            about = Derivative(reading, name, float(values[i]), turned.points[name], *units_of)
            slopes, grazes = sides[name]
            noise = (rounding + unlike * slopes[:, i].any()) / scale  # what no run shows to depend on a number does not err by it
            made.append(_derivative(about, scale, slopes[:, i].tolist(), noise, grazes, way))
        rows += sorted(
            made, key=lambda row: -abs(row.derivative * turned.scales[row.number]) if isfinite(row.derivative) else 0.0
        )
    return rows


def _sides(
    turned: _Turned, name: str, levels: Sequence[Evaluate], starts: Sequence[tuple[Array, list[str], float]], way: Way
) -> tuple[Array, bool]:
    """One-sided derivatives by a number: coarser from below and above, finer from below and above, shape (4, readings).

    Where the coarser one from below and the finer one from above agree, each stands for its other side, too. Also whether a
    contact begins on one side that does not on the other.
    """
    grazes = []

    def slope(level: int, share: float) -> Array:
        d, (start, _, onsets) = share * way.width * turned.scales[name], starts[level]
        moved, _, found = turned.evaluated(levels[level], **{name: turned.points[name] + d})
        grazes.append(found != onsets)
        return np.asarray((moved - start) / d)

    below0, above = slope(0, -WIDER), slope(1, 1.0)
    if way is MOVING and not np.all((below0 != 0) | (above != 0) | (starts[1][0] != 0)):
        slope(0, -GRAZING), slope(0, GRAZING)
    least = np.maximum(np.abs(above), SMALL * np.abs(starts[1][0]) / turned.scales[name])
    if way is MOVING and np.all(np.abs(above - below0) <= VISIBLE * least):
        return np.array([below0, below0, above, above]), any(grazes)
    return np.array([below0, slope(0, WIDER), slope(1, -1.0), above]), any(grazes)


def readings_of(of: str | Sequence[str] | Mapping[str, Reading], moving: bool) -> dict[str, Reading]:
    """Readings by name, checked by their grammar.

    Raises
    ------
    ValueError
    """
    found: dict[str, Reading] = dict(of) if isinstance(of, Mapping) else {
        text: text for text in ([of] if isinstance(of, str) else listed("of", of))
    }  # fmt: skip
    if not found:
        raise ValueError("of: no reading; write for instance 'max(B.contact_force)'")
    for name, reading in found.items():
        if not callable(reading):
            check(reading)
            if not moving and not statical(reading):
                raise ValueError(f"{name}: is read off a run; give a duration")
    return found


def _levels(
    mechanism: Mechanism, duration: float | None, solver: Spectral | None, readings: Mapping[str, Reading]
) -> list[Evaluate]:
    """What takes all readings of a mechanism: coarser, and finer."""
    moving = any(isinstance(each, str) and not statical(each) for each in readings.values())
    if not moving or duration is None:
        return [Level(readings, None)] * 2
    solver = solver or TIGHT
    degree = solver.degree or DEGREE
    steps = Steps.of(mechanism, duration, replace(solver, degree=degree + DEGREES))
    return [Level(readings, steps.coarser(degree)), Level(readings, steps)]


@dataclass(frozen=True)
class Level:
    """How readings are taken.

    Attributes
    ----------
    readings : dict of str to text or callable
    steps : Steps or None
        Of the runs.
    """

    readings: Mapping[str, Reading]
    steps: Steps | None

    @property
    def asked(self) -> str:
        """All texts."""
        return " ".join(text for text in self.readings.values() if isinstance(text, str))

    def __call__(
        self, mechanism: Mechanism, duration: float | None = None, run: Run | None = None
    ) -> tuple[Array, list[str], float]:
        """Values and units, and how many contacts begin in the run, which may be given."""
        values, units = list[float](), list[str]()
        for reading in self.readings.values():
            if callable(reading):
                value, unit = float(reading(mechanism)), ""
            elif resting := statical(reading):
                value, unit = resting(mechanism), "Hz"
            else:
                run = run or (self.steps.run(mechanism, duration, self.asked) if self.steps else None)
                if run is None:
                    raise ValueError(f"{short(reading)}: is read off a run; give a duration")
                value, unit = measure(reading, run.record.time, run.values, run.units, Smooth)
            values.append(value)
            units.append(unit)
        return np.array(values), units, run.work["onsets"] if run else 0


def _scale(name: str, value: float, spreads: Mapping[str, float]) -> float:
    """What counts as a large change of a number."""
    scale = abs(value) or abs(spreads.get(name, 0.0))
    if not scale:
        raise ValueError(f"{name} = 0: a relative change says nothing; give its standard deviation, too")
    return scale


def _derivative(about: Derivative, scale: float, sides: Sequence[float], noise: float, grazes: bool, way: Way) -> Derivative:
    """Put together what the coarser and the finer readings say."""
    below0, above0, below, above = sides
    value, middle, other = about.value, 0.5 * (below + above), 0.5 * (below0 + above0)
    gap, wider = above - below, above0 - below0
    off, error = abs(middle - other) + noise, abs(middle - other) / way.better + abs(gap - wider / WIDER) / NOISE + noise
    gap, wider = abs(gap), abs(wider)
    note = ""
    if not isfinite(middle + other):
        note = "the reading has no value there"
    elif gap > KINKED * wider and gap > max(10 * off, VISIBLE * abs(middle)):
        note = f"a kink: {below:.4g} below, {above:.4g} above"
    elif grazes and (off > KINKED * abs(middle) or middle == other == 0):
        note = "a graze: a contact begins on one side only"
    elif off > KINKED * abs(middle) and off * scale > SMALL * abs(value):
        note = f"no digit is certain: {other:.3g} and {middle:.3g} of two widths and step lengths: chaos or a jump"
    if note:
        middle, error = nan, inf
    return about._replace(derivative=middle, error=error, below=below, above=above, note=note)
