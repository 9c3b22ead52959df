"""Compilation of the kernel by Numba: once for all mechanisms, cached on disk, run without the interpreter's lock.

`jit` compiles the few functions that Python calls to machine code, kept on disk. Those that only these call are decorated
`kernel_function`: Numba stops at the intermediate code of LLVM, which is optimised as a part of the callers. Named tuples of
arrays, with a hundred arrays in all, are passed to them by reference, as one pointer to the addresses and shapes of the arrays.
"""

import sys
from collections.abc import Callable, Mapping, Sequence
from functools import partial, reduce
from inspect import signature
from pathlib import Path
from time import perf_counter
from types import FunctionType, SimpleNamespace
from typing import Any, TypeVar

import numba
import numpy as np
from llvmlite import ir
from numba import carray, types
from numba.core import cgutils
from numba.core import typing as numba_typing
from numba.core.base import BaseContext
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.core.event import Event, Listener, register
from numba.core.typing.templates import AttributeTemplate, Signature
from numba.extending import infer_getattr, intrinsic, lower_getattr_generic, models, register_model

from ..laws.compiled import compile_cached, compile_function, stamp_of
from ..process import COMPILING
from ..progress import Ticker, Watch, is_interactive

F = TypeVar("F", bound=Callable[..., Any])
Intrinsic = tuple[Signature, Callable[..., ir.Value]]
"""Signature of a function that Numba compiles inline, and the function that emits its code for LLVM."""
ANNOUNCEMENT = (
    "What this run needs of the compiled solver is being compiled, up to a minute or two; it is kept for later runs. "
    "`buckler --compile` does it beforehand."
)
"""Text printed on stderr when a compilation begins."""
WORD = ir.IntType(64)
"""Integer of the size of an address, in which references are stored."""
FAST_SUMS = {"reassoc", "contract", "arcp", "nsz"}
"""Fast-math flags of LLVM that let sums be reordered and vectorised; NaN and infinity keep their meaning."""


class Announcer(Listener):
    """Listener to Numba that announces a compilation of the kernel on stderr, once, and adds its time to `COMPILING`."""

    def __init__(self) -> None:
        self.depth = 0  # number of functions being compiled, one within the other
        self.start = 0.0  # time at which the compilation of the outermost one began [s]
        self.progress = Watch("functions compiled", clock=perf_counter)
        self.progress.most = 215  # as counted for an implicit run: full scale of the progress line
        self.ticker: Ticker | None = None  # prints the progress while the outermost one is compiled
        self.announced = False  # the ticker has printed the expected time

    def on_start(self, event: Event) -> None:
        """Start the clock and the progress line when Numba begins to compile a function within no other."""
        if not _is_ours(event):
            return
        if self.depth == 0:
            self.start, COMPILING.is_active = perf_counter(), True
            if not self.progress.count:  # the first function of this process
                print(ANNOUNCEMENT, file=sys.stderr)
                self.progress.start = self.start
            if is_interactive():
                self.ticker = Ticker(self.progress, compiles=True, announced=self.announced)
        self.depth += 1

    def on_end(self, event: Event) -> None:
        """Count a compiled function; after the outermost one, stop the clock and the progress line."""
        if not _is_ours(event) or self.depth == 0:
            return
        self.depth, self.progress.count = self.depth - 1, self.progress.count + 1
        if self.depth == 0:
            COMPILING.seconds, COMPILING.is_active = COMPILING.seconds + perf_counter() - self.start, False
            if self.ticker:
                self.announced = self.ticker.stop()
                self.ticker = None


def _is_ours(event: Event) -> bool:
    """Return True if an event is of a function of this package."""
    return str(event.data["dispatcher"].py_func.__module__).startswith("buckler.mbs.spectral.")


register("numba:compile", Announcer())


def list_compiled_files() -> list[Path]:
    """List all files whose functions are compiled, and those that define their constants."""
    here = Path(__file__).parent
    own = [path for path in here.glob("*.py") if "from .compiling import" in path.read_text(encoding="utf-8")]
    laws = [here.parent / "laws" / name for name in ("table.py", "pieces.py")]
    return [Path(__file__), *(here / name for name in ("tables.py", "output.py", "elimination.py")), *own, *laws]


STAMP = stamp_of(*list_compiled_files())
"""Checksum of the files on which compiled functions depend."""


def jit(function: F) -> F:
    """Compile a function that Python calls, for the types of its first call: an entry that passes its arguments by reference."""
    names = list(signature(function).parameters)
    references = [f"by_reference({name})" for name in names]
    # made from text, to have the parameters of the function
    text = f"lambda {', '.join(names)}: inner({', '.join(references)})"
    inner = kernel_function(function) if isinstance(function, FunctionType) else function  # else it is a kernel function already
    namespace = {"inner": inner, "by_reference": by_reference, "__name__": function.__module__}
    entry = eval(compile(text, function.__code__.co_filename, "eval"), namespace)
    entry.__name__ = entry.__qualname__ = function.__name__
    return compile_cached(entry, STAMP, nogil=True, fastmath=FAST_SUMS)


class _IntermediateCode(JITCodeLibrary):
    """Intermediate code of a function, which Numba would else optimise and translate again at each level of calls."""

    @property
    def codegen(self) -> SimpleNamespace:
        """Stand-in for Numba's code generator; its `set_env` does nothing, as there is no machine code to change."""
        return SimpleNamespace(set_env=lambda name, environment: None)

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        """List the addresses in the code that hold in this process only; Numba does not store callers of such code on disk."""
        self._finalize_dynamic_globals()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """Return 0: there is no machine code."""
        return 0


class _IntermediateCompiler(Compiler):
    """Compiler of functions to intermediate code."""

    def compile_extra(self, func: FunctionType) -> object:
        """Compile a function into a library of intermediate code."""
        self.state.library = _IntermediateCode(self.state.targetctx.codegen(), func.__qualname__)
        return super().compile_extra(func)


def kernel_function(function: F, **options: object) -> F:
    """Compile a function that only compiled functions call: Python cannot call it, and nothing is kept on disk."""
    options |= {"no_cpython_wrapper": True, "no_cfunc_wrapper": True, "pipeline_class": _IntermediateCompiler}
    dispatcher = numba.njit(error_model="numpy", nogil=True, fastmath=FAST_SUMS, **options)(function)
    dispatcher._compiler.fold_argument_types = partial(_generalise, dispatcher._compiler.fold_argument_types)
    return dispatcher


def _generalise(fold: Callable[..., Any], args: Sequence[types.Type], kws: Mapping[str, types.Type]) -> tuple[Any, Any]:
    """Replace the type of a constant argument by the general one: else Numba compiles a function again for each constant."""
    python_signature, argument_types = fold(args, kws)
    return python_signature, tuple(map(types.unliteral, argument_types))


def inline(function: F) -> F:
    """Compile a function that LLVM inlines into its callers, which saves the tenth of a microsecond of a call."""
    return kernel_function(function, forceinline=True)


class Reference(types.Type):
    """Type of a pointer to words: address and shape of each array of a named tuple, one after the other.

    `words` has the index of each field's first word, `count` is the number of words. A named tuple within the tuple is one word,
    the pointer to its own words. Numba counts no references to the arrays: the tuple must outlive the call.
    """

    def __init__(self, record: types.Type) -> None:
        kinds = (Reference(t) if isinstance(t, types.BaseNamedTuple) else t for t in record.types)
        self.fields = dict(zip(record.fields, kinds, strict=True))
        sizes = [1 if isinstance(field, Reference) else 1 + field.ndim for field in self.fields.values()]
        self.words = dict(zip(self.fields, np.cumsum([0, *sizes]).tolist(), strict=False))
        self.count = sum(sizes)
        super().__init__(name=f"Reference({record.instance_class.__name__})")


register_model(Reference)(models.OpaqueModel)  # represented by a pointer


@infer_getattr
class _ReferenceFields(AttributeTemplate):
    """Types of the fields of a reference."""

    key = Reference

    def generic_resolve(self, reference: Reference, name: str) -> types.Type | None:
        """Return the type of a field."""
        return reference.fields.get(name)


def _has_only_arrays(kind: types.Type) -> bool:
    """Return True for a type of named tuples that contain arrays, or such tuples, and nothing else."""
    return isinstance(kind, types.BaseNamedTuple) and all(isinstance(t, types.Array) or _has_only_arrays(t) for t in kind.types)


def _return_argument(context: BaseContext, builder: ir.IRBuilder, signature: Signature, values: Sequence[ir.Value]) -> ir.Value:
    """Emit the argument itself; Numba counts references to its arrays, and the result is one more."""
    context.nrt.incref(builder, signature.return_type, values[0])
    return values[0]


@intrinsic
def by_reference(_context: numba_typing.Context, argument: types.Type) -> Intrinsic:
    """Return a reference to a named tuple of arrays, for functions that are called from here; return anything else unchanged."""
    if not _has_only_arrays(argument):
        return numba_typing.signature(argument, argument), _return_argument  # types of the result and of the argument

    def store_words(context: BaseContext, builder: ir.IRBuilder, reference: Reference, value: ir.Value) -> ir.Value:
        """Emit code that stores the words of a reference on the stack; return their address."""
        words = cgutils.alloca_once(builder, WORD, size=reference.count)
        for i, (name, field) in enumerate(reference.fields.items()):
            part = builder.extract_value(value, i)
            if isinstance(field, Reference):
                field_words = [builder.ptrtoint(store_words(context, builder, field, part), WORD)]
            else:
                array = context.make_array(field)(context, builder, part)
                field_words = [builder.ptrtoint(array.data, WORD), *cgutils.unpack_tuple(builder, array.shape)]
            for k, word in enumerate(field_words):
                builder.store(word, cgutils.gep_inbounds(builder, words, reference.words[name] + k))
        return words

    def codegen(context: BaseContext, builder: ir.IRBuilder, signature: Signature, values: Sequence[ir.Value]) -> ir.Value:
        """Emit the address of the words."""
        return builder.bitcast(store_words(context, builder, signature.return_type, values[0]), cgutils.voidptr_t)

    return numba_typing.signature(Reference(argument), argument), codegen


@lower_getattr_generic(Reference)
def _load_field(context: BaseContext, builder: ir.IRBuilder, reference: Reference, value: ir.Value, name: str) -> ir.Value:
    """Emit the array or the reference that is a field of a reference."""
    words, field = builder.bitcast(value, WORD.as_pointer()), reference.fields[name]

    def load(k: int) -> ir.Value:
        """Emit the load of word k of the field, marked as constant: so LLVM reads it once, before all loops."""
        read = builder.load(cgutils.gep_inbounds(builder, words, reference.words[name] + k))
        read.set_metadata("invariant.load", builder.module.add_metadata([]))
        return read

    if isinstance(field, Reference):
        return builder.inttoptr(load(0), cgutils.voidptr_t)
    array = context.make_array(field)(context, builder)
    item_size = WORD(context.get_abi_sizeof(context.get_data_type(field.dtype)))
    shape, strides = [load(1 + k) for k in range(field.ndim)], [item_size]
    for size in reversed(shape[1:]):  # arrays are contiguous, the last index the fastest
        strides.insert(0, builder.mul(strides[0], size))
    array.data = builder.inttoptr(load(0), array.data.type)
    array.shape, array.strides = cgutils.pack_array(builder, shape), cgutils.pack_array(builder, strides)
    array.itemsize, array.nitems = item_size, reduce(builder.mul, shape)
    array.meminfo = cgutils.get_null_value(array.meminfo.type)  # no counter of references
    array.parent = cgutils.get_null_value(array.parent.type)  # no Python object
    return array._getvalue()


@intrinsic
def _pointer_to(_context: numba_typing.Context, array: types.Type, index: types.Type) -> Intrinsic:
    """Return the pointer to an element of an array."""

    def codegen(context: BaseContext, builder: ir.IRBuilder, signature: Signature, values: Sequence[ir.Value]) -> ir.Value:
        """Emit the address of the element."""
        return builder.gep(context.make_array(signature.args[0])(context, builder, values[0]).data, [values[1]])

    return numba_typing.signature(types.CPointer(array.dtype), array, index), codegen


@inline
def view(array, first, count):
    """Return `count` elements of a contiguous array from `first`: a slice without checks and reference counting."""
    return carray(_pointer_to(array, first), (count,))


def compile_law(function: F) -> F:
    """Compile a plain function of `laws`, and those that it calls, as kernel functions; `laws` itself does not import this."""
    return compile_function(function, kernel_function)


@kernel_function
def copy(source, target):
    """Copy a contiguous array into another of its shape; Numba takes longer to compile an assignment, for its checks."""
    for i in range(target.size):
        target.flat[i] = source.flat[i]
