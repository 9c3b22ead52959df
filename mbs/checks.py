"""Self-checks of a finished run: each gives the reasons for which it must not be trusted."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from mbs.mechanism import Beam, Cable
from mbs.result import Result

BALANCE = 1e-2
"""Energy balance, relative to the energy put through, beyond which a run is suspect."""
BUCKLED_FROM = 1e-3
"""Relative end shortening beyond which a strip must be seen to be buckled."""


def suspicions(scene: Any, result: Result) -> Iterator[str]:
    """Yield the checks that failed, in words."""
    if not all(np.isfinite(values).all() for values in result.signals.values()):
        yield "NOT_FINITE: a signal is not finite"
    if len(result.time) > 1 and not (np.diff(result.time) > 0).all():
        yield "TIME: time does not increase"
    if result.energy and not result.energy_balance <= BALANCE:
        yield f"ENERGY: balance {result.energy_balance:.2e} of the energy put through, allowed {BALANCE:g}"
    yield from _straight_strips(scene, result)
    yield from _pierced_stops(scene, result)


def _straight_strips(scene: Any, result: Result) -> Iterator[str]:
    """A strip much shorter than its arc must bow: chord shortening without bending is axial crushing, not buckling."""
    for link in scene.mechanism.links:
        if isinstance(link.body, Beam | Cable):
            length = scene.arc_length(link.name)
            shortening = result.signals[f"{link.name}.end_shortening"] / length
            strips = np.abs(shortening) > BUCKLED_FROM
            axial = np.abs(_axial_share(link, result, shortening, length))
            if (strips & (axial > 0.5)).any():
                yield f"UNBUCKLED: '{link.name}' is {shortening.max():.2g} of its length short without bending"


def _axial_share(link: Any, result: Result, shortening: Any, length: float) -> Any:
    """Share of the end shortening that the mid-span deflection cannot explain, for a single half wave.

    Higher modes bend without deflecting the middle, so only a vanishing deflection over the whole run speaks against it.
    """
    deflection = np.abs(result.signals[f"{link.name}.deflection"]) / length
    return np.where(deflection.max() < 1e-6, 1.0, 0.0) * np.ones_like(shortening)


def _pierced_stops(scene: Any, result: Result) -> Iterator[str]:
    """A contact law means nothing once the point has gone through the stop by the size of the mechanism."""
    size = max(scene.mechanism.length(link.name) for link in scene.mechanism.links)
    for point in scene.stops:
        deepest = float(result.signals[f"{point}.penetration"].max(initial=0.0))
        if deepest > 0.05 * size:
            yield f"PENETRATION: '{point}' is {deepest:.3g} m inside its stop; the stop is too soft for this motion"
