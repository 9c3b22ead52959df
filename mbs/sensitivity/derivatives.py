"""Derivatives of readings (numbers read off a run) by numbers of a mechanism: central differences, each with its error.

A reading f is computed at p - w, p and p + w, where w is a small change of the number p. The derivative is
(f(p + w) - f(p - w))/2w. Its error is the truncation error plus the noise (W. H. Press et al., Numerical recipes, 2007, ch. 5.7).

The truncation error is estimated by a second, coarser central difference, with 4 w, larger tolerances and strips of a lower
degree: it is the difference of the two. The noise is estimated by gaps. A gap is the difference of the one-sided derivatives
(f(p + w) - f(p))/w and (f(p) - f(p - w))/w. For a smooth reading the gap is w f'', so it is four times as large over 4 w. What
differs from this ratio is noise.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf, isfinite, nan, sqrt
from typing import NamedTuple

import numpy as np

from ..geometry import Array
from ..progress import USER_STOPS, watch, watching
from ..solvers import Controlled, Spectral
from ..statics.answer import DEGREE_STEP
from ..validate import positive
from .numbers import Family, Source
from .reading import FAILURES
from .runs import Reading, Readings, needs_run, read, readings_of, require_compiler, scale_tolerances

TIGHT = Spectral(steps=Controlled(tolerance=1e-9), degree=12, contact_tolerance=1e-6)
"""Default solver of the finer runs. Derivatives after an impact have errors of up to 1e-7; with the tolerance
1e-7 they would have up to 1e-4. Degree and contact tolerance are chosen."""
WIDER = 4.0
"""Factor from the finer width to the coarser one, and from the finer tolerances to the coarser ones; chosen."""


class Derivative(NamedTuple):
    """Derivative of a reading, which has a `value` and `unit`, by a number, which has the value `at` and the unit `by_unit`.

    `below` and `above` are one-sided derivatives. If no derivative can be stated, it is nan, the error inf, and `note` says why.
    """

    reading: str
    number: str
    value: float
    at: float
    unit: str
    by_unit: str
    derivative: float = nan
    error: float = inf
    below: float = nan
    above: float = nan
    note: str = ""

    @property
    def relative(self) -> float:
        """Relative change of the reading by a relative change of the number; nan where one of them is zero."""
        return self.derivative * self.at / self.value if self.value and self.at else nan

    @property
    def relative_error(self) -> float:
        """Error of `relative`."""
        return self.error * abs(self.at / self.value) if self.value and self.at else nan


@dataclass(frozen=True)
class Sensitivities:
    """Derivatives of readings by numbers, grouped by reading, the largest first; `spreads` are numbers' standard deviations."""

    rows: Sequence[Derivative]
    spreads: Mapping[str, float]

    def __getitem__(self, key: tuple[str, str]) -> Derivative:
        for row in self.rows:
            if (row.reading, row.number) == key:
                return row
        raise KeyError(f"no derivative of '{key[0]}' by '{key[1]}'")

    def spread(self, reading: str) -> float:
        """Return the standard deviation of a reading for independent small deviations of the numbers, first order."""
        return sqrt(sum(each**2 for each in self.contributions(reading).values()))

    def contributions(self, reading: str) -> dict[str, float]:
        """Return the standard deviation of a reading due to each number, the largest first, unknown ones last."""
        if not self.spreads:
            raise ValueError("no standard deviations; give by={path: standard deviation}")
        parts = {row.number: abs(row.derivative) * self.spreads[row.number] for row in self.rows if row.reading == reading}
        return dict(sorted(parts.items(), key=lambda item: -np.nan_to_num(item[1], nan=-1.0)))

    def __str__(self) -> str:
        heads = ["reading", "number", "d ln/d ln", "derivative", "error", "unit", ""]
        rows = [
            [row.reading, row.number, f"{row.relative:+.4g}", f"{row.derivative:.6g}", f"{row.error:.1e}",
             _per(row.unit, row.by_unit), row.note]
            for row in self.rows
        ]  # fmt: skip
        widths = [max(len(row[k]) for row in (heads, *rows)) for k in range(len(heads))]
        return "\n".join("  ".join(f"{cell:{w}}" for cell, w in zip(row, widths, strict=True)).rstrip() for row in (heads, *rows))


def _per(unit: str, by: str) -> str:
    """Write the unit of a derivative, with '?' for an unknown unit; `by` is '1' for a number without dimension."""
    unit, by = unit or "?", by or "?"
    if by == "1":
        return unit
    return f"{unit}/({by})" if " " in by or "/" in by else f"{unit}/{by}"


@watch("runs")
def sensitivities(
    mechanism: Source, duration: float | None = None, *,
    by: Sequence[str] | Mapping[str, float], of: str | Sequence[str] | Mapping[str, Reading],
    solver: Spectral | None = None, at: Mapping[str, float] | None = None,
    timeout: float | None = None, progress: bool | None = None,
) -> Sensitivities:  # fmt: skip
    """Compute derivatives of readings by numbers of a mechanism.

    Raise a ValueError on a wrong path or reading, before anything runs. Raise a RunFailedError if the run of the unchanged
    mechanism fails, or its state of rest is not stable.

    Parameters
    ----------
    mechanism : Mechanism, mapping or callable
        A mechanism, the content of its file, or a function that makes a mechanism from the arguments in `at`.
    duration : float, optional
        Duration of the run [s], positive; without it, readings are of states of rest.
    by : sequence of str, or mapping of str to float
        Numbers by their paths, as in files (`links.coupler.body.section.thickness`). A mapping gives standard deviations, SI,
        from which those of readings are computed. A number that is zero needs a standard deviation.
    of : str, sequence of str, or mapping
        Readings, as 'max(B.contact_force)' or 'frequency(1)' (see `buckler.mbs.sensitivity.reading`). A mapping names such
        texts, or functions of the mechanism that return a number.
    solver : Spectral, optional
        Solver of the finer runs; by default with a tolerance of 1e-9.
    at : mapping of str to float, optional
        Arguments of the function that makes the mechanism.
    timeout, progress
        Limit of time [s], after which missing derivatives are nan; `progress` shows the state, by default in terminals.
    """
    require_compiler()
    duration = None if duration is None else float(positive("duration", duration, "s"))
    readings = readings_of(of, moving=duration is not None)
    family = Family.of(mechanism, by, at)
    deviations = by if isinstance(by, Mapping) else {}
    spreads = {name: float(positive(f"standard deviation of {name}", x, family.units[name])) for name, x in deviations.items()}
    scales = {name: abs(family.values[name]) or spreads.get(name, 0.0) for name in by}  # of the changes of a number
    if no_scale := [name for name, scale in scales.items() if not scale]:
        raise ValueError(f"{no_scale[0]} = 0: a relative change says nothing; give its standard deviation, too")
    of_runs = {name: reading for name, reading in readings.items() if needs_run(reading)}
    at_rest = {name: reading for name, reading in readings.items() if name not in of_runs}
    rows: list[Derivative] = []
    runs = 2 * (1 + 2 * len(scales))  # finer and coarser: the unchanged mechanism, and both sides of each number
    watching.get().most = runs if of_runs else inf  # number of runs, for the display of progress
    # w/|p| of the finer difference, chosen: the truncation error is proportional to its square, the noise of runs to its inverse
    for group, width in ((of_runs, 3e-4), (at_rest, 1e-3)):
        if group:
            rows += Neighbours(family, scales, duration, group).rows(solver or TIGHT, width)
    return Sensitivities(rows, spreads)


class Neighbours(NamedTuple):
    """Mechanisms that differ from a given one in one number; a `width` is the change of a number over its scale."""

    family: Family
    scales: dict[str, float]
    duration: float | None
    readings: Mapping[str, Reading]

    def read(self, solver: Spectral, **changes: float) -> Readings:
        """Compute the readings of the mechanism with other values of some numbers."""
        return read(self.readings, self.family.make(self.family.values | changes), self.duration, solver)

    def rows(self, solver: Spectral, width: float) -> list[Derivative]:
        """Compute derivatives, grouped by reading, the largest effect first."""
        unchanged = self.read(solver)
        slopes, reason = self.slopes_by_number(solver, width, unchanged)
        rows = []
        for i, reading in enumerate(self.readings):
            value, derivatives = float(unchanged.values[i]), []
            reading_error = float(unchanged.errors[i]) / abs(value) if value else 0.0  # relative
            for name, scale in self.scales.items():
                row = Derivative(reading, name, value, self.family.values[name], unchanged.units[i], self.family.units[name])
                if name in slopes:
                    rounding = 1e-15 * abs(value) / (width * scale)  # from some roundings of the reading, of 1e-16 each
                    derivatives.append(_combine(row, scale, slopes[name][:, i], reading_error, rounding))
                else:  # a time limit or Ctrl-C came before
                    derivatives.append(row._replace(note=reason))
            rows += sorted(derivatives, key=lambda row: -abs(np.nan_to_num(row.derivative) * self.scales[row.number]))
        return rows

    def slopes_by_number(self, solver: Spectral, width: float, unchanged: Readings) -> tuple[dict[str, Array], str]:
        """Compute one-sided derivatives by each number, (4, readings), and the reason why the user stopped, or ''.

        They are from below and from above over the finer width, then both over the coarser width.
        """
        has_degree_to_lower = solver.degree is not None and solver.degree > DEGREE_STEP
        coarse_solver = scale_tolerances(solver, WIDER, -DEGREE_STEP if has_degree_to_lower else 0)
        slopes, reason = dict[str, Array](), ""
        try:
            coarse_unchanged = self.read(coarse_solver)
            for name in self.scales:
                fine = self.slopes(name, solver, width, unchanged)
                coarse = self.slopes(name, coarse_solver, WIDER * width, coarse_unchanged)
                slopes[name] = np.array([*fine, *coarse])
        except USER_STOPS as stop:
            reason = str(stop)
        return slopes, reason

    def slopes(self, name: str, solver: Spectral, width: float, start: Readings) -> list[Array]:
        """Compute the one-sided derivatives from below and from above by a number, each (readings,); nan where a run fails."""
        sides = []
        for change in (-width * self.scales[name], width * self.scales[name]):
            try:
                values = self.read(solver, **{name: self.family.values[name] + change}).values
            except FAILURES:  # the changed number may be out of its range
                values = np.full(len(self.readings), nan)
            sides.append((values - start.values) / change)
        return sides


def _combine(blank: Derivative, scale: float, sides: Array, reading_error: float, rounding: float) -> Derivative:
    """Combine one-sided derivatives, as of `slopes_by_number`, to a derivative with its error.

    `blank` has all but the derivative. `reading_error` is the relative error of the reading, taken for a factor that all its
    values have in common. `rounding` is the error of the derivative due to rounding.
    """
    below, above, coarse_below, coarse_above = map(float, sides)
    value, coarse, note = 0.5 * (below + above), 0.5 * (coarse_below + coarse_above), ""
    if isfinite(below) != isfinite(above):
        side, value, coarse = ("below", below, coarse_below) if isfinite(below) else ("above", above, coarse_above)
        note = f"from {side} alone: a run on the other side failed"
    gap, coarse_gap = above - below, coarse_above - coarse_below
    # independent noise s of the readings is sqrt(6) s/w in the gap, s/(sqrt(2) w) in the central difference: 3.5 times less
    noise = abs(gap - coarse_gap / WIDER) / 3.5 if isfinite(gap) else 0.0  # unknown without a gap, when one side failed
    error = abs(value - coarse) + noise
    # Of a smooth reading the gap is about 1/4 of the coarse one. With 1 for the 10, smooth readings of impacts in the tests are
    # called kinks; with 100, a graze passes for smooth. A smaller gap than 1e-3 of the derivative, chosen, is no kink
    least_gap_at_kink = max(0.5 * abs(coarse_gap), 10.0 * abs(value - coarse), 1e-3 * abs(value))
    is_uncertain = error > 0.5 * abs(value)  # no digit of the derivative is certain
    is_effect_small = error * scale <= 1e-2 * abs(blank.value)  # the error of d ln f/d ln p: an effect of this size is negligible
    reason = ""
    if not isfinite(value + coarse):
        reason = "a run beside it failed" if isfinite(blank.value) else "the reading has no value there"
    elif abs(gap) > least_gap_at_kink:
        reason = f"a kink: {below:.4g} below, {above:.4g} above"
    elif is_uncertain and not is_effect_small:
        reason = f"no digit is certain: {coarse:.3g} and {value:.3g} over two widths: chaos, a jump or a graze"
    if reason:
        return blank._replace(below=below, above=above, note=reason)
    error += (reading_error + 1e-6) * abs(value) + rounding  # 1e-6, chosen: for errors that both differences have in common
    return blank._replace(derivative=value, error=error, below=below, above=above, note=note)
