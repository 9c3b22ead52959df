"""What a fit makes least: residuals of experiments over the unit cube of the free numbers, with their derivatives."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import f as fisher
from scipy.stats import qmc

from ..geometry import Array
from ..mechanism import Mechanism
from ..record.lookup import between
from ..record.run import Run
from ..solvers import Controlled, Spectral
from ..units import fits
from ..validate import near
from .curve import Smooth
from .data import Experiment
from .numbers import Family
from .reading import WrongReadingError, measure
from .runs import RunFailedError, run

Bounds = tuple[float, float]
STEADY = Spectral(steps=Controlled(tolerance=1e-8), contact_tolerance=1e-4)
"""Solver by default: its error over `WIDTH` is that of a derivative."""
WIDTH = 1e-4
"""Width of the differences that make the derivatives, over a number's range."""
CLOSE = 1e-7
"""Of the sum of squares, and of the one that a constant adds to it: a fit ends where a step would change it by less, which is by
less than a thousandth of the standard deviations of its numbers, however small what is left."""
FAR = 1e3
"""Standard deviations by which a run that fails is off."""
POLISHED = 2
"""Starts, of the best, from which least squares are sought."""
LEVEL = 0.95


class Profile(NamedTuple):
    """Least cost over one number, the others fitted anew.

    Attributes
    ----------
    at, cost : array
    level : float
        Cost up to which a value lies in the 95 % interval.
    """

    at: Array
    cost: Array
    level: float


class Cached(NamedTuple):
    """Point, and what the runs there predict."""

    x: Array
    predicted: list[dict[str, Any]]


@dataclass
class Problem:
    """Residuals over the unit cube of the free numbers.

    Attributes
    ----------
    make : callable
    experiments : list of Experiment
    names : list of str
        Of the numbers; those of one experiment as `name [k]`.
    places : list of dict of str to int
        Of each experiment: which numbers it has, by the names that `make` knows.
    low, high : array
    errors : dict of str to float
        Standard deviations of signals.
    known : bool
        Whether all of them were given.
    units : dict of str to str
        Of the numbers, and of signals once a run has told them.
    failed : str
        Why the first run that failed did.
    """

    make: Callable[[Mapping[str, float]], Mechanism]
    experiments: list[Experiment]
    names: list[str]
    places: list[dict[str, int]]
    low: Array
    high: Array
    errors: dict[str, float]
    known: bool
    solver: Spectral | None
    robust: bool
    units: dict[str, str]
    cached: Cached | None = None
    failed: str = ""

    @classmethod
    def of(cls, mechanism: Any, experiments: list[Experiment], free: Mapping[str, Bounds], own: Mapping[str, Bounds],
           solver: Spectral | None, robust: bool) -> Problem:  # fmt: skip
        """Check what is asked for and number the free numbers."""
        if not free and not own:
            raise ValueError("free: no number; give {path: (low, high)}")
        ranges = {**free, **own}
        for name, (low, high) in ranges.items():
            if not low < high:
                raise ValueError(f"free['{name}'] = ({low:g}, {high:g}): low must be less than high")
        settings = {name for each in experiments for name in each.settings}
        if both := sorted(settings & set(ranges)):
            raise ValueError(f"free['{both[0]}']: the experiments set it")
        family = Family.of(mechanism, [*ranges, *settings], {name: 0.0 for name in (*ranges, *settings)})
        names, bounds = list(free), list(free.values())
        places = [{name: k for k, name in enumerate(free)} for _ in experiments]
        for k, place in enumerate(places):
            for name in own:
                place[name] = len(names)
                names.append(f"{name} [{k}]")
                bounds.append(own[name])
        signals = list(dict.fromkeys(name for each in experiments for name in each.signals))
        for name in signals:
            if not any(np.isfinite(each.signals[name]).any() for each in experiments if name in each.signals):
                raise ValueError(f"data: {name} has no value at any time")
        units = {name: family.units[name.partition(" [")[0]] for name in names}
        given = {name: each.errors[name] for each in experiments for name in each.errors}
        guess = {name: _spread(experiments, name) for name in signals}
        low, high = np.array(bounds, dtype=float).T
        known = set(signals) <= set(given)
        return cls(family.make, experiments, names, places, low, high, guess | given, known, solver, robust, units)

    def mechanism(self, x: Array, k: int) -> Mechanism:
        """That of the k-th experiment at a point of the cube."""
        values = self.low + x * (self.high - self.low)
        return self.make({name: float(values[i]) for name, i in self.places[k].items()} | dict(self.experiments[k].settings))

    def run(self, x: Array) -> Cached:
        """Runs of all experiments."""
        if self.cached is None or not np.array_equal(self.cached.x, x):
            self.cached = Cached(x.copy(), [self.predicted(x, k) for k in range(len(self.experiments))])
        return self.cached

    def predicted(self, x: Array, k: int) -> dict[str, Any]:
        """Run the k-th experiment at a point of the cube."""
        each = self.experiments[k]
        found = run(self.mechanism(x, k), each.span, self.solver or STEADY)
        self.units |= {name: found.units[name] for name in each.signals if name in found.units}
        return predict(found, each)

    def residuals(self, x: Array) -> Array:
        """What is off, in standard deviations."""
        try:
            return np.concatenate(
                [self.off(each, said) for each, said in zip(self.experiments, self.run(x).predicted, strict=True)]
            )
        except WrongReadingError:
            raise
        except (RunFailedError, ValueError) as error:
            self.failed = self.failed or str(error)
            return np.full(self.count, FAR)

    def off(self, each: Experiment, predicted: Mapping[str, Any]) -> Array:
        """What one experiment is off."""
        parts = [((predicted[name] - values) / self.errors[name])[np.isfinite(values)] for name, values in each.signals.items()]
        parts.append(np.array([read.lacks(predicted[text]) for text, read in each.readings.items()]))
        found = np.concatenate(parts)
        return np.asarray(np.where(np.isfinite(found), found, FAR))

    def jacobian(self, x: Array) -> Array:
        """Derivatives of the residuals by the numbers over the cube, to one side, to the other where a run fails."""
        here, rows = self.run(x), []
        for k, each in enumerate(self.experiments):
            block = np.zeros((size(each), len(self.names)))
            start = self.off(each, here.predicted[k])
            for i in self.places[k].values():
                width, axis = WIDTH if x[i] < 0.5 else -WIDTH, np.arange(len(x)) == i
                try:
                    said = self.predicted(x + width * axis, k)
                except (RunFailedError, ArithmeticError):
                    width = -width
                    said = self.predicted(x + width * axis, k)
                block[:, i] = (self.off(each, said) - start) / width
            rows.append(block)
        return np.concatenate(rows)

    def best(self, starts: int, seed: int) -> Array:
        """The best point that least squares find from the best of some starts."""
        d = len(self.names)
        points = np.vstack([np.full(d, 0.5), qmc.Halton(d, rng=np.random.default_rng(seed)).random(starts - 1)])
        ends = []
        for x in sorted(points, key=lambda x: float(np.sum(self.residuals(x) ** 2)))[:POLISHED]:
            if np.all(self.residuals(x) == FAR):
                continue
            found = self.solve(x)
            ends.append((float(np.sum(self.residuals(found) ** 2)), found))
        if not ends:
            raise RunFailedError(f"no start leads to a run that ends; narrow the ranges. The first: {self.failed}")
        return min(ends, key=lambda end: end[0])[1]

    def solve(self, x: Array, held: int | None = None) -> Array:
        """Least squares from a point; all numbers but one that is held."""
        loose = np.arange(len(x)) != held

        def whole(part: Array) -> Array:
            out = x.copy()
            out[loose] = part
            return out

        if not loose.any():
            return x
        found = least_squares(
            lambda part: np.append(self.residuals(whole(part)), 1.0), np.clip(x[loose], 1e-9, 1 - 1e-9),
            jac=lambda part: np.vstack([self.jacobian(whole(part))[:, loose], np.zeros(len(part))]), bounds=(0.0, 1.0),
            x_scale="jac", loss="soft_l1" if self.robust else "linear", xtol=1e-10, ftol=CLOSE, gtol=1e-12, max_nfev=60,
        )  # fmt: skip
        return whole(found.x)

    def weighed(self, x: Array) -> Problem:
        """The same with the standard deviations that a fit leaves, of signals whose own are not given."""
        given = {name for each in self.experiments for name in each.errors}
        left = {
            name: value for name, value in rms(self.experiments, self.run(x).predicted, self.robust).items() if name not in given
        }
        self.errors |= {name: max(value, 1e-12 * self.errors[name]) for name, value in left.items()}
        return self

    def profile(self, best: Array, name: str) -> Profile:
        """Least cost over a number, from its best value on to both sides."""
        i = self.names.index(name)
        wide = min(0.5, 3.0 * float(np.sqrt(self.covariance(best)[i, i])))
        found = {float(best[i]): float(np.sum(self.residuals(best) ** 2))}
        for side in (-1, 1):
            x = best.copy()
            for part in (0.25, 0.5, 0.75, 1.0):
                x[i] = np.clip(best[i] + side * part * wide, 0.0, 1.0)
                x = self.solve(x, held=i)
                found[float(x[i])] = float(np.sum(self.residuals(x) ** 2))
        at = np.array(sorted(found))
        cost = 0.5 * np.array([found[each] for each in at])
        return Profile(self.low[i] + at * (self.high[i] - self.low[i]), cost, float(cost.min()) * self.growth(best))

    def growth(self, best: Array) -> float:
        """By how much the sum of squares may grow within the 95 % interval of one number."""
        freedom = max(1, self.count - len(best))
        return 1.0 + float(fisher.ppf(LEVEL, 1, freedom)) / freedom

    def covariance(self, x: Array) -> Array:
        """Of the numbers over the cube; infinite where the data say nothing."""
        j, r = self.jacobian(x), self.residuals(x)
        if self.robust:
            weight = (1 + r**2) ** -0.25
            j, r = j * weight[:, None], r * weight
        _, s, vh = np.linalg.svd(j, full_matrices=False)
        scale = 1.0 if self.known else float(r @ r) / max(1, len(r) - len(x))
        with np.errstate(divide="ignore"):
            spread = np.where(s > 1e-9 * s[0], 1 / np.maximum(s, 1e-300), 1e12)
        return np.asarray(scale * (vh.T * spread**2) @ vh)

    @property
    def count(self) -> int:
        """Number of residuals."""
        return sum(size(each) for each in self.experiments)


def predict(run: Run, each: Experiment) -> dict[str, Any]:
    """What a run says of what an experiment measured."""
    time, values, traits, units = run.record.time, run.values, run.traits, run.units
    found: dict[str, Any] = {}
    for name in each.signals:
        if name not in values:
            close = near(name, values)
            hint = f"did you mean {close[0]}?" if close else f"there are: {', '.join(values)}"
            raise WrongReadingError(f"no signal '{name}'; {hint}")
        if (given := each.units.get(name)) and not fits(given, units[name]):
            raise WrongReadingError(f"data: {name} [{given}]: must be in {units[name]}")
        rate = traits[name].rate
        slopes = values[rate] if rate in values else Smooth(time, values[name]).slopes
        found[name] = between(time, values[name], slopes, each.time)
    return found | {text: measure(text, time, values, units, Smooth).value for text in each.readings}


def rms(experiments: Sequence[Experiment], predicted: Sequence[Mapping[str, Any]], robust: bool = False) -> dict[str, float]:
    """What is left of each signal, its root mean square; where outliers are expected 1.4826 times its median size."""
    left: dict[str, list[Array]] = {}
    for each, said in zip(experiments, predicted, strict=True):
        for name, values in each.signals.items():
            left.setdefault(name, []).append((said[name] - values)[np.isfinite(values)])
    size = {name: np.concatenate(parts) for name, parts in left.items()}
    return {name: float(1.4826 * np.median(np.abs(x)) if robust else np.sqrt(np.mean(x**2))) for name, x in size.items()}


def _measured(experiments: Sequence[Experiment], name: str) -> Array:
    """All that was measured of a signal."""
    values = np.concatenate([each.signals[name] for each in experiments if name in each.signals])
    return values[np.isfinite(values)]


def _spread(experiments: Sequence[Experiment], name: str) -> float:
    """Of a signal's data: what its residuals are held against before a fit."""
    values = _measured(experiments, name)
    return float(np.std(values)) or float(np.max(np.abs(values))) or 1.0


def unexplained(experiments: Sequence[Experiment], left: Mapping[str, float], growth: float) -> list[str]:
    """Signals of which more is left than about their mean, beyond chance and what a fit does not look for."""
    known = {name: _measured(experiments, name) for name in left}
    return [name for name, x in known.items() if left[name] ** 2 > growth * np.var(x) + CLOSE * np.mean(x**2)]


def size(each: Experiment) -> int:
    """Number of residuals."""
    return sum(int(np.isfinite(values).sum()) for values in each.signals.values()) + len(each.readings)
