"""Self-check of the energy: what is held, taken and given must add up."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from buckler.mbs.checks.check import Check
from buckler.mbs.record.energy import AT_REST, BALANCE, BRISTLE, STRETCH, ledger, put_through, size_of
from buckler.mbs.record.result import Result
from buckler.mbs.record.run import Run

OF_ACCURACY = 3.0
"""The same in units of an accuracy that was asked for, or of what extrapolation changed the places by: the ledger is that of the
finest run, not of the limit."""


def _unbalanced(run: Run, result: Result) -> Iterator[str]:
    """What is held, taken and given must add up, and what takes energy must not give it."""
    record, energy = run.record, result.energy or ledger(run.record)
    allowed = max(BALANCE, OF_ACCURACY * result.asked, OF_ACCURACY * _changed(run, result))
    if result.asked > 0:  # of places, say: how far the energies are off is told
        allowed = max([allowed, *(error for name, error in result.error.items() if name.startswith("energy."))])
    through, unseen = put_through(record, energy, result.signals)
    allowed += unseen
    balance = float(np.abs(energy["error"]).max()) / through
    if not balance <= allowed:
        yield f"balance {balance:.2e} of the energy put through, allowed {allowed:g}"
    for name, taken in energy.items():
        if name.startswith("taken_"):
            given = float((np.maximum.accumulate(taken) - taken).max()) / through
            if given > allowed:
                yield f"'{name}' gives back {given:.2e} of the energy put through: a law makes energy"


def _idle(run: Run, result: Result) -> str:
    """Work cannot be summed over steps that were not recorded."""
    return "" if result.energy or run.solver.steps.record_every == 1 else "not every step was recorded"


def _changed(run: Run, result: Result) -> float:
    """Change of the points' places by extrapolation, in lengths of the largest link; 0 where nothing was extrapolated."""
    names = [f"{point}.{axis}" for point in run.record.mechanism.points for axis in "xy"]
    return max(float(np.abs(result.signals[name] - run.signals[name].values).max()) for name in names) / size_of(run.record)


CHECK = Check(
    "ENERGY",
    "failed when energy held, taken and given do not add up, or something that takes energy gives it back",
    _unbalanced,
    {
        "balance": BALANCE,
        "of an accuracy": OF_ACCURACY,
        "way of rest": AT_REST,
        "unseen stretch": STRETCH,
        "unseen bristle": BRISTLE,
    },
    _idle,
)
