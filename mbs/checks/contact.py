"""Self-check of contacts: they push while they are closed, and do nothing while they are open; ropes pull."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from buckler.mbs.checks.check import Check, without
from buckler.mbs.record.result import Result
from buckler.mbs.record.run import Run

ROUNDING = 1e-9
"""Of the largest force: a pull smaller than that is none."""


def _pulls(run: Run, result: Result) -> Iterator[str]:
    for name, depth in _one_sided(run):
        force = result.signals[name]
        allowed = ROUNDING * float(np.abs(force).max(initial=0.0))
        wrong = {"pulls" if depth else "would push, but goes slack,": force < -allowed}
        if depth:
            wrong["acts without touching"] = (np.abs(force) > allowed) & (result.signals[depth] <= 0)
        for what, where in wrong.items():
            if where.any():
                k = int(np.argmax(where))
                yield f"'{name}' {what} with {force[k]:.3g} N at t = {result.time[k]:.4g} s"


def _one_sided(run: Run) -> list[tuple[str, str]]:
    """Forces that must not be negative, and depths without which they are zero."""
    return [signals for name, element in run.record.mechanism.elements().items() for signals in element.one_sided(name)]


CHECK = Check(
    "CONTACT", "failed when a contact pulls, or acts without touching, or a rope pushes", _pulls,
    {"share of the largest force": ROUNDING}, without(_one_sided, "no stop, no joint with clearance and no rope"),
)  # fmt: skip
