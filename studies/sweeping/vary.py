"""What `--vary` and its companions mean: from words to the list of cases.

    thickness=0.1mm:0.5mm:9        nine values, evenly spaced, both ends among them
    tolerance=1e-5:1e-3:7:log      seven values, evenly spaced in the logarithm
    speed=0.75,1.25,6.58           these values
    models=strut,beam              these words, one a case
    thickness=0.1mm:0.5mm          no count: sampled (`--samples`, `--method`), `:log` in the logarithm

Several grids and lists are combined each with each, and each with every sample. Samples fill all ranges jointly.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from buckler.mbs.declare import Declaration

from ..kit.parameters import Cases, StudyParameters, specs
from ..kit.registry import hint

METHODS = ("sobol", "halton", "lhs")
DIGITS = 12
"""Of values between the ends, so that 0.1mm:0.5mm:9 holds 0.15 mm and not a rounding error more."""
MOST = 1_000_000
"""Cases of one sweep; more is taken for a slip of the keyboard."""


class Grid(NamedTuple):
    """A varied parameter with its values."""

    name: str
    values: tuple[Any, ...]
    log: bool = False


class Range(NamedTuple):
    """A varied parameter to be sampled from `low` to `high`."""

    name: str
    low: Any
    high: Any
    log: bool = False


@dataclass(frozen=True)
class Sampling:
    """How ranges are sampled.

    Attributes
    ----------
    count : how many samples
    method : sobol, halton (quasi-random, scrambled) or lhs (Latin hypercube); `scipy.stats.qmc`
    draw : another one gives other samples of the same kind
    """

    count: int
    method: str = "sobol"
    draw: int = 0


@dataclass(frozen=True)
class Plan:
    """The cases of a sweep and what varies between them.

    Attributes
    ----------
    cases : sequence of StudyParameters
    names : parameters that vary, in the order given, without the seed of repeats
    sampled, log : those that are sampled, and those that are spaced in the logarithm
    repeats : cases that differ by their seed only
    """

    cases: Sequence[StudyParameters]
    names: tuple[str, ...]
    sampled: frozenset[str]
    log: frozenset[str]
    repeats: int


def parse(text: str, kind: type[StudyParameters] | Cases) -> Grid | Range:
    """Read one `NAME=VALUES`.

    Raises
    ------
    ValueError
        In one line.
    """
    name, equals, values = text.partition("=")
    known = specs(kind)
    name = name.strip() if name.strip() in known else name.strip().replace("-", "_")
    if name not in known:
        raise ValueError(f"--vary {text}: unknown parameter '{name}'; {hint(name, known) or 'see --help'}")
    if not equals or not values.strip():
        raise ValueError(f"--vary {text}: no values; write {name}=START:STOP:COUNT, {name}=START:STOP or {name}=A,B,C")
    try:
        return _range(name, values, known[name]) if ":" in values else _list(name, values, known[name])
    except ValueError as reason:
        raise ValueError(f"--vary {text}: {reason}") from None


def _one(name: str, text: str, spec: Declaration) -> Any:
    """One value; of a parameter that takes several, one alone."""
    value = spec.spec.read(name, text)
    return value[0] if isinstance(value, tuple) else value


def _list(name: str, text: str, spec: Declaration) -> Grid:
    values = tuple(_one(name, part, spec) for part in text.split(","))
    if len(set(values)) < len(values):
        raise ValueError("one of them given twice")
    return Grid(name, values)


def _range(name: str, text: str, spec: Declaration) -> Grid | Range:
    start, stop, *rest = text.split(":")
    log = rest[-1:] == ["log"]
    low, high = _one(name, start, spec), _one(name, stop, spec)
    if isinstance(low, str):
        raise ValueError(f"words have no range; write {name}={start},{stop}")
    if low == high:
        raise ValueError("start and stop are the same")
    if log and min(low, high) <= 0:
        raise ValueError("log needs start and stop above 0")
    counts = rest[:-1] if log else rest
    if not counts:
        return Range(name, low, high, log)
    if len(counts) > 1 or not counts[0].strip().isdecimal() or not 2 <= int(counts[0]) <= MOST:
        raise ValueError(f"'{':'.join(counts)}' is no count; allowed: 2 to {MOST}, and `:log` behind it")
    return Grid(name, _spaced(low, high, int(counts[0]), log), log)


def _spaced(low: Any, high: Any, count: int, log: bool) -> tuple[Any, ...]:
    """Values from low to high, the ends exactly as given."""
    inner = (np.geomspace if log else np.linspace)(low, high, count)[1:-1]
    values = [_rounded(x) for x in inner]
    if isinstance(low, int):
        for x in values:
            if not x.is_integer():
                raise ValueError(f"gives {x:g}, which is not a whole number; choose another count or list them")
        values = [int(x) for x in values]
    return (low, *values, high)


def _rounded(x: float) -> float:
    return float(f"{x:.{DIGITS}g}") + 0.0


def plan(
    kind: type[StudyParameters] | Cases,
    given: Mapping[str, object],
    varied: Sequence[Grid | Range],
    sampling: Sampling | None = None,
    repeats: int = 1,
) -> Plan:
    """Make every case.

    Parameters
    ----------
    kind : the study's `Parameters`, or what makes cases in its place
    given : parameters that all cases share
    varied : sequence of Grid or Range
    sampling : needed if there is a Range, and only then
    repeats : how often each case is run, with the seeds `seed`, `seed` + 1, ...

    Raises
    ------
    ValueError
        In one line, before anything runs.
    """
    names = [axis.name for axis in varied]
    _check(kind, names, given, repeats)
    grids = [axis for axis in varied if isinstance(axis, Grid)]
    ranges = [axis for axis in varied if isinstance(axis, Range)]
    samples = _samples(ranges, sampling)
    total = math.prod(len(grid.values) for grid in grids) * len(samples) * repeats
    if total > MOST:
        raise ValueError(f"{total} cases; allowed: up to {MOST}")
    first = kind(**given).seed if repeats > 1 else 0  # type: ignore[attr-defined]  # _check has seen to it
    cases = []
    for values in product(*(grid.values for grid in grids)):
        for sample in samples:
            for i in range(repeats):
                case = dict(zip([grid.name for grid in grids], values, strict=True)) | sample
                seed = {"seed": first + i} if repeats > 1 else {}
                cases.append(_case(kind, given, {**{name: case[name] for name in names}, **seed}))
    return Plan(cases, tuple(names), frozenset(r.name for r in ranges), frozenset(a.name for a in varied if a.log), repeats)


def _check(kind: type[StudyParameters] | Cases, names: Sequence[str], given: Mapping[str, Any], repeats: int) -> None:
    for i, name in enumerate(names):
        if name in names[:i]:
            raise ValueError(f"--vary {name}: given twice")
        if name in given:
            raise ValueError(f"--vary {name}: also given as --{name.replace('_', '-')}")
    if repeats < 1:
        raise ValueError(f"--repeat {repeats}: out of range; allowed: 1 or more")
    if repeats > 1 and "seed" not in specs(kind):
        raise ValueError(f"--repeat {repeats}: this study has no parameter seed, so that all repeats would be the same")
    if repeats > 1 and "seed" in names:
        raise ValueError(f"--repeat {repeats}: the seed is also varied")


def _case(kind: type[StudyParameters] | Cases, given: Mapping[str, object], varied: Mapping[str, object]) -> StudyParameters:
    try:
        return kind(**{**given, **varied})
    except ValueError as error:
        known = specs(kind)
        shown = ", ".join(f"{name} = {known[name].show(value)}" for name, value in varied.items())
        raise ValueError(f"{shown}: {error}" if shown else str(error)) from None


def _samples(ranges: Sequence[Range], sampling: Sampling | None) -> list[dict[str, Any]]:
    """Values of every range, jointly; one empty sample if there is no range."""
    if not ranges:
        if sampling:
            raise ValueError(f"--samples {sampling.count}: nothing to sample; write --vary NAME=START:STOP, without a count")
        return [{}]
    if sampling is None:
        raise ValueError(f"--vary {ranges[0].name}: no count; write START:STOP:COUNT, or give --samples")
    if not 1 <= sampling.count <= MOST:
        raise ValueError(f"--samples {sampling.count}: out of range; allowed: 1 to {MOST}")
    from scipy.stats import qmc  # slow to load, and most sweeps sample nothing

    kinds: dict[str, Any] = {"sobol": qmc.Sobol, "halton": qmc.Halton, "lhs": qmc.LatinHypercube}
    if sampling.method not in kinds:
        raise ValueError(f"--method {sampling.method}: unknown; allowed: {', '.join(METHODS)}")
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "The balance properties of Sobol")  # any count is allowed; the how-to tells
        points = kinds[sampling.method](len(ranges), seed=np.random.default_rng(sampling.draw)).random(sampling.count)
    return [{r.name: _place(r, u) for r, u in zip(ranges, point, strict=True)} for point in points]


def _place(r: Range, u: float) -> Any:
    """The value at the share u, 0 to 1, of a range."""
    low, high = sorted((r.low, r.high))
    whole = isinstance(low, int)
    top = high + whole  # every whole number has an equal share
    x = low * (top / low) ** u if r.log else low + u * (top - low)
    return min(math.floor(x), high) if whole else min(max(_rounded(x), low), high)
