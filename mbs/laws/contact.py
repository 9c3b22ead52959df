"""Laws as rows of a `table.Laws`, and the contact kernel of joints with clearance in Exudyn.

A row of the table has the kind of a law, addresses and numbers. A law of this package is given by its kind and numbers, so that
one compiled kernel serves all laws. A user's law is compiled separately, and its row has the address of the machine code. The
kernel computes the forces of all joints with the same pair of laws; if a law does more than arithmetic, it is plain Python.
"""

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
from .journal import add_forces
from .pieces import NormalLaw
from .table import CODES, NUMBERS, FrictionKind, Laws, NormalKind, bristle_after, friction, normal_force

RowForms = Mapping[type, tuple[int, tuple[str, ...]]]
"""Kind of the row of a class of laws, and the attributes that are its numbers."""


class LawTable(Protocol):
    """Protocol of a table to which laws are added."""

    def add_law(
        self, key: Hashable, kind: int, numbers: Sequence[float], pointers: Sequence[Pointer] = (), about: str = "", /
    ) -> int:
        """Add a row and return its number; if a row has the same key, return the number of that row."""


NORMAL_KINDS: RowForms = {
    laws.HysteresisLaw: (NormalKind.POWER, ("stiffness", "exponent", "chi")),
    laws.Hertz: (NormalKind.POWER, ("stiffness", "exponent")),
    laws.KelvinVoigt: (NormalKind.VOIGT, ("stiffness", "damping")),
    laws.Impact: (NormalKind.IMPACT, ("stiffness", "exponent", "damping", "damping_depth")),
}
STRIBECK = ("static", "dynamic", "v_stribeck", "exponent")
"""Numbers of `table.stribeck`."""
FRICTION_KINDS: RowForms = {
    laws.NoFriction: (FrictionKind.SMOOTH, ()),
    laws.Coulomb: (FrictionKind.COULOMB, ("dynamic", "v_reg", "viscous")),
    laws.AdamsFriction: (FrictionKind.ADAMS, ("static", "dynamic", "v_s", "v_d")),
    laws.Ambrosio: (FrictionKind.AMBROSIO, ("dynamic", "v0", "v1")),
    laws.Threlfall: (FrictionKind.THRELFALL, ("dynamic", "v0")),
    laws.Stribeck: (FrictionKind.STRIBECK, (*STRIBECK, "v_reg", "viscous")),
    laws.LuGre: (FrictionKind.LUGRE, (*STRIBECK, "bristle_stiffness", "bristle_damping", "viscous")),
}
"""Kind and numbers of the friction laws of this package; a law without an exponent has 2."""


def _row_of(law: object, forms: RowForms) -> tuple[int, list[float]] | None:
    """Return kind and numbers of a law of this package, or of a user's `HysteresisLaw` of another chi(e); None for other laws."""
    if isinstance(law, laws.HysteresisLaw):
        is_known = type(law).force is laws.HysteresisLaw.force
    else:
        is_known = type(law).__module__.startswith(laws.__name__)
    form = next((forms[base] for base in type(law).__mro__ if base in forms), None)
    if form is None or not is_known:
        return None
    kind, names = form
    return kind, [getattr(law, name, 2.0) for name in names]  # 2.0: exponent of `LuGre`


def add_normal(builder: LawTable, law: laws.NormalLaw) -> int:
    """Add a normal law to the table, and return its row."""
    row, key = _row_of(law, NORMAL_KINDS), ("normal", type(law), law)
    if row is not None:
        return builder.add_law(key, *row)
    about = f"the normal law {type(law).__name__}"
    return builder.add_law(key, NormalKind.CALLED, (), [function_pointer(law.force, arguments=3)], about)


def add_friction(builder: LawTable, law: laws.FrictionLaw | laws.BristleLaw) -> int:
    """Add a friction law to the table, and return its row."""
    row, key = _row_of(law, FRICTION_KINDS), ("friction", type(law), law)
    if row is not None:
        return builder.add_law(key, *row)
    about = f"the friction law {type(law).__name__}"
    if isinstance(law, laws.BristleLaw):
        pointers = [function_pointer(law.coefficient, arguments=2), function_pointer(law.after, arguments=3)]
        return builder.add_law(key, FrictionKind.BRISTLE_CALLED, (), pointers, about)
    return builder.add_law(key, FrictionKind.COEFFICIENT_CALLED, (), [function_pointer(law.coefficient, arguments=1)], about)


GEOMETRY = journal.GAP + 1
"""Number of columns of geometry in a joint's row; kinds and addresses of its two laws follow, as the bits of floats."""
FIRST_FLOAT = GEOMETRY + 2 * CODES
"""First column of the floats of both laws."""
COLUMNS = FIRST_FLOAT + 2 * NUMBERS
"""Number of all columns of a joint's row."""
WIDTH = len(journal.COLUMNS)
"""Number of columns of the report of a joint, which `journal` defines."""
LawRow = IntEnum("LawRow", "NORMAL FRICTION", start=0)
"""Rows of the two laws of a joint in its table."""


@dataclass(frozen=True)
class Kernel:
    """Functions that compute generalised forces, and the report (normal force, depth, ...) of joints with a pair of laws.

    Both functions take time, coordinates, rates, memory, offsets, numbers and the array to fill, as in `journal`. `constants` are
    the columns after the geometry in each joint's row of numbers; `owners` keep the machine code at their addresses alive.
    """

    forces: Callable[..., None]
    report: Callable[..., None]
    compiled: bool
    constants: Array = field(default_factory=lambda: np.empty(0))
    owners: tuple[object, ...] = ()


def kernel_of(law: NormalLaw, friction: FrictionLaw | BristleLaw) -> Kernel:
    """Make the kernel of two laws: compiled if Numba can do that, else in plain Python, which is twenty times slower."""
    compiled = compile_kernel(law, friction) if has_compiler() else None  # type: ignore[arg-type]  # laws can be hashed
    if compiled is not None:
        return compiled
    bristle_law = as_bristle_law(friction)
    report = journal.make_report(
        lambda _numbers, *state: law.force(*state),
        lambda _numbers, *state: bristle_law.coefficient(*state),
        lambda _numbers, *state: bristle_law.after(*state),
    )
    return Kernel(_with_report(_forces, report), report, compiled=False)


@lru_cache(maxsize=256)
def compile_kernel(law: NormalLaw, friction: FrictionLaw | BristleLaw) -> Kernel | None:
    """Make the compiled kernel of two laws; None if one of them does more than arithmetic on its arguments and numbers."""
    table = _PairTable()
    add_normal(table, law)
    add_friction(table, friction)
    if not all(pointer.compiled for pointer in table.pointers):
        return None
    codes = np.array(table.codes, dtype=np.int64).view(float)  # the bits of integers, in a row of floats
    constants = np.concatenate([codes.ravel(), np.array(table.numbers).ravel()])
    return Kernel(*_functions(), compiled=True, constants=constants, owners=tuple(table.pointers))


class _PairTable:
    """`LawTable` of a normal and a friction law."""

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
    """Return the table of the two laws in a joint's row of numbers."""
    codes, floats = numbers[GEOMETRY:FIRST_FLOAT].view(np.int64), numbers[FIRST_FLOAT:COLUMNS]
    return Laws(codes.reshape(2, CODES), floats.reshape(2, NUMBERS))


def _normal(numbers: Array, depth: float, rate: float, onset: float) -> float:
    return normal_force(_laws_of(numbers), LawRow.NORMAL, depth, rate, onset)


def _friction(numbers: Array, speed: float, bristle: float) -> float:
    return friction(_laws_of(numbers), LawRow.FRICTION, speed, bristle)


def _bristle(numbers: Array, bristle: float, speed: float, time: float) -> float:
    return bristle_after(_laws_of(numbers), LawRow.FRICTION, bristle, speed, time)


def _report(*_: object) -> None:
    """Raise NotImplementedError: `_with_report` replaces this function by the report of joints."""
    raise NotImplementedError


def _fill_report(t: float, q: Array, v: Array, memory: Array, offsets: Array, numbers: Array, out: Array) -> None:
    _report(t, q, v, memory, offsets, numbers, out)


def _forces(t: float, q: Array, v: Array, memory: Array, offsets: Array, numbers: Array, out: Array) -> None:
    rows = np.empty((offsets.shape[0], WIDTH))
    _report(t, q, v, memory, offsets, numbers, rows)
    add_forces(rows, q, v, offsets, numbers, out)


def _with_report(function: Callable[..., None], report: Callable[..., None]) -> Any:
    """Copy a function of this module, in which the global `_report` is a given report.

    So the copy can call any report, as with a closure or an argument. But Numba caches on disk only functions that use globals.
    """
    return FunctionType(function.__code__, globals() | {"_report": report}, function.__name__)


@cache
def _functions() -> tuple[Any, Any]:
    """Compile forces and report, or read them from disk."""
    import numba
    from numba import float64, int64, void

    jit = numba.njit(error_model="numpy")
    report = compile_plain(journal.make_report(*(compile_plain(law, jit) for law in (_normal, _friction, _bristle))), jit)
    stamp = stamp_of(*(Path(__file__).with_name(f"{name}.py") for name in ("contact", "journal", "table")))
    vector, table, offsets = float64[::1], float64[:, ::1], int64[:, ::1]
    compiled = []
    for function, out in ((_forces, vector), (_fill_report, table)):
        compiled.append(compile_plain(_with_report(function, report), jit, outer=partial(compile_cached, stamp=stamp)))
        compiled[-1].compile(void(float64, vector, vector, table, offsets, table, out))
    return compiled[0], compiled[1]
