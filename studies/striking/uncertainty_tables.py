"""Metrics and tables of the study `uncertainty`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from buckler.mbs.sensitivity.derivatives import Sensitivities
from buckler.studies.kit.report import Metric, Table
from buckler.studies.kit.statistics import PowerLaw, mean
from buckler.studies.striking.uncertainty_models import IMPACT, MEASURES, Indices, Input

Array = np.ndarray[Any, Any]
OUTPUTS = {
    "slider-crank": {"contact_force": "N", "impact_force": "N"},
    "crank-rocker": {name: unit for name, (_, _, unit) in MEASURES.items()},
}
"""Outputs of each mechanism, and their units."""
LEVEL = 0.95
"""Of all confidence intervals."""


def deviation(unit: str, values: Array) -> Metric:
    """Standard deviation and its relative standard error, as for normal numbers."""
    return Metric(float(values.std(ddof=1)), unit, error=float(np.sqrt(0.5 / (values.size - 1))))


def spread(mechanism: str, sample: Array) -> dict[str, Metric]:
    """Mean, standard deviation and quantiles of each output."""
    found: dict[str, Metric] = {}
    for (name, unit), values in zip(OUTPUTS[mechanism].items(), sample, strict=True):
        low, middle, high = np.quantile(values, [0.05, 0.5, 0.95]).tolist()
        found |= {f"{name}.mean": mean(unit, values), f"{name}.sd": deviation(unit, values)}
        found |= {f"{name}.5%": Metric(low, unit), f"{name}.50%": Metric(middle, unit), f"{name}.95%": Metric(high, unit)}
    return found


def shares(mechanism: str, inputs: Sequence[Input], found: Indices) -> dict[str, Metric]:
    """Indices; their error is half the confidence interval, over the value."""
    metrics = {}
    for s, name in enumerate(OUTPUTS[mechanism]):
        for d, given in enumerate(inputs):
            for kind in ("first", "total"):
                value, limits = float(getattr(found, kind)[s, d]), getattr(found, f"{kind}_range")[s, d]
                error = float(np.ptp(limits)) / 2 / abs(value) if value else np.nan
                metrics[f"{name}.{given.name}.{kind}"] = Metric(value, "1", error=error)
    return metrics


def slope_metrics(name: str, inputs: Sequence[Input], fitted: PowerLaw) -> dict[str, Metric]:
    """D ln y/d ln x of each input, and the share of the variance that they explain."""
    found = {f"{name}.explained": Metric(fitted.explained, "1")}
    for given, slope in zip(inputs, fitted.metrics(), strict=True):
        found[f"{name}.{given.name}.slope"] = slope
    return found


def arrays(found: Indices, mechanism: str) -> dict[str, Array]:
    """What goes to signals.npz."""
    named = dict(zip(OUTPUTS[mechanism], found.sample, strict=True))
    indices = ("first", "total", "first_range", "total_range")
    return {"inputs": found.inputs, **named, **{name: getattr(found, name) for name in indices}}


def spread_table(p: Any, mechanism: str, metrics: Mapping[str, Metric]) -> Table:
    """Distribution of each output."""
    columns = ("mean", "sd", "5%", "50%", "95%")
    rows = [[name, unit, *(metrics[f"{name}.{c}"].value for c in columns)] for name, unit in OUTPUTS[mechanism].items()]
    if mechanism == "slider-crank":
        values = [metrics[f"simulated.impact_force.{c}"].value for c in ("mean", "sd")]
        rows.append([f"impact_force, {p.coupler} simulated", "N", *values])
    titles = {
        "slider-crank": f"Slider-crank at {p.slider_speed:g} rad/s, h = {1e3 * p.thickness:g} mm",
        "crank-rocker": f"Crank-rocker, c = {1e3 * p.clearance:g} mm, {p.speed:.4g} rad/s: means over {p.cycles} turns a run",
    }
    return Table(["", "unit", *columns], rows, titles[mechanism])


def _around(value: float, limits: Array) -> str:
    return f"{value:.3f} ± {np.ptp(limits) / 2:.3f}"


def striker_table(
    inputs: Sequence[Input], found: Indices, slope: Array, shares: Array, simulated: Sensitivities, exact: float, stated: str
) -> Table:
    """Slope, first-order index and its value for small tolerances, of both forces; slope of the simulated impact."""
    rows = []
    for d, given in enumerate(inputs):
        row = [given.name, f"{given.sd / given.mean:.2%}"]
        for s in range(2):
            row += [f"{slope[s, d]:.2f}", _around(found.first[s, d], found.first_range[s, d]), f"{shares[s, d]:.3f}"]
        told = simulated[IMPACT, given.name]
        rows.append([*row, f"{told.relative:.2f} ± {told.relative_error:.2g}"])
    force = ("slope", "first order", "linear")
    headers = ["", "sd", *(f"contact: {x}" for x in force), *(f"impact: {x}" for x in force), "simulated impact: slope"]
    notes = (
        "slope: d ln F/d ln x. linear: (slope sd)^2 over their sum. The share of the thickness in the contact force is exactly "
        f"{exact:.4f}.\n± half a {LEVEL:.0%} interval (first order), error of the derivative (simulation, whose "
        f"mean and deviation are of first order).\n{stated}"
    )
    return Table(headers, rows, "Whose variance it is", notes)


def rattler_table(
    p: Any, inputs: Sequence[Input], found: Indices, fits: Sequence[PowerLaw], chance: Array, error: Array
) -> Table:
    """Slopes and indices of each output, the share of chance among them; `error` is the standard error of `chance`."""
    rows = []
    for s, name in enumerate(MEASURES):
        for d, given in enumerate(inputs[:-1]):
            slope = f"{fits[s].slope[d]:.2f} ± {fits[s].error[d]:.2f}"
            first, total = (_around(x[s, d], y[s, d]) for x, y in _kinds(found))
            rows.append([name, given.name, f"{given.sd / given.mean:.1%}", slope, first, total])
            rows[-1].append(f"{found.total[s, d] - found.total[s, -1]:.3f}")
        rows.append([name, "chance", "", "", *(_around(x[s, -1], y[s, -1]) for x, y in _kinds(found)), ""])
        rows.append([name, "chance, at the mean", "", "", "", f"{chance[s]:.3f} ± {2 * error[s]:.3f}", ""])
    notes = (
        f"slope: d ln y/d ln x by least squares, its standard error. ± half a {LEVEL:.0%} interval. chance: the seed; its total "
        f"index is what no tolerance\ntakes away; at the mean: of {p.repeats} runs that differ by their seed only. Means over m "
        f"times as many turns have 1/m of its variance.\nContact and friction laws take 8 values each, alike in "
        f"probability.\n{p.stated()}."
    )
    return Table(["", "input", "sd", "slope", "first order", "total", "total - chance"], rows, "Whose variance it is", notes)


def _kinds(found: Indices) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    return (found.first, found.first_range), (found.total, found.total_range)
