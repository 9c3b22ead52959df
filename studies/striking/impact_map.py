"""The striking coupler over speed, bow, stop stiffness and slider mass, in dimensionless numbers: the regime of every strike.

Every point of the grid is one strike of the beam of `slider-crank`, read as the strip's largest compression and the stop's
largest force, both over the Euler load. Beside it stand two theories that know nothing of the simulation: a strip of sine modes
(`sine_strip`), and closed forms (`impact_numbers`) for the compression and for the borders of late buckling, Euler plateau,
sagging strip, and a strip that swings before its slider arrives, or keeps it away.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product
from math import isfinite, nan
from typing import Any, NamedTuple

import numpy as np

from ..kit.parameters import integer, quantities, quantity
from ..kit.report import QUIET, Metric, Progress, StudyResult, metrics_table, status_of
from ..kit.statistics import exponent
from ..kit.style import COLOURS, Figure, subplots
from ..sweeping.sweep import sweep
from .assumptions import StrikeAssumptions
from .impact_models import BUCKLED_FROM
from .impact_numbers import REGIMES, ImpactNumbers, regime
from .sine_strip import SineStrip
from .slider_crank import Parameters as Case

UNTIL = np.radians(190.0)
"""Crank angle at which a run ends [rad]: the first impact of every regime is over."""
SINE_TO = 0.05
"""Largest median difference of the peaks of sine strip and simulation; beyond it the study is suspect."""
CLOSED_TO = 0.35
"""Largest median difference of the peaks of closed form and simulation; beyond it the study is suspect."""
SHAPES = ("o", "s", "^", "x")


@dataclass(frozen=True)
class Parameters(StrikeAssumptions):
    """Parameters of the study."""

    speeds: tuple[float, ...] = quantities((0.3, 1.25, 4.0, 10.0), "rad/s", 0.1, 60, "speeds of the crank", "grid")
    bows: tuple[float, ...] = quantities((1e-4, 1e-3, 0.01, 0.03), "1", -0.05, 0.05, "bows of the strip over its length", "grid")
    stiffnesses: tuple[float, ...] = quantities((500, 7.2e3, 1e5), "N/m", 1e2, 1e8, "stiffnesses of the stop", "grid")
    masses: tuple[float, ...] = quantities((0.05, 0.5), "kg", 0.01, 10, "masses of the slider", "grid")
    thickness: float = quantity(3e-4, "m", 5e-5, 1e-3, "thickness of the strip", "strip")
    damping: float = quantity(0.05, "1", 0, 1, "damping ratio of the strip's first bending mode", "strip")
    friction: float = quantity(0.02, "1", 0, 0.9, "Coulomb coefficient of the slider by its weight", "slider and stop")
    restitution: float = quantity(0.8, "1", 0.1, 1, "restitution of the stop", "slider and stop")
    elements: int = integer(8, 2, 64, "elements of the beam", "numerics")
    workers: int = integer(0, 0, 256, "processes, 0 for none but this", "numerics")

    def cases(self) -> list[Case]:
        """Make one strike for each mass, stiffness, bow and speed, the last running fastest."""
        given = self.share(Case) | {"models": ("beam",), "until": UNTIL}
        return [
            Case(mass=mass, stop_stiffness=stiffness, imperfection=bow, speed=speed, **given)
            for mass, stiffness, bow, speed in product(self.masses, self.stiffnesses, self.bows, self.speeds)
        ]


class MapPoint(NamedTuple):
    """One strike: simulated, by sine modes, by closed form; forces over the Euler load."""

    case: Case
    peak: float
    compression: float
    early: float
    sine: float
    numbers: ImpactNumbers
    failure: str

    @property
    def regime(self) -> str:
        """Name of the regime by the simulation."""
        doubled = 0.75 * (np.pi * self.case.imperfection) ** 2  # what a bow shortens the strip by as it doubles
        return regime(self.compression, self.early > BUCKLED_FROM + doubled or not isfinite(self.peak))

    @classmethod
    def of(cls, case: Case, row: Any) -> MapPoint:
        """Read a row of the sweep, and put both theories beside it."""
        numbers = ImpactNumbers.of(SineStrip(case))
        peak, compression, early = (row.value(f"beam.{name}") for name in ("impact_peak", "impact_push", "early_shortening"))
        failure = "" if row.status in ("OK", "SUSPECT") else f"{case.speed:g} rad/s, bow {case.imperfection:g}: {row.status}"
        euler = numbers.euler
        return cls(case, (peak or nan) / euler, compression / euler, early, SineStrip(case).peak() / euler, numbers, failure)


def run(p: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Strike everywhere on the grid, by simulation and by both theories."""
    cases = p.cases()
    rows = sweep("slider-crank", cases, workers=p.workers, progress=progress)
    points = [MapPoint.of(case, row) for case, row in zip(cases, progress(rows, label="theory"), strict=True)]
    metrics = _metrics(points)
    wrong = [point.failure for point in points if point.failure]
    for name, bar in (("sine", SINE_TO), ("closed", CLOSED_TO)):
        if not abs(metrics[f"{name}.median"].value - 1) <= bar:
            wrong.append(f"{name.upper()}: median peak {metrics[f'{name}.median'].value:.3g} of the simulation's")
    columns = {
        **{name: [getattr(x.numbers, name) for x in points] for name in ("rate", "strength", "way")},
        **{name: [getattr(x, name) for x in points] for name in ("peak", "compression", "sine")},
        "bow": [x.numbers.seeds[0] for x in points],
        "closed": [x.numbers.peak() for x in points],
        "closed.compression": [x.numbers.compression() for x in points],
        "regime": [REGIMES.index(x.regime) for x in points],
    }
    return StudyResult(
        parameters=p,
        **status_of(wrong),
        metrics=metrics,
        signals={name: np.array(column) for name, column in columns.items()},
        work={"strikes": len(points)},
        tables=[replace(metrics_table(metrics), notes=f"sine, closed: peaks over those of the simulation.\n{p.describe()}.")],
    )


def _metrics(points: list[MapPoint]) -> dict[str, Metric]:
    """Compute how far the theories' peaks are off where the strip is whole on arrival, how often they name the regime; powers."""
    met = [x for x in points if x.regime != "swing"]
    found: dict[str, Metric] = {}
    for name, theory in (("sine", [x.sine for x in met]), ("closed", [x.numbers.peak() for x in met])):
        ratio = np.array(theory) / np.array([x.peak for x in met]) if met else np.array([nan])
        for what, value in (("median", np.median(ratio)), ("low", ratio.min()), ("high", ratio.max())):
            found[f"{name}.{what}"] = Metric(float(value), "1")
        found[f"{name}.within_20"] = Metric(float(np.mean(np.abs(ratio - 1) < 0.2)), "1")
    found["regimes.agree"] = Metric(float(np.mean([x.regime == x.numbers.regime() for x in points])), "1")
    for name in REGIMES:
        found[f"regime.{name.replace(' ', '_')}"] = Metric(float(sum(x.regime == name for x in points)), "1")
    late = [x for x in points if x.regime == "late buckling" and x.numbers.seeds[0] < 5]
    if len({x.case.speed for x in late}) > 1:
        slope = exponent([x.numbers.rate for x in late], [x.compression for x in late])
        found["late.power_of_rate"] = Metric(slope, "1", exact=0.5)
    return found


def figure(result: StudyResult) -> Figure:
    """Draw compression over rate, by closed form as crosses, with the slope 1/2; and closed against simulated peaks."""
    fig, (over, parity) = subplots(2, 1, height=170)
    s = result.signals
    for k, name in enumerate(REGIMES):
        own, look = s["regime"] == k, {"color": COLOURS[k], "markersize": 4, "linestyle": ""}
        over.loglog(s["rate"][own], s["compression"][own], marker=SHAPES[k], label=name, **look)
        over.loglog(s["rate"][own], s["closed.compression"][own], marker="+", **look)
        parity.loglog(s["peak"][own], s["closed"][own], marker=SHAPES[k], label=name, **look)
    x, ends = np.sort(s["rate"]), (np.nanmin(s["peak"]), np.nanmax(s["peak"]))
    over.loglog(x, 8 * np.sqrt(x), "k--", linewidth=0.8, label="slope 1/2")
    parity.loglog(ends, ends, "k-", linewidth=0.8)
    over.set(xlabel="rate $s$ of compression [1]", ylabel="compression / Euler load [1]")
    parity.set(xlabel="simulated peak / Euler load [1]", ylabel="closed form [1]")
    for ax in (over, parity):
        ax.legend(fontsize=7)
    return fig
