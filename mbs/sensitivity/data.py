"""What was measured: signals over time, readings, bounds; from arrays or a CSV file with units."""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import inf, isfinite, nan
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..geometry import Array
from ..units import measured, parse_quantity
from ..validate import near

SIDES = {"is": 0, "at most": 1, "at least": -1}
HEADER = re.compile(r"\s*(?P<name>[^\[]*?)\s*(?:\[(?P<unit>[^\]]*)\])?\s*")


class Read(NamedTuple):
    """A number that was read.

    Attributes
    ----------
    value, error : float
        SI; the error is a standard deviation.
    side : str
        'is'; 'at most' where the sensor said only that it was not more, 'at least' that it was not less.
    """

    value: float
    error: float
    side: str = "is"

    def lacks(self, predicted: float) -> float:
        """How far a prediction is off, in standard deviations; 0 on the right side of a bound."""
        off = (predicted - self.value) / self.error
        return off if not SIDES[self.side] else max(0.0, off * SIDES[self.side]) * SIDES[self.side]


@dataclass(frozen=True)
class Experiment:
    """One experiment: what was set, what was measured.

    Attributes
    ----------
    time : array, shape (samples,)
        s, increasing, from the start of the run.
    signals : dict of str to array, shape (samples,)
        By the names of a result, SI; nan where nothing was measured.
    units : dict of str to str
        Those in which signals came, which must be of their kind; any of signals that are not named.
    errors : dict of str to float
        Standard deviations of signals; those of the others are estimated from what the fit leaves.
    readings : dict of str to Read
        By their formula, as 'max(B.contact_force)'.
    settings : dict of str to float
        Numbers of the mechanism, by path, that this experiment has.
    duration : float, optional
        s; by default the last time.
    name : str
    """

    time: Array = field(default_factory=lambda: np.empty(0))
    signals: Mapping[str, Array] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    errors: Mapping[str, float] = field(default_factory=dict)
    readings: Mapping[str, Read] = field(default_factory=dict)
    settings: Mapping[str, float] = field(default_factory=dict)
    duration: float | None = None
    name: str = ""

    def __post_init__(self) -> None:
        time = np.asarray(self.time, dtype=float)
        if wrong := [k for k, (t, before) in enumerate(zip(time, [-1e-300, *time], strict=False)) if not before < t < inf]:
            raise ValueError(f"time[{wrong[0]}] = {time[wrong[0]]:g} s: times must be finite, 0 at least, and increase")
        object.__setattr__(self, "time", time)
        signals = {name: np.asarray(values, dtype=float) for name, values in self.signals.items()}
        for name, values in signals.items():
            if values.shape != time.shape:
                raise ValueError(f"{name}: {values.size} values for {time.size} times")
            if np.isinf(values).any():
                raise ValueError(f"{name}: must be finite, or nan where nothing was measured")
        object.__setattr__(self, "signals", signals)
        for name, read in self.readings.items():
            if not (isfinite(read.value) and read.error > 0 and read.side in SIDES):
                raise ValueError(f"{name} = {read}: needs a value, an error above 0, and one of {', '.join(SIDES)}")
        if not signals and not self.readings:
            raise ValueError("data: neither signals nor readings")

    @property
    def span(self) -> float:
        """Length of its run, s."""
        if self.duration is None and not len(self.time):
            raise ValueError("duration: an experiment of readings alone needs it")
        return float(self.time[-1]) if self.duration is None else float(self.duration)


def read_csv(path: str | Path, signals: Sequence[str], settings: Sequence[str] = ()) -> list[Experiment]:
    """Read experiments from a CSV file: the first column is the time, each other one a signal or a setting.

    Parameters
    ----------
    path : str or Path
        Its first line names columns, with units in brackets, as `angle [deg]`; without one they are in SI. Between columns stand
        commas, tabs or semicolons; with these decimal commas are read, too.
    signals : sequence of str
        Signals that are fitted: `NAME` of a column, or `COLUMN=NAME`.
    settings : sequence of str
        Columns whose value is a number of the mechanism, by its path, or what parts the experiments: rows of equal values are one
        experiment. A column `name` only parts. Where a recording goes on from one experiment to the next, each run begins with
        its first row; else the times are those of the run.

    Raises
    ------
    ValueError
        In one line, with the file's name.
    """
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise ValueError(f"{path}: is no text in UTF-8") from None
    first = text.partition("\n")[0]
    mark = max(",;\t", key=first.count)
    rows = [(line, row) for line, row in enumerate(csv.reader(text.splitlines(), delimiter=mark), 1) if any(row)]
    if len(rows) < 3:
        raise ValueError(f"{path}: needs a line of names and two of numbers at least")
    heads = [HEADER.fullmatch(cell) for cell in rows[0][1]]
    names = [head["name"] if head else cell for head, cell in zip(heads, rows[0][1], strict=True)]
    units = {name: head["unit"] or "" if head else "" for name, head in zip(names, heads, strict=True)}
    if len(units) < len(names):
        raise ValueError(f"{path}: two columns of the same name; there are: {', '.join(names)}")
    wanted = dict(_pair(text) for text in signals)
    for column in (*wanted.values(), *settings):
        if column not in names:
            close = near(column, names)
            hint = f"did you mean {close[0]}?" if close else f"there are: {', '.join(names)}"
            raise ValueError(f"{path}: no column '{column}'; {hint}")
    used = dict.fromkeys([names[0], *wanted.values(), *settings])
    table: dict[str, list[float]] = {name: [] for name in used}
    factors = {name: _factor(path, name, units[name], "s" if name == names[0] else "") for name in used}
    for line, row in rows[1:]:
        if len(row) < len(names) or any(row[len(names) :]):
            raise ValueError(f"{path}: line {line}: {len(row)} cells for {len(names)} columns")
        for name, cell in zip(names, row, strict=False):
            if name in used:
                cell = cell.replace(",", ".") if mark == ";" else cell
                table[name].append(_number(path, line, name, cell) * factors[name])
    try:
        return _parted({name: np.array(values) for name, values in table.items()}, names[0], wanted, settings, units)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


def _parted(
    table: Mapping[str, Array], time: str, wanted: Mapping[str, str], settings: Sequence[str], units: Mapping[str, str]
) -> list[Experiment]:
    """Experiments: rows that follow each other with the same settings."""
    goes_on = bool(settings) and bool((np.diff(table[time]) > 0).all())
    keys = np.column_stack([table[name] for name in settings]) if settings else np.zeros((len(table[time]), 1))
    cuts = np.flatnonzero((np.diff(keys, axis=0) != 0).any(axis=1)) + 1
    found = []
    for rows in np.split(np.arange(len(keys)), cuts):
        t = table[time][rows]
        found.append(Experiment(
            t - t[0] if goes_on else t, {name: table[column][rows] for name, column in wanted.items()},
            units={name: units[column] for name, column in wanted.items() if units[column]},
            settings={name: float(table[name][rows[0]]) for name in settings if "." in name},
            name=", ".join(f"{name} = {table[name][rows[0]]:g}" for name in settings),
        ))  # fmt: skip
    return found


def _pair(text: str) -> tuple[str, str]:
    """Signal and column."""
    column, equals, name = text.partition("=")
    return (name, column) if equals else (column, column)


def _factor(path: Path, column: str, unit: str, wanted: str) -> float:
    """What a column's unit is in SI; of another kind than the one wanted, if one is, it is refused."""
    try:
        return parse_quantity(f"1 {unit}", wanted) if wanted else float(measured(f"1 {unit}"))
    except ValueError as error:
        raise ValueError(f"{path}: {column} [{unit}]: {error}") from None


def _number(path: Path, line: int, name: str, cell: str) -> float:
    try:
        return float(cell) if cell.strip() else nan
    except ValueError:
        raise ValueError(f"{path}: line {line}, {name}: '{cell}' is no number") from None
