"""Stiff and extreme cases of the whole grammar: is any run reported fine that is wrong, is any right one suspected?

Families in which runs were found to be wrong are drawn at random, and so is the grammar; others stand in lists: thin and thick,
slow and fast, soft and stiff, coarse in mesh and steps, at dead centres, and wrong input. Each case ends within tolerance of a
reference that it does not share (closed form, exact elastica, the second solver refined until two of its runs agree), or is
refused before the run, or fails or is suspect by name. A case reported fine that is not is silently wrong; there must be none.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from ..kit.parameters import StudyParameters, choices, integer, quantity, text
from ..kit.report import QUIET, Metric, Progress, StudyResult, Table, judged
from ..kit.style import COLOURS, Figure, subplots
from ..sweeping.sweep import sweep
from . import extreme
from .extreme import FAMILIES, slug
from .extremes_case import KINDS, VERDICTS, Finding, Verdict

ENDS = (
    Verdict.WITHIN, Verdict.WRONG, Verdict.SUSPECT, Verdict.REFUSED, Verdict.FALSE_ALARM, Verdict.FAILED, Verdict.UNFINISHED,
    Verdict.OPEN,
)  # fmt: skip
COLOUR = dict(zip(ENDS, (*COLOURS, "#bbbbbb"), strict=True))
MARK = dict(zip(ENDS, "oX^sDPv*", strict=True))
"""How a verdict is drawn: by its shape, too."""
LEAST, MOST = 1e-4, 1e4
"""Errors, of what is allowed, at which the figure ends; what lies beyond is drawn there."""


@dataclass(frozen=True)
class Parameters(StudyParameters):
    """Parameters of the study."""

    cases: int = integer(100, 1, 10**6, "cases; families take turns, those that stand in a list until it ends", "cases")
    seed: int = integer(1, 0, 2**31 - 1, "draws them", "cases")
    families: tuple[str, ...] = choices(
        tuple(map(slug, FAMILIES)), [slug(name) for name in FAMILIES], "families of cases", "cases"
    )
    timeout: float = quantity(60.0, "s", 0.1, 3600, "longest time of a run; a longer one is unfinished", "cases")
    workers: int = integer(1, 0, 256, "processes, 0 for none but this", "numerics")
    store: str = text("", "file that keeps the cases that have run, to go on from; none: memory only", "numerics")

    @property
    def all(self) -> list[extreme.Parameters]:
        """What is run: families take turns, a list until it ends."""
        listed = Counter(slug(case.family) for case in extreme.everything())
        turns = ((family, k) for k in range(self.cases) for family in self.families if k < listed.get(family, self.cases))
        return [extreme.Parameters(family, self.seed, k, self.timeout) for family, k in islice(turns, self.cases)]


def run(p: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Run every case and its reference."""
    store = Path(p.store) if p.store else None
    rows = sweep(extreme, p.all, workers=p.workers, store=store, progress=progress, name="extremes")
    findings = [extreme.finding(row) for row in rows if row.status == "OK"]
    said = [f"{f.family}: {f.name}: {f.verdict}" for f in findings if f.verdict in (Verdict.WRONG, Verdict.OPEN)]
    lost = [row for row in rows if row.status != "OK"]
    said += [f"{row.parameters['family']} {row.parameters['number']}: {row.status}: {row.message}" for row in lost]
    return StudyResult(
        parameters=p,
        **judged(said, f"{len(findings)} cases, none of them silently wrong"),
        metrics=_metrics(findings),
        signals={name: np.array([getattr(f, name) for f in findings]) for name in Finding._fields},
        tables=[_by_family(findings), _named(findings)],
    )


def _metrics(findings: Sequence[Finding]) -> dict[str, Metric]:
    count = Counter(finding.verdict for finding in findings)
    fine = [finding.off for finding in findings if finding.verdict == Verdict.WITHIN]
    prices = [finding.price for finding in findings if np.isfinite(finding.price)]
    return {
        "cases": Metric(len(findings), "1"),
        "within_tolerance": Metric(count[Verdict.WITHIN], "1"),
        "refused": Metric(count[Verdict.REFUSED], "1"),
        "failed_by_name": Metric(count[Verdict.FAILED] + count[Verdict.SUSPECT], "1"),
        "silent_wrong": Metric(count[Verdict.WRONG], "1", exact=0.0),
        "false_alarms": Metric(count[Verdict.FALSE_ALARM], "1", exact=0.0),
        "unfinished": Metric(count[Verdict.UNFINISHED], "1", exact=0.0),
        "no_reference": Metric(count[Verdict.OPEN], "1"),
        "price": Metric(float(np.median(prices)) if prices else float("nan"), "1"),
        "largest_error_reported_fine": Metric(max(fine, default=0.0), "1"),
    }


def _by_family(findings: Sequence[Finding]) -> Table:
    """How many cases of each family ended how."""
    rows: list[list[Any]] = []
    for family in (*FAMILIES, "all"):
        if mine := [f for f in findings if family in (f.family, "all")]:
            counted = Counter(f.verdict for f in mine)
            worst = max((f.off for f in mine if f.verdict is Verdict.WITHIN), default=None)
            rows.append([family, len(mine), *(counted[verdict] for verdict in VERDICTS), worst])
    allowed = "\n".join(f"{name} to {kind.allowed:g}: {kind.why}" for name, kind in KINDS.items())
    notes = (
        f"error: largest of those within tolerance, over what is allowed. Allowed, relative to the largest or as said:\n{allowed}"
    )
    return Table(["family", "cases", *VERDICTS, "error"], rows, "Stiff and extreme cases", notes)


def _named(findings: Sequence[Finding]) -> Table:
    """Every case that is not within tolerance, with what was said of it."""
    rows = [
        [f.family, f.name, f.verdict, None if np.isnan(f.off) else f"{f.off:.2g} {f.worst}", f.message[:90]]
        for f in sorted(findings, key=lambda f: (VERDICTS.index(f.verdict), FAMILIES.index(f.family)))
        if f.verdict != Verdict.WITHIN
    ]
    return Table(["family", "case", "verdict", "error/allowed", "said"], rows, "Cases that are not within tolerance")


def figure(result: StudyResult) -> Figure:
    """One dot a case: its error by family; right of the scale those that were not compared."""
    s = result.signals
    fig, ax = subplots(height=60 + 6 * len(set(s["family"])))
    families = [name for name in FAMILIES if (s["family"] == name).any()]
    row = np.array([families.index(name) for name in s["family"]])
    compared = ~np.isnan(s["off"])
    place = np.clip(np.nan_to_num(s["off"], posinf=MOST), LEAST, MOST)
    apart, aside = np.random.default_rng(0).uniform(-0.5, 0.5, (2, len(row)))  # keep the dots of a row apart
    place[~compared] = 40 * MOST * 6 ** aside[~compared]
    height = row + 0.6 * apart
    for verdict in [v for v in VERDICTS if (s["verdict"] == v).any()]:
        mine = s["verdict"] == verdict
        ax.plot(place[mine], height[mine], MARK[verdict], ms=3.5, color=COLOUR[verdict], label=f"{verdict} ({mine.sum()})")
    ax.axvline(1.0, color="black", lw=0.8)
    ax.axvline(8 * MOST, color="#dddddd", lw=0.8)
    ax.set(xscale="log", xlim=(LEAST / 2, 200 * MOST), xlabel="error over what is allowed [1]", ylabel="family of cases")
    ax.set_xticks([LEAST, 1e-2, 1.0, 1e2, MOST, 40 * MOST], ["$10^{-4}$", "0.01", "1", "100", "$\\geq 10^4$", "not\ncompared"])
    ax.minorticks_off()
    ax.set_yticks(range(len(families)), families)
    ax.invert_yaxis()
    ax.legend(loc="lower center", bbox_to_anchor=(0.25, 1.0), ncols=3, columnspacing=1.0)
    return fig
