"""Self-checks of strips and struts: are they on the branch that a thin strip takes?"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from buckler.mbs.record.record import Record
from buckler.mbs.record.result import Result

BUCKLED_FROM = 5e-3
"""Relative end shortening beyond which a strip must be seen to be buckled."""
ENDS_MET = 0.02
"""Distance of a strut's ends, relative to its length, at which they have met."""


def branches(record: Record, result: Result) -> Iterator[str]:
    """Yield what is wrong with the branch a run is on, in words."""
    yield from _straight_strips(record, result)
    yield from _crossed_struts(record, result)


def _straight_strips(record: Record, result: Result) -> Iterator[str]:
    """A strip much shorter than its arc must have bent: a chord shortened by axial strain alone is an unbuckled state."""
    for link in record.mechanism.links:
        if link.body.meshed:
            shortening = result.signals[f"{link.name}.end_shortening"] / record.links[link.name].length
            strain = -result.signals[f"{link.name}.axial_force"] / link.body.section.axial_stiffness
            unbuckled = (shortening > BUCKLED_FROM) & (strain > 0.5 * shortening)
            if unbuckled.any():
                k = int(np.argmax(unbuckled))
                yield f"UNBUCKLED: at t = {result.time[k]:.4g} s '{link.name}' is {shortening[k]:.2g} of its length short, unbent"


def _crossed_struts(record: Record, result: Result) -> Iterator[str]:
    """A strut knows its ends' distance only: once they have met, it pushes the wrong way."""
    for name in [link.name for link in record.mechanism.links if link.body.massless]:
        length = record.mechanism.length(name)
        if (result.signals[f"{name}.end_shortening"] > (1 - ENDS_MET) * length).any():
            yield f"CROSSED: the ends of strut '{name}' met; its force law ends there"
