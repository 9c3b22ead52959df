"""Contact forces of joints with clearance as a user function of the engine."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..geometry import Array
from . import Callback, System

if TYPE_CHECKING:
    from ..laws.contact import Kernel

PATIENCE = 1_000_000
"""Calls without a later time after which a step counts as stuck, some 10 s of them.

The engine's explicit integrator can reject one step for ever, and calls nothing in between but the forces."""
SLOWER = 10
"""Factor by which fewer calls are allowed in plain Python."""
STUCK = "the step is rejected again and again: no step is short enough for this law"


class NoStepError(RuntimeError):
    """Raised where no step is short enough for a law."""


def user_function(kernel: Kernel, memory: Array, places: Array, numbers: Array, size: int, latest: Array) -> Callback:
    """Make the engine's function of time, coordinates and rates from a kernel, its tables and its memory.

    Parameters
    ----------
    size : int
        Number of coordinates.
    latest : array, shape (2,)
        Latest time of all calls [s] and calls since then; infinite once it was called too often.
    """
    out, most = np.zeros(size), PATIENCE if kernel.compiled else PATIENCE // SLOWER

    def forces(_system: System, t: float, _item: int, q: Array, q_t: Array) -> Array:
        """Return the generalised forces at the engine's state."""
        latest[:] = (t, 0.0) if t > latest[0] else (latest[0], latest[1] + 1.0)
        if latest[1] > most:
            latest[1] = np.inf
            raise NoStepError(STUCK)
        kernel.forces(t, np.array(q), np.array(q_t), memory, places, numbers, out)
        return out

    return forces
