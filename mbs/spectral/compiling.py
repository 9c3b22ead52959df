"""Compilation of the kernel: once for all mechanisms, kept on disk, without the interpreter's lock."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cache, partial, reduce
from pathlib import Path
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
from numba.core.typing.templates import AttributeTemplate, Signature
from numba.extending import infer_getattr, intrinsic, lower_getattr_generic, models, register_model

from ..laws.calls import call1, call2, call3, call_array
from ..laws.compiled import compile_cached, compile_plain, sums

__all__ = [
    "noinline",
    "call1",
    "call2",
    "call3",
    "call_array",
    "inline",
    "compile_below",
    "copy",
    "draft",
    "jit",
    "by_reference",
    "view",
]

F = TypeVar("F", bound=Callable[..., Any])
Intrinsic = tuple[Signature, Callable[..., ir.Value]]
"""Types of a function with machine code of its own, and the function that writes that code."""
COMPILED = (
    "compiling", "tables", "markers", "lawtable", "strips", "along", "stateful", "forces", "fronts", "kernel",
    "output", "contacts", "integrators", "radau", "newton", "samples", "events", "doors", "implicit", "explicit", "recording",
    "channels", "statistics",
)  # fmt: skip
"""Files that hold compiled functions."""
DRAFTED: list[str] = []
"""Functions that only compiled ones call."""
WORD = ir.IntType(64)
SUMS = {"reassoc", "contract", "arcp", "nsz"}
"""Liberties with the order of sums, which let them be made four at a time; what is not finite is still seen."""


@cache
def _stamp(name: str) -> tuple[str, ...]:
    """Contents, as sums, of a file that holds compiled functions and of those that it imports."""
    path = Path(__file__).with_name(f"{name}.py")
    text = path.read_text(encoding="utf-8")
    below = [path.parents[1] / "laws" / f"{other}.py" for other in ("table", "calls") if f"from ..laws.{other} import" in text]
    own = sums(path, *below)
    needed = [other for other in COMPILED if f"from .{other} import" in text]
    return tuple(sorted({*own, *(each for other in needed for each in _stamp(other))}))


def jit(function: F) -> F:
    """Compile for the types it is first called with, and keep that on disk as long as no file that it needs changes."""
    return compile_cached(function, _stamp(function.__module__.rpartition(".")[2]), nogil=True, fastmath=SUMS)


class _Draft(JITCodeLibrary):
    """Code for callers only: it is optimised and translated once, as part of theirs, and not at every level of calls anew."""

    @property
    def codegen(self) -> SimpleNamespace:
        """A stand-in that notes no environment: there is no machine code that has one."""
        return SimpleNamespace(set_env=lambda name, environment: None)

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """None: there is no machine code."""
        return 0


class _NoInline(_Draft):
    """A draft that callers call and do not take in."""

    def finalize(self) -> None:
        """Mark it, before what it calls is linked to it."""
        for function in self._final_module.functions:
            if not function.is_declaration:
                function.add_function_attribute("noinline")
        super().finalize()


class _Drafting(Compiler):
    """Numba's compiler that leaves a draft."""

    kind = _Draft

    def compile_extra(self, func: FunctionType) -> object:
        """Compile a function."""
        self.state.library = self.kind(self.state.targetctx.codegen(), func.__qualname__)
        return super().compile_extra(func)


class _DraftingNoInline(_Drafting):
    """Numba's compiler that leaves a draft to be called."""

    kind = _NoInline


def draft(function: F, compiler: type[Compiler] = _Drafting, **options: object) -> F:
    """Compile a function that only compiled ones call: Python cannot call it, and nothing is kept on disk."""
    DRAFTED.append(function.__name__)
    wrappers = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    made = numba.njit(error_model="numpy", nogil=True, fastmath=SUMS, pipeline_class=compiler, **wrappers, **options)(function)
    made._compiler.fold_argument_types = partial(_widen, made._compiler.fold_argument_types)
    return made


def _widen(fold: Callable[..., Any], args: Sequence[types.Type], kws: Mapping[str, types.Type]) -> tuple[Any, Any]:
    """Take a constant for an argument as its type: Numba compiles a function anew for each number that it is called with."""
    signature, found = fold(args, kws)
    return signature, tuple(map(types.unliteral, found))


def noinline(function: F) -> F:
    """Compile a function that is seldom called: once, beside its callers."""
    return draft(function, _DraftingNoInline, forceinline=False)  # or it would take over that of the first to call it


def inline(function: F) -> F:
    """Compile a function into those that call it: handing over all tables in a call takes a tenth of a microsecond."""
    return draft(function, forceinline=True)


class Reference(types.Type):
    """Type of a pointer to the places and shapes of a named tuple's arrays: one pointer in place of some hundred numbers.

    They have no share in the memory's reference counts: the tuple must outlive the call. `words` is where a field's place
    and shape begin.
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


@intrinsic
def by_reference(_typing: typing.Context, whole: types.Type) -> Intrinsic:
    """Hand the arrays of a named tuple, and of those within it, by reference to functions that are called from here."""

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
    """Return elements of a contiguous array from one on: a slice without checks and without a share in its reference count."""
    return carray(_place(array, first), (count,))


def compile_below(function: F) -> F:
    """Compile a function that stands with the laws, below the kernel, and those that it calls."""
    return compile_plain(function, draft)


@draft
def copy(source, target):
    """Copy an array into another of its shape, both contiguous; the checks of an assignment take long to compile."""
    for i in range(target.size):
        target.flat[i] = source.flat[i]
