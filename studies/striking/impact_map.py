"""The striking coupler over speed, bow, stop stiffness and slider mass, in dimensionless numbers: which regime a strike is in.

Every point of the grid is one simulated strike of the beam (`strike`), read as the strip's largest compression and the stop's
largest force, both over the Euler load. Beside it stand two theories that know nothing of the simulation: a strip of sine modes
(`studies.striking.sine_strip`), and closed forms for the compression and for the borders (`studies.striking.impact_numbers`):
late buckling, Euler plateau, sagging strip, and a strip that swings before its slider arrives, or keeps it away.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product
from math import isfinite, nan
from typing import Any, NamedTuple

import numpy as np

from ..kit.parameters import integer, quantities, quantity
from ..kit.report import QUIET, Metric, Progress, StudyResult, Table, judged
from ..kit.statistics import exponent
from ..kit.style import COLOURS, Axes, Figure, subplots
from ..sweeping.sweep import sweep
from . import strike
from .assumptions import StrikeAssumptions
from .impact_models import BUCKLED_FROM
from .impact_numbers import LATE, REGIMES, SAGS, ImpactNumbers, regime
from .sine_strip import SineStrike, SineStrip

SINE_TO, CLOSED_TO = 0.05, 0.35
"""Median difference of the sine strip's and the closed form's peak from the simulation beyond which the study is suspect."""
SHAPES = dict(zip(REGIMES, ("o", "s", "^", "x"), strict=True))


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

    def cases(self) -> list[strike.Parameters]:
        """One strike for each mass, stiffness, bow and speed, the last running fastest."""
        given = self.shared(strike.Parameters)
        return [
            strike.Parameters(mass=mass, stop_stiffness=stiffness, imperfection=bow, speed=speed, **given)
            for mass, stiffness, bow, speed in product(self.masses, self.stiffnesses, self.bows, self.speeds)
        ]


def sine_strip(p: strike.Parameters) -> SineStrip:
    """The same strike for the theories."""
    return SineStrip(
        p.section, p.damping, p.imperfection, p.mass, p.friction_force, p.stop_stiffness, p.restitution, p.speed, p.pull
    )


class MapPoint(NamedTuple):
    """One strike: simulated, by sine modes, by closed form; forces over the Euler load."""

    case: strike.Parameters
    peak: float
    compression: float
    early: float
    sine: SineStrike
    numbers: ImpactNumbers
    status: str

    @property
    def regime(self) -> str:
        """By the simulation."""
        doubled = 0.75 * (np.pi * self.case.imperfection) ** 2  # what a bow shortens the strip by as it doubles
        return regime(self.compression, self.early > BUCKLED_FROM + doubled or not isfinite(self.peak))


def run(p: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Strike everywhere on the grid, by simulation and by both theories."""
    cases = p.cases()
    rows = sweep("strike", cases, workers=p.workers, progress=progress)
    points = [_point(case, row) for case, row in zip(cases, progress(rows, label="theory"), strict=True)]
    metrics = _metrics(points)
    wrong = [
        f"{x.case.speed:g} rad/s, bow {x.case.imperfection:g}: {x.status}" for x in points if x.status not in ("OK", "SUSPECT")
    ]
    for name, bar in (("sine", SINE_TO), ("closed", CLOSED_TO)):
        if not abs(metrics[f"{name}.median"].value - 1) <= bar:
            wrong.append(f"{name.upper()}: median peak {metrics[f'{name}.median'].value:.3g} of the simulation's")
    numbers = {name: np.array([getattr(x.numbers, name) for x in points]) for name in ("rate", "bow", "strength", "way")}
    return StudyResult(
        parameters=p,
        **judged(wrong),
        metrics=metrics,
        signals={
            **numbers,
            "peak": np.array([x.peak for x in points]), "compression": np.array([x.compression for x in points]),
            "sine": np.array([x.sine.peak for x in points]), "closed": np.array([x.numbers.peak() for x in points]),
            "closed.compression": np.array([x.numbers.compression() for x in points]),
            "regime": np.array([REGIMES.index(x.regime) for x in points]),
        },
        work={"strikes": len(points)},
        tables=[_regimes_table(points), _table(p, points)],
    )  # fmt: skip


def _point(case: strike.Parameters, row: Any) -> MapPoint:
    strip = sine_strip(case)
    numbers, found = ImpactNumbers.of(strip), strip.strike()
    euler = numbers.euler
    peak, compression = (row.value(name) / euler for name in ("peak", "compression"))
    sine = SineStrike(found.peak / euler, found.compression / euler, found.bent)
    return MapPoint(case, peak, compression, row.value("early"), sine, numbers, row.status)


def _metrics(points: Sequence[MapPoint]) -> dict[str, Metric]:
    """How far the theories' peaks are off where the strip is whole on arrival, how often they name the regime, and powers."""
    met = [x for x in points if x.regime != "swing"]
    found: dict[str, Metric] = {}
    for name, theory in (("sine", [x.sine.peak for x in met]), ("closed", [x.numbers.peak() for x in met])):
        ratio = np.array(theory) / np.array([x.peak for x in met]) if met else np.array([nan])
        for what, value in (("median", np.median(ratio)), ("low", ratio.min()), ("high", ratio.max())):
            found[f"{name}.{what}"] = Metric(float(value), "1")
        found[f"{name}.within_20"] = Metric(float(np.mean(np.abs(ratio - 1) < 0.2)), "1")
    found["regimes.agree"] = Metric(float(np.mean([x.regime == x.numbers.regime() for x in points])), "1")
    for name in REGIMES:
        found[f"regime.{name.replace(' ', '_')}"] = Metric(float(sum(x.regime == name for x in points)), "1")
    late = [x for x in points if x.regime == "late buckling" and x.numbers.bow < 5]
    if len({x.case.speed for x in late}) > 1:
        slope = exponent([x.numbers.rate for x in late], [x.compression for x in late])
        found["late.power_of_rate"] = Metric(slope, "1", exact=0.5)
    return found


def _regimes_table(points: Sequence[MapPoint]) -> Table:
    borders = {
        "late buckling": f"P > {LATE:g}: the least of (2) over all modes",
        "plateau": "between",
        "sagging": f"P < {SAGS:g}: bow against the shortening asked for, (3)",
        "swing": "W > 1: compression on the way over the Euler load",
    }
    rows = []
    for name in REGIMES:
        own = [x for x in points if x.regime == name]
        forces = [x.peak for x in own if isfinite(x.peak)]
        told = f"{min(forces):.3g} to {max(forces):.3g}" if forces else "none"
        agreed = sum(x.numbers.regime() == name for x in own)
        rows.append([name, borders[name], len(own), agreed, told])
    notes = "P: largest compression of the strip over its Euler load. Equations: buckler.studies.striking.impact_numbers."
    return Table(["regime", "closed border", "strikes", "named by the border", "peak over Euler load"], rows, "Regimes", notes)


def _table(p: Parameters, points: Sequence[MapPoint]) -> Table:
    rows = [
        [
            f"{x.case.mass:g}", f"{x.case.stop_stiffness:g}", f"{x.case.imperfection:g}", f"{x.case.speed:g}",
            f"{x.numbers.rate:.3g}", f"{x.numbers.bow:.3g}", f"{x.numbers.strength:.3g}", f"{x.numbers.way:.2f}",
            f"{x.compression:.3g}", f"{x.numbers.compression():.3g}",
            f"{x.peak:.3g}", f"{x.sine.peak:.3g}", f"{x.numbers.peak():.3g}", x.regime,
        ]
        for x in points
    ]  # fmt: skip
    headers = ["m [kg]", "K [N/m]", "bow", "[rad/s]", "s", "b", "S", "W", "P", "P closed", "F", "F sine", "F closed", "regime"]
    notes = f"P, F: largest compression of the strip and force on the stop over its Euler load.\n{p.stated()}."
    return Table(headers, rows, "Strikes", notes)


def figure(result: StudyResult) -> Figure:
    """Compression over rate; regimes over rate and bow, and over the way; simulated against closed peaks."""
    p = result.of(Parameters)
    s, fig_axes = result.signals, subplots(2, 2, height=150)
    fig, ((over, plane), (parity, way)) = fig_axes
    shape = len(p.masses), len(p.stiffnesses), len(p.bows), len(p.speeds)
    bows = np.broadcast_to(np.arange(len(p.bows))[None, None, :, None], shape).ravel()
    met = s["regime"] != REGIMES.index("swing")
    for k, bow in enumerate(p.bows):
        own = met & (bows == k)
        over.loglog(s["rate"][own], s["compression"][own], "o", color=COLOURS[k], markersize=3, label=f"bow {bow:g} L")
        over.loglog(*_closed(p, bow), color=COLOURS[k], linewidth=0.8)
    x = np.array(over.get_xlim())
    over.loglog(x, 8 * np.sqrt(x), "k--", linewidth=0.8, label="slope 1/2")
    over.set(xlabel="rate $s$ of compression [1]", ylabel="compression / Euler load [1]")
    over.legend(fontsize=7, ncols=2)
    for k, name in enumerate(REGIMES):
        own = s["regime"] == k
        style: dict[str, Any] = {"color": COLOURS[k], "markersize": 3.5, "linestyle": "", "marker": SHAPES[name]}
        plane.loglog(s["rate"][own], s["bow"][own], label=name, **style)
        parity.loglog(s["peak"][own], s["closed"][own], label=name, **style)
        way.loglog(s["way"][own], s["strength"][own], label=name, **style)
    _borders(plane, p)
    plane.set(xlabel="rate $s$ of compression [1]", ylabel="deflection / gyration radius [1]")
    plane.legend(fontsize=7, ncols=2, loc="lower center", bbox_to_anchor=(0.5, 1.0))  # there is no room within
    for ax in (parity, way):
        ax.legend(fontsize=7)
    ends = np.nanmin(s["peak"]), np.nanmax(s["peak"])
    parity.loglog(ends, ends, "k-", linewidth=0.8)
    parity.set(xlabel="simulated peak / Euler load [1]", ylabel="closed form [1]")
    way.axvline(1.0, color="#000000", linewidth=0.8)
    way.set(xlabel="compression on the way $W$ [1]", ylabel="strength of the slider $S$ [1]")
    return fig


def _middle(p: Parameters, **changes: object) -> strike.Parameters:
    """The strike in the middle of the grid."""
    lists = {"mass": p.masses, "stop_stiffness": p.stiffnesses, "speed": p.speeds}
    middle = {name: values[len(values) // 2] for name, values in lists.items()}
    return strike.Parameters(**p.shared(strike.Parameters) | middle | changes)


def _closed(p: Parameters, bow: float) -> tuple[list[float], list[float]]:
    """Rate and compression by the closed form over the stiffness of the stop, slider and speed from the middle of the grid."""
    stiffnesses = np.geomspace(min(p.stiffnesses) / 2, 2 * max(p.stiffnesses), 60)
    found = [ImpactNumbers.of(sine_strip(_middle(p, imperfection=bow, stop_stiffness=float(k)))) for k in stiffnesses]
    return [x.rate for x in found], [x.compression() for x in found]


def _borders(ax: Axes, p: Parameters) -> None:
    """Closed border of late buckling over bow, for the middle mass and stiffness."""
    base = ImpactNumbers.of(sine_strip(_middle(p)))
    (least, most), (slow, fast) = ax.get_ylim(), ax.get_xlim()
    bows, rates = np.geomspace(least, most, 40), np.geomspace(slow, fast, 200)
    late = np.array([[replace(base, rate=s, seeds=np.array([b])).late() > LATE for s in rates] for b in bows])
    border = np.where(late.any(axis=1), rates[late.argmax(axis=1)], nan)
    ax.plot(border, bows, "k-", linewidth=0.8)
