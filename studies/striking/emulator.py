"""Numbers of a strike between those simulated: tables over stop stiffness, speed and a third and fourth axis, interpolated.

Every table is a grid of runs of the study `strike`, kept by the sweep engine. Logarithms are interpolated over logarithms by
cubic splines. `held_out` runs strikes at points of no grid and tells how far the interpolation is off.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import RegularGridInterpolator
from scipy.stats import qmc

from buckler.studies.kit.report import QUIET, Progress
from buckler.studies.striking import strike
from buckler.studies.striking.strike import UNITS
from buckler.studies.sweeping.sweep import sweep

Array = np.ndarray[Any, Any]
STANDARD = 9.81
STRAIGHT = 1e-4
"""Bow of the strip that is called straight, over its length."""
RANGES = {
    "stop_stiffness": (1e3, 2e5),
    "speed": (0.85, 3.8),
    "bow": (STRAIGHT, 0.03),
    "motor": (0.2, 20.0),
    "compliance": (1e-3, 1.0),
}
"""Ranges of the axes: N/m, rad/s, 1, N m s, rad/(N m)."""
FIELDS = {"bow": "imperfection"}
"""Axes whose parameter of `strike` is called otherwise."""
GRAVITY: dict[str, dict[str, Any]] = {
    "": {},
    "-y": {"gravity": STANDARD, "gravity_angle": -pi / 2},
    "+y": {"gravity": STANDARD, "gravity_angle": pi / 2},
}
FLOOR = 1e-3
"""Least force, N, time, s, or torque, N m, in a table; where a strike does not happen."""


@dataclass(frozen=True)
class Grid:
    """Axes of one table, and gravity.

    Attributes
    ----------
    axes : mapping of str to int
        How many values each axis has; stop_stiffness and speed come first.
    """

    axes: tuple[tuple[str, int], ...]
    gravity: str = ""

    @property
    def values(self) -> dict[str, Array]:
        """Of each axis, alike in their logarithms."""
        return {name: np.geomspace(*RANGES[name], count) for name, count in self.axes}

    def cases(self, **numerics: Any) -> list[strike.Parameters]:
        """One run for each point, the last axis running fastest."""
        return [self.case(dict(zip(self.values, point, strict=True)), **numerics) for point in product(*self.values.values())]

    def case(self, point: Mapping[str, float], **numerics: Any) -> strike.Parameters:
        """The run at a point."""
        given: dict[str, Any] = {FIELDS.get(name, name): float(value) for name, value in point.items()}
        return strike.Parameters(**given, **GRAVITY[self.gravity], **numerics)


def grids(causes: Sequence[str], pairs: bool, stiffnesses: int, speeds: int, bows: int, others: int) -> dict[str, Grid]:
    """The tables that causes need, by name: a rigid drive, motor, compliance, each under gravity as well if that is a cause.

    With pairs the bow is an axis of every table but those of motor and compliance under gravity.
    """
    shared = (("stop_stiffness", stiffnesses), ("speed", speeds))
    bow = (("bow", bows),) if "bow" in causes else ()
    found = {}
    for gravity in GRAVITY if "gravity" in causes else ("",):
        found[f"rigid{gravity}"] = Grid((*shared, *(bow if pairs or not gravity else ())), gravity)
    for name in (n for n in ("motor", "compliance") if n in causes):
        for gravity in GRAVITY if "gravity" in causes and pairs else ("",):
            both = (("bow", max(2, bows - 1)),) if bow and pairs and not gravity else ()
            found[f"{name}{gravity}"] = Grid((*shared, (name, others), *both), gravity)
    return found


class Emulator:
    """Tables of strikes.

    Parameters
    ----------
    grids : mapping of str to Grid
    workers : int
        Processes.
    store : Path, optional
        File of the runs.
    """

    def __init__(
        self, grids: Mapping[str, Grid], workers: int, store: Path | None, progress: Progress = QUIET, **numerics: Any
    ) -> None:
        self.grids, self.workers, self.numerics = dict(grids), workers, numerics
        cases = [case for grid in grids.values() for case in grid.cases(**numerics)]
        self.runs = len(cases)
        rows = sweep("strike", cases, workers=workers, store=store, progress=progress)
        self.failed = sum(row.status != "OK" for row in rows)
        self.tables: dict[str, dict[str, RegularGridInterpolator]] = {}
        begin = 0
        for name, grid in grids.items():
            axes = [np.log(values) for values in grid.values.values()]
            shape = tuple(len(axis) for axis in axes)
            mine = rows[begin : begin + int(np.prod(shape))]
            begin += len(mine)
            self.tables[name] = {what: _table(axes, [row.value(what) for row in mine], shape) for what in UNITS}

    def __call__(self, table: str, what: str, **point: Any) -> Array:
        """A number of `UNITS` at points, one array for each axis of the table; within its ranges, else at their ends."""
        columns = []
        for name, _ in self.grids[table].axes:
            low, high = RANGES[name]
            columns.append(np.log(np.clip(point[name], low, high)))
        return np.asarray(np.exp(self.tables[table][what](np.stack(np.broadcast_arrays(*columns), axis=-1))))

    def held_out(self, count: int, seed: int, progress: Progress = QUIET) -> Array:
        """Relative errors of the peak at so many points of every table, drawn over its axes; shape (tables, count)."""
        errors = []
        for name, grid in self.grids.items():
            unit = qmc.Sobol(len(grid.axes), rng=np.random.default_rng(seed)).random_base2(max(0, (count - 1).bit_length()))
            names = [axis for axis, _ in grid.axes]
            points = [{axis: _between(*RANGES[axis], x) for axis, x in zip(names, row, strict=True)} for row in unit[:count]]
            cases = [grid.case(point, **self.numerics) for point in points]
            rows = sweep("strike", cases, workers=self.workers, progress=progress)
            told = np.array([self(name, "peak", **point).item() for point in points])
            errors.append(told / np.array([row.value("peak") for row in rows]) - 1)
        return np.array(errors)


def _between(low: float, high: float, x: float) -> float:
    """Alike in its logarithm."""
    return float(low * (high / low) ** x)


def _table(axes: Sequence[Array], values: Sequence[float], shape: tuple[int, ...]) -> RegularGridInterpolator:
    """Of logarithms."""
    filled = np.log(np.maximum(np.nan_to_num(np.array(values, dtype=float), nan=FLOOR), FLOOR)).reshape(shape)
    method = "cubic" if min(shape) > 3 else "linear"
    return RegularGridInterpolator(axes, filled, method=method)
