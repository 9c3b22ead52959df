"""What the engine leaves behind before it is made into a record."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from buckler.mbs.engine.placed import States
from buckler.mbs.engine.system import System
from buckler.mbs.geometry import Array


@dataclass(frozen=True)
class History:
    """What the engine's steps left behind, as arrays.

    Attributes
    ----------
    time : array, shape (times,)
    states : States
        Coordinates and rates, each (times, coordinates).
    multipliers : array, shape (times, constraints)
    contact : array, shape (times, stops)
        Contact forces, N.
    memory : list of array, shape (times, joints, 4)
        What `journal.MEMORY` names, of each of the scene's `remembering`.
    """

    time: Array
    states: States
    multipliers: Array
    contact: Array
    memory: list[Array]


class Remembering(Protocol):
    """What keeps a memory from one accepted step to the next."""

    memory: Array
    remembers: bool
    latest: Array
    """Latest time it was asked for, and how often since: infinite once that was too often."""

    def locate(self, system: System) -> None:
        """Take down where its coordinates lie, once the system is assembled."""

    def accept(self, q: Array, q_t: Array, t: float) -> Array:
        """Take over an accepted step; a copy of the memory."""
