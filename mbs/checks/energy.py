"""Self-check of the energy: what is held, taken and given must add up."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from buckler.mbs.elements.element import Array
from buckler.mbs.mechanism import Mechanism

BALANCE = 1e-2
"""Energy balance, relative to the energy put through, beyond which a run is suspect."""
RESTING = 1e-6
"""Way, relative to the mechanism's size, that a mechanism at rest may go in a run."""
OF_ACCURACY = 3.0
"""The same in units of an accuracy that was asked for, where that is more."""


def unbalanced(energy: Mapping[str, Array], allowed: float, least: float = 0.0) -> Iterator[str]:
    """What is held, taken and given must add up, and what takes energy must not give it; below `least`, J, nothing moves."""
    through = max(float(energy["throughput"][-1]), least, np.finfo(float).tiny)
    balance = float(np.abs(energy["error"]).max()) / through
    if not balance <= allowed:
        yield f"ENERGY: balance {balance:.2e} of the energy put through, allowed {allowed:g}"
    for name, taken in energy.items():
        if name.startswith("taken_"):
            given = float((np.maximum.accumulate(taken) - taken).max()) / through
            if given > allowed:
                yield f"ENERGY: '{name}' gives back {given:.2e} of the energy put through: a law makes energy"


def energy_at_rest(mechanism: Mechanism, duration: float) -> float:
    """Kinetic energy, J, with which all links would go a millionth of the mechanism's size in a run."""
    lengths = [mechanism.length(link.name) for link in mechanism.links]
    mass = sum(link.mass(length) for link, length in zip(mechanism.links, lengths, strict=True))
    return 0.5 * mass * (RESTING * max(lengths) / duration) ** 2
