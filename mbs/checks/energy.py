"""Self-check of the energy: what is held, taken and given must add up."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from buckler.mbs.elements.element import Array

BALANCE = 1e-2
"""Energy balance, relative to the energy put through, beyond which a run is suspect."""
OF_ACCURACY = 3.0
"""The same in units of an accuracy that was asked for, where that is more."""


AT_REST = 1e-6
"""Way, in lengths of the largest link, below which a mechanism has not moved in the whole run: what moves it is round-off."""


def at_rest(mechanism: Any, duration: float) -> float:
    """Energy, J, of all links at a speed at which nothing moves in a run this long [s]."""
    lengths = {link.name: mechanism.length(link.name) for link in mechanism.links}
    mass = sum(link.mass(lengths[link.name]) for link in mechanism.links)
    return mass * (AT_REST * max(lengths.values()) / duration) ** 2 / 2


def unbalanced(energy: Mapping[str, Array], allowed: float, least: float) -> Iterator[str]:
    """What is held, taken and given must add up, and what takes energy must not give it; `least` is as good as none, J."""
    through = max(float(energy["throughput"][-1]), least)
    balance = float(np.abs(energy["error"]).max()) / through
    if not balance <= allowed:
        yield f"ENERGY: balance {balance:.2e} of the energy put through, allowed {allowed:g}"
    for name, taken in energy.items():
        if name.startswith("taken_"):
            given = float((np.maximum.accumulate(taken) - taken).max()) / through
            if given > allowed:
                yield f"ENERGY: '{name}' gives back {given:.2e} of the energy put through: a law makes energy"
