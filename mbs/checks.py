"""Self-checks of a finished run: each gives the reasons for which it must not be trusted."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from mbs.mechanism import Beam, Cable
from mbs.result import Result

BALANCE = 1e-2
"""Energy balance, relative to the energy put through, beyond which a run is suspect."""
BUCKLED_FROM = 5e-3
"""Relative end shortening beyond which a strip must be seen to be buckled."""

ENDS_MET = 0.02
"""Distance of a strut's ends, relative to its length, at which they have met."""


def suspicions(scene: Any, result: Result) -> Iterator[str]:
    """Yield the checks that failed, in words."""
    if not all(np.isfinite(values).all() for values in result.signals.values()):
        yield "NOT_FINITE: a signal is not finite"
    if len(result.time) > 1 and not (np.diff(result.time) > 0).all():
        yield "TIME: time does not increase"
    if result.energy and not result.energy_balance <= BALANCE:
        yield f"ENERGY: balance {result.energy_balance:.2e} of the energy put through, allowed {BALANCE:g}"
    for name, taken in result.energy.items():
        if name.startswith("taken_"):
            given = float((np.maximum.accumulate(taken) - taken).max() / max(result.energy["throughput"][-1], 1e-300))
            if given > BALANCE:
                yield f"ENERGY: '{name}' gives back {given:.2e} of the energy put through: a law makes energy"
    yield from _straight_strips(scene, result)
    yield from _pierced_stops(scene, result)
    yield from _crossed_struts(scene, result)
    yield from _pierced_bushes(scene, result)


def _straight_strips(scene: Any, result: Result) -> Iterator[str]:
    """A strip much shorter than its arc must have bent: a chord shortened by axial strain alone is an unbuckled state."""
    for link in scene.mechanism.links:
        if isinstance(link.body, Beam | Cable):
            shortening = result.signals[f"{link.name}.end_shortening"] / scene.arc_length(link.name)
            strain = -result.signals[f"{link.name}.axial_force"] / link.body.section.axial_stiffness
            unbuckled = (shortening > BUCKLED_FROM) & (strain > 0.5 * shortening)
            if unbuckled.any():
                k = int(np.argmax(unbuckled))
                yield f"UNBUCKLED: at t = {result.time[k]:.4g} s '{link.name}' is {shortening[k]:.2g} of its length short, unbent"


def _pierced_stops(scene: Any, result: Result) -> Iterator[str]:
    """A contact law means nothing once the point has gone through the stop by the size of the mechanism."""
    size = max(scene.mechanism.length(link.name) for link in scene.mechanism.links)
    for point in scene.stops:
        deepest = float(result.signals[f"{point}.penetration"].max(initial=0.0))
        if deepest > 0.05 * size:
            yield f"PENETRATION: '{point}' is {deepest:.3g} m inside its stop; the stop is too soft for this motion"


def _crossed_struts(scene: Any, result: Result) -> Iterator[str]:
    """A strut knows its ends' distance only: once they have met, it pushes the wrong way."""
    for name in scene.struts:
        length = scene.mechanism.length(name)
        if (result.signals[f"{name}.end_shortening"] > (1 - ENDS_MET) * length).any():
            yield f"CROSSED: the ends of strut '{name}' met; its force law ends there"


def _pierced_bushes(scene: Any, result: Result) -> Iterator[str]:
    """A contact law of pin and bush means nothing once the pin is deeper in the bush than it has play."""
    for group in scene.clearances:
        for joint in group.joints:
            deepest = float(result.signals[f"{joint.point}.penetration"].max(initial=0.0))
            if deepest > joint.gap:
                yield f"PENETRATION: pin '{joint.point}' is {deepest:.3g} m in its bush, more than its play {joint.gap:.3g} m"
