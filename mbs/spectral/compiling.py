"""Compilation of the kernel by Numba: once for all mechanisms, cached on disk, without the interpreter's lock."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from functools import cache, partial, reduce
from inspect import signature
from pathlib import Path
from time import perf_counter
from types import FunctionType, SimpleNamespace
from typing import Any, TypeVar

import numba
import numpy as np
from llvmlite import ir
from numba import carray, types
from numba.core import cgutils, typing
from numba.core.base import BaseContext
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.core.event import Event, Listener, register
from numba.core.typing.templates import AttributeTemplate, Signature
from numba.extending import infer_getattr, intrinsic, lower_getattr_generic, models, register_model

from ..laws.compiled import compile_cached, compile_plain, stamp_of
from ..process import COMPILING
from ..progress import Ticker, Watch, is_interactive

F = TypeVar("F", bound=Callable[..., Any])
Intrinsic = tuple[Signature, Callable[..., ir.Value]]
"""Signature of a function, and the one that writes its code for LLVM."""
TEXT = (
    "What this run needs of the compiled solver is being compiled, up to a minute or two; it is kept for later runs. "
    "`buckler --compile` does it beforehand."
)
"""Announcement of a compilation."""
ALL = 215
"""Functions that Numba compiles for a run of the implicit integrator, the inner ones among them."""
WORD = ir.IntType(64)
SUMS = {"reassoc", "contract", "arcp", "nsz"}
"""Fast-math flags that let sums be reordered and vectorised; NaN and infinity keep their meaning."""


class Announcer(Listener):
    """Announces on stderr that the solver's functions are compiled, once, how long it takes, and counts it in `COMPILING`."""

    def __init__(self) -> None:
        self.depth, self.begun, self.state = 0, 0.0, Watch("functions compiled", clock=perf_counter)
        self.state.most, self.told = ALL, False

    def on_start(self, event: Event) -> None:
        """Note that Numba begins to compile a function, perhaps within another."""
        if not _is_ours(event):
            return
        if self.depth == 0:
            if not self.state.count:
                print(TEXT, file=sys.stderr)
                self.state.start = perf_counter()
            self.begun, COMPILING.runs = perf_counter(), True
            self.ticker = Ticker(self.state, compiles=True, announced=self.told) if is_interactive() else None
        self.depth += 1

    def on_end(self, event: Event) -> None:
        """Count the time when Numba has compiled the outermost function."""
        if not _is_ours(event) or self.depth == 0:
            return
        self.depth, self.state.count = self.depth - 1, self.state.count + 1
        if self.depth == 0:
            COMPILING.seconds, COMPILING.runs = COMPILING.seconds + perf_counter() - self.begun, False
            if self.ticker:
                self.told = self.ticker.stop()


def _is_ours(event: Event) -> bool:
    return str(event.data["dispatcher"].py_func.__module__).startswith("buckler.mbs.spectral.")


register("numba:compile", Announcer())


@cache
def _stamp() -> str:
    """Hash of the contents of all files whose functions are compiled."""
    here = Path(__file__).parent
    own = [path for path in here.glob("*.py") if "from .compiling import" in path.read_text(encoding="utf-8")]
    return stamp_of(Path(__file__), here / "tables.py", *own, here.parent / "laws" / "table.py")


def jit(function: F) -> F:
    """Compile a function that Python calls, for the types it is first called with; named tuples of arrays are passed by
    reference.

    It stays on disk as long as no file with compiled functions changes.
    """
    names = list(signature(function).parameters)
    text = f"lambda {', '.join(names)}: inner({', '.join(f'by_reference({name})' for name in names)})"
    known = {"inner": draft(function), "by_reference": by_reference, "__name__": function.__module__}
    entry = eval(compile(text, function.__code__.co_filename, "eval"), known)
    entry.__name__ = entry.__qualname__ = function.__name__
    return compile_cached(entry, _stamp(), nogil=True, fastmath=SUMS)


class _Draft(JITCodeLibrary):
    """Code for callers only: it is optimised and translated once, as a part of theirs, and not again at each level of calls."""

    @property
    def codegen(self) -> SimpleNamespace:
        """An object that ignores environments, as there is no machine code that has one."""
        return SimpleNamespace(set_env=lambda name, environment: None)

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """None: there is no machine code."""
        return 0


class _Drafting(Compiler):
    """Numba's compiler that leaves a draft."""

    def compile_extra(self, func: FunctionType) -> object:
        """Compile a function."""
        self.state.library = _Draft(self.state.targetctx.codegen(), func.__qualname__)
        return super().compile_extra(func)


def draft(function: F, **options: object) -> F:
    """Compile a function that only compiled ones call: Python cannot call it, and nothing is kept on disk."""
    options |= {"no_cpython_wrapper": True, "no_cfunc_wrapper": True, "pipeline_class": _Drafting}
    made = numba.njit(error_model="numpy", nogil=True, fastmath=SUMS, **options)(function)
    made._compiler.fold_argument_types = partial(_widen, made._compiler.fold_argument_types)
    return made


def _widen(fold: Callable[..., Any], args: Sequence[types.Type], kws: Mapping[str, types.Type]) -> tuple[Any, Any]:
    """Replace the type of a constant argument by the general one: else Numba compiles a function again for each constant."""
    folded, found = fold(args, kws)
    return folded, tuple(map(types.unliteral, found))


def inline(function: F) -> F:
    """Compile a function into those that call it, as passing all tables in a call takes a tenth of a microsecond."""
    return draft(function, forceinline=True)


class Reference(types.Type):
    """Type of a pointer to the addresses and shapes of a named tuple's arrays: one pointer instead of some hundred numbers.

    It holds no references to the arrays: the tuple must outlive the call.
    """

    def __init__(self, whole: types.Type) -> None:
        self.fields = dict(
            zip(whole.fields, (Reference(t) if isinstance(t, types.BaseNamedTuple) else t for t in whole.types), strict=True)
        )
        sizes = [1 if isinstance(field, Reference) else 1 + field.ndim for field in self.fields.values()]
        self.words = dict(zip(self.fields, np.cumsum([0, *sizes]).tolist(), strict=False))
        self.count = sum(sizes)
        super().__init__(name=f"Reference({whole.instance_class.__name__})")


@register_model(Reference)
class _ReferenceModel(models.OpaqueModel):
    """A pointer."""


@infer_getattr
class _ReferenceFields(AttributeTemplate):
    """Fields of a reference."""

    key = Reference

    def generic_resolve(self, reference: Reference, name: str) -> types.Type | None:
        """Type of a field."""
        return reference.fields.get(name)


def _holds_arrays(whole: types.Type) -> bool:
    """Check for a named tuple of arrays, and of such tuples."""
    return isinstance(whole, types.BaseNamedTuple) and all(isinstance(t, types.Array) or _holds_arrays(t) for t in whole.types)


def _hand_on(context: BaseContext, builder: ir.IRBuilder, signature: Signature, values: Sequence[ir.Value]) -> ir.Value:
    """Return the argument, with the reference counts of its arrays raised."""
    context.nrt.incref(builder, signature.return_type, values[0])
    return values[0]


@intrinsic
def by_reference(_typing: typing.Context, whole: types.Type) -> Intrinsic:
    """Pass a table by reference to functions that are called from here; anything else as it is."""
    if not _holds_arrays(whole):
        return whole(whole), _hand_on

    def table(context: BaseContext, builder: ir.IRBuilder, reference: Reference, value: ir.Value) -> ir.Value:
        """Store the words of a reference on the stack and return their address."""
        words = cgutils.alloca_once(builder, WORD, size=reference.count)
        for i, (name, field) in enumerate(reference.fields.items()):
            part = builder.extract_value(value, i)
            if isinstance(field, Reference):
                found = [builder.ptrtoint(table(context, builder, field, part), WORD)]
            else:
                array = context.make_array(field)(context, builder, part)
                found = [builder.ptrtoint(array.data, WORD), *cgutils.unpack_tuple(builder, array.shape)]
            for k, word in enumerate(found):
                builder.store(word, cgutils.gep_inbounds(builder, words, reference.words[name] + k))
        return words

    def codegen(context: BaseContext, builder: ir.IRBuilder, signature: Signature, values: Sequence[ir.Value]) -> ir.Value:
        """Emit the address that the call returns."""
        return builder.bitcast(table(context, builder, signature.return_type, values[0]), cgutils.voidptr_t)

    return Reference(whole)(whole), codegen


@lower_getattr_generic(Reference)
def _field(context: BaseContext, builder: ir.IRBuilder, reference: Reference, value: ir.Value, name: str) -> ir.Value:
    """Field of a reference. Nothing writes to the words during the call, so that they are read once."""
    words, field = builder.bitcast(value, WORD.as_pointer()), reference.fields[name]

    def word(k: int) -> ir.Value:
        """Load a word of the field, marked as constant."""
        read = builder.load(cgutils.gep_inbounds(builder, words, reference.words[name] + k))
        read.set_metadata("invariant.load", builder.module.add_metadata([]))
        return read

    if isinstance(field, Reference):
        return builder.inttoptr(word(0), cgutils.voidptr_t)
    array = context.make_array(field)(context, builder)
    shape, item = [word(1 + k) for k in range(field.ndim)], WORD(context.get_abi_sizeof(context.get_data_type(field.dtype)))
    strides = [item]
    for size in reversed(shape[1:]):
        strides.insert(0, builder.mul(strides[0], size))
    array.data = builder.inttoptr(word(0), array.data.type)
    array.shape, array.strides = cgutils.pack_array(builder, shape), cgutils.pack_array(builder, strides)
    array.itemsize, array.nitems = item, reduce(builder.mul, shape)
    array.meminfo, array.parent = (cgutils.get_null_value(x.type) for x in (array.meminfo, array.parent))
    return array._getvalue()


@intrinsic
def _place(_typing: typing.Context, array: types.Type, index: types.Type) -> Intrinsic:
    """Pointer to an element of an array."""

    def codegen(context: BaseContext, builder: ir.IRBuilder, signature: Signature, values: Sequence[ir.Value]) -> ir.Value:
        """Emit the address of the element."""
        return builder.gep(context.make_array(signature.args[0])(context, builder, values[0]).data, [values[1]])

    return types.CPointer(array.dtype)(array, index), codegen


@inline
def view(array, first, count):
    """Return `count` elements of a contiguous array from `first`: a slice without checks and reference counting."""
    return carray(_place(array, first), (count,))


def compile_below(function: F) -> F:
    """Compile a function of `laws`, a layer below the kernel, and those that it calls."""
    return compile_plain(function, draft)


@draft
def copy(source, target):
    """Copy an array into another of its shape, both contiguous; the checks of an assignment take long to compile."""
    for i in range(target.size):
        target.flat[i] = source.flat[i]
