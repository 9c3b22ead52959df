"""Load of a buckled strip: error against run time of each element, and of a plain run of the engine.

Twenty end shortenings, from u = 0.001 to 0.95, of the pinned strip. Beam and Cable start each value from the exact
elastica (`mbs.engine.pressed.pinned_strip`); the plain run ramps through the values, each starting from the last, as one would
write it straight on the engine (studies/plain.py). The error is the largest relative one of the twenty loads against
the exact solution of the element's own theory (`buckler.elastica.rod`): a Beam extends and shears, a Cable only extends. "off
elastica" is the same against the inextensible closed form, from which the theories themselves differ by 1e-6 to 4e-6.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from buckler.elastica import pinned
from buckler.elastica.rod import Rod
from buckler.mbs import Beam, Cable, Section
from buckler.mbs.geometry import Array
from buckler.mbs.library import PAPER

from ..kit import work_precision as precision
from ..kit.parameters import StudyParameters, integer, quantity
from ..kit.published import STRIP_WIDTH
from ..kit.report import QUIET, Metric, Progress, StudyResult, Table, judged
from ..kit.statistics import exponent
from ..kit.style import Figure, subplots
from ..kit.work_precision import Point, Series

SHORTENINGS = np.concatenate([[1e-3], np.linspace(0.05, 0.95, 19)])
OFF_BRANCH = 0.5
"""Relative distance from the exact load beyond which a value is not on the buckled branch."""
CONVERGING = 1e-2
"""Errors above it have not begun to converge: they count for no rate."""
SERIES = {"beam3": "Beam, 3 nodes", "beam2": "Beam, 2 nodes", "cable": "Cable", "plain": "plain ANCF"}
ORDERS = {"beam3": 4, "beam2": 2, "cable": 4}
"""Orders of the load's error in the element size that theory promises: twice the strain's own."""
ERROR_BAR, TIME_BAR = 1e-5, 0.5
"""What is asked of the Beam: this error, in this part of the plain run's time."""


@dataclass(frozen=True)
class Parameters(StudyParameters):
    """Parameters of the study."""

    thickness: float = quantity(3e-4, "m", 1e-4, 2e-3, "thickness of the strip", "strip")
    elements: int = integer(20, 4, 200, "three-node Beam elements held against the plain run", "numerics")
    finest: int = integer(64, 16, 256, "most elements of each series; 4, 8, 16, ... up to there", "numerics")
    plain_elements: int = integer(64, 16, 256, "elements of the plain run", "numerics")
    repeats: int = integer(9, 1, 1000, "repetitions, taken in turn", "numerics")

    @property
    def section(self) -> Section:
        """Of the strip."""
        return Section(STRIP_WIDTH, self.thickness)


@dataclass(frozen=True)
class LoadCurve:
    """Normalised loads of one run, with the exact ones of its theory."""

    load: Array
    exact: Array
    message: str = ""
    work: Mapping[str, float] = field(default_factory=dict)

    @property
    def error(self) -> float:
        """Largest relative error; nan if the run failed."""
        return float(np.abs(self.load / self.exact - 1).max())

    @property
    def on_branch(self) -> float:
        """Share of the values that are on the buckled branch."""
        return float((np.abs(self.load / self.exact - 1) < OFF_BRANCH).mean())


def run(p: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Run every element once for its loads, then all of them in turn for their times."""
    runs = _variants(p)
    found = precision.outcomes(runs)
    curves = {_title(name, n): curve for name, part in found.items() for n, curve in part.items()}
    series = precision.measure(runs, lambda curve: curve.error, p.repeats, progress)
    series = {name: {n: replace(point, name=_title(name, n)) for n, point in part.items()} for name, part in series.items()}
    beam, plain = series["beam3"][str(p.elements)], series["plain"][str(p.plain_elements)]
    equal = precision.fastest([point for name in ORDERS for point in series[name].values()], plain.error)
    sentence = " ".join(precision.verdict(point, plain) for point in dict.fromkeys(filter(None, (beam, equal))))
    lost = [f"{name}: {c.message or 'off the buckled branch'}" for name, c in curves.items() if c.on_branch < 1]
    signals = {"shortening": SHORTENINGS, **{f"load.{name}": curve.load for name, curve in curves.items()}}
    return StudyResult(
        parameters=p,
        **judged(lost, sentence),
        metrics=_metrics(series, curves, beam, plain, equal),
        signals=signals | precision.as_signals(series, ".elements", int),
        tables=[_table(series, curves, plain, f"{sentence}\n{precision.footnote(p)}")],
    )


def _title(series: str, elements: str) -> str:
    return f"{SERIES[series]} x {elements}"


def _variants(p: Parameters) -> Mapping[str, Mapping[str, Callable[[], LoadCurve]]]:
    """Runs by series and number of elements."""
    from buckler.mbs.engine.pressed import pinned_strip  # loads the engine

    from ..trust import plain

    section, length = p.section, PAPER.coupler
    unit = section.bending_stiffness / length**2
    axial, shear = section.axial_stiffness / unit, section.shear_stiffness / unit
    rods = Rod(axial, shear), Rod(axial)
    beam, cable = (np.array([rod.at_shortening(u).load for u in SHORTENINGS]) for rod in rods)

    def ours(body: Beam | Cable) -> LoadCurve:
        found = pinned_strip(body, length, SHORTENINGS)
        return LoadCurve(found.load, beam if body.turns else cable, found.message, found.work)

    def theirs(n: int) -> LoadCurve:
        found = plain.buckled_strip(section, length, SHORTENINGS, n)
        return LoadCurve(found.force / unit, cable, found.message, found.work)

    counts = [2**k for k in range(2, p.finest.bit_length()) if 2**k <= p.finest]
    quadratic, linear = sorted({*counts, p.elements}), [n for n in counts if n >= 16]
    plains = sorted({*linear, p.plain_elements})
    return {
        "beam3": {str(n): partial(ours, Beam(section, n)) for n in quadratic},
        "beam2": {str(n): partial(ours, Beam(section, n, nodes=2)) for n in linear},
        "cable": {str(n): partial(ours, Cable(section, n)) for n in counts},
        "plain": {str(n): partial(theirs, n) for n in plains},
    }


def _metrics(
    series: Series, curves: Mapping[str, LoadCurve], beam: Point, plain: Point, equal: Point | None
) -> dict[str, Metric]:
    ours = [curve.on_branch for name, curve in curves.items() if not name.startswith(SERIES["plain"])]
    found = {
        "on_branch": Metric(min(ours), "1", exact=1.0),
        "beam_error": Metric(beam.error, "1"),
        "beam_error_to_elastica": Metric(_off_elastica(curves[beam.name]), "1"),
        "plain_error": Metric(plain.error, "1"),
        "beam_time": Metric(beam.wall_s, "s"),
        "plain_time": Metric(plain.wall_s, "s"),
        "time_ratio": Metric(1 / beam.speedup(plain), "1"),
    }
    if equal is not None:
        found["time_ratio_at_plain_error"] = Metric(1 / equal.speedup(plain), "1")
    for name, order in ORDERS.items():
        converging = {1 / int(n): point.error for n, point in series[name].items() if point.error < CONVERGING}
        if len(converging) > 1:
            found[f"rate_{name}"] = Metric(exponent([*converging], [*converging.values()]), "1", exact=order)
    return found


def _off_elastica(curve: LoadCurve) -> float:
    return float(np.abs(curve.load / pinned.load(SHORTENINGS) - 1).max())


def _table(series: Series, curves: Mapping[str, LoadCurve], plain: Point, notes: str) -> Table:
    rows = [
        [
            SERIES[name], int(n), f"{p.error:.1e}", f"{1e3 * p.wall_s:.3g}", f"{1 / p.speedup(plain):.2f}",
            p.work.get("newton_iterations"), f"{_off_elastica(curves[p.name]):.1e}", precision.mark(p),
        ]
        for name, part in series.items()
        for n, p in part.items()
    ]  # fmt: skip
    headers = ["model", "elements", "relative error", "time [ms]", "time/plain", "Newton steps", "off elastica", "front"]
    return Table(headers, rows, "Post-buckling of the pinned strip, 20 end shortenings", notes)


def figure(result: StudyResult) -> Figure:
    """Error over time, with the box that was asked for."""
    p = result.of(Parameters)
    s = result.signals
    fig, ax = subplots(height=95)
    precision.draw(ax, s, SERIES, "elements", setting=".elements")
    time = 1e3 * TIME_BAR * s["plain.wall_s"][list(s["plain.elements"]).index(p.plain_elements)]
    ax.axhline(ERROR_BAR, xmax=1, color="0.5", linestyle=":", linewidth=0.8)
    ax.axvline(time, color="0.5", linestyle=":", linewidth=0.8)
    ax.text(time, ax.get_ylim()[1], f" {TIME_BAR:g} of plain x {p.plain_elements}", color="0.4", va="top", fontsize=8)
    ax.text(
        ax.get_xlim()[1], ERROR_BAR, f"{ERROR_BAR:.0e}".replace("e-0", "e-"), color="0.4", ha="right", va="bottom", fontsize=8
    )
    ax.set(ylabel="largest relative error of the load")
    return fig
