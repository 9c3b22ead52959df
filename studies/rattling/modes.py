"""Influence of the rocker's modes: sets of modes of a solid rocker, compared with the rigid rocker and the largest set.

The paper on the crank-rocker, of unknown authors, gives the rocker "modes four, five and six". `bars.SETS` has the four ways of
counting them: among all modes of the free body, its flexible modes, those in the plane, or those of bending in the plane. The
crank-rocker runs with each set on the compiled solver, with the default crank speed. A case is a pair of a unit of c_max (the
largest contact damping) and a side of the bars in the plane.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from buckler.mbs import Mechanism, Modal

from ..kit.parameters import choices, quantities, quantity
from ..kit.published import DAMPING_UNITS
from ..kit.report import QUIET, Metric, Progress, StudyResult, Table, status_of
from ..kit.style import COLOURS, Figure, plain_ticks, subplots
from .bars import BENDING, SETS, Assumptions, PlayParameters, beam_frequencies, make_rocker_of_set, set_damping, solid_modes
from .claims import CLAIMS, READINGS, Ratio, ideal_motion, ratio
from .turns import TestedRuns, Turns, run_turns

BASE = "none"
"""Empty set: the rigid rocker."""
LARGEST = "bending_1_8_axial_1_4"
"""Largest set, with which the others are compared."""
PRINTED = {
    "force.coupler_rocker": "force B", "force.rocker_frame": "force C", "acceleration.coupler": "peak a coupler",
    "acceleration.rocker": "peak a rocker", "acceleration.rocker_middle": "peak a mid-point", "velocity.coupler": "v coupler",
}  # fmt: skip
"""Claims in the printed table and the figure, with their headers; metrics.json has all claims."""
AGREES, DIFFERS, UNDECIDED = "=", "≠", "?"
MARKS = {AGREES: 1.0, UNDECIDED: 0.0, DIFFERS: -1.0}
"""Numbers in metrics.json of the comparison of a set with the largest one."""
FREE_SETS = tuple(name for name in SETS if name != "craig_bampton")  # they run by default


@dataclass(frozen=True)
class Parameters(Assumptions, TestedRuns):
    """Parameters of the study."""

    sets: tuple[str, ...] = choices(FREE_SETS, tuple(SETS), "sets of modes; none and the largest one always run", "bars")
    in_plane_depth: tuple[float, ...] = quantities((20e-3, 5e-3), "m", 5e-3, 20e-3, "sides of the bars in the plane", "bars")
    damping_unit: tuple[str, ...] = choices(tuple(DAMPING_UNITS), tuple(DAMPING_UNITS), "published unit of c_max", "contact")
    pin: float = quantity(5e-3, "m", 1e-3, 1e-2, "radius of the pins", "joints")
    clearance: float = quantity(2.5e-4, "m", 1e-6, 2e-3, "radial clearance", "joints")

    def agree(self) -> None:
        """Check that nobody sets the inherited `modes_of`, as the sets define the modes, and that the mechanism can be made."""
        super().agree()
        if self.modes_of != "free":
            raise ValueError(f"modes_of = {self.modes_of}: sets are free modes here; add craig_bampton to sets")
        for unit, depth in self.cases.values():
            self.crank_rocker(unit, depth)

    @property
    def mode_sets(self) -> list[str]:
        """Names of the sets that run, in the order of `SETS`."""
        return [name for name in SETS if name in (*self.sets, BASE, LARGEST)]

    @property
    def cases(self) -> dict[str, tuple[str, float]]:
        """Cases by their names in metrics.json: unit in which c_max is read, and side of the bars in the plane [m]."""
        return {f"c_max[{unit}].h{1e3 * h:g}mm": (unit, h) for unit, h in product(self.damping_unit, self.in_plane_depth)}

    def crank_rocker(self, unit: str, depth: float, rocker: Modal | None = None) -> Mechanism:
        """Make the crank-rocker of a case, by default with the rigid rocker."""
        values = self.share(PlayParameters) | {"damping_unit": unit, "in_plane_depth": depth}
        return PlayParameters(**values).bars(rocker=rocker)


def run(p: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Compute the frequencies of the modes, run every set in every case, and compare the sets."""
    metrics = {name: metric for depth in p.in_plane_depth for name, metric in _frequencies(depth).items()}
    wrong: list[str] = []
    ideal = ideal_motion(PlayParameters().speed)
    for batch, (name, (unit, depth)) in enumerate(progress(list(p.cases.items()), label="cases")):
        rockers = [make_rocker_of_set(depth, modes, p.rocker_damping) for modes in p.mode_sets]  # None is rigid
        damped = [rocker and set_damping(rocker, p.modal_damping, p.rocker_damping) for rocker in rockers]
        mechanisms = [p.crank_rocker(unit, depth, rocker) for rocker in damped]
        results = run_turns(p, mechanisms, READINGS, batch, ideal)  # batch: random starts of this case's own
        turns = dict(zip(p.mode_sets, results, strict=True))
        wrong += [f"{name}.{modes}: {note}" for modes, each in turns.items() for note in each.notes]
        for modes, each in turns.items():
            metrics |= _numbers(p, f"{name}.{modes}", each, turns[BASE], turns[LARGEST])
    return StudyResult(
        parameters=p, **status_of(wrong), metrics=metrics,
        tables=[*map(_modes_table, p.in_plane_depth), *(_table(metrics, p, name) for name in p.cases), _summary(metrics, p)],
    )  # fmt: skip


def _frequencies(depth: float) -> dict[str, Metric]:
    """Return the frequencies of the solid rocker's modes in the plane, with those of Timoshenko's theory as exact values."""
    found, table = {}, solid_modes(depth).table()  # rows: number, frequency [Hz], main kind of motion, and two more numbers
    for kind, exact in beam_frequencies(depth).items():
        of_solid = [hertz for _, hertz, each, *_ in table if each == kind]
        for i, (hertz, theory) in enumerate(zip(of_solid, exact, strict=False), 1):
            found[f"h{1e3 * depth:g}mm.{kind.replace(' ', '_')}.{i}"] = Metric(hertz, "Hz", exact=float(theory))
    return found


def _numbers(p: Parameters, name: str, turns: Turns, base: Turns, largest: Turns) -> dict[str, Metric]:
    """Return the number of each claim for a set, its ratios to the rigid rocker and the largest set, and the comparison."""
    found: dict[str, Metric] = {}
    comparisons = len(CLAIMS) * (len(p.mode_sets) - 1) * len(p.cases)
    one_end = p.level / (2 * comparisons)  # Bonferroni: `level` is the probability that any mark is wrong; 2 ends of an interval
    for claim in CLAIMS:
        mean = turns.means[claim.reading]
        itself = Ratio(1.0, error=0.0, freedom=1.0)  # without error any number of degrees of freedom will do
        over_base, over_largest = (itself if turns is x else ratio(mean, x.means[claim.reading]) for x in (base, largest))
        key = f"{name}.{claim.name}"
        found |= {key: mean.metric(claim.unit), f"{key}.over_rigid": over_base.metric, f"{key}.over_fullest": over_largest.metric}
        found[f"{key}.agrees"] = Metric(MARKS[sameness(over_largest, one_end, p.margin)], "1")
    return found


def sameness(found: Ratio, one_end: float, margin: float) -> str:
    """Return = for a confidence interval in 1 ± `margin`, else ≠ if it excludes 1, else ?; `one_end` is as in `half_width`."""
    half = found.half_width(one_end)
    if abs(found.value - 1) + half < margin:
        return AGREES
    return DIFFERS if abs(found.value - 1) > half else UNDECIDED


def _modes_table(depth: float) -> Table:
    """Tabulate the first twelve flexible modes of the solid rocker, with their numbers in each way of counting."""
    rows, planar = list[list[Any]](), 0
    theory = {kind: iter(hertz) for kind, hertz in beam_frequencies(depth).items()}
    # `kind` is the kind of motion with the largest share of the mode's energy.
    for number, hertz, kind, share, is_planar in solid_modes(depth).table()[:12]:
        planar += is_planar
        exact = f"{next(theory[kind]):.0f}" if kind in theory else None
        in_plane, in_free_body = planar if is_planar else None, number + 6  # after six rigid modes
        rows.append([number, in_free_body, in_plane, kind, f"{hertz:.0f}", f"{share:.3f}", exact])
    heads = ["flexible", "free body", "in the plane", "kind", "Hz", "share of its energy", "beam theory, Hz"]
    fourth_to_sixth = slice(3, 6)
    timoshenko, slender = (beam_frequencies(depth, shear)[BENDING][fourth_to_sixth] / 1e3 for shear in (True, False))  # [kHz]
    notes = "Bending 4 to 6: {:.0f} {:.0f} {:.0f} kHz; {:.0f} {:.0f} {:.0f} kHz without shear and rotary inertia."
    title = f"Modes of the free rocker, {1e3 * depth:g} mm in the plane, and their numbers"
    return Table(heads, rows, title, notes.format(*timoshenko, *slender))


def _table(metrics: Mapping[str, Metric], p: Parameters, case: str) -> Table:
    """Tabulate a case, a row for each set and a column for each claim: the ratio to the rigid rocker, and the mark."""
    rows = []
    for name in p.mode_sets:
        rows.append([SETS[name].label, *(_cell(metrics, f"{case}.{name}.{claim}", ".3f", ".3f") for claim in PRINTED)])
    notes = (
        f"= within {100 * p.margin:g} % of the largest set's for sure, ≠ for sure not the same, ? undecided; the chance "
        f"that any mark is wrong is below {100 * p.level:g} %. {p.members} runs of {p.cycles} turns a set.\n{p.describe()}."
    )
    return Table(["modes", *PRINTED.values()], rows, f"{case}: over the rigid rocker's, ± standard error", notes)


def _cell(metrics: Mapping[str, Metric], name: str, *formats: str) -> str:
    """Write the ratio to the rigid rocker, in formats of its value and its error, and its mark."""
    mark = next(mark for mark, value in MARKS.items() if value == metrics[f"{name}.agrees"].value)
    return f"{metrics[f'{name}.over_rigid'].format(*formats)} {mark}"


def _summary(metrics: Mapping[str, Metric], p: Parameters) -> Table:
    """Tabulate all cases, a row for each set: ratios of two claims to the rigid rocker, and their marks."""
    rows, summarised = [], ("force.coupler_rocker", "acceleration.rocker")
    for name in [name for name in p.mode_sets if name != BASE]:
        cells = [", ".join(_cell(metrics, f"{case}.{name}.{claim}", ".2f", ".2f") for claim in summarised) for case in p.cases]
        rows.append([SETS[name].label, *cells])
    claims = ", ".join(PRINTED[claim] for claim in summarised)
    heads = [f"{unit}, {1e3 * depth:g} mm: {claims}" for unit, depth in p.cases.values()]
    return Table(["modes", *heads], rows, "All cases: over the rigid rocker's")


def figure(result: StudyResult) -> Figure:
    """Draw ratios to the rigid rocker with bars of two standard errors, a panel for each case."""
    p = result.of(Parameters)
    shape = {"squeeze": False, "sharey": True, "sharex": True}
    fig, axes = subplots(len(p.damping_unit), len(p.in_plane_depth), height=30 + 80 * len(p.damping_unit), **shape)  # [mm]
    names = p.mode_sets[::-1]
    for ax, case in zip(axes.ravel(), p.cases, strict=True):
        ax.axvline(1, color="#999999", linewidth=0.8)
        ax.axhspan(names.index(LARGEST) - 0.5, names.index(LARGEST) + 0.5, color="#eeeeee", zorder=0)
        for i, (claim, colour) in enumerate(zip(PRINTED, COLOURS, strict=False)):
            ratios = [result.metrics[f"{case}.{name}.{claim}.over_rigid"] for name in names]
            value, error = np.array([(m.value, m.error_in_unit or 0.0) for m in ratios]).T
            style: dict[str, Any] = {"fmt": "o", "color": colour, "markersize": 2.5, "elinewidth": 0.8}
            heights = np.arange(len(names)) + 0.11 * (2.5 - i)  # the claims of a set one above another
            ax.errorbar(value, heights, xerr=2 * error, label=PRINTED[claim], **style)
        unit, depth = p.cases[case]
        ax.set_title(f"c_max in {unit}, rocker {1e3 * depth:g} mm high")
        ax.set_yticks(range(len(names)), [SETS[name].label for name in names])
        ax.set_xscale("log")
        plain_ticks(ax.xaxis)
    for ax in axes[-1]:
        ax.set_xlabel("over the rigid rocker's")
    fig.legend(*axes[0][0].get_legend_handles_labels(), loc="outside upper center", ncols=3)
    return fig
