"""What the engine is given for joints with clearance: the equations of a journal with its laws, as functions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from buckler.mbs.elements import journal
from buckler.mbs.elements.element import Array
from buckler.mbs.laws import BristleLaw

PATIENCE, SLOWER = 3_000_000, 20
"""Calls, some 10 s of them, without a later time than any before; of plain Python so many times fewer. The engine's explicit
integrator can reject one step for ever, and asks nobody in between but the forces."""
STUCK = "the step is rejected again and again: no step is short enough for this law"


class NoStepError(RuntimeError):
    """No step is short enough."""


@dataclass(frozen=True)
class Kernel:
    """The functions for one pair of laws, and whether Numba made them.

    Attributes
    ----------
    forces, report : callable
        Of time, coordinates and their rates, memory, the two tables, and what is to be filled.
    callback : callable
        Of memory, tables and number of coordinates: makes `forces` a user function of the engine.
    compiled : bool
    """

    forces: Callable[..., None]
    report: Callable[..., None]
    callback: Callable[[Array, Array, Array, int, Array], Callable[..., Any]]
    compiled: bool


def has_bristle(friction: Any) -> bool:
    """Tell whether a friction law bends a bristle."""
    return isinstance(friction, BristleLaw)


def plain(law: Any, friction: Any) -> Kernel:
    """Make the functions in plain Python."""
    if has_bristle(friction):
        laws = law.force, friction.coefficient, friction.after
    else:
        laws = law.force, lambda speed, _bristle: friction.coefficient(speed), lambda _bristle, _speed, _time: 0.0
    forces = partial(journal.forces, *laws)

    def callback(memory: Array, places: Array, numbers: Array, size: int, latest: Array) -> Callable[..., Any]:
        out = np.zeros(size)

        def generalised(_system: Any, t: float, _item: int, q: Any, q_t: Any) -> Any:
            latest[:] = (t, 0.0) if t > latest[0] else (latest[0], latest[1] + 1.0)
            if latest[1] > PATIENCE // SLOWER:
                latest[1] = np.inf
                raise NoStepError(STUCK)
            forces(t, np.array(q), np.array(q_t), memory, places, numbers, out)
            return out

        return generalised

    return Kernel(forces, partial(journal.report, *laws), callback, compiled=False)
