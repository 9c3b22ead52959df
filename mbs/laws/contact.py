"""Laws as rows of the compiled table, and the contact kernel of joints with clearance: compiled, or in plain Python.

Laws of this package are numbers of a row, so that the kernel is compiled once for all of them. A user's law is compiled
separately, and the row has its address. A law that does more than arithmetic runs in plain Python.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from functools import cache, lru_cache, partial
from pathlib import Path
from types import FunctionType
from typing import Any, Protocol

import numpy as np

from .. import laws
from ..geometry import Array
from ..process import has_compiler
from . import journal
from .compiled import Pointer, compile_cached, compile_plain, function_pointer, stamp_of
from .friction import BristleLaw, FrictionLaw, as_bristle_law
from .journal import spread
from .pieces import NormalLaw
from .table import CODES, NUMBERS, FrictionKind, Laws, NormalKind, bristle_after, friction, normal_force

Known = Mapping[type, tuple[int, tuple[str, ...]]]


class LawTable(Protocol):
    """Protocol of a table to which laws are added."""

    def add_law(
        self, key: Hashable, kind: int, numbers: Sequence[float], pointers: Sequence[Pointer] = (), about: str = "", /
    ) -> int:
        """Add a row and return its number, or that of the row with the same key."""


NORMAL_KINDS: Known = {
    laws.HysteresisLaw: (NormalKind.POWER, ("stiffness", "exponent", "chi")),
    laws.Hertz: (NormalKind.POWER, ("stiffness", "exponent")),
    laws.KelvinVoigt: (NormalKind.VOIGT, ("stiffness", "damping")),
    laws.Impact: (NormalKind.IMPACT, ("stiffness", "exponent", "damping", "damping_depth")),
}
RUBBING = ("static", "dynamic", "v_stribeck", "exponent")
FRICTION_KINDS: Known = {
    laws.NoFriction: (FrictionKind.SMOOTH, ()),
    laws.Coulomb: (FrictionKind.COULOMB, ("dynamic", "v_reg", "viscous")),
    laws.AdamsFriction: (FrictionKind.ADAMS, ("static", "dynamic", "v_s", "v_d")),
    laws.Ambrosio: (FrictionKind.AMBROSIO, ("dynamic", "v0", "v1")),
    laws.Threlfall: (FrictionKind.THRELFALL, ("dynamic", "v0")),
    laws.Stribeck: (FrictionKind.STRIBECK, (*RUBBING, "v_reg", "viscous")),
    laws.LuGre: (FrictionKind.LUGRE, (*RUBBING, "bristle_stiffness", "bristle_damping", "viscous")),
}
"""Kind of the row of each law of this package, and names of its numbers; a missing exponent is 2."""


def _row_of(law: object, rows: Known) -> tuple[int, list[float]] | None:
    """Return kind and numbers of a law of this package, or of a user's hysteresis law with another chi; None for others."""
    kind, ours = type(law), type(law).__module__.startswith(laws.__name__)
    if isinstance(law, laws.HysteresisLaw):
        ours = type(law).force is laws.HysteresisLaw.force
    found = next((rows[each] for each in kind.__mro__ if each in rows), None) if ours else None
    return found and (found[0], [getattr(law, name, 2.0) for name in found[1]])


def add_normal(builder: LawTable, law: laws.NormalLaw) -> int:
    """Add a normal law to the table."""
    row, key = _row_of(law, NORMAL_KINDS), ("normal", type(law), law)
    if row is not None:
        return builder.add_law(key, *row)
    about = f"the normal law {type(law).__name__}"
    return builder.add_law(key, NormalKind.CALLED, (), [function_pointer(law.force, 3)], about)


def add_friction(builder: LawTable, law: laws.FrictionLaw | laws.BristleLaw) -> int:
    """Add a friction law to the table."""
    row, key = _row_of(law, FRICTION_KINDS), ("friction", type(law), law)
    if row is not None:
        return builder.add_law(key, *row)
    about = f"the friction law {type(law).__name__}"
    if isinstance(law, laws.BristleLaw):
        pointers = [function_pointer(law.coefficient, 2), function_pointer(law.after, 3)]
        return builder.add_law(key, FrictionKind.BRISTLE_CALLED, (), pointers, about)
    return builder.add_law(key, FrictionKind.COEFFICIENT_CALLED, (), [function_pointer(law.coefficient, 1)], about)


GEOMETRY = journal.GAP + 1
"""Numbers of a joint's row before those of its laws: the codes of both as the bits of floats, then the numbers of both."""
FIRST = GEOMETRY + 2 * CODES
LAST = FIRST + 2 * NUMBERS
WIDTH = len(journal.COLUMNS)
"""Columns of the report."""
LawRow = IntEnum("LawRow", "NORMAL FRICTION", start=0)
"""Rows of a joint's laws."""


@dataclass(frozen=True)
class Kernel:
    """Forces and report of joints that share a pair of laws.

    Both are functions of time, coordinates, rates, memory, the two tables and the array to fill. `constants` follow the
    geometry in each joint's row; `owners` keep the machine code of their addresses alive.
    """

    forces: Callable[..., None]
    report: Callable[..., None]
    compiled: bool
    constants: Array = field(default_factory=lambda: np.empty(0))
    owners: tuple[object, ...] = ()


def kernel_of(law: NormalLaw, friction: FrictionLaw | BristleLaw) -> Kernel:
    """Build the functions for a normal and a friction law: compiled if Numba can, else in plain Python, twenty times slower."""
    return (has_compiler() and compile_kernel(law, friction)) or plain(law, friction)  # type: ignore[arg-type]  # laws are frozen


def plain(law: NormalLaw, friction: FrictionLaw | BristleLaw) -> Kernel:
    """Make the kernel in plain Python."""

    def normal(_numbers: Array, depth: float, rate: float, onset: float) -> float:
        """Return the normal force [N]."""
        return law.force(depth, rate, onset)

    rubs = as_bristle_law(friction)
    functions = normal, lambda _numbers, *state: rubs.coefficient(*state), lambda _numbers, *state: rubs.after(*state)
    report = journal.report_with(*functions)
    return Kernel(_bound(_forces, report), report, compiled=False)


@lru_cache(maxsize=256)
def compile_kernel(law: NormalLaw, friction: FrictionLaw | BristleLaw) -> Kernel | None:
    """Make the compiled kernel; None if a law does more than arithmetic on its arguments and numbers."""
    rows = _PairTable()
    add_normal(rows, law)
    add_friction(rows, friction)
    if not all(pointer.compiled for pointer in rows.pointers):
        return None
    constants = np.concatenate([np.array(rows.codes, dtype=np.int64).ravel().view(float), np.array(rows.numbers).ravel()])
    return Kernel(*_functions(), compiled=True, constants=constants, owners=tuple(rows.pointers))


class _PairTable:
    """Table of a normal and a friction law."""

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
    return normal_force(_laws_of(numbers), LawRow.NORMAL, depth, rate, onset)


def _friction(numbers: Array, speed: float, bristle: float) -> float:
    return friction(_laws_of(numbers), LawRow.FRICTION, speed, bristle)


def _bristle(numbers: Array, bristle: float, speed: float, time: float) -> float:
    return bristle_after(_laws_of(numbers), LawRow.FRICTION, bristle, speed, time)


def _report(*_: object) -> None:
    """Stand for the report of joints, which `_bound` replaces."""
    raise NotImplementedError


def _rows(t: float, q: Array, v: Array, memory: Array, places: Array, numbers: Array, out: Array) -> None:
    _report(t, q, v, memory, places, numbers, out)


def _forces(t: float, q: Array, v: Array, memory: Array, places: Array, numbers: Array, out: Array) -> None:
    rows = np.empty((places.shape[0], WIDTH))
    _report(t, q, v, memory, places, numbers, rows)
    spread(rows, q, v, places, numbers, out)


def _bound(function: Callable[..., None], report: Callable[..., None]) -> Any:
    """Copy a function of this module with `_report` replaced.

    Numba caches functions with globals on disk, but not those with closures or functions as arguments.
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
