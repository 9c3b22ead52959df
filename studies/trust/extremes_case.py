"""One case of the study `extremes`: a run, what it is held against, and the verdict."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np

from buckler.mbs import Controlled, Exudyn, Mechanism, Result, Status, simulate

Array = np.ndarray[Any, Any]
Measures = Mapping[str, Any]
DEFAULT = Exudyn()
WITHIN, REFUSED, FAILED, SUSPECT, FALSE_ALARM, WRONG, OPEN = (
    "within tolerance", "refused before the run", "failed by name", "suspect by name", "suspect, yet within tolerance",
    "silently wrong", "no reference",
)  # fmt: skip
"""Verdicts. OPEN is a case reported fine whose reference itself failed."""


def largest(values: Array) -> float:
    """Largest magnitude."""
    return float(np.abs(values).max())


def mean_square(values: Array) -> float:
    """Root of the mean square over the samples, of the row where it is largest."""
    return float(np.sqrt((values**2).mean(axis=-1)).max())


class Kind(NamedTuple):
    """How far a measure may be off.

    Attributes
    ----------
    allowed : float
        Of the scale.
    why : str
        Why that is fair.
    norm : callable
        Of the error.
    """

    allowed: float
    why: str
    norm: Callable[[Array], float] = largest


KINDS: dict[str, Kind] = {
    "force": Kind(0.05, "largest of a contact or of a drive; contact laws are known no better"),
    "impulse": Kind(0.05, "it changes speeds, as a restitution 5 % wrong would"),
    "load": Kind(0.01, "static: no steps, the mesh alone decides"),
    "place": Kind(1e-3, "of the longest link: what a drawing of the mechanism can show"),
    "path": Kind(5e-3, "of the longest link, where something strikes: a rebound at 5 % wrong speed errs by so much"),
    "acceleration": Kind(0.05, "of the largest: forces are as good as accelerations"),
    "journal": Kind(0.1, "place of a link, of the clearance: the pin is on the right side of its bush", mean_square),
    "speed": Kind(0.05, "of a link, of the largest: it jumps at impacts, and they shift a little", mean_square),
}
"""Kinds of measures; a measure is called `kind` or `kind of what`."""


PATIENCE = 120.0
"""Longest time, s, a reference may take."""


@dataclass(frozen=True)
class CaseOutcome:
    """How a run ended, and what was read off it; a scale where the reference's largest value is none."""

    status: str
    message: str
    measures: Measures = field(default_factory=dict)


@dataclass(frozen=True)
class Case:
    """A case: what is run, and what is held to be right.

    Attributes
    ----------
    family, name : str
    run : callable
        Gives an CaseOutcome, or raises ValueError.
    reference : callable, optional
        Gives the measures that are right, from another method, or None if that failed; None where a run cannot be right.
    scales : dict of str to float
        By measure; the largest value of the reference where there is none.
    """

    family: str
    name: str
    run: Callable[[float], CaseOutcome]
    reference: Callable[[], Measures | None] | None = None
    scales: Mapping[str, float] = field(default_factory=dict)


class Finding(NamedTuple):
    """What became of a case; `off` is the largest error over what is allowed, nan where nothing was compared."""

    family: str
    name: str
    verdict: str
    off: float
    worst: str
    message: str
    wall_s: float


def judge(case: Case, timeout: float) -> Finding:
    """Run a case and its reference, and say what became of it."""
    start = perf_counter()
    try:
        outcome = case.run(timeout)
    except ValueError as error:  # KinematicsError among them
        return Finding(case.family, case.name, REFUSED, np.nan, "", " ".join(str(error).split()), perf_counter() - start)
    fine, suspect = outcome.status == Status.OK, outcome.status == Status.SUSPECT
    if not fine and not suspect:
        return Finding(case.family, case.name, FAILED, np.nan, "", _text(outcome), perf_counter() - start)
    right = case.reference() if case.reference else None
    off, worst = compare(outcome.measures, right, case.scales) if right is not None else (np.inf, "no run of it can be right")
    if right is None and case.reference:
        verdict, off = (OPEN if fine else SUSPECT), np.nan
    elif fine:
        verdict = WITHIN if off <= 1 else WRONG
    else:
        verdict = FALSE_ALARM if off <= 1 else SUSPECT
    return Finding(case.family, case.name, verdict, float(off), worst, _text(outcome), perf_counter() - start)


def _text(outcome: CaseOutcome) -> str:
    return "" if outcome.status == Status.OK else f"{outcome.status}: {outcome.message}"


def compare(found: Measures, right: Measures, scales: Mapping[str, float]) -> tuple[float, str]:
    """Largest error of all measures over what is allowed, and the measure's name."""
    errors = {}
    for name, value in right.items():
        scale, kind = scales.get(name) or largest(value), KINDS[name.partition(" ")[0]]
        compared = np.asarray(found[name])[
            ..., : np.shape(value)[-1]
        ]  # a reference may end where motion is one trajectory no longer
        errors[name] = kind.norm(compared - value) / max(scale, 1e-12) / kind.allowed
    worst = max(errors, key=lambda name: np.nan_to_num(errors[name], nan=np.inf))
    return float(np.nan_to_num(errors[worst], nan=np.inf)), worst


def simulated(
    mechanism: Callable[[], Mechanism], duration: float, solver: Exudyn, read: Callable[[Result], Measures]
) -> Callable[[float], CaseOutcome]:
    """Make the run of a case: build the mechanism, simulate it, read its measures."""

    def run(timeout: float) -> CaseOutcome:
        result = simulate(mechanism(), duration, solver=solver, timeout=timeout)
        ended = result.status in (Status.OK, Status.SUSPECT)
        return CaseOutcome(str(result.status), result.message, read(result) if ended else {})

    return run


def finer(
    mechanism: Callable[[], Mechanism], duration: float, tolerance: float, read: Callable[[Result], Measures]
) -> Callable[[], Measures | None]:
    """Make a reference from the engine: steps a hundred times more exact, another damping of the integrator."""

    def reference() -> Measures | None:
        solver = Exudyn(Controlled(tolerance=tolerance, contact_resolution=100), spectral_radius=0.9)
        result = simulate(mechanism(), duration, solver=solver, timeout=PATIENCE)
        return read(result) if result.status in (Status.OK, Status.SUSPECT) else None

    return reference
