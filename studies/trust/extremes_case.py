"""One case of the study `extremes`: a run, what it is held against, and the verdict."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from time import perf_counter
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from buckler.mbs import Status
from buckler.mbs.geometry import Array

Measures = Mapping[str, Any]
OF_THE_MODEL = frozenset(("PENETRATION", "LINEAR"))
"""Checks that say that a law or a linear link is beyond its range. A reference of the same model cannot gainsay them."""


class Verdict(StrEnum):
    """What becomes of a case. UNFINISHED ran out of time; OPEN was reported fine, and its reference itself failed."""

    WITHIN = "within tolerance"
    REFUSED = "refused before the run"
    FAILED = "failed by name"
    SUSPECT = "suspect by name"
    FALSE_ALARM = "suspect, yet within tolerance"
    WRONG = "silently wrong"
    UNFINISHED = "unfinished"
    OPEN = "no reference"


VERDICTS = tuple(Verdict)


def largest(values: Array) -> float:
    """Largest magnitude."""
    return float(np.abs(values).max())


def mean_square(values: Array) -> float:
    """Root of the mean square over the samples, of the row where it is largest."""
    return float(np.sqrt((values**2).mean(axis=-1)).max())


class Kind(NamedTuple):
    """How far a measure may be off, of its scale; why that is fair; the norm of the error."""

    allowed: float
    why: str
    norm: Callable[[Array], float] = largest


KINDS: dict[str, Kind] = {
    "force": Kind(0.05, "largest of a contact or of a drive; contact laws are known no better"),
    "impulse": Kind(0.05, "it changes speeds, as a restitution 5 % wrong would"),
    "load": Kind(0.01, "static: no steps, the mesh alone decides"),
    "place": Kind(1e-3, "of the longest link: what a drawing of the mechanism can show"),
    "path": Kind(5e-3, "of the longest link, where something strikes: a rebound at 5 % wrong speed errs by so much"),
    "journal": Kind(0.1, "place of a link, of the clearance: the pin is on the right side of its bush", mean_square),
}
"""Kinds of measures; a measure is called `kind` or `kind of what`."""


@dataclass(frozen=True)
class CaseOutcome:
    """How a run ended, what was read off it, and how long it took, s, where that is known without what came before it.

    `told` are errors of measures that the run itself tells to be larger than what is allowed: that is not silent.
    """

    status: str
    message: str
    measures: Measures = field(default_factory=dict)
    wall_s: float = float("nan")
    told: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Case:
    """A case: what is run within a time, s, which raises ValueError if it is refused, and what is held to be right.

    The reference gives the measures that are right, by another method, or None if that failed; there is none where a run cannot
    be right. Measures without a scale are compared with the reference's largest value. `plain` runs the same once, with nothing
    checked or refined: what the price is held against.
    """

    family: str
    name: str
    run: Callable[[float], CaseOutcome]
    reference: Callable[[], Measures | None] | None = None
    scales: Mapping[str, float] = field(default_factory=dict)
    plain: Callable[[], None] | None = None


class Finding(NamedTuple):
    """What became of a case.

    `off` is the largest error over what is allowed, nan where nothing was compared; `price` is the run's time over a plain
    one's, nan where none was run.
    """

    family: str
    name: str
    verdict: Verdict
    off: float
    worst: str
    message: str
    wall_s: float
    price: float = float("nan")


def judge(case: Case, timeout: float) -> Finding:
    """Run a case and its reference, and say what became of it."""
    start = perf_counter()

    def found(verdict: Verdict, off: float = np.nan, worst: str = "", said: str = "", price: float = np.nan) -> Finding:
        return Finding(case.family, case.name, verdict, float(off), worst, said, perf_counter() - start, price)

    try:
        outcome = case.run(timeout)
    except ValueError as error:  # KinematicsError among them
        return found(Verdict.REFUSED, said=" ".join(str(error).split()))
    fine, suspect = outcome.status == Status.OK, outcome.status == Status.SUSPECT
    said = "" if fine else f"{outcome.status}: {outcome.message}"
    if outcome.status == Status.TIMED_OUT:
        return found(Verdict.UNFINISHED, said=said)
    if not fine and not suspect:
        return found(Verdict.FAILED, said=said)
    price = np.nan
    if case.plain is not None:
        begin = perf_counter()
        case.plain()
        price = outcome.wall_s / (perf_counter() - begin)
    right = case.reference() if case.reference else None
    if right is None and case.reference:
        return found(Verdict.OPEN if fine else Verdict.SUSPECT, said=said, price=price)
    off, worst = np.inf, "no run of it can be right"
    if right is not None:
        off, worst = compare(outcome.measures, right, case.scales, outcome.told)
    named = set(re.findall(r"(?:^|; )([A-Z]+): ", outcome.message))
    good = Verdict.WITHIN if fine else Verdict.SUSPECT if named and named <= OF_THE_MODEL else Verdict.FALSE_ALARM
    return found(good if off <= 1 else Verdict.WRONG if fine else Verdict.SUSPECT, off, worst, said, price)


def compare(
    found: Measures, right: Measures, scales: Mapping[str, float], told: Mapping[str, float] = MappingProxyType({})
) -> tuple[float, str]:
    """Largest error of all measures over what is allowed, or what the run tells of it, and the measure's name.

    What a run tells is relative to its own values, which may be far larger than the right ones.
    """
    errors = {}
    for name, value in right.items():
        scale, kind = scales.get(name) or largest(value), KINDS[name.partition(" ")[0].rstrip(",")]
        own = np.asarray(found[name])
        compared = own[..., : np.shape(value)[-1]]  # a reference may end where motion is one trajectory no longer
        allowed = max(kind.allowed * scale, told.get(name, 0.0) * largest(own), 1e-12 * kind.allowed)
        errors[name] = kind.norm(compared - value) / allowed
    worst = max(errors, key=lambda name: np.nan_to_num(errors[name], nan=np.inf))
    return float(np.nan_to_num(errors[worst], nan=np.inf)), worst
