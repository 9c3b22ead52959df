"""Self-check of the clock: time goes forward."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from buckler.mbs.checks.check import Check
from buckler.mbs.record.result import Result
from buckler.mbs.record.run import Run


def _increases(_run: Run, result: Result) -> Iterator[str]:
    if not (np.diff(result.time) > 0).all():
        yield "time does not increase"


CHECK = Check("TIME", "failed when time stands still or goes back from one sample to the next", _increases)
