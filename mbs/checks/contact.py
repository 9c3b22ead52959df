"""Self-check of contacts: they push while they are closed, and do nothing while they are open; ropes pull."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from buckler.mbs.checks.check import Check
from buckler.mbs.elements.element import Array
from buckler.mbs.record.result import Result
from buckler.mbs.record.run import Run

ROUNDING = 1e-9
"""Of the largest force: a pull smaller than that is none."""


def _pulls(run: Run, result: Result) -> Iterator[str]:
    signals = result.signals
    for point, force in _contacts(result):
        allowed = ROUNDING * float(np.abs(force).max(initial=0.0))
        pulling = force < -allowed
        apart = (np.abs(force) > allowed) & (signals[f"{point}.penetration"] <= 0)
        for wrong, what in ((pulling, "pulls"), (apart, "acts without touching")):
            if wrong.any():
                k = int(np.argmax(wrong))
                yield f"'{point}' {what} with {force[k]:.3g} N at t = {result.time[k]:.4g} s"
    for name in _one_sided(run):
        force = signals[name]
        slack = force < -ROUNDING * float(np.abs(force).max(initial=0.0))
        if slack.any():
            k = int(np.argmax(slack))
            yield f"{name} = {force[k]:.3g} N at t = {result.time[k]:.4g} s: it would push, but goes slack"


def _one_sided(run: Run) -> list[str]:
    """Signals that must not be negative."""
    return [signal for name, element in run.record.mechanism.elements().items() for signal in element.one_sided(name)]


def _contacts(result: Result) -> Iterator[tuple[str, Array]]:
    """Name and force of every contact; the force of a slider, which may have either sign, is none."""
    for name, force in result.signals.items():
        point, _, kind = name.rpartition(".")
        if kind in ("contact_force", "normal_force") and f"{point}.penetration" in result.signals:
            yield point, force


def _idle(run: Run, result: Result) -> str:
    return "" if any(_contacts(result)) or _one_sided(run) else "no stop, no joint with clearance and no rope"


CHECK = Check(
    "CONTACT", "failed when a contact pulls, or acts without touching, or a rope pushes", _pulls,
    {"share of the largest force": ROUNDING}, _idle,
)  # fmt: skip
