"""Random mechanisms: saved ones that were once solved wrongly, and one of every family of the study `extremes`.

`drawn/cases.json` has, for each saved mechanism, its duration, the accuracy asked for, the verdict that it is known to have still
(`known`), and whether it is slow.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

from buckler.mbs import Mechanism
from buckler.studies.extremes import extremes
from buckler.studies.extremes.case import Finding, Verdict, judge
from buckler.studies.kit.drawn import Draw

from .known import Answer, Known

FOLDER = Path(__file__).parent / "drawn"
ACCEPTED = (Verdict.RIGHT, Verdict.NAMED)
"""Verdicts that a random mechanism may have."""
SEED = 1
"""Seed of the study's mechanisms, an arbitrary number."""
TIMEOUT = 200.0
"""Time limit of a run [s]; longer than any takes, so that verdicts do not depend on the machine."""


def convert(finding: Finding) -> Answer:
    """Convert a finding of the study to an answer, whose number is the error over the allowed one."""
    status, _, message = (finding.message or "OK").partition(": ")
    right = float("nan") if finding.worst == "" else 0.0
    return Answer(finding.error, right, 1.0, status=status, message=message)


def solve_saved(case: dict[str, Any]) -> Answer:
    """Run a saved mechanism, and compare it with its reference."""
    saved = Draw(case["name"], Mechanism.load(FOLDER / f"{case['name']}.toml"), case["duration"])
    return convert(judge("saved", saved, case["accuracy"], TIMEOUT))


def solve_drawn(slug: str) -> Answer:
    """Run the first mechanism of a family, and compare it with its reference."""
    parameters = extremes.Parameters(seed=SEED, families=(slug,))
    return convert(judge(*extremes.make_case(parameters, 0), TIMEOUT))


def list_known() -> Iterator[Known]:
    """Yield the saved mechanisms, and the first of each family."""
    for case in json.loads((FOLDER / "cases.json").read_text(encoding="utf-8")):
        solve = partial(solve_saved, case)
        yield Known("random", "saved: once wrong", case["name"], solve, case["slow"], ACCEPTED, case["known"])
    for slug in extremes.SLUGS:
        still = Verdict.SILENT if slug == "clearance" else ""  # its highest peak is 5.9 % off, its error reported as 5.0 %
        yield Known("random", "first of each family of `extremes`", slug, partial(solve_drawn, slug), True, ACCEPTED, still)
