"""Self-check of struts: their force law ends where their ends meet."""

from __future__ import annotations

from collections.abc import Iterator

from buckler.mbs.checks.check import Check, without
from buckler.mbs.record.result import Result
from buckler.mbs.record.run import Run

ENDS_MET = 0.02
"""Distance of a strut's ends, relative to its length, at which they have met."""


def _crossed(run: Run, result: Result) -> Iterator[str]:
    """A strut knows its ends' distance only: once they have met, it pushes the wrong way."""
    for name in _struts(run):
        if (result.signals[f"{name}.end_shortening"] > (1 - ENDS_MET) * run.record.mechanism.length(name)).any():
            yield f"the ends of strut '{name}' met; its force law ends there"


def _struts(run: Run) -> list[str]:
    return [link.name for link in run.record.mechanism.links if link.body.massless]


NONE = without(_struts, "no strut")
CHECK = Check("CROSSED", "failed when the ends of a strut have met", _crossed, {"distance over length": ENDS_MET}, NONE)
