"""Does a flexible rocker reduce forces and motions? Test of each published claim over all assumptions that the paper leaves open.

The module `claims` has the claims; authors and title of the paper are unknown. Each option lists the values that an assumption
may have, or the two ends of its range. A sample draws a value of each assumption by a scrambled Sobol' sequence; in a range the
logarithm of the value is uniform. A cell is a pair of a unit of c_max (the largest contact damping) and a gravity. Every sample
runs in every cell, with a rigid and a flexible rocker; the journals start at random places.

A claim holds in a sample if the mean of its reading is lower with the flexible rocker than with the rigid one, by the share
`margin` at least. The ratio flexible over rigid has two errors. The sampling error is its standard error, from the scatter of the
runs; the model error is the scatter over samples beyond that. With Student's t distribution the sampling error gives each ratio a
95 % interval.

The share of samples in which a claim holds has an interval, too. In a sample it surely holds if the whole 95 % interval is below
1 - `margin`, and possibly if the lower end is. The lower end of Wilson's interval for the share of sure samples, and the upper
end of that for possible ones, are the ends of the share. A claim holds if both are above one half, and does not hold if both are
below. Else it is undecided. `level` is the probability that any verdict of the table is wrong (Bonferroni).

A claim flips in a sample where it holds with the first of the gravities (by default 0 m/s^2) and not with the last one: then the
claim depends on a gravity that the paper does not give.

Sources: E. B. Wilson, Probable inference, the law of succession, and statistical inference, doi 10.1080/01621459.1927.10502953.
I. M. Sobol', On the distribution of points in a cube, doi 10.1016/0041-5553(67)90144-9.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from math import ceil, log2, pi
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import binomtest, qmc

from buckler.mbs import Modal
from buckler.mbs.geometry import Array

from ..kit.parameters import choices, counts, integer, quantities
from ..kit.published import CONTACT_DAMPING, DAMPING_UNITS, GRAVITY
from ..kit.report import QUIET, Metric, Progress, StudyResult, Table, status_of
from ..kit.style import COLOURS, Figure, plain_ticks, subplots
from .bars import BODIES, DAMPINGS, KINDS, PINS, RockerParameters, make_modal_rocker
from .claims import CLAIMS, FAILS, HOLDS, READINGS, UNDECIDED, VERDICTS, ideal_motion, ratio
from .turns import JOINTS, TestedRuns, run_turns

RANGES = ("pin", "friction_thresholds", "rocker_damping", "frequency_factor", "clearance")
"""Assumptions whose two values are ends of a range."""
OPEN = "unpublished"
"""Heading, in the help, of what the paper does not give."""


@dataclass(frozen=True)
class Parameters(TestedRuns):
    """Parameters of the study: values of each assumption, and the number of samples. `TestedRuns` has those of the runs."""

    gravity: tuple[float, ...] = quantities((0.0, GRAVITY), "m/s^2", 0, 100, "gravity in the plane: each in turn", OPEN)
    gravity_angle: tuple[float, ...] = quantities((-pi / 2, pi / 2, pi, 0.0), "rad", -7, 7, "its angles to the x axis", OPEN)
    pin_on: tuple[str, ...] = choices(PINS, PINS, "bodies that may carry the pins; a joint not named keeps its default", OPEN)
    pin: tuple[float, ...] = quantities((2.8e-3, 1e-2), "m", 1e-3, 1e-2, "radius of the pins: one, or from, to", OPEN)
    friction_thresholds: tuple[float, ...] = quantities(
        (0.1, 1.0), "1", 1e-4, 100, "factor on both threshold speeds of the friction: one, or from, to", OPEN
    )
    modal_damping: tuple[str, ...] = choices(tuple(DAMPINGS), tuple(DAMPINGS), "damping ratios of modes", OPEN)
    rocker_damping: tuple[float, ...] = quantities((2e-3, 5e-2), "1", 1e-6, 1, "damping ratio: one, or from, to", OPEN)
    modes_of: tuple[str, ...] = choices(KINDS, KINDS, "modes of the rocker", OPEN)
    bending: tuple[int, ...] = counts((2, 3, 6), 1, 8, "bending modes of a free rocker", OPEN)
    axial: tuple[int, ...] = counts((1, 3), 0, 8, "axial modes of a free rocker", OPEN)
    frequency_factor: tuple[float, ...] = quantities(
        (0.9, 1.1), "1", 0.5, 2, "factor on the frequencies of a plain bar, as the real rocker has holes: one, or from, to", OPEN
    )
    damping_unit: tuple[str, ...] = choices(tuple(DAMPING_UNITS), tuple(DAMPING_UNITS), "units of c_max: each in turn", OPEN)
    in_plane_depth: tuple[float, ...] = quantities((20e-3, 5e-3), "m", 5e-3, 20e-3, "sides of the bars in the plane", OPEN)
    clearance: tuple[float, ...] = quantities((5e-5, 5e-4), "m", 1e-6, 2e-3, "radial clearance: one, or from, to", OPEN)
    samples: int = integer(32, 1, 2**16, "samples over all that is left open", "statistics")

    def agree(self) -> None:
        """Check parameters against each other: ranges have at most two ends, all first and all last values make a mechanism."""
        for name in RANGES:
            if len(getattr(self, name)) > 2:
                raise ValueError(f"{name} = {','.join(f'{x:g}' for x in getattr(self, name))}: must be one number or two ends")
        for x in (0.0, np.nextafter(1.0, 0.0)):  # 1 itself is beyond the last value
            self.case([x] * len(self.axes()))  # raises if there is no such mechanism

    def axes(self) -> dict[str, Sequence[Any]]:
        """Return the values from which a sample draws: of each assumption by name, and the pins of each joint."""
        chosen = ("gravity_angle", "modal_damping", "modes_of", "bending", "axial", "in_plane_depth")  # from lists of values
        axes: dict[str, Sequence[Any]] = {name: getattr(self, name) for name in (*RANGES, *chosen)}
        for joint in JOINTS:
            bodies = [f"{joint}.{body}" for body in BODIES[joint]]
            axes[f"pin {joint}"] = [body for body in bodies if body in self.pin_on] or bodies[:1]  # the default
        return axes

    def case(self, point: Sequence[float]) -> RockerParameters:
        """Return the assumptions at a point of the unit cube, in the order of the `axes`.

        Unit of c_max and gravity, which make a cell and are no axes, have their defaults.
        """
        values: dict[str, Any] = {}
        for x, (name, options) in zip(point, self.axes().items(), strict=True):
            is_range = name in RANGES and len(options) > 1
            values[name] = options[0] * (options[1] / options[0]) ** x if is_range else options[int(x * len(options))]
        pins = tuple(values.pop(f"pin {joint}") for joint in JOINTS)
        return RockerParameters(rocker="modal", pin_on=pins, **values)

    def cases(self) -> list[RockerParameters]:
        """Draw all samples; a larger number adds samples to the same first ones."""
        sobol = qmc.Sobol(len(self.axes()), rng=np.random.default_rng(self.seed))
        return [self.case(point) for point in sobol.random_base2(ceil(log2(self.samples)))[: self.samples].tolist()]

    @property
    def cells(self) -> dict[str, tuple[str, float]]:
        """Cells by their names in metrics.json: pairs of a unit of c_max and a gravity [m/s^2]."""
        return {f"c_max[{unit}].g{gravity:g}": (unit, gravity) for unit, gravity in product(self.damping_unit, self.gravity)}


def ratios(p: Parameters, cases: Sequence[RockerParameters], bodies: Sequence[Modal], batch: int) -> Array:
    """Run all samples of a cell with a flexible rocker (`bodies`) and a rigid one; return the ratios of their means.

    The result has the shape (3, samples, claims): ratio flexible over rigid, its standard error and the half width of its 95 %
    interval, nan after a failed run. `batch` is the number of the cell, from which the seed of its random starts follows.
    """
    rockers: Sequence[Modal | None] = [*bodies, *[None] * len(cases)]  # None is the rigid rocker
    mechanisms = [case.bars(rocker=rocker) for case, rocker in zip([*cases, *cases], rockers, strict=True)]
    ideal = ideal_motion(cases[0].speed)  # which some readings subtract; all cases have the same crank speed
    results = run_turns(p, mechanisms, READINGS, batch, ideal)
    found = np.full((3, len(cases), len(CLAIMS)), np.nan)
    for i, (flexible, rigid) in enumerate(zip(results[: len(cases)], results[len(cases) :], strict=True)):
        if not (flexible.notes or rigid.notes):  # faults that make the means invalid
            quotients = [ratio(flexible.means[reading], rigid.means[reading]) for reading in READINGS]
            found[:, i] = np.transpose([(x.value, x.error, x.half_width(0.025)) for x in quotients])  # 95 %
    return found


class Judgement(NamedTuple):
    """Test of a claim in a cell."""

    ratio: float  # median over the samples
    sampling: float  # sampling error, root mean square over the samples
    model: float  # model error
    share: float  # share of the samples in which the claim holds
    low: float  # lower end of the share's interval
    high: float  # its upper end

    @property
    def verdict(self) -> str:
        """Verdict on the claim by the interval of the share."""
        return HOLDS if self.low > 0.5 else FAILS if self.high < 0.5 else UNDECIDED


def judge(values: Array, errors: Array, half_widths: Array, margin: float, level: float) -> Judgement:
    """Test a claim by its ratios, their standard errors and half widths, each (samples,); samples that are nan do not count."""
    is_sound = np.isfinite(values)
    value, error, half, n = values[is_sound], errors[is_sound], half_widths[is_sound], int(is_sound.sum())
    if not n:
        return Judgement(np.nan, np.nan, np.nan, np.nan, 0.0, 1.0)
    sampling_variance = float(np.mean(error**2))
    model_variance = max(float(value.var(ddof=1)) - sampling_variance, 0.0) if n > 1 else np.nan
    excess = value - (1 - margin)  # the claim holds where it is negative
    surely, possibly = int((excess + half < 0).sum()), int((excess - half < 0).sum())
    low, high = (binomtest(hits, n).proportion_ci(1 - level, "wilson") for hits in (surely, possibly))
    share, median = float((excess < 0).mean()), float(np.median(value))
    return Judgement(median, sampling_variance**0.5, model_variance**0.5, share, float(low.low), float(high.high))


def overall(verdicts: Sequence[str]) -> str:
    """Summarise the verdicts on a claim in all cells."""
    holds, fails = HOLDS in verdicts, FAILS in verdicts
    if holds == fails:
        return "holds in part" if holds else UNDECIDED
    return (HOLDS if holds else FAILS) + (" where decided" if UNDECIDED in verdicts else "")


def run(p: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Run all samples in all cells, and test every claim."""
    samples = p.cases()
    bodies = [make_modal_rocker(case) for case in samples]
    by_cell = [
        ratios(p, [replace(case, damping_unit=unit, gravity=gravity) for case in samples], bodies, batch)
        for batch, (unit, gravity) in enumerate(progress(p.cells.values(), label="cells"))
    ]
    found = np.stack(by_cell, axis=1)  # (3, cells, samples, claims)
    metrics = judge_claims(p, found)
    is_unsound = np.isnan(found[0, :, :, 0])  # (cells, samples): a run has failed, and no claim has a ratio
    metrics["unsound"] = Metric(int(is_unsound.sum()), "1")
    return StudyResult(
        parameters=p,
        **status_of([f"all {is_unsound.size} cases are unsound"] if is_unsound.all() else []),
        metrics=metrics,
        signals=dict(zip(("ratio", "error", "half_width"), found, strict=True)),
        tables=[*(_cell_table(p, metrics, unit) for unit in p.damping_unit), _summary(p, metrics)],
    )


def judge_claims(p: Parameters, found: Array) -> dict[str, Metric]:
    """Test every claim in every cell by the `ratios`, (3, cells, samples, claims), and compute the share of its flips."""
    metrics: dict[str, Metric] = {}
    level = p.level / (len(CLAIMS) * len(p.cells))
    for (i, cell), (k, claim) in product(enumerate(p.cells), enumerate(CLAIMS)):
        values, errors, half_widths = found[:, i, :, k]
        judgement = judge(values, errors, half_widths, p.margin, level)
        metrics |= {f"{cell}.{claim.name}.{key}": Metric(value, "1") for key, value in judgement._asdict().items()}
        metrics[f"{cell}.{claim.name}.verdict"] = Metric(VERDICTS[judgement.verdict], "1")
    holds = np.where(np.isnan(found[0]), np.nan, found[0] < 1 - p.margin)  # (cells, samples, claims), cells by unit
    for i, unit in enumerate(p.damping_unit if len(p.gravity) > 1 else ()):
        first, last = holds[i * len(p.gravity)], holds[(i + 1) * len(p.gravity) - 1]
        for k, claim in enumerate(CLAIMS):
            is_sound = np.isfinite(first[:, k] + last[:, k])
            flips = first[is_sound, k] > last[is_sound, k]
            metrics[f"c_max[{unit}].{claim.name}.flips"] = Metric(float(flips.mean()) if flips.size else np.nan, "1")
    return metrics


def _verdict(metrics: Mapping[str, Metric], name: str) -> str:
    """Find the verdict on a claim in a cell, by the metric `verdict`, its number."""
    return next(verdict for verdict, number in VERDICTS.items() if number == metrics[f"{name}.verdict"].value)


def _cell_table(p: Parameters, metrics: dict[str, Metric], unit: str) -> Table:
    """Tabulate the cells of a unit of c_max: a row for each claim, three columns for each gravity."""
    rows = []
    for claim in CLAIMS:
        row = [claim.text]
        for name in [f"{cell}.{claim.name}" for cell, (its_unit, _) in p.cells.items() if its_unit == unit]:
            median, sampling, model, share, low, high = (metrics[f"{name}.{key}"].value for key in Judgement._fields)
            row += [f"{median:.2f} ± {sampling:.2f} ± {model:.2f}", f"{share:.2f} ({low:.2f} to {high:.2f})"]
            row.append(_verdict(metrics, name))
        flips = metrics.get(f"c_max[{unit}].{claim.name}.flips")
        rows.append(row if flips is None else [*row, f"{flips.value:.2f}"])
    heads = [f"{head}, {g:g} m/s²" for g in p.gravity for head in ("flexible/rigid", "share of samples", "verdict")]
    notes = "flexible/rigid: median over samples ± sampling ± model. share of samples in which the claim holds, with interval."
    return Table(["claim", *heads, *["flips"] * (len(p.gravity) > 1)], rows, f"c_max = {CONTACT_DAMPING:g} {unit}", notes)


def _summary(p: Parameters, metrics: dict[str, Metric]) -> Table:
    rows = [[claim.text, overall([_verdict(metrics, f"{cell}.{claim.name}") for cell in p.cells])] for claim in CLAIMS]
    notes = (
        f"A reduction counts from {100 * p.margin:g} %; the chance that any verdict is wrong is below {100 * p.level:g} %. "
        f"{p.samples} samples in {len(p.cells)} cells, {metrics['unsound'].value:.0f} left out as unsound; of each rocker "
        f"{p.members} runs of {p.cycles} turns after {p.settle}, starts drawn over the clearance, seed {p.seed}."
    )
    return Table(["claim", "overall"], rows, "Verdicts", notes)


def figure(result: StudyResult) -> Figure:
    """Draw the ratios of all samples and their medians: a panel for each cell, a row for each claim, coloured by verdict."""
    p = result.of(Parameters)
    fig, axes = subplots(1, len(p.cells), height=115, squeeze=False, sharex=True, sharey=True)
    heights, jitter = np.arange(len(CLAIMS))[::-1], np.random.default_rng(0)
    colours = {HOLDS: COLOURS[2], UNDECIDED: COLOURS[0], FAILS: COLOURS[1]}
    for ax, (cell, (unit, gravity)), ratios_of_cell in zip(axes[0], p.cells.items(), result.signals["ratio"], strict=True):
        for claim, height, found in zip(CLAIMS, heights, ratios_of_cell.T, strict=True):
            sound, colour = found[np.isfinite(found)], colours[_verdict(result.metrics, f"{cell}.{claim.name}")]
            ax.plot(sound, height + jitter.uniform(-0.25, 0.25, len(sound)), ".", color=colour, markersize=2.5, alpha=0.6)
            median = result.metrics[f"{cell}.{claim.name}.ratio"].value
            ax.plot(median, height, "|", color="#000000", markersize=10, markeredgewidth=1.2)
        ax.axvline(1 - p.margin, color="#999999", linewidth=0.8)
        ax.set(xscale="log", xlabel="flexible/rigid")
        ax.set_title(f"{unit}, {gravity:g} m/s²", fontsize=8)
        plain_ticks(ax.xaxis, subs=(1, 3))
    axes[0][0].set_yticks(heights, [claim.text.replace(": ", ":\n") for claim in CLAIMS], fontsize=7)
    for verdict, colour in colours.items():
        axes[0][0].plot([], [], ".", color=colour, label=verdict)
    fig.legend(*axes[0][0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return fig
