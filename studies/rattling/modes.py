"""Which modes of the rocker matter? Chosen sets of a solid's modes, against the rigid rocker and the fullest set.

The paper gives its rocker "modes four, five and six" and does not say how they are counted. `mbs.modal` says what each number
is: of the free body's modes, the first six of which are rigid; of its flexible modes in space; of those in the plane; or
of its bending modes. The compiled solver runs the crank-rocker with each set, and one short run on the engine, with the
same modes, is held against it before chaos parts them.

The default takes about two minutes; the table of docs/buffering-claims.md is that of `--members 12 --cycles 8`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from buckler import mbs
from buckler.mbs import Modal
from buckler.mbs.modal import FreeModes

from ..kit.parameters import choices, integer, quantity
from ..kit.report import QUIET, Metric, Progress, StudyResult, Table, judged
from ..kit.style import COLOURS, Figure, plain_ticks, subplots
from . import buffering_measures as measures
from .buffering_measures import CLAIMS, Claim, ClaimCase, EnsembleParameters, Ratio
from .mode_sets import BENDING, MESH, NAMES, SETS, beam_frequencies, counted, damped, flexibility, section
from .turns import Ensemble, solver

LISTED = 12
"""Flexible modes in the printed table."""
BASE, BEST = "none", "bending_1_8_axial_1_4"
"""What the others are held against: the rigid rocker and the fullest set."""
SHOWN = {
    "force.coupler_rocker": "force B", "force.rocker_frame": "force C", "acceleration.coupler": "peak a coupler",
    "acceleration.rocker": "peak a rocker", "acceleration.rocker_middle": "peak a mid-point", "velocity.coupler": "v coupler",
}  # fmt: skip
"""The claims in the printed table and the figure; metrics.json has all."""
AGREES, DIFFERS, UNDECIDED = "=", "≠", "?"
MARKS = {AGREES: 1.0, UNDECIDED: 0.0, DIFFERS: -1.0}
"""How a set compares with the fullest one, and as the number in metrics.json."""
MOVED = ("coupler", "rocker")
ALIKE = 1e-3
"""Distance of the two solvers, over the clearance, beyond which the study is suspect."""


@dataclass(frozen=True)
class Parameters(EnsembleParameters):
    """Parameters of the study."""

    sets: tuple[str, ...] = choices(tuple(SETS)[:-1], tuple(SETS), "sets of modes; the first and the fullest always run", "bars")
    clearance: float = quantity(2.5e-4, "m", 1e-6, 2e-3, "radial clearance", "joints")
    members: int = integer(6, 2, 10_000, "runs of each case; their scatter gives the standard error", "statistics")
    cycles: int = integer(2, 1, 10_000, "turns measured of each run", "statistics")
    settle: int = integer(1, 0, 10_000, "turns before that", "statistics")
    cross_check: float = quantity(5e-3, "s", 0, 0.05, "length of the run on the engine; 0: none", "numerics")

    def check(self) -> None:
        """The kind of modes is one of the sets here."""
        super().check()
        if self.modes_of != "free":
            raise ValueError(f"modes_of = {self.modes_of}: sets are free modes here; add craig_bampton to sets")

    @property
    def chosen(self) -> list[str]:
        """Sets to run, in order."""
        return [name for name in SETS if name in (*self.sets, BASE, BEST)]


def cases(p: Parameters) -> list[ClaimCase]:
    """All of them."""
    return [ClaimCase(*each) for each in product(p.damping_unit, p.in_plane_depth)]


def run(p: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Count the modes, run every set in every case, compare; run one on the engine."""
    metrics = {name: metric for depth in p.in_plane_depth for name, metric in _counted_metrics(depth).items()}
    found: dict[tuple[ClaimCase, str], Ensemble] = {}
    wrong: list[str] = []
    for case, name in progress(list(product(cases(p), p.chosen)), label="ensembles"):
        modes = flexibility(case.depth, name, p.rocker_damping)
        if modes is not None:
            modes = damped(modes, p.modal_damping, p.rocker_damping)
        made = p.bars(case.unit, case.depth, p.clearance, modes)
        one = found[case, name] = p.ensemble(made, batch=list(SETS).index(name))
        wrong += measures.trouble(f"{case.name}.{name}", one)
    for (case, name), one in found.items():
        metrics |= _numbers(p, f"{case.name}.{name}", one, found[case, BASE], found[case, BEST])
    for depth in p.in_plane_depth if p.cross_check else ():
        apart = cross_check(p, depth)
        metrics[f"h{1e3 * depth:g}mm.engine_distance_over_clearance"] = Metric(apart, "1")
        if not apart <= ALIKE:
            wrong.append(f"h{1e3 * depth:g}mm: engine and compiled solver {apart:.1e} clearances apart, more than {ALIKE:g}")
    tables = [_modes_table(depth) for depth in p.in_plane_depth]
    return StudyResult(
        parameters=p,
        **judged(wrong),
        metrics=metrics,
        work={"turns": len(found) * p.members * (p.settle + p.cycles)},
        tables=[*tables, *(_table(metrics, p, case) for case in cases(p)), *_check_table(metrics, p)],
    )


def _counted_metrics(depth: float) -> dict[str, Metric]:
    """Frequencies by kind, those in the plane against beam theory."""
    found, theory = {}, beam_frequencies(depth)
    table = counted(depth).table()
    for kind, exact in theory.items():
        mine = [hertz for _, hertz, what, *_ in table if what == kind]
        for i, (hertz, known) in enumerate(zip(mine, exact, strict=False), 1):
            found[f"h{1e3 * depth:g}mm.{kind.replace(' ', '_')}.{i}"] = Metric(hertz, "Hz", exact=float(known))
    return found


def _numbers(p: Parameters, name: str, one: Ensemble, base: Ensemble, best: Ensemble) -> dict[str, Metric]:
    """Every claim's number for one set, over that of the rigid rocker and over that of the fullest set."""
    found = measures.numbers(name, one)
    level = p.level / (2 * len(CLAIMS) * (len(p.chosen) - 1) * len(cases(p)))
    for claim in CLAIMS:
        rigid, fullest = (_over(one, other, claim) for other in (base, best))
        found |= {f"{name}.{claim.name}.over_rigid": rigid.metric, f"{name}.{claim.name}.over_fullest": fullest.metric}
        found[f"{name}.{claim.name}.agrees"] = Metric(MARKS[sameness(fullest, level, p.margin)], "1")
    return found


def _over(one: Ensemble, other: Ensemble, claim: Claim) -> Ratio:
    return Ratio(1.0, 0.0, 1.0) if one is other else measures.ratio(measures.mean(one, claim), measures.mean(other, claim))


def sameness(found: Ratio, level: float, margin: float) -> str:
    """= if surely within the margin of 1; ≠ if surely not 1, and not that; else ?. Level is that of one end of the interval."""
    reach = found.reach(level) if found.error else 0.0
    if abs(found.value - 1) + reach < margin:
        return AGREES
    return DIFFERS if abs(found.value - 1) > reach else UNDECIDED


def cross_check(p: Parameters, depth: float) -> float:
    """Largest distance of the two solvers in the centres of coupler and rocker, over the clearance.

    Same modes (three lowest in the plane, of the same damping ratio), law and start; rattling joints, as far as chaos lets
    trajectories be compared.
    """
    rocker = Modal(section(depth), FreeModes((1, 2, 3), "in-plane"), p.rocker_damping, MESH)
    made, fine = p.bars("N.s/m", depth, p.clearance, rocker), mbs.Exudyn(mbs.Controlled(tolerance=1e-6))
    engine = mbs.simulate(made, p.cross_check, solver=fine, timeout=120)
    ours = mbs.simulate(made, p.cross_check, solver=solver(made, 1e-10))
    if not (engine.ok and ours.ok):
        return float("nan")
    away = [np.hypot(*(engine[f"{link}.{x}"] - ours.at(f"{link}.{x}", engine.time) for x in "xy")).max() for link in MOVED]
    return float(max(away)) / p.clearance


def _modes_table(depth: float) -> Table:
    """What each number stands for, in each way of counting."""
    rows: list[list[Any]] = []
    theory = beam_frequencies(depth)
    seen = dict.fromkeys(theory, 0)
    for number, hertz, kind, share, in_plane in counted(depth).table()[:LISTED]:
        row = [number, number + 6, sum(seen.values()) + 1 if in_plane else None, kind, f"{hertz:.0f}", f"{share:.3f}", None]
        if kind in seen:
            row[-1] = f"{theory[kind][seen[kind]]:.0f}"
            seen[kind] += 1
        rows.append(row)
    heads = ["flexible", "free body", "in the plane", "kind", "Hz", "share of its energy", "beam theory, Hz"]
    slender = " ".join(f"{hertz / 1e3:.0f}" for hertz in beam_frequencies(depth, shear=False)[BENDING][3:6])
    timo = " ".join(f"{hertz / 1e3:.0f}" for hertz in theory[BENDING][3:6])
    notes = f"Bending 4 to 6: {timo} kHz; {slender} kHz without shear and rotary inertia."
    return Table(heads, rows, f"Modes of the free rocker, {1e3 * depth:g} mm in the plane, by the number they have", notes)


def _table(metrics: Mapping[str, Metric], p: Parameters, case: ClaimCase) -> Table:
    """One row a set, one column a number: over the rigid rocker's, and whether it is the fullest set's."""
    rows = []
    marks = {number: mark for mark, number in MARKS.items()}
    for name in p.chosen:
        row = [NAMES[name]]
        for claim in SHOWN:
            over = metrics[f"{case.name}.{name}.{claim}.over_rigid"].shown(".3f", ".3f")
            row.append(f"{over} {marks[metrics[f'{case.name}.{name}.{claim}.agrees'].value]}")
        rows.append(row)
    title = f"over the rigid rocker's, ± standard error; c_max = 253 {case.unit}, {1e3 * case.depth:g} mm in the plane"
    notes = (
        f"= within {100 * p.margin:g} % of the fullest set's for sure, ≠ for sure not the same, ? undecided; the chance "
        f"that any of these marks is wrong is below {100 * p.level:g} %. {p.members} runs of {p.cycles} turns a set.\n"
        f"{p.stated()}."
    )
    return Table(["modes", *SHOWN.values()], rows, title, notes)


def _check_table(metrics: Mapping[str, Metric], p: Parameters) -> list[Table]:
    """Engine against compiled solver, if that was asked for."""
    planes = [f"h{1e3 * depth:g}mm" for depth in p.in_plane_depth]
    rows = [[name, f"{metrics[f'{name}.engine_distance_over_clearance'].value:.1e}"] for name in planes if p.cross_check]
    title = f"engine against compiled solver, same modes, after {1e3 * p.cross_check:g} ms"
    return [Table(["plane", "distance/clearance"], rows, title)] if rows else []


def figure(result: StudyResult) -> Figure:
    """Ratios to the rigid rocker with bars of two standard errors, a panel for each reading of c_max and plane."""
    p = result.of(Parameters)
    shape = {"squeeze": False, "sharey": True, "sharex": True}
    fig, axes = subplots(len(p.damping_unit), len(p.in_plane_depth), height=30 + 80 * len(p.damping_unit), **shape)
    names = p.chosen[::-1]
    for ax, case in zip(axes.ravel(), cases(p), strict=True):
        ax.axvline(1, color="#999999", linewidth=0.8)
        ax.axhspan(names.index(BEST) - 0.5, names.index(BEST) + 0.5, color="#eeeeee", zorder=0)
        for i, (claim, colour) in enumerate(zip(SHOWN, COLOURS, strict=False)):
            over = [result.metrics[f"{case.name}.{name}.{claim}.over_rigid"] for name in names]
            found = np.array([(m.value, m.value * (m.error or 0.0)) for m in over])
            place = np.arange(len(names)) + 0.11 * (2.5 - i)
            dots: dict[str, Any] = {"fmt": "o", "color": colour, "markersize": 2.5, "elinewidth": 0.8}
            ax.errorbar(found[:, 0], place, xerr=2 * found[:, 1], label=SHOWN[claim], **dots)
        ax.set_title(f"{case.unit}, {1e3 * case.depth:g} mm in the plane")
        ax.set_yticks(range(len(names)), [NAMES[name] for name in names])
        ax.set_xscale("log")
        plain_ticks(ax.xaxis)
    for ax in axes[-1]:
        ax.set_xlabel("over the rigid rocker's")
    fig.legend(*axes[0][0].get_legend_handles_labels(), loc="outside upper center", ncols=3)
    return fig
