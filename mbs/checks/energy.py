"""Self-check of the energy: what is held, taken and given must add up."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from buckler.mbs.checks.check import Check
from buckler.mbs.record.energy import AT_REST, BALANCE, BRISTLE, STRETCH, ledger, put_through
from buckler.mbs.record.means import RINGS
from buckler.mbs.record.result import Result
from buckler.mbs.record.run import Run


def _unbalanced(run: Run, result: Result) -> Iterator[str]:
    """What is held, taken and given must add up, and what takes energy must not give it."""
    record, energy = run.record, result.energy or ledger(run.record)
    told = (error for name, error in result.error.items() if name.startswith("energy.") and name != "energy.balance")
    allowed = max([BALANCE, *told])
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


CHECK = Check(
    "ENERGY",
    "failed when energy held, taken and given do not add up, or something that takes energy gives it back",
    _unbalanced,
    {
        "balance": BALANCE,
        "way of rest": AT_REST,
        "unseen stretch": STRETCH,
        "stretch that steps do not follow": RINGS,
        "unseen bristle": BRISTLE,
    },
    _idle,
)
