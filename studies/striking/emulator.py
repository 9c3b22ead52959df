"""Numbers of a strike between those simulated: tables over stop stiffness, speed and a third and fourth axis, interpolated.

Every table is a grid of runs of the study `strike`, kept by the sweep engine. Logarithms are interpolated over logarithms by
cubic splines. Where it matters, further strikes (`refine`) correct the tables by what they are off there, faded out away from
them. `off` runs strikes at other points and tells how far the tables are off.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import RBFInterpolator, RegularGridInterpolator

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
REACH, NOISE = 0.3, 1e-3
"""How far a further strike corrects a table, over its axes' ranges; and how exactly it is met."""
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
        self.further: dict[str, list[tuple[Mapping[str, float], Any]]] = {name: [] for name in grids}
        self.corrections: dict[str, dict[str, RBFInterpolator]] = {}
        begin = 0
        for name, grid in grids.items():
            axes = [np.log(values) for values in grid.values.values()]
            shape = tuple(len(axis) for axis in axes)
            mine = rows[begin : begin + int(np.prod(shape))]
            begin += len(mine)
            self.tables[name] = {what: _table(axes, [row.value(what) for row in mine], shape) for what in UNITS}

    def __call__(self, table: str, what: str, **point: Any) -> Array:
        """A number of `UNITS` at points, one array for each axis of the table; within its ranges, else at their ends."""
        logs = self._logs(table, point)
        found = self.tables[table][what](logs)
        if table in self.corrections:
            found = found + self.corrections[table][what](self._unit(table, logs))
        return np.asarray(np.exp(found)).reshape(np.broadcast_shapes(*(np.shape(x) for x in point.values())))

    def _logs(self, table: str, point: Mapping[str, Any]) -> Array:
        """Logarithms of points, shape (points, axes)."""
        columns = [np.log(np.clip(point[name], *RANGES[name])) for name, _ in self.grids[table].axes]
        return np.stack([np.ravel(x) for x in np.broadcast_arrays(*columns)], axis=-1)

    def _unit(self, table: str, logs: Array) -> Array:
        """The same over the axes' ranges."""
        low, high = np.log(np.array([RANGES[name] for name, _ in self.grids[table].axes])).T
        return np.asarray((logs - low) / (high - low))

    def strikes(self, points: Mapping[str, Sequence[Mapping[str, float]]], progress: Progress = QUIET) -> dict[str, list[Any]]:
        """Rows of further strikes, at points by table."""
        cases = {name: [self.grids[name].case(point, **self.numerics) for point in some] for name, some in points.items()}
        alone = list(dict.fromkeys(case for some in cases.values() for case in some))
        rows = dict(zip(alone, sweep("strike", alone, workers=self.workers, progress=progress), strict=True))
        self.runs += len(alone)
        return {name: [rows[case] for case in some] for name, some in cases.items()}

    def off(self, points: Mapping[str, Sequence[Mapping[str, float]]], progress: Progress = QUIET) -> dict[str, Array]:
        """Relative errors of the peak at points by table."""
        found = {}
        for name, rows in self.strikes(points, progress).items():
            told = np.array([self(name, "peak", **point).item() for point in points[name]])
            found[name] = told / np.array([row.value("peak") for row in rows]) - 1
        return found

    def refine(self, points: Mapping[str, Sequence[Mapping[str, float]]], progress: Progress = QUIET) -> None:
        """Correct tables by further strikes at points: by radial functions of what the grid is off there."""
        for name, rows in self.strikes(points, progress).items():
            self.further[name] += [pair for pair in zip(points[name], rows, strict=True) if pair[1].value("peak") > FLOOR]
            if not self.further[name]:
                continue
            axes = [axis for axis, _ in self.grids[name].axes]
            at = {axis: np.array([point[axis] for point, _ in self.further[name]]) for axis in axes}
            logs = self._logs(name, at)
            self.corrections[name] = {
                what: RBFInterpolator(
                    self._unit(name, logs), _logarithms([row.value(what) for _, row in self.further[name]])
                    - self.tables[name][what](logs), kernel="gaussian", epsilon=1 / REACH, degree=-1, smoothing=NOISE,
                )
                for what in UNITS
            }  # fmt: skip


def _table(axes: Sequence[Array], values: Sequence[float], shape: tuple[int, ...]) -> RegularGridInterpolator:
    """Of logarithms."""
    filled = _logarithms(values).reshape(shape)
    method = "cubic" if min(shape) > 3 else "linear"
    return RegularGridInterpolator(axes, filled, method=method)


def _logarithms(values: Sequence[float]) -> Array:
    """Of numbers of strikes; of those that do not happen, of the floor."""
    return np.asarray(np.log(np.maximum(np.nan_to_num(np.array(values, dtype=float), nan=FLOOR), FLOOR)))
