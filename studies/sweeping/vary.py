"""Cases of a sweep from the words of `--vary`.

    thickness=0.1mm:0.5mm:9        nine values, evenly spaced, both ends among them
    tolerance=1e-5:1e-3:7:log      seven values, evenly spaced in the logarithm
    speed=0.75,1.25,6.58           these values
    models=strut,beam              these words, one a case

Several are combined each with each.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from buckler.mbs.declare import Declaration
from buckler.mbs.units import measured, parse_quantity, written_unit

from ..kit.parameters import Cases, StudyParameters, specs
from ..kit.registry import hint

DIGITS = 12
"""Significant digits of values between the ends, so that 0.1mm:0.5mm:9 holds 0.15 mm without a rounding error."""
MOST = 1_000_000
"""Largest number of cases: more is a slip of the keyboard."""


class Axis(NamedTuple):
    """Varied parameter and its values; `log` where they are spaced in the logarithm.

    Tables and figures show it in `unit`, as it was written, whose size is `factor`; without one in the parameter's own unit.
    """

    name: str
    values: tuple[Any, ...]
    log: bool = False
    unit: str = ""
    factor: float = 1.0

    def show(self, value: Any) -> Any:
        """Return a value in the unit of tables and figures."""
        return float(f"{value / self.factor:.12g}") if self.unit and isinstance(value, float) else value

    def label(self, units: Mapping[str, str]) -> str:
        """Return the unit of tables and figures."""
        return self.unit or units[self.name]


class Plan(NamedTuple):
    """Cases of a sweep, and the parameters that vary."""

    cases: Sequence[StudyParameters]
    axes: Sequence[Axis]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the varied parameters, in the order given."""
        return tuple(axis.name for axis in self.axes)


def parse(text: str, kind: type[StudyParameters] | Cases) -> Axis:
    """Read one `NAME=VALUES`."""
    name, equals, values = text.partition("=")
    known = specs(kind)
    name = name.strip() if name.strip() in known else name.strip().replace("-", "_")
    if name not in known:
        raise ValueError(f"--vary {text}: unknown parameter '{name}'; {hint(name, known) or 'see --help'}")
    if not equals or not values.strip():
        raise ValueError(f"--vary {text}: no values; write {name}=START:STOP:COUNT or {name}=A,B,C")
    try:
        if ":" in values:
            return _as_written(_range(name, values, known[name]), values, known[name].unit)
        listed = tuple(_value(name, part, known[name]) for part in values.split(","))
        if len(set(listed)) < len(listed):
            raise ValueError("one of them given twice")
        return _as_written(Axis(name, listed), values, known[name].unit)
    except ValueError as reason:
        raise ValueError(f"--vary {text}: {reason}") from None


def _as_written(axis: Axis, text: str, unit: str) -> Axis:
    """Return the axis with the unit that stands behind its first number."""
    given = written_unit(re.split("[:,]", text)[0])
    if not given or not isinstance(axis.values[0], float):
        return axis
    return axis._replace(unit=given, factor=parse_quantity(f"1 {given}", unit) if unit else float(measured(f"1 {given}")))


def _value(name: str, text: str, spec: Declaration) -> Any:
    """Read a value; one alone of a parameter that takes several."""
    value = spec.spec.read(name, text)
    return value[0] if isinstance(value, tuple) else value


def _range(name: str, text: str, spec: Declaration) -> Axis:
    start, stop, *rest = text.split(":")
    log = rest[-1:] == ["log"]
    low, high = _value(name, start, spec), _value(name, stop, spec)
    if isinstance(low, str):
        raise ValueError(f"words have no range; write {name}={start},{stop}")
    if low == high:
        raise ValueError("start and stop are the same")
    if log and min(low, high) <= 0:
        raise ValueError("log needs start and stop above 0")
    counts = rest[:-1] if log else rest
    if not counts:
        raise ValueError("no count; write START:STOP:COUNT")
    if len(counts) > 1 or not counts[0].strip().isdecimal() or not 2 <= int(counts[0]) <= MOST:
        raise ValueError(f"'{':'.join(counts)}' is no count; allowed: 2 to {MOST}, and `:log` behind it")
    inner: list[Any] = [_round(x) for x in (np.geomspace if log else np.linspace)(low, high, int(counts[0]))[1:-1]]
    if isinstance(low, int):
        if odd := [x for x in inner if not x.is_integer()]:
            raise ValueError(f"gives {odd[0]:g}, which is not a whole number; choose another count or list them")
        inner = [int(x) for x in inner]
    return Axis(name, (low, *inner, high), log)


def _round(x: float) -> float:
    return float(f"{x:.{DIGITS}g}") + 0.0


def plan(kind: type[StudyParameters] | Cases, given: Mapping[str, object], axes: Sequence[Axis]) -> Plan:
    """Make every case, each value with each, or refuse the plan by a ValueError of one line; all cases share what is given."""
    names = [axis.name for axis in axes]
    for i, name in enumerate(names):
        if name in names[:i]:
            raise ValueError(f"--vary {name}: given twice")
        if name in given:
            raise ValueError(f"--vary {name}: also given as --{name.replace('_', '-')}")
    total = math.prod(len(axis.values) for axis in axes)
    if total > MOST:
        raise ValueError(f"{total} cases; allowed: up to {MOST}")
    combined = product(*(axis.values for axis in axes))
    return Plan([_case(kind, given, dict(zip(names, values, strict=True))) for values in combined], axes)


def _case(kind: type[StudyParameters] | Cases, given: Mapping[str, object], varied: Mapping[str, object]) -> StudyParameters:
    try:
        return kind(**{**given, **varied})
    except ValueError as error:
        known = specs(kind)
        shown = ", ".join(f"{name} = {known[name].show(value)}" for name, value in varied.items())
        raise ValueError(f"{shown}: {error}" if shown else str(error)) from None
