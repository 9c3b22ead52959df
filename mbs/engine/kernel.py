"""What the engine is given for joints with clearance: the equations of a journal with its laws, as functions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from ..elements import journal
from ..geometry import Array
from ..laws import BristleLaw, FrictionLaw, NormalLaw
from ..laws.friction import remembering
from . import Callback, System

PATIENCE, SLOWER = 3_000_000, 20
"""Calls, some 10 s of them, without a later time than any before; of plain Python so many times fewer. The engine's explicit
integrator can reject one step for ever, and asks nobody in between but the forces."""
STUCK = "the step is rejected again and again: no step is short enough for this law"


class NoStepError(RuntimeError):
    """No step is short enough."""


@dataclass(frozen=True)
class Kernel:
    """The functions for one pair of laws, whether Numba made them, and what they find of the laws in a joint's row of numbers.

    Attributes
    ----------
    forces, report : callable
        Of time, coordinates and their rates, memory, the two tables, and what is to be filled.
    callback : callable
        Of memory, tables and number of coordinates: makes `forces` a user function of the engine.
    compiled : bool
    constants : array
        What follows the places and radii in each joint's row of numbers.
    owners : tuple
        What keeps the machine code alive whose addresses are among them.
    """

    forces: Callable[..., None]
    report: Callable[..., None]
    callback: Callable[[Array, Array, Array, int, Array], Callback]
    compiled: bool
    constants: Array = field(default_factory=lambda: np.empty(0))
    owners: tuple[object, ...] = ()


def plain(law: NormalLaw, friction: FrictionLaw | BristleLaw) -> Kernel:
    """Make the functions in plain Python."""

    def normal(_numbers: Array, depth: float, rate: float, onset: float) -> float:
        return law.force(depth, rate, onset)

    rubs = remembering(friction)
    laws = normal, lambda _numbers, *state: rubs.coefficient(*state), lambda _numbers, *state: rubs.after(*state)
    forces = partial(journal.forces, *laws)

    def callback(memory: Array, places: Array, numbers: Array, size: int, latest: Array) -> Callback:
        out = np.zeros(size)

        def generalised(_system: System, t: float, _item: int, q: Array, q_t: Array) -> Array:
            latest[:] = (t, 0.0) if t > latest[0] else (latest[0], latest[1] + 1.0)
            if latest[1] > PATIENCE // SLOWER:
                latest[1] = np.inf
                raise NoStepError(STUCK)
            forces(t, np.array(q), np.array(q_t), memory, places, numbers, out)
            return out

        return generalised

    return Kernel(forces, partial(journal.report, *laws), callback, compiled=False)
