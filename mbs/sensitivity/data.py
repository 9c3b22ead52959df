"""Experiments: measured signals over time, measured numbers and bounds, and their input from text files."""

import csv
import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from math import isfinite, nan
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..geometry import Array
from ..units import measured, parse_quantity, parse_unit
from ..validate import near, short

SIDES = {"is": 0, "at most": 1, "at least": -1}
"""Sign of the residuals that count, by `side` of a measurement: 0 for both signs, 1 above an upper bound, -1 below a lower."""
BRACKETED = re.compile(r"(?P<name>.*?)\s*(?:\[(?!\d+\])(?P<square>[^\]]*)\]|\((?P<round>[^)]*)\))\s*")
"""Pattern of a name with a unit in brackets. Digits in brackets are no unit: `value[0]` is the path of a number."""


class Read(NamedTuple):
    """Measured value of a reading, SI, and its standard deviation `error`; with `side` 'at most' or 'at least' a bound of it."""

    value: float
    error: float
    side: str = "is"

    def residual(self, predicted: float) -> float:
        """Return the residual of a prediction in standard deviations; 0 if the prediction meets the bound."""
        residual, sign = (predicted - self.value) / self.error, SIDES[self.side]
        return residual if not sign else max(0.0, residual * sign) * sign


@dataclass(frozen=True)
class Experiment:
    """Measurements of one run of a mechanism, at increasing times [s] from the start of the run, (samples,).

    `signals` (samples,) are named as in a result, SI, nan where nothing was measured. `units` are those of the file, of the same
    dimensions as those of the result. `errors` are standard deviations of signals; a fit estimates missing ones. `readings` are
    measured numbers by formula, as 'max(B.contact_force)'. `settings` are values of numbers of the mechanism in this experiment,
    by path. The `duration` [s] is by default the last time.
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
        is_wrong = ~np.isfinite(time) | (np.diff(time, prepend=-1e-300) <= 0)  # -1e-300: the first time may be 0
        if wrong := np.flatnonzero(is_wrong).tolist():
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
        """Duration of the run [s]."""
        if self.duration is None and not len(self.time):
            raise ValueError("duration: an experiment of readings alone needs it")
        return float(self.time[-1]) if self.duration is None else float(self.duration)


class DataColumn(NamedTuple):
    """Name and unit of a column, as written, and the heading that contains them."""

    name: str
    unit: str
    heading: str


Rows = list[tuple[int, list[str]]]
"""Number of a line and its cells, for each row of a table."""


def read_csv(
    path: str | Path, signals: Sequence[str], settings: Sequence[str] = (), start: float | None = None
) -> list[Experiment]:
    """Read experiments from a text file: the first column is the time, each further one a signal or a setting.

    The text is in UTF-8 or UTF-16. Columns are separated by tabs, semicolons, commas or spaces; a comma within a number is a
    decimal comma. The last line before the numbers names the columns; lines above it are ignored. Units are in brackets,
    `angle [deg]` or `angle (deg)`, after a slash, `angle/deg`, or in a line below the names; without a unit, numbers are SI.

    `signals` are columns to be fitted: `NAME`, or `COLUMN=NAME` where the signal has another name. `settings` are columns that
    separate experiments: consecutive rows with equal values are one experiment. A setting with a point in its name is the path of
    a number of the mechanism. `start` is the time of the file at which the run begins [s], by default 0. It is required if the
    first time exceeds the file's duration. With settings, if time increases over the whole file, the time of each experiment
    counts from its first row, and `start` has no effect.
    """
    try:
        content = Path(path).read_bytes()
        text = content.decode("utf-16" if content[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig")
        return _experiments(*_table(text), signals, settings, start)
    except UnicodeDecodeError:
        raise ValueError(f"{path}: is no text in UTF-8 or UTF-16") from None
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


def _table(text: str) -> tuple[list[DataColumn], Rows]:
    """Split a text into columns and rows of numbers, by the first separator for which a line of names is followed by numbers."""
    lines = text.splitlines()
    for separator in ("\t", ";", ",", " "):  # the comma late, as it may be a decimal comma
        rows = [(number, _cells(line, separator)) for number, line in enumerate(lines, 1) if line.strip()]
        has_numbers = [len(row) > 1 and row[0] != "" and None not in map(_value, row) for _, row in rows]
        first = has_numbers.index(True) if any(has_numbers) else 0  # number of lines above the numbers
        if first and len(rows) > first + 1:
            return _columns([row for _, row in rows[:first]], rows[first - 1][0]), rows[first:]
    last = next((f"; the last line is {short(line)}" for line in reversed(lines) if line.strip()), "")
    raise ValueError(f"needs a line of names and two of numbers at least{last}")


def _cells(line: str, separator: str) -> list[str]:
    return line.split() if separator == " " else [cell.strip() for cell in next(csv.reader([line], delimiter=separator))]


def _value(cell: str) -> float | None:
    """Read a number with a decimal point or comma; return nan for an empty cell, None for text."""
    with suppress(ValueError):
        return float(cell.replace(",", ".") if cell.count(",") == 1 and "." not in cell else cell) if cell else nan
    return None


def _is_unit(text: str) -> bool:
    with suppress(ValueError):
        parse_unit(text)
        return True
    return False


def _columns(above: list[list[str]], line: int) -> list[DataColumn]:
    """Read names and units from the lines above the numbers, `above`; number `line` is the last of them."""
    names, units = above[-1], [""] * len(above[-1])
    split = [_column(cell, "") for cell in names]
    # The last line has units, and the line above it names, if its cells are units or empty and the first is a unit of time. The
    # first column is the time; names such as `t` and `m` are units, too. `[deg]` splits into the unit `deg` and no name.
    texts = [column.heading if column.name else column.unit for column in split]
    are_units = len(above) > 1 and len(above[-2]) == len(names) and all(map(_is_unit, filter(None, texts)))
    if are_units and texts[0] and parse_unit(texts[0]).dimension == parse_unit("s").dimension:
        names, units = above[-2], texts
    while names and not names[-1]:
        names = names[:-1]
    if wrong := [cell for cell in names if cell and _value(cell) is not None]:
        raise ValueError(f"line {line}: '{wrong[0]}' stands where names of columns should")
    columns = [_column(cell, unit) for cell, unit in zip(names, units, strict=False)]
    if len({column.name for column in columns}) < len(columns):
        raise ValueError(f"two columns of the same name; there are: {', '.join(column.name for column in columns)}")
    times = [column.heading for column in columns if column.name.lower() in ("t", "time")]  # else the first is the time
    if times and columns[0].heading not in times:
        first = f"'{columns[0].heading}'" if columns[0].heading else "which has no name"
        raise ValueError(f"line {line}: the first column, {first}, is read as the time; leave out columns before '{times[0]}'")
    return columns


def _column(heading: str, unit: str) -> DataColumn:
    """Split a heading into name and unit: text in brackets is a unit, text after a slash may be one."""
    if found := BRACKETED.fullmatch(heading):
        return DataColumn(found["name"], found["square"] or found["round"] or "", heading)
    name, slash, after = heading.partition("/")
    if slash and _is_unit(after):
        return DataColumn(name.strip(), after.strip(), heading)
    return DataColumn(heading, unit, heading)


def _experiments(
    columns: list[DataColumn], rows: Rows, signals: Sequence[str], settings: Sequence[str], start: float | None
) -> list[Experiment]:
    """Convert the columns of signals and settings to SI, and split their rows into experiments where a setting changes."""
    pairs = [text.partition("=") for text in signals]  # COLUMN=NAME
    fitted = {name if equals else column: _find(columns, column) for column, equals, name in pairs}
    set_columns = {name: _find(columns, name) for name in settings}
    used = (columns[0], *fitted.values(), *set_columns.values())
    factors = {column: _factor(column, "s" if column is columns[0] else "") for column in used}
    values: dict[DataColumn, list[float]] = {column: [] for column in factors}
    for line, row in rows:
        if len(row) < len(columns) or any(row[len(columns) :]):
            raise ValueError(f"line {line}: {len(row)} cells for {len(columns)} columns")
        for column, cell in zip(columns, row, strict=False):
            if column in factors:
                if (value := _value(cell)) is None:
                    raise ValueError(f"line {line}, {column.name}: '{cell}' is no number")
                values[column].append(value * factors[column])
    arrays = {column: np.array(numbers) for column, numbers in values.items()}
    time = arrays[columns[0]]
    counts_from_first_rows = bool(settings) and bool((np.diff(time) > 0).all())
    if start is None and not counts_from_first_rows and time[0] > time[-1] - time[0] > 0:
        late = f"its time begins at {time[0]:g} s, later than it lasts"
        raise ValueError(f"{late}: give start={time[0]:g} if the run begins there, start=0 if it begins at 0 s")
    time = time - (start or 0.0)
    keys = np.column_stack([arrays[column] for column in set_columns.values()]) if settings else np.zeros((len(time), 1))
    experiments = []
    is_change = (np.diff(keys, axis=0) != 0).any(axis=1)
    for part in np.split(np.arange(len(keys)), np.flatnonzero(is_change) + 1):  # indices of the rows of an experiment
        constants = {name: float(arrays[column][part[0]]) for name, column in set_columns.items()}
        first_time = time[part[0]] if counts_from_first_rows else 0.0
        experiments.append(Experiment(
            time[part] - first_time, {name: arrays[column][part] for name, column in fitted.items()},
            units={name: column.unit for name, column in fitted.items() if column.unit},
            settings={name: value for name, value in constants.items() if "." in name},
            name=", ".join(f"{name} = {value:g}" for name, value in constants.items()),
        ))  # fmt: skip
    return experiments


def _find(columns: Sequence[DataColumn], name: str) -> DataColumn:
    """Find a column by its name or its heading."""
    for column in columns:
        if name in (column.name, column.heading):
            return column
    names = [column.name for column in columns]
    close = near(name, names)
    raise ValueError(f"no column '{name}'; {f'did you mean {close[0]}?' if close else 'there are: ' + ', '.join(names)}")


def _factor(column: DataColumn, expected: str) -> float:
    """Return the factor from a column's unit to SI; `expected` is an SI unit of the same dimension, or '' for any dimension.

    Raise a ValueError if the unit is unknown or has another dimension.
    """
    unit_quantity = f"1 {column.unit}"
    try:
        return parse_quantity(unit_quantity, expected) if expected else float(measured(unit_quantity))
    except ValueError as error:
        raise ValueError(f"{column.name} [{column.unit}]: {error}; write its unit in brackets behind its name") from None
