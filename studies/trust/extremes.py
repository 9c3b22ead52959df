"""Stiff and extreme cases of every scene: is any run reported fine that is wrong?

Thin and thick, slow and fast, soft and stiff, closed and open joints, frictionless and sticking, undamped, coarse in mesh and
steps, on the wrong branch, at dead centres, and wrong input. Each case ends within tolerance of a reference that it does not
share (closed form, exact elastica, compiled reference, or a run a hundred times more exact on a finer mesh), or is refused
before the run, or fails or is suspect by name. A case reported fine that is not is silently wrong; there must be none.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from buckler.studies.kit.cli import main
from buckler.studies.kit.parameters import StudyParameters, choices, integer, quantity
from buckler.studies.kit.report import QUIET, Metric, Progress, StudyResult, Table
from buckler.studies.kit.style import COLOURS, subplots
from buckler.studies.trust import extremes_input, extremes_linkages, extremes_play, extremes_strips
from buckler.studies.trust.extremes_case import (
    FAILED,
    FALSE_ALARM,
    KINDS,
    OPEN,
    REFUSED,
    SUSPECT,
    WITHIN,
    WRONG,
    Case,
    Finding,
    judge,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = np.ndarray[Any, Any]
FAMILIES = (
    "slider-crank, range", "slider-crank, steps", "slider-crank, mesh", "four-bar, ideal joints", "four-bar with play",
    "four-bar with play, flexible rocker", "static strip", "strip pressed in line", "wrong input",
)  # fmt: skip
VERDICTS = (WITHIN, REFUSED, FAILED, SUSPECT, FALSE_ALARM, WRONG, OPEN)
COLOUR = dict(zip((WITHIN, WRONG, SUSPECT, REFUSED, FALSE_ALARM, FAILED, OPEN), COLOURS, strict=True))
LEAST, MOST = 1e-4, 1e4
"""Errors, of what is allowed, at which the figure ends; what lies beyond is drawn there."""


@dataclass(frozen=True)
class Parameters(StudyParameters):
    """Parameters of the study."""

    families: tuple[str, ...] = choices(
        tuple(name.replace(", ", "-").replace(" ", "-") for name in FAMILIES),
        [name.replace(", ", "-").replace(" ", "-") for name in FAMILIES],
        "families of cases",
        "cases",
    )
    every: int = integer(1, 1, 1000, "run one case in so many of each family; all of them take about three minutes", "cases")
    timeout: float = quantity(20.0, "s", 0.1, 3600, "longest time of a run; a longer one has failed by name", "cases")

    @property
    def cases(self) -> list[Case]:
        """What is run."""
        chosen = []
        for family in FAMILIES:
            if family.replace(", ", "-").replace(" ", "-") in self.families:
                chosen += [case for case in everything() if case.family == family][:: self.every]
        return chosen


def everything() -> Iterator[Case]:
    """All cases of all families."""
    for part in (extremes_strips, extremes_linkages, extremes_play, extremes_input):
        yield from part.every()


def run(parameters: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Run every case and its reference."""
    findings = [judge(case, parameters.timeout) for case in progress(parameters.cases, label="cases")]
    count = Counter(finding.verdict for finding in findings)
    named = count[FAILED] + count[SUSPECT] + count[FALSE_ALARM]
    fine = [finding.off for finding in findings if finding.verdict == WITHIN]
    metrics = {
        "cases": Metric(len(findings), "1"),
        "within_tolerance": Metric(count[WITHIN], "1"),
        "refused": Metric(count[REFUSED], "1"),
        "failed_by_name": Metric(named, "1"),
        "silent_wrong": Metric(count[WRONG], "1", exact=0.0),
        "suspect_yet_within": Metric(count[FALSE_ALARM], "1"),
        "no_reference": Metric(count[OPEN], "1"),
        "largest_error_reported_fine": Metric(max(fine, default=0.0), "1"),
    }
    wrong = [finding for finding in findings if finding.verdict in (WRONG, OPEN)]
    return StudyResult(
        parameters=parameters,
        status="SUSPECT" if wrong else "OK",
        message="; ".join(f"{f.family}: {f.name}: {f.verdict}" for f in wrong)
        or f"{len(findings)} cases, none of them silently wrong",
        metrics=metrics,
        signals={name: np.array([getattr(f, name) for f in findings]) for name in Finding._fields},
        tables=[_by_family(findings), _named(findings)],
    )


def _by_family(findings: Sequence[Finding]) -> Table:
    """How many cases of each family ended how."""
    rows: list[list[Any]] = []
    for family in [name for name in FAMILIES if any(f.family == name for f in findings)]:
        mine = [f for f in findings if f.family == family]
        rows.append([family, len(mine), *_counts(mine), max((f.off for f in mine if f.verdict == WITHIN), default=None)])
    rows.append(["all", len(findings), *_counts(findings), max((f.off for f in findings if f.verdict == WITHIN), default=None)])
    allowed = "\n".join(f"{name} to {kind.allowed:g}: {kind.why}" for name, kind in KINDS.items())
    notes = (
        f"error: largest of those within tolerance, over what is allowed. Allowed, relative to the largest or as said:\n{allowed}"
    )
    return Table(["family", "cases", *VERDICTS, "error"], rows, "Stiff and extreme cases", notes)


def _counts(findings: Sequence[Finding]) -> list[int]:
    counted = Counter(f.verdict for f in findings)
    return [counted[verdict] for verdict in VERDICTS]


def _named(findings: Sequence[Finding]) -> Table:
    """Every case that is not within tolerance, with what was said of it."""
    rows = [
        [f.family, f.name, f.verdict, None if np.isnan(f.off) else f"{f.off:.2g} {f.worst}", f.message[:90]]
        for f in sorted(findings, key=lambda f: (VERDICTS.index(f.verdict), FAMILIES.index(f.family)))
        if f.verdict != WITHIN
    ]
    return Table(["family", "case", "verdict", "error/allowed", "said"], rows, "Cases that are not within tolerance")


def figure(result: StudyResult) -> Figure:
    """One dot a case: its error by family; right of the scale those that were not compared."""
    s = result.signals
    fig, ax = subplots(height=115)
    families = [name for name in FAMILIES if (s["family"] == name).any()]
    row = np.array([families.index(name) for name in s["family"]])
    compared = ~np.isnan(s["off"])
    place = np.clip(np.nan_to_num(s["off"], posinf=MOST), LEAST, MOST)
    place[~compared] = 40 * MOST * 6 ** _spread(row, ~compared, 0.7548777)[~compared]
    height = row + 0.6 * _spread(row, compared, 0.618034)
    for verdict in [v for v in VERDICTS if (s["verdict"] == v).any()]:
        mine = s["verdict"] == verdict
        marker = "X" if verdict == WRONG else "o"
        ax.plot(place[mine], height[mine], marker, ms=3.5, color=COLOUR[verdict], label=f"{verdict} ({mine.sum()})")
    ax.axvline(1.0, color="black", lw=0.8)
    ax.axvline(8 * MOST, color="#dddddd", lw=0.8)
    ax.set(xscale="log", xlim=(LEAST / 2, 200 * MOST), xlabel="error over what is allowed [1]", ylabel="family of cases")
    ax.set_xticks([LEAST, 1e-2, 1.0, 1e2, MOST, 40 * MOST], ["$10^{-4}$", "0.01", "1", "100", "$\\geq 10^4$", "not\ncompared"])
    ax.minorticks_off()
    ax.set_yticks(range(len(families)), families)
    ax.invert_yaxis()
    ax.legend(loc="lower center", bbox_to_anchor=(0.25, 1.0), ncols=3, columnspacing=1.0)
    return fig


def _spread(row: Array, chosen: Array, stride: float) -> Array:
    """Offsets, -0.5 to 0.5, that keep the dots of a row apart, the same in every drawing: multiples of an irrational number."""
    offsets = np.zeros(len(row))
    for part in (chosen, ~chosen):
        for k in np.unique(row[part]):
            mine = np.flatnonzero(part & (row == k))
            offsets[mine] = np.modf((np.arange(len(mine)) + 1) * stride)[0] - 0.5
    return offsets


if __name__ == "__main__":
    raise SystemExit(main("extremes"))
