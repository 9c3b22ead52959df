"""Does a flexible rocker buffer? Each claim of the paper on rattling joints, held against means of many runs.

Four joints with clearance at 300 r/min, rigid rocker against one with its lowest bending and axial modes, over clearances, both
bending planes of the 20 mm x 5 mm bars and both readings of c_max. `studies/buffering_measures.py` has the numbers each
claim is judged by and the rule. The runs are those of the compiled solver (`studies/rattling/turns.py`).

Then the same in many worlds, each with one value of everything that the paper leaves open (`studies/rattling/worlds.py`): the
share of them in which a claim holds, and which assumption decides it. `worlds_store` keeps them, so that a run can go on.

Without worlds it takes a minute and a half on two cores, 256 worlds a quarter of an hour more; the table of
docs/buffering-claims.md is that of `--members 12 --cycles 9`, 108 turns of each rocker in each case. Forces are judged by their
size; the ratio of their x-components, which the paper draws, is the same within 3 %. The mid-point's accelerations rise with
every mode that is added (`modes`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from ..kit.parameters import integer, quantities, quantity, text
from ..kit.report import QUIET, Metric, Progress, StudyResult, Table, judged
from ..kit.style import COLOURS, Axes, Figure, plain_ticks, subplots
from ..sweeping.sweep import sweep
from . import buffering_measures as measures
from . import world_shares
from .assumptions import BODIES, ModalAssumptions
from .bars import flexible
from .buffering_measures import CLAIMS, VERDICTS, ClaimCase, EnsembleParameters
from .turns import BALANCED, Ensemble, period
from .worlds import drawn

ROCKERS = ("rigid", "flexible")
OVER_IDEAL = ("acceleration", "force", "smooth_acceleration")
"""Families whose number ideal joints have, too; the others are measured from ideal joints."""
SHORT = {
    "velocity": "velocity\nfluctuation", "acceleration": "acceleration\npeak", "force": "contact force\npeak",
    "smooth_velocity": "velocity\nroughness", "smooth_acceleration": "acceleration\nroughness",
}  # fmt: skip
TINT = dict(zip(measures.WHERE, COLOURS, strict=False))


@dataclass(frozen=True)
class Parameters(EnsembleParameters, ModalAssumptions):
    """Parameters of the study."""

    clearance: tuple[float, ...] = quantities((5e-5, 1e-4, 2.5e-4, 5e-4), "m", 1e-6, 2e-3, "radial clearances", "joints")
    worlds: int = integer(256, 0, 2**16, "worlds drawn over all that is left open; 0: none", "worlds")
    world_members: int = integer(5, 2, 2000, "runs of each rocker in each world", "worlds")
    world_cycles: int = integer(2, 1, 10_000, "turns measured of each run", "worlds")
    world_settle: int = integer(1, 0, 10_000, "turns before that", "worlds")
    world_tolerance: float = quantity(1e-6, "1", 1e-12, 1e-4, "of a step, of the longest bar and a radian", "worlds")
    worlds_store: str = text("", "file that keeps the worlds that have run, to go on from; none: memory only", "worlds")


def cases(p: Parameters) -> list[ClaimCase]:
    """All of them."""
    return [ClaimCase(*each) for each in product(p.damping_unit, p.in_plane_depth, p.clearance)]


def run(p: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Run rigid and flexible rocker in every case, and judge."""
    every = cases(p)
    metrics: dict[str, Metric] = {}
    wrong: list[str] = []
    ideal = {depth: _ideal(p, depth) for depth in p.in_plane_depth}
    for case, rocker in progress(list(product(every, ROCKERS)), label="ensembles"):
        found = _measured(p, case, rocker)
        wrong += measures.trouble(f"{case.name}.{rocker}", found)
        metrics |= measures.numbers(f"{case.name}.{rocker}", found)
        metrics[f"{case.name}.{rocker}.penetration"] = Metric(float(found.turns["depth"].max()), "m")
        if rocker == "rigid":
            rigid = found
        else:
            metrics |= _compared(p, case, rigid, found, ideal[case.depth], len(every))
    verdicts = {claim.name: [_verdict(metrics, case, claim.name) for case in every] for claim in CLAIMS}
    for name, found_out in verdicts.items():
        metrics |= {f"{name}.{verdict.replace(' ', '_')}": Metric(found_out.count(verdict), "1") for verdict in VERDICTS}
    tables = [_table(metrics, p, unit, depth, wrong) for unit, depth in product(p.damping_unit, p.in_plane_depth)]
    over_worlds = _over_worlds(p, progress)
    return StudyResult(
        parameters=p,
        **judged(wrong),
        metrics={**metrics, **over_worlds.metrics},
        signals=over_worlds.signals,
        work={"turns": len(every) * len(ROCKERS) * p.members * (p.settle + p.cycles)},
        tables=[*tables, _summary(metrics, p, wrong), *over_worlds.tables],
    )


def _over_worlds(p: Parameters, progress: Progress) -> StudyResult:
    """Sweep the worlds and read them."""
    if not p.worlds:
        return StudyResult(parameters=p)
    numerics = {"members": p.world_members, "cycles": p.world_cycles, "settle": p.world_settle, "tolerance": p.world_tolerance}
    worlds = drawn(p.worlds, p.seed, workers=1, **numerics)
    store = Path(p.worlds_store) if p.worlds_store else None
    rows = sweep("buffering-world", worlds.cases, workers=p.workers, store=store, progress=progress)
    ratios, errors = world_shares.read(rows)
    found = world_shares.shares(worlds, ratios, errors, p.margin)
    shown = world_shares.table(found, p.margin, p.worlds, p.world_members, p.world_cycles)
    signals = {"worlds.codes": worlds.codes, "worlds.ratio": ratios, "worlds.error": errors}
    metrics = world_shares.metrics(found) | {"worlds.seconds": Metric(sum(row.wall_s for row in rows), "s")}
    return StudyResult(parameters=p, metrics=metrics, signals=signals, tables=[shown])


def _measured(p: Parameters, case: ClaimCase, rocker: str) -> Ensemble:
    """Run one rocker; the two have other seeds, so their errors are independent."""
    if rocker == "rigid":
        return p.ensemble(p.bars(*case))
    return p.ensemble(p.bars(*case, flexible(p, case.depth)), batch=1)


def _ideal(p: Parameters, depth: float) -> Mapping[str, Any]:
    """Measures of one turn with ideal joints, as those of an ensemble."""
    made = p.bars(p.damping_unit[0], depth, p.clearance[0])
    turn = measures.ideal_turn(made)
    a = np.stack([turn.at(f"{link}.ax", measures.TURN * period(made)) for link in measures.LINKS], axis=1)
    force = [np.hypot(*(turn[f"{joint}.{'-'.join(pair)}.f{x}"] for x in "xy")).max() for joint, pair in BODIES.items()]
    peak = [np.abs(turn[f"{link}.ax"]).max() for link in measures.LINKS]
    return {"force": np.array(force), "peak_a": np.array(peak), "travel_a": np.abs(np.diff(a, axis=0)).sum(axis=0)}


def _compared(p: Parameters, case: ClaimCase, rigid: Ensemble, bent: Ensemble, ideal: Any, count: int) -> dict[str, Metric]:
    """Ratios of the two, their verdicts; and what clearance does with the rigid rocker, over ideal joints."""
    numbers = {}
    for claim in CLAIMS:
        found, name = measures.ratio(measures.mean(bent, claim), measures.mean(rigid, claim)), f"{case.name}.{claim.name}"
        numbers[f"{name}.ratio"] = found.metric
        numbers[f"{name}.verdict"] = Metric(VERDICTS[found.verdict(p.level / (len(CLAIMS) * count), p.margin)], "1")
        if claim.family in OVER_IDEAL:
            over = measures.mean(rigid, claim).value / float(ideal[claim.measure][claim.column])
            numbers[f"{name}.play_over_ideal"] = Metric(over, "1")
    return numbers


def _verdict(metrics: Mapping[str, Metric], case: ClaimCase, claim: str) -> str:
    """In words."""
    number = metrics[f"{case.name}.{claim}.verdict"].value
    return next(verdict for verdict, known in VERDICTS.items() if known == number)


def _marked(case: ClaimCase, wrong: Sequence[str]) -> bool:
    """True if a rocker of this case is suspect."""
    return any(line.startswith(f"{case.name}.") for line in wrong)


def _table(metrics: Mapping[str, Metric], p: Parameters, unit: str, depth: float, wrong: Sequence[str]) -> Table:
    """One row a claim, one column a clearance: ratio, its standard error, verdict."""
    here = [ClaimCase(unit, depth, gap) for gap in p.clearance]
    rows = []
    for claim in CLAIMS:
        row = [claim.text]
        for case in here:
            shown, mark = metrics[f"{case.name}.{claim.name}.ratio"].shown(".3f", ".3f"), "*" if _marked(case, wrong) else ""
            row.append(f"{shown} {_verdict(metrics, case, claim.name)}{mark}")
        rows.append(row)
    title = f"flexible/rigid, ± standard error; c_max = 253 {unit}, {1e3 * depth:g} mm in the plane"
    suspect = f"* suspect: energy balance above {BALANCED:g}, or a pin deeper in than the clearance"
    notes = suspect if "*" in str(rows) else ""
    return Table(["claim", *(f"c = {1e3 * gap:g} mm" for gap in p.clearance)], rows, title, notes)


def _summary(metrics: Mapping[str, Metric], p: Parameters, wrong: Sequence[str]) -> Table:
    """One row a claim: how many cases hold / do not / are undecided, by the reading of c_max, and what it comes to."""
    sound = [case for case in cases(p) if not _marked(case, wrong)]
    rows = []
    for claim in CLAIMS:
        row, every = [claim.text], [_verdict(metrics, case, claim.name) for case in sound]
        for unit in p.damping_unit:
            mine = [_verdict(metrics, case, claim.name) for case in sound if case.unit == unit]
            row.append(" / ".join(str(mine.count(verdict)) for verdict in ("holds", "does not", "undecided")))
        rows.append([*row, measures.overall(every)])
    play = {
        family: [m.value for name, m in metrics.items() if name.endswith("play_over_ideal") and f".{family}." in name]
        for family in OVER_IDEAL
    }
    spans = ", ".join(f"{SHORT[f]} {min(v):.3g} to {max(v):.3g}".replace("\n", " ") for f, v in play.items())
    notes = (
        f"A reduction counts from {100 * p.margin:g} %; the chance that any verdict is wrong is below {100 * p.level:g} %. "
        f"{p.members} runs of {p.cycles} turns a rocker and case{'; suspect cases left out' if wrong else ''}.\n"
        f"Clearance itself, rigid rocker, times what ideal joints have: {spans}.\n{p.stated()}."
    )
    heads = [f"{unit}: holds / does not / undecided" for unit in p.damping_unit]
    return Table(["claim", *heads, "overall"], rows, "What the claims come to", notes)


def figure(result: StudyResult) -> dict[str, Figure]:
    """Ratios over the clearance; and over the worlds, where there are any."""
    drawings = {"figure": _over_clearance(result)}
    if "worlds.ratio" in result.signals:
        p = result.of(Parameters)
        worlds, signals = drawn(p.worlds, p.seed), result.signals
        found = world_shares.shares(worlds, signals["worlds.ratio"], signals["worlds.error"], p.margin)
        drawings["worlds"] = world_shares.figure(found, signals["worlds.ratio"])
    return drawings


def _over_clearance(result: StudyResult) -> Figure:
    """Ratios, one row a reading and plane, one column a kind of claim."""
    p = result.of(Parameters)
    planes = list(product(p.damping_unit, p.in_plane_depth))
    grid = {"squeeze": False, "sharex": True, "sharey": "col"}
    fig, axes = subplots(len(planes), len(measures.FAMILIES), height=28 + 38 * len(planes), **grid)
    for line, (unit, depth) in zip(axes, planes, strict=True):
        for ax, family in zip(line, measures.FAMILIES, strict=True):
            ax.axhspan(1 - p.margin, 1, color="#eeeeee", zorder=0)
            ax.axhline(1, color="#999999", linewidth=0.8, zorder=1)
            claims = [claim for claim in CLAIMS if claim.family == family]
            for i, claim in enumerate(claims):
                _draw(ax, result.metrics, [ClaimCase(unit, depth, gap) for gap in p.clearance], claim, 0.06 * (i - 1))
        line[0].set_ylabel(f"{unit}, {1e3 * depth:g} mm\nflexible/rigid")
    for ax, family in zip(axes[0], measures.FAMILIES, strict=True):
        ax.set_title(SHORT[family], fontsize=8)
    for ax in axes[-1]:
        ax.set(xscale="log")
        ticks = [1e3 * gap for gap in p.clearance]
        ax.set_xticks(ticks, [f"{tick:g}".removeprefix("0") for tick in ticks])
        ax.set_xticks([], minor=True)
    for ax in axes[0]:
        ax.set_yscale("log")
        plain_ticks(ax.yaxis)
    fig.supxlabel("clearance c [mm]", fontsize=9)
    _legend(fig)
    return fig


def _draw(ax: Axes, metrics: Mapping[str, Metric], here: Sequence[ClaimCase], claim: Any, shift: float) -> None:
    """One claim's ratios with bars of two standard errors; the marks tell the verdicts."""
    found = [metrics[f"{case.name}.{claim.name}.ratio"] for case in here]
    gap = np.array([1e3 * case.gap for case in here]) * np.exp(shift)
    value, error = np.array([m.value for m in found]), np.array([2 * m.value * (m.error or 0) for m in found])
    colour = TINT[claim.place]
    ax.errorbar(gap, value, error, color=colour, linewidth=0.7, elinewidth=0.9, capsize=1.5)
    for x, y, case in zip(gap, value, here, strict=True):
        ax.plot(x, y, **_mark(_verdict(metrics, case, claim.name), colour))


def _mark(verdict: str, colour: str) -> dict[str, Any]:
    """Filled where a claim holds, open where it does not, a cross where that is undecided."""
    marker = {"holds": "o", "does not": "o", "undecided": "x"}[verdict]
    return {"marker": marker, "color": colour, "markerfacecolor": "white" if verdict == "does not" else colour, "linestyle": ""}


def _legend(fig: Figure) -> None:
    from matplotlib.lines import Line2D

    lines = [Line2D([], [], color=TINT[place], label=measures.WHERE[place]) for place in measures.WHERE]
    marks = [Line2D([], [], **_mark(verdict, "#555555"), label=verdict) for verdict in ("holds", "does not", "undecided")]
    fig.legend(handles=[*lines, *marks], loc="outside upper center", ncols=4)
