"""Answer of a refinement: a run with its errors."""

from dataclasses import dataclass, field
from math import inf

from ..record.errors import Errors, Status
from ..record.run import Run
from .demand import Demand, Worst


@dataclass(frozen=True)
class CheckedRun:
    """A run, its errors, and the signal whose error is worst."""

    run: Run
    errors: Errors = field(default_factory=Errors)  # unknown where no finer run could be made
    worst: Worst = field(default_factory=lambda: Worst(error=inf))  # without a finer run the error is not known
    chaos: Status | None = None  # CHAOTIC or SENSITIVE: errors hold only up to `errors.until`
    reason: str = ""  # why refinement ended early, in words
    count: int = 1  # runs that were made

    def shortfall(self, demand: Demand) -> str:
        """Say in a sentence which error is above the allowed one; '' if none is."""
        why = f"; {self.reason}" if self.reason else ""
        if not self.errors.known:
            return f"ACCURACY: no finer run could be made, so that the error is not known ({self.count} runs){why}"
        if self.worst.ratio <= 1:
            return ""
        error, allowed = (f"{100 * e:.2g} %" if 1e-3 <= e < 10 else f"{e:.1e}" for e in (self.worst.error, self.worst.allowed))
        off = f"is off by {error} (relative error), allowed {allowed}"
        return f"ACCURACY: '{self.worst.name}' {off}, after {self.count} runs; asked of {demand.words}{why}"
