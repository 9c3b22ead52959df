"""What `buffering-claims` says of its worlds: shares with intervals, what decides them, a verdict in one sentence; a figure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from buckler.mbs.geometry import Array

from ..kit.report import Metric, Table
from ..kit.style import COLOURS, Figure, plain_ticks, subplots
from .buffering_measures import CLAIMS
from .worlds import ASSUMPTIONS, Worlds, grown, sentence, wilson

NOTES = """\
A world has one value of everything that the paper leaves open, drawn from a Sobol' set: {names}.
Holds: the flexible rocker's number is lower by {margin:g} % at least. Interval: Wilson, 95 %. unsure: worlds whose ratio is
within two standard errors of that bound. decided by: the question that divides the worlds best, none if it divides shuffled
answers as well; its number in metrics.json is its place in the list above, from 0; -1 for none.
{count} worlds, {suspect} left out as suspect; of each rocker {members} runs of {cycles} turns, starts drawn over turn and
clearance."""


@dataclass(frozen=True)
class Share:
    """One claim over all worlds: in how many it holds of how many, the share unsure, what decides it, the verdict in words."""

    hits: int
    of: int
    unsure: float
    place: int
    words: str

    @property
    def share(self) -> float:
        """Of the worlds in which it holds."""
        return self.hits / max(self.of, 1)

    @property
    def interval(self) -> tuple[float, float]:
        """Wilson's, of 95 %."""
        return wilson(self.hits, self.of)

    @property
    def decided_by(self) -> str:
        """Name of the assumption that divides the worlds best."""
        return "none" if self.place < 0 else ASSUMPTIONS[self.place].name


def shares(worlds: Worlds, ratios: Array, errors: Array, margin: float) -> dict[str, Share]:
    """Of every claim, from ratios and their standard errors of shape (worlds, claims); worlds without a number do not count."""
    codes, found = worlds.codes, {}
    for k, claim in enumerate(CLAIMS):
        sound = np.isfinite(ratios[:, k])
        value, error = ratios[sound, k], errors[sound, k]
        answers = (value < 1 - margin).astype(float)
        tree = grown(codes[sound], answers)
        hits, of = int(answers.sum()), int(sound.sum())
        unsure = float((np.abs(value - (1 - margin)) < 2 * error).mean()) if of else 1.0
        words = sentence(hits / of if of else 0.0, *wilson(hits, of), tree, answers)
        found[claim.name] = Share(hits, of, unsure, -1 if tree.root is None else tree.root.place, words)
    return found


def metrics(found: dict[str, Share]) -> dict[str, Metric]:
    """`<claim>.share`, `.low`, `.high`, `.unsure`, `.decided_by`."""
    keys = ("share", "low", "high", "unsure", "decided_by")
    numbers = {name: (one.share, *one.interval, one.unsure, float(one.place)) for name, one in found.items()}
    return {f"{name}.{key}": Metric(x, "1") for name, all_ in numbers.items() for key, x in zip(keys, all_, strict=True)}


def table(found: dict[str, Share], margin: float, count: int, members: int, cycles: int) -> Table:
    """One row a claim."""
    rows = []
    for claim in CLAIMS:
        one = found[claim.name]
        low, high = one.interval
        interval = f"{one.share:.2f}, {low:.2f} to {high:.2f}"
        rows.append([claim.text, interval, f"{one.unsure:.2f}", one.decided_by, one.words])
    names = ", ".join(f"{k} {a.name}" for k, a in enumerate(ASSUMPTIONS))
    sound = max(one.of for one in found.values())
    notes = NOTES.format(names=names, margin=100 * margin, count=count, suspect=count - sound, members=members, cycles=cycles)
    return Table(["claim", "share of worlds", "unsure", "decided by", "verdict"], rows, "Over all worlds", notes)


def figure(found: dict[str, Share], ratios: Array) -> Figure:
    """Left the ratio of every claim in every world; right the share of worlds in which it holds, with its interval."""
    fig, (left, right) = subplots(1, 2, height=115, sharey=True, width_ratios=(1.2, 1))
    places, draw = np.arange(len(CLAIMS))[::-1], np.random.default_rng(0)
    for k, (claim, place) in enumerate(zip(CLAIMS, places, strict=True)):
        values = ratios[np.isfinite(ratios[:, k]), k]
        left.plot(values, place + draw.uniform(-0.3, 0.3, len(values)), ".", color=COLOURS[0], markersize=1.5, alpha=0.5)
        left.plot(np.median(values), place, "|", color=COLOURS[6], markersize=11, markeredgewidth=1.5)
        one = found[claim.name]
        low, high = one.interval
        right.errorbar(one.share, place, xerr=[[one.share - low], [high - one.share]], fmt="o", color=COLOURS[1], capsize=2)
        right.annotate(
            one.decided_by.replace("c_max in", "unit of c_max"), (1.03, place), va="center", fontsize=7, annotation_clip=False
        )
    left.axvline(1, color="#999999", linewidth=0.8)
    left.set(xscale="log", xlabel="flexible/rigid; bar: median")
    plain_ticks(left.xaxis)
    left.set_yticks(places, [claim.text.replace(": ", ":\n") for claim in CLAIMS], fontsize=7)
    right.axvline(0.5, color="#999999", linewidth=0.8)
    right.set(xlim=(0, 1), xlabel="share of worlds")
    right.annotate("decided by:", (1.03, len(CLAIMS) - 0.3), va="center", fontsize=7, annotation_clip=False)
    return fig


def read(rows: Sequence[Any]) -> tuple[Array, Array]:
    """Ratios and their standard errors from a sweep's rows, shape (worlds, claims); nan in suspect and failed worlds."""
    ratios = np.full((len(rows), len(CLAIMS)), np.nan)
    errors = np.full_like(ratios, np.nan)
    for i, row in enumerate(rows):
        if row.status != "OK":
            continue
        for k, claim in enumerate(CLAIMS):
            found = row.metrics[f"{claim.name}.ratio"]
            ratios[i, k], errors[i, k] = found.value, found.value * found.error
    return ratios, errors
