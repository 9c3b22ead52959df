"""Laws as rows of a `table.Laws`, and the contact kernel of joints with clearance in Exudyn.

A row of the table has the kind of a law, addresses and numbers. A law of this package is given by its kind and numbers. A user's
law is compiled separately, and its row has the address of the machine code. So one machine code serves all laws. A `Kernel` is
this code with the table of one pair of laws, and computes the forces of all joints with this pair. If one of the two laws does
more than arithmetic, the kernel of the pair is plain Python.
"""

from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from functools import cache, lru_cache, partial
from pathlib import Path
from types import FunctionType
from typing import Any, cast

import numpy as np

from .. import laws
from ..geometry import Array
from ..process import has_compiler
from .compiled import Pointer, compile_cached, function_pointer, stamp_of, with_compiled_names
from .friction import BristleLaw, FrictionLaw, as_bristle_law
from .journal import BRISTLE, COLUMNS, GAP, ONSET, RADIUS, SINCE, SLIDING, Joints, fill_forces, find_states, locate_contact
from .pieces import NormalLaw
from .table import CODES, NUMBERS, FrictionKind, Laws, NormalKind, bristle_after, friction, normal_force

LawKinds = Mapping[type, tuple[int, tuple[str, ...]]]
"""For each class of laws: the kind of its rows in the table, and the names of the attributes that are the numbers of a row."""


@dataclass
class LawTable:
    """Laws as rows of integers and of floats, with the machine code at the addresses in them."""

    laws: list[list[int]] = field(default_factory=list, init=False)  # of each law kind and addresses: `CODES` integers
    law_numbers: list[list[float]] = field(default_factory=list, init=False)  # parameters of each law: `NUMBERS` floats
    pointers: list[Pointer] = field(default_factory=list, init=False)  # of functions at the addresses, which it keeps alive
    notes: list[str] = field(default_factory=list, init=False)  # sentences for the summary: what could not be compiled
    _law_rows: dict[Hashable, int] = field(default_factory=dict, init=False)  # index of a law by its key

    def add_law(
        self, key: Hashable, kind: int, numbers: Sequence[float], pointers: Sequence[Pointer] = (), about: str = ""
    ) -> int:
        """Add a law, or find the one with this key, unless it is None; return its index.

        The `kind` tells the laws of contact, friction and motion apart; for other forces it is not used. `about` names its
        functions in a note if they are not compiled; without it there is no note.
        """
        if key in self._law_rows:  # None is never stored
            return self._law_rows[key]
        codes, parameters = [kind, *(p.address for p in pointers)], [float(x) for x in numbers]
        self.laws.append(codes + [0] * (CODES - len(codes)))
        self.law_numbers.append(parameters + [0.0] * (NUMBERS - len(parameters)))
        self.pointers += pointers
        if about and not all(p.compiled for p in pointers):
            self.notes.append(
                f"{about} is not plain arithmetic: each call of it is called back in Python, some fifty times slower"
            )
        if key is not None:
            self._law_rows[key] = len(self.laws) - 1
        return len(self.laws) - 1


NORMAL_KINDS: LawKinds = {
    laws.HysteresisLaw: (NormalKind.POWER, ("stiffness", "exponent", "chi")),
    laws.Hertz: (NormalKind.POWER, ("stiffness", "exponent")),
    laws.KelvinVoigt: (NormalKind.VOIGT, ("stiffness", "damping")),
    laws.Impact: (NormalKind.IMPACT, ("stiffness", "exponent", "damping", "damping_depth")),
}
STRIBECK = ("static", "dynamic", "v_stribeck", "exponent")
"""Numbers of `pieces.stribeck_level`."""
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
    """Return kind and numbers of a law's row; None for a law that is compiled separately."""
    # a user's subclass may have another force; a `HysteresisLaw` with the force of the base class has only a chi of its own
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


LawRow = IntEnum("LawRow", "NORMAL FRICTION", start=0)
"""Rows of the two laws of a joint in its table of laws."""


@dataclass(frozen=True)
class Kernel:
    """Functions that compute generalised forces, and the report (normal force, depth, ...) of joints with a pair of laws.

    Both take the time [s], coordinates q, rates v, `memory` (joints, 4) of the values `journal.MEMORY`, the joints and the array
    to fill. `owners` keep the machine code of the laws alive.
    """

    forces: Callable[..., None]
    report: Callable[..., None]
    compiled: bool
    owners: tuple[object, ...] = ()


def kernel_of(law: NormalLaw, friction: FrictionLaw | BristleLaw) -> Kernel:
    """Make the kernel of two laws: compiled if Numba can do that, else in plain Python, which is twenty times slower."""
    compiled = compile_kernel(law, friction) if has_compiler() else None  # type: ignore[arg-type]  # laws can be hashed
    if compiled is not None:
        return compiled
    bristle_law = as_bristle_law(friction)
    report = _replace_globals(
        _report,
        normal_force=lambda _laws, _row, depth, rate, onset_speed: law.force(depth, rate, onset_speed),
        friction=lambda _laws, _row, speed, bristle: bristle_law.coefficient(speed, bristle),
        bristle_after=lambda _laws, _row, bristle, speed, duration: bristle_law.after(bristle, speed, duration),
    )
    forces, no_laws = _replace_globals(_forces, _report=report), Laws(np.empty(0), np.empty(0))
    return Kernel(partial(forces, no_laws), partial(report, no_laws), compiled=False)


def _replace_globals(function: Callable[..., None], **functions: Callable[..., Any]) -> Any:
    """Copy a function with other functions as its globals of these names."""
    return FunctionType(function.__code__, globals() | functions, function.__name__)


@lru_cache(maxsize=256)
def compile_kernel(law: NormalLaw, friction: FrictionLaw | BristleLaw) -> Kernel | None:
    """Make the compiled kernel of two laws; None if one of them does more than arithmetic on its arguments and numbers."""
    table = LawTable()
    add_normal(table, law)
    add_friction(table, friction)
    if not all(pointer.compiled for pointer in table.pointers):
        return None
    pair = Laws(np.array(table.laws, dtype=np.int64), np.array(table.law_numbers))
    forces, report = (partial(function, pair) for function in _compile_functions())
    return Kernel(forces, report, compiled=True, owners=tuple(table.pointers))


def _report(pair: Laws, t: float, q: Array, v: Array, memory: Array, joints: Joints, out: Array) -> None:
    numbers = joints.numbers
    for j in range(numbers.shape[0]):
        pin, bush = find_states(joints.offsets[j], numbers[j], q, v)
        depth, rate, sliding, nx, ny = locate_contact(
            numbers[j, RADIUS], numbers[j, GAP], (pin.x - bush.x, pin.y - bush.y), (pin.vx - bush.vx, pin.vy - bush.vy),
            (pin.spin, bush.spin),
        )  # fmt: skip
        force = drag = bristle = fx = fy = 0.0
        if depth > 0.0:
            past = memory[j]
            force = normal_force(pair, LawRow.NORMAL, depth, rate, past[ONSET])
            mean_sliding = 0.5 * (past[SLIDING] + sliding)
            bristle = bristle_after(pair, LawRow.FRICTION, past[BRISTLE], mean_sliding, t - past[SINCE])
            drag = friction(pair, LawRow.FRICTION, sliding, bristle) * force
            fx, fy = -force * nx + drag * ny, -force * ny - drag * nx
        out[j] = force, drag, depth, rate, sliding, bristle, fx, fy, nx, ny  # in the order of `COLUMNS`


def _forces(pair: Laws, t: float, q: Array, v: Array, memory: Array, joints: Joints, out: Array) -> None:
    rows = np.empty((memory.shape[0], len(COLUMNS)))
    _report(pair, t, q, v, memory, joints, rows)
    fill_forces(rows, q, v, joints, out)


@cache
def _compile_functions() -> tuple[Any, Any]:
    """Compile forces and report, or read them from disk, with the code of the functions that they call."""
    import numba
    from numba import float64, int64, types, void

    stamp = stamp_of(*(Path(__file__).with_name(name) for name in ("contact.py", "journal.py", "pieces.py", "table.py")))
    vector, table, integers = float64[::1], float64[:, ::1], int64[:, ::1]
    pair, joints = (types.NamedTuple((integers, table), each) for each in (Laws, Joints))
    arguments = pair, float64, vector, vector, table, joints
    compiled = []
    for function, out in ((_forces, vector), (_report, table)):
        copied = with_compiled_names(cast(FunctionType, function), numba.njit(error_model="numpy"))
        compiled.append(compile_cached(copied, stamp))
        compiled[-1].compile(void(*arguments, out))
    return compiled[0], compiled[1]
