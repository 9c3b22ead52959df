"""Numbers of a mechanism fitted to data: least squares."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import t as student

from ..geometry import Array
from ..offers import offered
from ..solvers import Spectral
from ..units import behind
from ..validate import whole
from .data import Experiment, read_csv
from .numbers import Source
from .residuals import LEVEL, Bounds, Problem, Profile, rms, unexplained
from .runs import needs_compiler

VAGUE = 0.5
"""A number whose interval is wider than this share of its range is told as not identified."""


class Interval(NamedTuple):
    """Where a number lies with a probability of 95 %."""

    low: float
    high: float


@dataclass(frozen=True)
class Fit:
    """Numbers that suit data best.

    Attributes
    ----------
    values : dict of str to float
        SI; those that each experiment has of its own as `name [k]`.
    intervals : dict of str to Interval
        95 %, from the tangent at the best point; infinite where the data say nothing.
    unidentified : list of str
        Sentences: what the data cannot tell, and which signals no numbers explain.
    correlation : array, shape (numbers, numbers)
    rms : dict of str to float
        What is left of each signal, in its unit, over all experiments.
    predicted : list of dict of str to array
        Signals at the times of the data, and readings, of each experiment.
    experiments : sequence of Experiment
    cost : float
        Half the sum of squares, in standard deviations.
    free : dict of str to (float, float)
    units : dict of str to str
        Of numbers and signals.
    profiles : dict of str to Profile
    """

    values: dict[str, float]
    intervals: dict[str, Interval]
    unidentified: list[str]
    correlation: Array
    rms: dict[str, float]
    predicted: list[dict[str, Any]]
    experiments: Sequence[Experiment]
    cost: float
    free: dict[str, Bounds]
    units: dict[str, str]
    profiles: dict[str, Profile] = field(default_factory=dict)

    def __str__(self) -> str:
        """Return the numbers with their intervals, and what cannot be told."""
        width = max(map(len, self.values))
        lines = [f"{name:{width}}  {value:.6g}{behind(self.units, name)}  (95 %: {self.intervals[name].low:.6g} to "
                 f"{self.intervals[name].high:.6g})" for name, value in self.values.items()]  # fmt: skip
        left = [f"rms of what is left of {name}: {value:.4g}{behind(self.units, name)}" for name, value in self.rms.items()]
        return "\n".join([*lines, *left, *self.unidentified])

    def write_html(self, path: str | Path, title: str = "Fit") -> Path:
        """Write a page: numbers, data beside the fit, what is left, profiles."""
        return offered("write_fit")(self, path, title)


def fit(
    mechanism: Source,
    data: Experiment | Sequence[Experiment] | str | Path,
    *,
    free: Mapping[str, Bounds],
    own: Mapping[str, Bounds] | None = None,
    signals: Sequence[str] = (),
    settings: Sequence[str] = (),
    solver: Spectral | None = None,
    starts: int = 8,
    robust: bool = False,
    profiles: Sequence[str] = (),
    seed: int = 0,
) -> Fit:
    """Fit numbers of a mechanism to what was measured.

    Parameters
    ----------
    mechanism : Mechanism, mapping or callable
        Or the content of its file; or a function that makes one of arguments by the names in `free`, `own` and the
        experiments' settings.
    data : Experiment, sequence of Experiment, or path of a CSV file
        Of a file, `signals` and `settings` are those of `read_csv`.
    free : dict of str to (low, high)
        Numbers by their paths, and where they lie at least and at most, SI.
    own : dict of str to (low, high), optional
        Numbers that each experiment has of its own, such as how it starts.
    solver : Spectral, optional
        What chooses the steps.
    starts : int
        Points of a Halton sequence over the ranges; least squares are sought from the best of them.
    robust : bool
        Outliers count by their size and not by its square (soft L1).
    profiles : sequence of str
        Numbers whose profile likelihood is wanted: for each of nine values the others are fitted anew.
    seed : int
        Of the starts.

    Returns
    -------
    Fit

    Raises
    ------
    ValueError
        On wrong input, before anything runs.
    RunFailedError
        If no start leads to a run that ends.

    References
    ----------
    H. G. Bock, in: Numerical treatment of inverse problems in differential and integral equations, Birkhäuser 1983, 95-121,
    doi 10.1007/978-1-4684-7324-7_7.
    D. M. Bates, D. G. Watts, Nonlinear regression analysis and its applications, Wiley 1988, doi 10.1002/9780470316757.
    A. Raue et al., Structural and practical identifiability analysis of partially observed dynamical models by exploiting the
    profile likelihood, Bioinformatics 25 (2009) 1923, doi 10.1093/bioinformatics/btp358.
    """
    needs_compiler()
    whole("starts", starts, 1, 10**9)
    if isinstance(data, str | Path):
        data = read_csv(data, signals, settings)
    experiments = [data] if isinstance(data, Experiment) else list(data)
    problem = Problem.of(mechanism, experiments, free, own or {}, solver, robust)
    if unknown := [name for name in profiles if name not in problem.names]:
        raise ValueError(f"profiles: '{unknown[0]}' is not among {', '.join(problem.names)}")
    best = problem.best(starts, seed)
    if not problem.known:
        problem = problem.weighed(best)
        best = problem.solve(best)
    return _told(problem, best, {name: problem.profile(best, name) for name in profiles})


def _told(problem: Problem, best: Array, profiles: dict[str, Profile]) -> Fit:
    """Put together what is known."""
    covariance, span = problem.covariance(best), problem.high - problem.low
    deviation = np.sqrt(np.diag(covariance))
    freedom = max(1, problem.count - len(best))
    reach = (float(student.ppf(0.5 + LEVEL / 2, freedom)) if not problem.known else 1.959964) * deviation * span
    values = problem.low + best * span
    intervals = {name: Interval(float(v - d), float(v + d)) for name, v, d in zip(problem.names, values, reach, strict=True)}
    correlation = covariance / np.outer(deviation, deviation)
    predicted = problem.run(best).predicted
    left = rms(problem.experiments, predicted)
    blind = [
        f"{name} is explained worse than by its mean; are its times and units those of the mechanism?"
        for name in unexplained(problem.experiments, left, problem.growth(best))
    ]
    return Fit(
        dict(zip(problem.names, map(float, values), strict=True)), intervals,
        [*_vague(problem, best, deviation, correlation), *blind], correlation, left, predicted, problem.experiments,
        0.5 * float(np.sum(problem.residuals(best) ** 2)),
        {name: (float(a), float(b)) for name, a, b in zip(problem.names, problem.low, problem.high, strict=True)},
        problem.units, profiles,
    )  # fmt: skip


def _vague(problem: Problem, best: Array, deviation: Array, correlation: Array) -> list[str]:
    """Sentences about numbers that the data do not tell."""
    found = []
    for i, name in enumerate(problem.names):
        if 2 * 1.96 * deviation[i] > VAGUE:
            twins = [other for k, other in enumerate(problem.names) if k != i and abs(correlation[i, k]) > 0.95]
            why = f"only together with {', '.join(twins)}" if twins else "the data hardly depend on it"
            found.append(f"{name} is not identified: {why}.")
        elif min(best[i], 1 - best[i]) < 1e-6:
            found.append(f"{name} lies at the {'low' if best[i] < 0.5 else 'high'} end of its range.")
    return found
