"""Laws as rows of a `table.Laws`, and the contact kernel of joints with clearance in Exudyn.

A row of the table has the kind of a law, addresses and numbers. A law of this package is given by its kind and numbers. A user's
law is compiled separately, and its row has the address of the machine code. So one machine code serves all laws. A `Kernel` is
this code with the constants of one pair of laws, and computes the forces of all joints with this pair. If one of the two laws
does more than arithmetic, the kernel of the pair is plain Python.
"""

from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from functools import cache, lru_cache
from pathlib import Path
from types import FunctionType
from typing import Any, Protocol

import numpy as np

from .. import laws
from ..geometry import Array
from ..process import has_compiler
from . import journal
from .compiled import Pointer, compile_cached, compile_function, function_pointer, stamp_of, with_compiled_names
from .friction import BristleLaw, FrictionLaw, as_bristle_law
from .journal import fill_forces
from .pieces import NormalLaw
from .table import CODES, NUMBERS, FrictionKind, Laws, NormalKind, bristle_after, friction, normal_force

LawKinds = Mapping[type, tuple[int, tuple[str, ...]]]
"""For each class of laws: the kind of its rows in the table, and the names of the attributes that are the numbers of a row."""


class LawTable(Protocol):
    """Protocol of a table to which laws are added."""

    def add_law(
        self, key: Hashable, kind: int, numbers: Sequence[float], pointers: Sequence[Pointer] = (), about: str = "", /
    ) -> int:
        """Add a row, or find the one with this key; return its number. `about` names the law in the notes of a run."""


NORMAL_KINDS: LawKinds = {
    laws.HysteresisLaw: (NormalKind.POWER, ("stiffness", "exponent", "chi")),
    laws.Hertz: (NormalKind.POWER, ("stiffness", "exponent")),
    laws.KelvinVoigt: (NormalKind.VOIGT, ("stiffness", "damping")),
    laws.Impact: (NormalKind.IMPACT, ("stiffness", "exponent", "damping", "damping_depth")),
}
STRIBECK = ("static", "dynamic", "v_stribeck", "exponent")
"""Numbers of `table.stribeck`."""
FRICTION_KINDS: LawKinds = {
    laws.NoFriction: (FrictionKind.SMOOTH, ()),
    laws.Coulomb: (FrictionKind.COULOMB, ("dynamic", "v_reg", "viscous")),
    laws.AdamsFriction: (FrictionKind.ADAMS, ("static", "dynamic", "v_s", "v_d")),
    laws.Ambrosio: (FrictionKind.AMBROSIO, ("dynamic", "v0", "v1")),
    laws.Threlfall: (FrictionKind.THRELFALL, ("dynamic", "v0")),
    laws.Stribeck: (FrictionKind.STRIBECK, (*STRIBECK, "v_reg", "viscous")),
    laws.LuGre: (FrictionKind.LUGRE, (*STRIBECK, "bristle_stiffness", "bristle_damping", "viscous")),
}


def _find_row(law: object, kinds: LawKinds) -> tuple[int, list[float]] | None:
    """Return kind and numbers of a law's row; None for a law that is compiled separately.

    A user's law is compiled separately even if it is a subclass of a law of this package, as its force may differ. But a user's
    `HysteresisLaw` with the force of the base class differs in the number chi only, and has a row.
    """
    is_of_this_package = type(law).__module__.startswith(laws.__name__)
    differs_in_chi_only = isinstance(law, laws.HysteresisLaw) and type(law).force is laws.HysteresisLaw.force
    base = next((base for base in type(law).__mro__ if base in kinds), None)
    if base is None or not (is_of_this_package or differs_in_chi_only):
        return None
    kind, names = kinds[base]
    return kind, [getattr(law, name) for name in names]


def add_normal(builder: LawTable, law: laws.NormalLaw) -> int:
    """Add a normal law to the table, and return its row."""
    row, key = _find_row(law, NORMAL_KINDS), ("normal", type(law), law)
    if row is not None:
        return builder.add_law(key, *row)
    about = f"the normal law {type(law).__name__}"
    return builder.add_law(key, NormalKind.CALLED, (), [function_pointer(law.force, arguments=3)], about)


def add_friction(builder: LawTable, law: laws.FrictionLaw | laws.BristleLaw) -> int:
    """Add a friction law to the table, and return its row."""
    row, key = _find_row(law, FRICTION_KINDS), ("friction", type(law), law)
    if row is not None:
        return builder.add_law(key, *row)
    about = f"the friction law {type(law).__name__}"
    if isinstance(law, laws.BristleLaw):
        pointers = [function_pointer(law.coefficient, arguments=2), function_pointer(law.after, arguments=3)]
        return builder.add_law(key, FrictionKind.BRISTLE_CALLED, (), pointers, about)
    return builder.add_law(key, FrictionKind.COEFFICIENT_CALLED, (), [function_pointer(law.coefficient, arguments=1)], about)


FIRST_CODE = journal.GAP + 1
"""First column of both laws in a joint's row of numbers: kinds and addresses, integers stored bit by bit, then floats."""
REPORT_COLUMNS = len(journal.COLUMNS)
LawRow = IntEnum("LawRow", "NORMAL FRICTION", start=0)
"""Rows of the two laws of a joint in its table of laws."""


@dataclass(frozen=True)
class Kernel:
    """Functions that compute generalised forces, and the report (normal force, depth, ...) of joints with a pair of laws.

    Both take the time [s], coordinates q, rates v, and `memory` (joints, 4) of the values `journal.MEMORY`. Then follow `offsets`
    (joints, 2) of pin and bush in q, the joints' rows of `numbers`, and the array to fill. `constants` are the columns of a row
    of numbers from `FIRST_CODE` on; `owners` keep the machine code at the addresses in them alive.
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
        normal=lambda _numbers, depth, rate, onset_speed: law.force(depth, rate, onset_speed),
        friction=lambda _numbers, speed, bristle: bristle_law.coefficient(speed, bristle),
        bristle_after=lambda _numbers, bristle, speed, duration: bristle_law.after(bristle, speed, duration),
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
    return Kernel(*_compile_functions(), compiled=True, constants=constants, owners=tuple(table.pointers))


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
    first_float = FIRST_CODE + 2 * CODES
    codes, floats = numbers[FIRST_CODE:first_float].view(np.int64), numbers[first_float:]
    return Laws(codes.reshape(2, CODES), floats.reshape(2, NUMBERS))


def _normal(numbers: Array, depth: float, rate: float, onset_speed: float) -> float:
    return normal_force(_laws_of(numbers), LawRow.NORMAL, depth, rate, onset_speed)


def _friction(numbers: Array, speed: float, bristle: float) -> float:
    return friction(_laws_of(numbers), LawRow.FRICTION, speed, bristle)


def _bristle(numbers: Array, bristle: float, speed: float, duration: float) -> float:
    return bristle_after(_laws_of(numbers), LawRow.FRICTION, bristle, speed, duration)


def _report(*_: object) -> None:
    """Stand for the report of joints in the two functions below: `_with_report` copies them with a given report instead."""
    raise NotImplementedError


def _fill_report(t: float, q: Array, v: Array, memory: Array, offsets: Array, numbers: Array, out: Array) -> None:
    _report(t, q, v, memory, offsets, numbers, out)


def _forces(t: float, q: Array, v: Array, memory: Array, offsets: Array, numbers: Array, out: Array) -> None:
    rows = np.empty((offsets.shape[0], REPORT_COLUMNS))
    _report(t, q, v, memory, offsets, numbers, rows)
    fill_forces(rows, q, v, offsets, numbers, out)


def _with_report(function: Callable[..., None], report: Callable[..., None]) -> Any:
    """Copy a function with a given report as its global `_report`. A closure would also do, but Numba would not keep its code."""
    return FunctionType(function.__code__, globals() | {"_report": report}, function.__name__)


@cache
def _compile_functions() -> tuple[Any, Any]:
    """Compile forces and report, or read them from disk."""
    import numba
    from numba import float64, int64, void

    jit = numba.njit(error_model="numpy")
    compiled_laws = [compile_function(law, jit) for law in (_normal, _friction, _bristle)]
    report = compile_function(journal.make_report(*compiled_laws), jit)
    stamp = stamp_of(*(Path(__file__).with_name(name) for name in ("contact.py", "journal.py", "table.py")))
    # only these two are kept on disk, as they contain the code of the functions that they call, by `with_compiled_names`
    forces = compile_cached(with_compiled_names(_with_report(_forces, report), jit), stamp)
    fill_report = compile_cached(with_compiled_names(_with_report(_fill_report, report), jit), stamp)
    vector, table, offsets = float64[::1], float64[:, ::1], int64[:, ::1]
    arguments = float64, vector, vector, table, offsets, table
    forces.compile(void(*arguments, vector))
    fill_report.compile(void(*arguments, table))
    return forces, fill_report
