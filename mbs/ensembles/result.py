"""Result of an ensemble: readings by member and window, means with standard errors, maps, histograms, Poincaré sections.

Numbers vary by a list of values or by a distribution, and are named by their paths in a file, as `joints[0].gap`. A cell is the
members with one mechanism and one value of each list.
"""

from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.special import stdtrit

from ..geometry import Array
from ..record.errors import CONFIDENCE
from ..sensitivity.numbers import Family
from ..units import label_with_unit
from .members import Members

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pandas import DataFrame


class Cell(NamedTuple):
    """Mean of a reading over a cell, with its standard error and the number of members that did not fail."""

    mechanism: int  # index
    values: dict[str, float]  # by path, one of each list
    mean: float
    error: float
    members: int


@dataclass(frozen=True, eq=False)
class Ensemble:
    """Readings of an ensemble, by member, window of time and formula."""

    members: Members
    readings: tuple[str, ...]  # formulas
    edges: Array  # limits of windows [s], (windows + 1,)
    skip: int  # number of windows at the start that statistics leave out
    values: Array  # (members, windows, readings), nan if a member failed or has not run
    done: Array  # True for members that have run, (members,)
    reasons: list[str]  # reasons of failures, '' for members that did not fail
    units: dict[str, str] = field(default_factory=dict)  # of readings, '' where it is not known
    interrupted: bool = False  # by Ctrl-C
    timed_out: bool = False  # the time limit was over before all members had run

    @property
    def failed(self) -> Array:
        """True for members that failed, shape (members,)."""
        return np.array([bool(reason) for reason in self.reasons])

    @property
    def message(self) -> str:
        """Numbers of members that ran and that failed, and the most frequent reason."""
        ran, failed = int(self.done.sum()), int(self.failed.sum())
        found = f"{ran} of {len(self.members)} members"
        if failed:
            why, count = Counter(filter(None, self.reasons)).most_common(1)[0]
            found += f", {failed} of them failed, {count} by {why}"
        return found + (" (interrupted)" if self.interrupted else " (TIMED_OUT)" if self.timed_out else "")

    @property
    def labels(self) -> dict[str, str]:
        """Readings and varied numbers with their units, by name."""
        units = Family.of(self.members.sources[0], self.members.paths).units | self.units
        return {name: label_with_unit(name, units.get(name, "")) for name in (*self.members.paths, *self.readings)}

    def of(self, reading: str, cell: int | None = None) -> Array:
        """Return values of a reading, of members that did not fail, without skipped windows, shape (members, windows).

        Raise a KeyError, with all readings, if there is no such reading.
        """
        if reading not in self.readings:
            raise KeyError(f"no reading '{reading}'; there are: {', '.join(self.readings)}")
        good = self.done & ~self.failed
        if cell is not None:
            good = good & (self.members.cells == cell)
        return self.values[good][:, self.skip :, self.readings.index(reading)]

    def mean(self, reading: str) -> float:
        """Compute the mean over members and windows."""
        return float(self.of(reading).mean())

    def error(self, reading: str, cell: int | None = None) -> float:
        """Compute the standard error of the mean from the independent means of members; nan for a single member."""
        values = self.of(reading, cell)
        means = values.mean(axis=1) if values.size else np.empty(0)
        return float(means.std(ddof=1) / np.sqrt(len(means))) if len(means) > 1 else float("nan")

    def interval(self, reading: str) -> tuple[float, float]:
        """Compute the 95 % confidence interval of the mean, by Student's distribution of the members' means."""
        freedom = max(len(self.of(reading)) - 1, 1)
        half_width = float(stdtrit(freedom, 0.5 + CONFIDENCE / 2)) * self.error(reading)
        return self.mean(reading) - half_width, self.mean(reading) + half_width

    def quantiles(self, reading: str, at: tuple[float, ...] = (0.05, 0.5, 0.95)) -> Array:
        """Compute quantiles over members and windows, shape (len(at),)."""
        return np.asarray(np.quantile(self.of(reading), at))

    def cells(self, reading: str) -> list[Cell]:
        """Compute mean and standard error for each cell."""
        paths = list(self.members.grid)
        columns = [self.members.paths.index(path) for path in paths]
        found = []
        for cell in np.unique(self.members.cells).tolist():
            values = self.of(reading, cell)
            first = int(np.argmax(self.members.cells == cell))
            numbers = dict(zip(paths, self.members.numbers[first, columns].tolist(), strict=True))
            mean = float(values.mean()) if values.size else float("nan")
            found.append(Cell(self.members.mechanism_index(first), numbers, mean, self.error(reading, cell), len(values)))
        return found

    def map(self, x: str, y: str, reading: str, ax: "Axes | None" = None) -> "Axes":
        """Draw the mean of a reading over two numbers that vary by lists; further lists are averaged."""
        if {x, y} - set(self.members.grid):
            lists = ", ".join(self.members.grid) or "none"
            raise ValueError(f"{x}, {y}: give both as lists of values in vary; lists are {lists}")
        grid, cells = [self.members.grid[path] for path in (x, y)], self.cells(reading)
        means = [[np.mean([cell.mean for cell in cells if (cell.values[x], cell.values[y]) == (a, b)]) for a in grid[0]]
                 for b in grid[1]]  # fmt: skip
        ax = ax or _make_axes()
        mesh = ax.pcolormesh(grid[0], grid[1], means, shading="nearest")
        ax.figure.colorbar(mesh, ax=ax, label=f"mean of {self.labels[reading]}")
        ax.set(xlabel=self.labels[x], ylabel=self.labels[y])
        for axis, values in zip((ax.xaxis, ax.yaxis), grid, strict=True):
            if len(values) <= 6:  # chosen, so that numbers do not overlap; ticks between the values would look like values
                axis.set_ticks(values)
        ax.ticklabel_format(scilimits=(-3, 4))
        return ax

    def histogram(self, reading: str, bins: int = 40, ax: "Axes | None" = None) -> "Axes":
        """Draw the distribution of a reading over members and windows, with the 95 % confidence interval of its mean."""
        ax = ax or _make_axes()
        ax.hist(self.of(reading).ravel(), bins=bins, color="0.7")
        ax.axvspan(*self.interval(reading), alpha=0.4, label="mean, 95 % interval")
        ax.axvline(self.mean(reading))
        ax.set(xlabel=self.labels[reading], ylabel="windows")
        ax.legend()
        return ax

    def section(self, x: str, y: str, ax: "Axes | None" = None) -> "Axes":
        """Draw a Poincaré section: two readings at the ends of all windows, such as `end(B.x)` and `end(B.vx)`."""
        ax = ax or _make_axes()
        ax.plot(self.of(x).ravel(), self.of(y).ravel(), ".", ms=1)
        ax.set(xlabel=self.labels[x], ylabel=self.labels[y])
        return ax

    def columns(self) -> dict[str, Array]:
        """Return all values by name, shape (members * windows,): number of member and window, varied numbers, readings."""
        members, windows = self.values.shape[:2]
        return {
            "member": np.repeat(np.arange(members), windows), "window": np.tile(np.arange(windows), members),
            **{path: np.repeat(self.members.numbers[:, k], windows) for k, path in enumerate(self.members.paths)},
            **{name: self.values[..., k].ravel() for k, name in enumerate(self.readings)},
        }  # fmt: skip

    def frame(self) -> "DataFrame":
        """Return all values as a data frame, with a row for each member and window."""
        import pandas as pd

        return pd.DataFrame(self.columns())

    def __str__(self) -> str:
        """Write the mean of each reading with its standard error and quantiles, in a line each."""
        lines = [self.message]
        for name in self.readings:
            low, middle, high = self.quantiles(name)
            lines.append(f"{name}: {self.mean(name):.6g} ± {self.error(name):.2g}; quantiles {low:.4g}, {middle:.4g}, {high:.4g}")
        return "\n".join(lines)

    def save(self, path: str | Path) -> Path:
        """Write readings, numbers and reasons of failures to one .npz file, which appears when it is complete."""
        target = Path(path)
        incomplete = target.with_name(f".{target.name}.part.npz")
        np.savez_compressed(  # `said` are the reasons: the name in the files of earlier versions
            incomplete, values=self.values, done=self.done, said=np.array(self.reasons), edges=self.edges, seed=self.members.seed,
            readings=np.array(self.readings), paths=np.array(self.members.paths), numbers=self.members.numbers,
        )  # fmt: skip
        incomplete.replace(target)
        return target

    def resume(self, path: str | Path) -> "Ensemble":
        """Read the members that an interrupted run has saved; raise a ValueError if the file is of another ensemble."""
        with np.load(path) as saved:
            own = {"readings": self.readings, "edges": self.edges, "numbers": self.members.numbers, "seed": self.members.seed}
            if any(not np.array_equal(saved[key], np.asarray(value)) for key, value in own.items()):
                differ = "members, numbers, readings or windows differ"
                raise ValueError(f"{path}: holds another ensemble ({differ}); name another file")
            self.values[:], self.done[:], self.reasons[:] = saved["values"], saved["done"], saved["said"].tolist()
        return self


def _make_axes() -> "Axes":
    from matplotlib.pyplot import subplots

    return subplots(layout="constrained")[1]
