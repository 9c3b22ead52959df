"""Contact of joints with clearance, with any pair of laws: one compiled kernel, or the same equations in plain Python.

The laws of this package are numbers of a joint's row, so that the kernel is compiled once for all of them. A user's own law is
compiled for itself and is an address there; a law that does more than arithmetic runs in plain Python.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, field
from functools import cache, lru_cache, partial
from pathlib import Path
from types import FunctionType
from typing import Any

import numpy as np

from ..geometry import Array
from ..process import compiler
from . import journal
from .compiled import Pointer, compile_cached, compile_plain, stamp_of
from .friction import BristleLaw, FrictionLaw, remembering
from .journal import spread
from .pieces import NormalLaw
from .rows import add_friction, add_normal
from .table import CODES, NUMBERS, Laws, bristle_after, friction, normal_force

GEOMETRY = journal.GAP + 1
"""Numbers of a joint's row before those of its laws: the codes of both as the bits of floats, then the numbers of both."""
FIRST = GEOMETRY + 2 * CODES
LAST = FIRST + 2 * NUMBERS
WIDTH = len(journal.COLUMNS)
"""Columns of the report."""
NORMAL = 0
"""Row of the normal law."""
FRICTION = 1
"""Row of the friction law."""


@dataclass(frozen=True)
class Kernel:
    """Forces and report of joints that share a pair of laws.

    Both are functions of time, coordinates, rates, memory, the two tables and what is to be filled. `constants` follow the
    geometry in each joint's row; `owners` keep the machine code alive whose addresses are among them.
    """

    forces: Callable[..., None]
    report: Callable[..., None]
    compiled: bool
    constants: Array = field(default_factory=lambda: np.empty(0))
    owners: tuple[object, ...] = ()


def kernel_of(law: NormalLaw, friction: FrictionLaw | BristleLaw) -> Kernel:
    """Build the functions for a normal and a friction law: compiled if Numba can, else in plain Python, twenty times slower."""
    return (compiler() and compile_kernel(law, friction)) or plain(law, friction)  # type: ignore[arg-type]  # laws are frozen


def plain(law: NormalLaw, friction: FrictionLaw | BristleLaw) -> Kernel:
    """Make the functions in plain Python."""

    def normal(_numbers: Array, depth: float, rate: float, onset: float) -> float:
        """Return the normal force [N]."""
        return law.force(depth, rate, onset)

    rubs = remembering(friction)
    laws = normal, lambda _numbers, *state: rubs.coefficient(*state), lambda _numbers, *state: rubs.after(*state)
    report = journal.report_with(*laws)
    return Kernel(_bound(_forces, report), report, compiled=False)


@lru_cache(maxsize=256)
def compile_kernel(law: NormalLaw, friction: FrictionLaw | BristleLaw) -> Kernel | None:
    """Make the compiled functions; None if a law does more than arithmetic on its arguments and its own numbers."""
    rows = _Rows()
    add_normal(rows, law)
    add_friction(rows, friction)
    if not all(pointer.compiled for pointer in rows.pointers):
        return None
    constants = np.concatenate([np.array(rows.codes, dtype=np.int64).ravel().view(float), np.array(rows.numbers).ravel()])
    return Kernel(*_functions(), compiled=True, constants=constants, owners=tuple(rows.pointers))


class _Rows:
    """A table of two laws in the making."""

    def __init__(self) -> None:
        self.codes: list[list[int]] = []
        self.numbers: list[list[float]] = []
        self.pointers: list[Pointer] = []

    def add_law(
        self, _key: Hashable, kind: int, numbers: Sequence[float], pointers: Sequence[Pointer] = (), _about: str = ""
    ) -> int:
        """Append a law; return its row."""
        addresses = [pointer.address for pointer in pointers]
        self.codes.append([kind, *addresses, *[0] * (CODES - 1 - len(addresses))])
        self.numbers.append([*map(float, numbers), *[0.0] * (NUMBERS - len(numbers))])
        self.pointers += pointers
        return len(self.codes) - 1


def _laws_of(numbers: Array) -> Laws:
    return Laws(numbers[GEOMETRY:FIRST].view(np.int64).reshape(2, CODES), numbers[FIRST:LAST].reshape(2, NUMBERS))


def _normal(numbers: Array, depth: float, rate: float, onset: float) -> float:
    return normal_force(_laws_of(numbers), NORMAL, depth, rate, onset)


def _friction(numbers: Array, speed: float, bristle: float) -> float:
    return friction(_laws_of(numbers), FRICTION, speed, bristle)


def _bristle(numbers: Array, bristle: float, speed: float, time: float) -> float:
    return bristle_after(_laws_of(numbers), FRICTION, bristle, speed, time)


def _report(*_: object) -> None:
    """Stand for the report of joints with laws, which `_bound` puts here."""
    raise NotImplementedError


def _rows(t: float, q: Array, v: Array, memory: Array, places: Array, numbers: Array, out: Array) -> None:
    _report(t, q, v, memory, places, numbers, out)


def _forces(t: float, q: Array, v: Array, memory: Array, places: Array, numbers: Array, out: Array) -> None:
    rows = np.empty((places.shape[0], WIDTH))
    _report(t, q, v, memory, places, numbers, rows)
    spread(rows, q, v, places, numbers, out)


def _bound(function: Callable[..., None], report: Callable[..., None]) -> Any:
    """Make a function of this module that reports by `report`.

    The compiler keeps machine code of functions with globals on disk, not of those with closures or functions as arguments.
    """
    return FunctionType(function.__code__, globals() | {"_report": report}, function.__name__)


@cache
def _functions() -> tuple[Any, Any]:
    """Compile forces and report, or read them from disk."""
    import numba
    from numba import float64, int64, void

    jit = numba.njit(error_model="numpy")
    report = compile_plain(journal.report_with(*(compile_plain(law, jit) for law in (_normal, _friction, _bristle))), jit)
    stamp = stamp_of(*(Path(__file__).with_name(f"{name}.py") for name in ("contact", "journal", "table")))
    vector, table, places = float64[::1], float64[:, ::1], int64[:, ::1]
    made = []
    for function, out in ((_forces, vector), (_rows, table)):
        made.append(compile_plain(_bound(function, report), jit, partial(compile_cached, stamp=stamp)))
        made[-1].compile(void(float64, vector, vector, table, places, table, out))
    return made[0], made[1]
