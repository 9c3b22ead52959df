"""Self-check of contact laws: they mean nothing beyond a depth."""

from __future__ import annotations

from collections.abc import Iterator

from buckler.mbs.elements.clearance import Clearance
from buckler.mbs.elements.stop import Stop
from buckler.mbs.mechanism import Mechanism
from buckler.mbs.record.result import Result

PIERCED = 0.05
"""Depth in a stop, relative to the mechanism's size, beyond which its contact law means nothing."""


def pierced(mechanism: Mechanism, result: Result) -> Iterator[str]:
    """Yield the points that are deeper in a stop than a share of the mechanism, or in a bush than they have clearance."""
    size = max(mechanism.length(link.name) for link in mechanism.links)
    for name, element in mechanism.elements().items():
        if isinstance(element, Stop):
            deepest = float(result.signals[f"{name}.penetration"].max(initial=0.0))
            if deepest > PIERCED * size:
                yield f"PENETRATION: '{name}' is {deepest:.3g} m inside its stop; the stop is too soft for this motion"
        elif isinstance(element, Clearance):
            deepest = float(result.signals[f"{element.point}.penetration"].max(initial=0.0))
            if deepest > element.gap:
                more = f"more than its play {element.gap:.3g} m"
                yield f"PENETRATION: pin '{element.point}' is {deepest:.3g} m in its bush, {more}"
