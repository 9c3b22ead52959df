"""How a design is sought from its starts: towards all constraints, then along their ends.

References
----------
C. G. Broyden, Math. Comput. 19 (1965) 577, doi 10.1090/S0025-5718-1965-0198670-6.
D. Kraft, A software package for sequential quadratic programming, DFVLR-FB 88-28, 1988.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import isfinite, nan

import numpy as np
from scipy.optimize import least_squares, minimize
from scipy.stats import qmc

from ..geometry import Array
from .wants import FAR, INSET, SAME, Task, Want

POLISHED = 3
"""Starts, of the best, from which a minimum is sought."""
TRIED, MET = 60, 15
"""Most steps of a descent; where nothing is minimised it meets its constraints in few or follows the noise of its runs."""
LITTLE = 1e-2
"""Of the squares of what is missed: where a step lessens them by less, they are told as they are."""
WIDE, REACH = 0.02, 0.25
"""Of a range: differences by which readings show where they tend, across their waves; longest step towards what is wanted."""


def search(task: Task) -> None:
    """Run the best of some starts downhill, until there is nothing more to find or to spend."""
    d = len(task.ranges)
    random = qmc.Halton(d, rng=np.random.default_rng(task.seed)).random(task.starts - 1) if d else []
    for starts in ([task.first], list(random)):
        alive = [x for x in starts if task.valued(task.evaluate(x))]
        for x in sorted(alive, key=task.better)[:POLISHED] if d else ():
            descend(task, x)
    best = task.best()
    if d and best is not None and not task.aims and task.better(best)[1] <= len(task.wants):
        _descend_along_ends(task, best)  # where all ends are kept no residual is above 1, nor is what is least above this sum


def descend(task: Task, x: Array) -> None:
    """Where nothing is minimised towards all constraints, then to their least squares; else along their ends."""
    if task.aims:
        return _descend_along_ends(task, x)
    _meet(task, x)
    least_squares(
        task.residuals, task.best(x), task.steepness, bounds=(0.0, 1.0), method="dogbox", xtol=SAME, ftol=LITTLE, max_nfev=MET
    )


def _meet(task: Task, x: Array) -> None:
    """Broyden's method for all constraints that are missed; those without a value wait until they have one, as the force of a
    contact that is not there yet.
    """
    here = task.missing(x)
    slopes = np.full((len(here), len(x)), nan)
    for _ in range(MET):
        some = np.isfinite(here) & (here != 0.0)
        if not np.isfinite(slopes[some]).all():
            sides = np.where(x < 0.5, WIDE, -WIDE)
            slopes = np.stack([(task.missing(x + d) - here) / d.sum() for d in np.diag(sides)], axis=1)
            slopes[some] = np.nan_to_num(slopes[some])
        step = np.linalg.lstsq(slopes[some], -here[some])[0]
        step = np.clip(x + step * min(1.0, REACH / max(np.abs(step).max(), SAME)), 0.0, 1.0) - x
        if not np.abs(step).max() > SAME:
            break
        x, before = x + step, here
        here = task.missing(x)
        known = some & np.isfinite(here)
        slopes[known] += np.outer((here - before)[known] - slopes[known] @ step, step) / (step @ step)


def _descend_along_ends(task: Task, x: Array) -> None:
    """Sequential quadratic programming from a point."""
    start = task.evaluate(x)
    scale = (abs(task.aim(start)) or 1.0) if task.aims else 1.0

    def constrained(x: Array) -> Array:
        found = task.evaluate(x)
        off = [side * (found[task.row(want.name)] - end) / want.scale for want, side, end in _sides(task)]
        return np.asarray(np.nan_to_num(off, nan=-FAR))

    def pushed(x: Array) -> Array:
        slopes = task.slopes(x)
        return np.array([side * slopes[task.row(want.name)] / want.scale for want, side, _ in _sides(task)])

    def objective(x: Array) -> float:
        value = task.aim(task.evaluate(x)) / scale if task.aims else 0.0
        return value if isfinite(value) else FAR

    def slope(x: Array) -> Array:
        return np.asarray(task.slopes(x)[task.row(task.aims[0])] / scale if task.aims else np.zeros(len(x)))

    minimize(
        objective, x, jac=slope, method="SLSQP", bounds=[(0.0, 1.0)] * len(x),
        options={"maxiter": TRIED if task.aims else MET, "ftol": 1e-9},
        constraints=[{"type": "ineq", "fun": constrained, "jac": pushed}] if task.wants else (),
    )  # fmt: skip


def _sides(task: Task) -> Iterator[tuple[Want, float, float]]:
    """Each finite end of each constraint: side * (reading - end) >= 0."""
    for want in task.wants:
        inset = INSET * (want.high - want.low) if want.band else 0.0
        if isfinite(want.low):
            yield want, 1.0, want.low + inset
        if isfinite(want.high):
            yield want, -1.0, want.high - inset
