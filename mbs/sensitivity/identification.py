"""Sentences about the limits of data: numbers that they do not identify, and signals that no numbers explain."""

from __future__ import annotations

import numpy as np

from ..geometry import Array
from .residuals import CLOSE, Problem, gather, signals_of

VAGUE = 0.5
"""Width of an interval over the range of a number above which the number is not identified."""
TOGETHER = 0.95
"""Correlation of two numbers above which the data identify them only together."""
SHIFTED = 0.1
"""First value of a measured angle, over its range, above which it does not count from the start of the run: beyond noise."""


def vague(problem: Problem, best: Array, deviation: Array, correlation: Array) -> list[str]:
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


def list_unexplained(problem: Problem, best: Array, growth: float) -> list[str]:
    """List signals whose residuals exceed those about their mean by more than chance and tolerance, in sentences."""
    left, found = problem.residual_sizes(best), []
    for name in signals_of(problem.experiments):
        x = gather(problem.experiments, name)
        if shift := _shift(problem, name):
            found.append(
                f"{name} counts the turn since the start of the run, and {shift:.3g} rad is measured there: it is explained "
                f"worse than '{name.removesuffix('angle')}direction', the angle from the x axis, would be."
            )
        elif left[name] ** 2 > growth * np.var(x) + CLOSE * np.mean(x**2):
            found.append(f"{name} is explained worse than by its mean; are its times and units those of the mechanism?")
    return found


def _shift(problem: Problem, name: str) -> float:
    """Return the angle of a link [rad] measured at the start of a run, where the signal is 0 whatever the numbers are."""
    if not name.endswith(".angle") or name.count(".") > 1 or "time_zero" in problem.names:
        return 0.0
    starts = [each.signals[name] for each in problem.experiments if name in each.signals and each.time[0] == 0.0]
    return max((float(x[0]) for x in starts if abs(x[0]) > SHIFTED * np.ptp(x)), key=abs, default=0.0)
