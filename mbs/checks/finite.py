"""Self-check of the numbers: they are numbers."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from buckler.mbs.checks.check import Check
from buckler.mbs.record.result import Result
from buckler.mbs.record.run import Run


def _finite(_run: Run, result: Result) -> Iterator[str]:
    if not all(np.isfinite(values).all() for values in result.signals.values()):
        yield "a signal is not finite"


CHECK = Check("NOT_FINITE", "failed when a signal has a value that is not finite", _finite)
