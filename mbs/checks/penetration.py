"""Self-check of contacts: their laws do not hold beyond a depth."""

from __future__ import annotations

from collections.abc import Iterator

from buckler.mbs.checks.check import Check, without
from buckler.mbs.elements.signal import Depth
from buckler.mbs.record.result import Result
from buckler.mbs.record.run import Run


def _pierced(run: Run, result: Result) -> Iterator[str]:
    """Each element knows how deep its contacts may be: `depths`."""
    for depth in _depths(run):
        deepest = float(result.signals[depth.signal].max(initial=0.0))
        if deepest > depth.allowed:
            yield f"{depth.what} is {deepest:.3g} m {depth.where}"


def _depths(run: Run) -> Iterator[Depth]:
    mechanism = run.record.mechanism
    for name, element in mechanism.elements().items():
        yield from element.depths(name, mechanism)


CHECK = Check(
    "PENETRATION",
    "failed when a point is deeper in its stop than a share of the mechanism, or a pin in its bush than both its clearance and a "
    "share of its radius: a law of surfaces does not hold there",
    _pierced,
    idle=without(_depths, "no stop and no joint with clearance"),
)
