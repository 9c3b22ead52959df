"""Numbers of a mechanism fitted to data by least squares, with their intervals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import f as fisher
from scipy.stats import qmc
from scipy.stats import t as student

from ..geometry import Array
from ..offers import find_offer
from ..progress import STOPS, watch, watching
from ..record.errors import LEVEL
from ..solvers import Spectral
from ..units import unit_suffix
from ..validate import one_of, whole
from .data import Experiment
from .numbers import Source
from .reading import RunFailedError
from .residuals import CLOSE, FAR, TIME_ZERO, Bounds, FitProblem, gather, signals_of
from .runs import needs_compiler

POLISHED = 2
"""Number of the best starts from which least squares are sought."""
ROUNDS = 60
"""Most evaluations of least squares from a start."""
VAGUE = 0.5
"""Width of the 95 % interval of a number, over its range, above which the data do not identify it."""
TOGETHER = 0.95
"""Correlation of two numbers above which the data identify only a combination of them."""


FROM_AXIS = 0.1
"""First measured angle over the range of all, beyond noise, above which they are taken for angles from the x axis."""


class Interval(NamedTuple):
    """Confidence interval of 95 % of a number."""

    low: float
    high: float


class ProfileLikelihood(NamedTuple):
    """Profile likelihood of a number: least `cost` with the number held `at` values, and cost at the ends of the interval."""

    at: Array
    cost: Array
    level: float

    def interval(self) -> Interval:
        """Find where the cost passes the level; infinite where it does not."""
        best, ends = int(np.argmin(self.cost)), []
        for at, cost, far in (
            (self.at[best::-1], self.cost[best::-1], -np.inf), (self.at[best:], self.cost[best:], np.inf)
        ):  # fmt: skip
            root = np.sqrt(np.maximum.accumulate(cost) - cost[0])  # straight where the cost is a parabola
            level = np.sqrt(self.level - cost[0])
            ends.append(float(np.interp(level, root, at)) if root[-1] >= level else far)
        return Interval(*ends)


@dataclass(frozen=True)
class Fit:
    """Numbers that fit data best, SI, with 95 % `intervals` by linearisation there, or by the profile where one was requested.

    `unidentified` are sentences on numbers that the data do not identify, and on signals that the mechanism does not explain. The
    `correlation` is (numbers, numbers). `rms` are root mean squares of the residuals of each signal, in its unit, over all
    experiments. `predicted` are signals at the times of the data, and readings, of each experiment. `cost` is half the sum of
    squared residuals, in standard deviations; `free` are the ranges of the numbers.
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
    profiles: dict[str, ProfileLikelihood] = field(default_factory=dict)

    def __str__(self) -> str:
        """Return the numbers with their intervals, and notes on identification."""
        width = max(map(len, self.values))
        lines = [f"{name:{width}}  {value:.6g}{unit_suffix(self.units, name)}  (95 %: {self.intervals[name].low:.6g} to "
                 f"{self.intervals[name].high:.6g})" for name, value in self.values.items()]  # fmt: skip
        left = [f"rms of what is left of {name}: {value:.4g}{unit_suffix(self.units, name)}" for name, value in self.rms.items()]
        return "\n".join([*lines, *left, *self.unidentified])

    def plot(self) -> Any:
        """Draw data and fit, residuals and profiles; return the matplotlib figure."""
        return find_offer("plot_fit")(self)


@watch("runs")
def fit(
    mechanism: Source,
    data: Experiment | Sequence[Experiment],
    *,
    free: Mapping[str, Bounds],
    solver: Spectral | None = None,
    starts: int = 8,
    profiles: Sequence[str] = (),
    timeout: float | None = None,
    progress: bool | None = None,
) -> Fit:
    """Fit numbers of a mechanism to experiments.

    Parameters
    ----------
    mechanism : Mechanism, mapping or callable
        Or the content of its file; or a function that makes one of the numbers in `free` and the experiments' settings.
    data : Experiment or sequence of Experiment
        As `read_csv` reads them from a text file.
    free : dict of str to (low, high)
        Numbers by their paths with their ranges, SI. `time_zero` is the time of the data at which the run begins.
    solver : Spectral, optional
        By default with a tolerance of 1e-8.
    starts : int
        Number of starts: the middle of the ranges, and points of a Halton sequence; least squares begin at the best of them.
    profiles : sequence of str
        Numbers whose interval is to come from the profile likelihood: with each at nine values, the others are fitted again.
    timeout, progress
        Limit of time [s], after which the best so far is the answer; how long it takes is shown, by default in terminals.

    Raises
    ------
    ValueError
        On wrong input, before anything runs.
    RunFailedError
        If no start leads to a run that ends.

    References
    ----------
    D. M. Bates, D. G. Watts, Nonlinear regression analysis and its applications, Wiley 1988, doi 10.1002/9780470316757.
    A. Raue et al., Structural and practical identifiability analysis of partially observed dynamical models by exploiting the
    profile likelihood, Bioinformatics 25 (2009) 1923, doi 10.1093/bioinformatics/btp358.
    """
    needs_compiler()
    whole("starts", starts, 1, 10**9)
    experiments = [data] if isinstance(data, Experiment) else list(data)
    for k, each in enumerate(experiments):
        one_of(f"data[{k}]", each, (Experiment,))
    problem = FitProblem.of(mechanism, experiments, free, solver)
    if unknown := [name for name in profiles if name not in problem.names]:
        raise ValueError(f"profiles: '{unknown[0]}' is not among {', '.join(problem.names)}")
    watching.get().most = len(problem.experiments) * (starts + (POLISHED + 1) * ROUNDS * (1 + 2 * len(problem.names)))
    best, known = _find_best(problem, starts), dict[str, ProfileLikelihood]()
    try:
        if not problem.has_errors and not problem.stopped:
            problem.weigh(best)
            best = _solve(problem, best)
        for name in profiles if not problem.stopped else ():
            known[name] = _profile(problem, best, name)
    except STOPS as stop:
        problem.stopped = str(stop)
    return _answer(problem, best, known)


def _find_best(problem: FitProblem, starts: int) -> Array:
    """Find the best point from the middle and from points of a Halton sequence."""
    d, alive, ends = len(problem.names), list[tuple[float, Array]](), list[Array]()
    try:
        for x in np.vstack([np.full(d, 0.5), qmc.Halton(d, rng=np.random.default_rng(0)).random(starts - 1)]):
            if not np.all((r := problem.residuals(x)) == FAR):
                alive.append((float(r @ r), x))
        alive.sort(key=lambda pair: pair[0])
        for _, x in alive[:POLISHED]:
            ends.append(_solve(problem, x))
    except STOPS as stop:
        problem.stopped = str(stop)
        if not alive:
            raise RunFailedError(f"{stop}, before any run ended") from None
        return ends[0] if ends else min(alive, key=lambda pair: pair[0])[1]
    if not alive:
        raise RunFailedError(f"no start leads to a run that ends; narrow the ranges. The first: {problem.failed}")
    return min(ends, key=lambda x: float(np.sum(problem.residuals(x) ** 2)))


def _solve(problem: FitProblem, x: Array, kept: int | None = None) -> Array:
    """Find least squares from a point; all numbers are free but one that is kept."""
    is_free = np.arange(len(x)) != kept
    if not is_free.any():
        return x

    def point(part: Array) -> Array:
        """Return the whole point of a part of its coordinates."""
        return np.insert(part, kept, x[kept]) if kept is not None else part

    # with an extra residual, the constant 1, `ftol` ends the search even for data without noise
    found = least_squares(
        lambda part: np.append(problem.residuals(point(part)), 1.0), np.clip(x[is_free], 1e-9, 1 - 1e-9),
        jac=lambda part: np.vstack([problem.jacobian(point(part))[:, is_free], np.zeros(len(part))]), bounds=(0.0, 1.0),
        x_scale="jac", xtol=1e-10, ftol=CLOSE, gtol=1e-12, max_nfev=ROUNDS,
    )  # fmt: skip
    return point(found.x)


def _profile(problem: FitProblem, best: Array, name: str) -> ProfileLikelihood:
    """Find the least cost for values of a number, from its best value to both sides."""
    i = problem.names.index(name)
    wide = min(0.5, 3.0 * float(np.sqrt(problem.covariance(best)[i, i])))
    found = {float(best[i]): float(np.sum(problem.residuals(best) ** 2))}
    for side in (-1, 1):
        x = best.copy()
        for part in (0.25, 0.5, 0.75, 1.0):
            x[i] = np.clip(best[i] + side * part * wide, 0.0, 1.0)
            x = _solve(problem, x, kept=i)
            found[float(x[i])] = float(np.sum(problem.residuals(x) ** 2))
    at, (low, high) = np.array(sorted(found)), (problem.low[i], problem.high[i])
    cost = 0.5 * np.array([found[each] for each in at])
    return ProfileLikelihood(low + at * (high - low), cost, float(cost.min()) * _growth(problem))


def _growth(problem: FitProblem) -> float:
    """Return the sum of squares at the ends of the 95 % interval of one number over the least one."""
    freedom = max(1, problem.count - len(problem.names))
    return 1.0 + float(fisher.ppf(LEVEL, 1, freedom)) / freedom


def _answer(problem: FitProblem, best: Array, profiles: dict[str, ProfileLikelihood]) -> Fit:
    names, covariance = problem.names, problem.covariance(best)
    deviation = np.sqrt(np.diag(covariance))
    quantile = float(student.ppf(0.5 + LEVEL / 2, np.inf if problem.has_errors else max(1, problem.count - len(best))))
    reach, values = quantile * deviation * (problem.high - problem.low), problem.values(best)
    intervals = {name: Interval(float(v - d), float(v + d)) for name, v, d in zip(names, values, reach, strict=True)}
    correlation = covariance / np.outer(deviation, deviation)
    notes = [*_list_unidentified(problem, best, deviation, correlation), *_list_unexplained(problem, best)]
    notes = [f"{problem.stopped}: these numbers are the best so far", *notes] if problem.stopped else notes
    return Fit(
        dict(zip(names, map(float, values), strict=True)),
        intervals | {name: profile.interval() for name, profile in profiles.items()},
        notes, correlation, problem.residual_sizes(best),
        problem.predict(best), problem.experiments, 0.5 * float(np.sum(problem.residuals(best) ** 2)),
        {name: (float(a), float(b)) for name, a, b in zip(names, problem.low, problem.high, strict=True)},
        problem.units, profiles,
    )  # fmt: skip


def _list_unidentified(problem: FitProblem, best: Array, deviation: Array, correlation: Array) -> list[str]:
    """List numbers that the data do not identify, in sentences."""
    found, names = [], problem.names
    for i, name in enumerate(names):
        twins = [other for k, other in enumerate(names) if k != i and abs(correlation[i, k]) > TOGETHER]
        if name in problem.blocked:
            found.append(f"{name} is not identified: runs beside it fail ({problem.blocked[name]}).")
        elif 2 * 1.96 * deviation[i] > VAGUE:
            why = f"only together with {', '.join(twins)}" if twins else "the data hardly depend on it"
            found.append(f"{name} is not identified: {why}.")
        elif min(best[i], 1 - best[i]) < 1e-6:
            found.append(f"{name} lies at the {'low' if best[i] < 0.5 else 'high'} end of its range.")
    return found


def _list_unexplained(problem: FitProblem, best: Array) -> list[str]:
    """List, in sentences, signals that the fit predicts worse than their mean does, and angles from a wrong origin."""
    left, found = problem.residual_sizes(best), []
    for name in signals_of(problem.experiments):
        x = gather(problem.experiments, name)
        if left[name] ** 2 > _growth(problem) * np.var(x) + CLOSE * np.mean(x**2):
            found.append(f"{name} is explained worse than by its mean; are its times and units those of the mechanism?")
    for each in problem.experiments if TIME_ZERO not in problem.names else ():
        for name, x in each.signals.items():
            if name.endswith(".angle") and each.time[0] == 0.0 and abs(x[0]) > FROM_AXIS * np.ptp(x[np.isfinite(x)]):
                from_axis = name.removesuffix("angle") + "direction"
                found.append(f"{name} begins at {x[0]:.3g} rad, but is the turn since then; {from_axis} counts from the x axis.")
    return found
