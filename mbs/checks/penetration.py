"""Self-check of contact laws: they do not hold beyond a depth."""

from __future__ import annotations

from collections.abc import Iterator

from buckler.mbs.mechanism import Mechanism
from buckler.mbs.record.result import Result


def pierced(mechanism: Mechanism, result: Result) -> Iterator[str]:
    """Yield the contacts that are deeper than their laws hold: a share of the mechanism, or the clearance of a joint."""
    for name, element in mechanism.elements().items():
        for depth in element.depths(name, mechanism):
            deepest = float(result.signals[depth.signal].max(initial=0.0))
            if deepest > depth.allowed:
                yield f"PENETRATION: {depth.what} is {deepest:.3g} m {depth.where}"
