"""Fit of numbers of a mechanism to data by nonlinear least squares, with confidence intervals and profile likelihoods.

The free numbers are scaled to the unit cube: a point x of it has one coordinate, 0 to 1, for each number.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from operator import itemgetter
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import qmc
from scipy.stats import t as student

from ..geometry import Array
from ..imports import import_late
from ..progress import USER_STOPS, watch, watching
from ..record.errors import CONFIDENCE
from ..solvers import Spectral
from ..units import unit_suffix
from ..validate import one_of, whole
from .data import Experiment
from .numbers import Source
from .reading import RunFailedError
from .residuals import TIME_ZERO, Bounds, FitProblem, gather_signals
from .runs import require_compiler

BEST_STARTS = 2
"""Number of the best starts from which sums of squares are minimised; chosen."""
MOST_EVALUATIONS = 60
"""Largest number of evaluations of a minimisation; chosen."""


class Interval(NamedTuple):
    """Confidence interval of 95 % of a number."""

    low: float
    high: float


class ProfileLikelihood(NamedTuple):
    """Profile likelihood: least `cost` with a number fixed at each value of `at`, up to values at which runs fail.

    `level` is the cost at the ends of the interval.
    """

    at: Array
    cost: Array
    level: float

    def interval(self) -> Interval:
        """Find the values at which the cost passes the level; infinite where it does not."""
        best, ends = int(np.argmin(self.cost)), []
        for side, infinite in ((slice(best, None, -1), -np.inf), (slice(best, None), np.inf)):
            at, cost = self.at[side], self.cost[side]
            rising = np.maximum.accumulate(cost)  # as interpolation requires
            root = np.sqrt(rising - cost[0])  # linear in the number where the cost is a parabola
            root_at_end = np.sqrt(self.level - cost[0])
            ends.append(float(np.interp(root_at_end, root, at)) if root[-1] >= root_at_end else infinite)
        return Interval(*ends)


@dataclass(frozen=True)
class Fit:
    """Numbers that fit data best, SI, with 95 % `intervals` by linearisation, or by a profile likelihood if one was requested.

    `unidentified` are sentences on numbers that the data do not identify, and on signals that the fit predicts badly.
    `rms` is the root mean square of the residuals of each signal over all experiments, in its unit. `predicted` has for each
    experiment the signals at the times of the data, and the readings. `cost` is half the sum of squared residuals in standard
    deviations; `free` are the ranges of the numbers. Without `complete` a timeout or Ctrl-C ended the fit early.
    """

    values: dict[str, float]
    intervals: dict[str, Interval]
    unidentified: list[str]
    correlation: Array  # (numbers, numbers)
    rms: dict[str, float]
    predicted: list[dict[str, Any]]
    experiments: Sequence[Experiment]
    cost: float
    free: dict[str, Bounds]
    units: dict[str, str]
    profiles: dict[str, ProfileLikelihood] = field(default_factory=dict)
    complete: bool = True

    def __str__(self) -> str:
        width = max(map(len, self.values))
        lines = [f"{name:{width}}  {value:.6g}{unit_suffix(self.units, name)}  (95 %: {self.intervals[name].low:.6g} to "
                 f"{self.intervals[name].high:.6g})" for name, value in self.values.items()]  # fmt: skip
        rms = [f"rms of what is left of {name}: {value:.4g}{unit_suffix(self.units, name)}" for name, value in self.rms.items()]
        return "\n".join([*lines, *rms, *self.unidentified])

    def plot(self) -> Any:
        """Draw data and fit, residuals and profiles; return the matplotlib figure."""
        return import_late("view.plot:plot_fit")(self)


@watch("runs")
def fit(
    mechanism: Source, data: Experiment | Sequence[Experiment], *,
    free: Mapping[str, Bounds], solver: Spectral | None = None, starts: int = 8, profiles: Sequence[str] = (),
    timeout: float | None = None, progress: bool | None = None,
) -> Fit:  # fmt: skip
    """Fit numbers of a mechanism to experiments.

    Intervals: D. M. Bates, D. G. Watts, Nonlinear regression analysis, Wiley 1988, doi 10.1002/9780470316757. Profiles:
    A. Raue et al., Bioinformatics 25 (2009) 1923, doi 10.1093/bioinformatics/btp358. Raise a ValueError on wrong input, before
    anything runs, and a RunFailedError if no start leads to a run that ends.

    Parameters
    ----------
    mechanism : Mechanism, mapping or callable
        A mechanism, the content of its file, or a function that makes a mechanism from the numbers in `free` and in settings.
    data : Experiment or sequence of Experiment
        Measurements; `read_csv` reads them from a text file.
    free : dict of str to (low, high)
        Numbers by their paths with their ranges, SI. `time_zero` is the time of the data at which the run begins.
    solver : Spectral, optional
        Solver of the runs, by default with a tolerance of 1e-8.
    starts : int
        Number of starts: the middle of the ranges, and points of a Halton sequence. The two with the least cost are used.
    profiles : sequence of str
        Numbers whose interval is found by the profile likelihood: at nine values of each, all other numbers are fitted again.
    timeout, progress
        Limit of time [s], after which the best fit so far is returned; `progress` shows the state, by default in terminals.
    """
    require_compiler()
    whole("starts", starts, 1, 10**9)
    experiments = [data] if isinstance(data, Experiment) else list(data)
    for k, experiment in enumerate(experiments):
        one_of(f"data[{k}]", experiment, (Experiment,))
    problem = FitProblem.of(mechanism, experiments, free, solver)
    if unknown := [name for name in profiles if name not in problem.names]:
        raise ValueError(f"profiles: '{unknown[0]}' is not among {', '.join(problem.names)}")
    minimisations = BEST_STARTS + 1  # the last with estimated errors
    evaluations = starts + minimisations * MOST_EVALUATIONS * (1 + 2 * len(problem.names))  # at most 2 runs for a derivative
    watching.get().most = len(problem.experiments) * evaluations  # shown with the progress
    best, likelihoods = _find_best(problem, starts), dict[str, ProfileLikelihood]()
    try:
        if problem.estimated and not problem.stopped:  # signals of unknown error: estimate it, then fit again
            problem.estimate_errors(best)
            best = _solve(problem, best)
        for name in profiles if not problem.stopped else ():
            likelihoods[name] = _profile(problem, best, name)
    except USER_STOPS as stop:
        problem.stopped = str(stop)
    return _answer(problem, best, likelihoods)


def _find_best(problem: FitProblem, starts: int) -> Array:
    """Minimise the sum of squares from the best of the starts: the middle and points of a Halton sequence."""
    d, found = len(problem.names), list[tuple[float, Array]]()  # sums of squares and points: of starts that run, then of minima
    try:
        for x in np.vstack([np.full(d, 0.5), qmc.Halton(d, rng=np.random.default_rng(0)).random(starts - 1)]):
            if np.isfinite(squares := problem.sum_of_squares(x)):
                found.append((squares, x))
        for _, start in sorted(found, key=itemgetter(0))[:BEST_STARTS]:
            x = _solve(problem, start)
            found.append((problem.sum_of_squares(x), x))
    except USER_STOPS as stop:
        problem.stopped = str(stop)
    if not found:
        no_run = f"no start leads to a run that ends; narrow the ranges. The first: {problem.failed}"
        raise RunFailedError(f"{problem.stopped}, before any run ended" if problem.stopped else no_run)
    return min(found, key=itemgetter(0))[1]


def _solve(problem: FitProblem, x: Array, fixed: int | None = None) -> Array:
    """Minimise the sum of squares from a point by a trust-region method; the coordinate of index `fixed`, if any, is kept."""
    is_free = np.arange(len(x)) != fixed
    if not is_free.any():
        return x

    def point(part: Array) -> Array:
        """Add the fixed coordinate to the free ones."""
        return np.insert(part, fixed, x[fixed]) if fixed is not None else part

    # The last step lowers the cost, about N/2 for N data, by less than 1e-7 of it (`ftol`), so by 5e-8 N. It changes numbers by
    # less than sqrt(1e-7 N) of their standard deviation. An extra residual of 1 keeps the cost above 0 for data without noise.
    # The start is 1e-9 inside the bounds: on a bound the method's scaling (Coleman and Li) is 0.
    solution = least_squares(
        lambda part: np.append(problem.residuals(point(part)), 1.0), np.clip(x[is_free], 1e-9, 1 - 1e-9),
        jac=lambda part: np.vstack([problem.jacobian(point(part))[:, is_free], np.zeros(len(part))]), bounds=(0.0, 1.0),
        x_scale="jac", xtol=1e-10, ftol=1e-7, gtol=1e-12, max_nfev=MOST_EVALUATIONS,
    )  # fmt: skip
    return point(solution.x)


def _profile(problem: FitProblem, best: Array, name: str) -> ProfileLikelihood:
    """Compute the profile likelihood of a number at its best value and at four values on each side."""
    i = problem.names.index(name)
    width = min(0.5, 3.0 * float(np.sqrt(problem.covariance(best)[i, i])))  # 3 standard deviations, or half the range
    sums = {float(best[i]): problem.sum_of_squares(best)}  # by the coordinate of the number
    for side in (-1, 1):
        x = best.copy()
        for fraction in (0.25, 0.5, 0.75, 1.0):
            x[i] = np.clip(best[i] + side * fraction * width, 0.0, 1.0)
            if np.isinf(problem.sum_of_squares(x)):  # a run fails: the profile ends before this value
                break
            x = _solve(problem, x, fixed=i)
            sums[float(x[i])] = problem.sum_of_squares(x)
    at = np.array(sorted(sums))
    squares = np.array([sums[coordinate] for coordinate in at])
    values = problem.low[i] + at * (problem.high[i] - problem.low[i])
    least = float(squares.min())
    variance = least / problem.freedom if problem.estimated else 1.0
    return ProfileLikelihood(values, 0.5 * squares, 0.5 * (least + variance * _quantile(problem) ** 2))


def _quantile(problem: FitProblem) -> float:
    """Return the half width of a 95 % interval in standard deviations: by Student's t if these were estimated, else normal."""
    return float(student.ppf(0.5 + CONFIDENCE / 2, problem.freedom if problem.estimated else np.inf))


def _answer(problem: FitProblem, best: Array, profiles: dict[str, ProfileLikelihood]) -> Fit:
    """Make the result at the best point, with intervals by linearisation and Student's t distribution."""
    names, covariance = problem.names, problem.covariance(best)
    deviation = np.sqrt(np.diag(covariance))
    half_widths, values = _quantile(problem) * deviation * (problem.high - problem.low), problem.values(best)
    intervals = {name: Interval(float(v - d), float(v + d)) for name, v, d in zip(names, values, half_widths, strict=True)}
    correlation = covariance / np.outer(deviation, deviation)
    notes = [*_list_unidentified(problem, best, deviation, correlation), *_list_unexplained(problem, best)]
    notes = [f"{problem.stopped}: these numbers are the best so far", *notes] if problem.stopped else notes
    return Fit(
        values=dict(zip(names, map(float, values), strict=True)),
        intervals=intervals | {name: profile.interval() for name, profile in profiles.items()},
        unidentified=notes, correlation=correlation, rms=problem.residual_sizes(best),
        predicted=problem.predict(best), experiments=problem.experiments, cost=0.5 * problem.sum_of_squares(best),
        free={name: (float(a), float(b)) for name, a, b in zip(names, problem.low, problem.high, strict=True)},
        units=problem.units, profiles=profiles, complete=not problem.stopped,
    )  # fmt: skip


def _list_unidentified(problem: FitProblem, best: Array, deviation: Array, correlation: Array) -> list[str]:
    """List, in sentences, numbers that the data do not identify. The limits 0.95 and 0.5 are conventions."""
    notes, names = [], problem.names
    for i, name in enumerate(names):
        correlated = [other for k, other in enumerate(names) if k != i and abs(correlation[i, k]) > 0.95]
        if name in problem.blocked:
            notes.append(f"{name} is not identified: runs beside it fail ({problem.blocked[name]}).")
        elif 2 * 1.96 * deviation[i] > 0.5:  # of the range: 1.96 deviations on each side are 95 % of a normal distribution
            reason = f"only together with {', '.join(correlated)}" if correlated else "the data hardly depend on it"
            notes.append(f"{name} is not identified: {reason}.")
        elif min(best[i], 1 - best[i]) < 1e-6:  # of the range; the search ends near a bound, not on it
            notes.append(f"{name} lies at the {'low' if best[i] < 0.5 else 'high'} end of its range.")
    return notes


def _list_unexplained(problem: FitProblem, best: Array) -> list[str]:
    """List, in sentences, signals that the fit predicts worse than their mean does, and angles from a wrong origin."""
    rms, notes = problem.residual_sizes(best), []
    for name, x in gather_signals(problem.experiments).items():
        # ratio of the sum of squares at an end of a 95 % interval to the least one: a fit may be so much worse by chance
        by_chance = 1 + _quantile(problem) ** 2 / problem.freedom
        if rms[name] ** 2 > by_chance * np.var(x) + 1e-7 * np.mean(x**2):  # 1e-7 is for a signal that hardly changes
            notes.append(f"{name} is explained worse than by its mean; are its times and units those of the mechanism?")
    for experiment in problem.experiments if TIME_ZERO not in problem.names else ():
        for name, x in experiment.signals.items():
            # a signal `.angle` is 0 at t = 0; a tenth of its range there is more than noise
            if name.endswith(".angle") and experiment.time[0] == 0.0 and abs(x[0]) > 0.1 * np.ptp(x[np.isfinite(x)]):
                from_axis = name.removesuffix("angle") + "direction"
                notes.append(f"{name} begins at {x[0]:.3g} rad, but is the turn since then; {from_axis} counts from the x axis.")
    return notes
