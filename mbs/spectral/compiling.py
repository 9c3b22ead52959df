"""How the equations run: compiled, or as plain Python where there is no compiler."""

from __future__ import annotations

from buckler.mbs.compiler import compiler

if compiler():
    from buckler.mbs.spectral.machine import borrowed, call1, call2, call3, close, inner, jit, lend_tables, lend_work
else:
    from buckler.mbs.spectral.interpreted import borrowed, call1, call2, call3, close, inner, jit, lend_tables, lend_work

__all__ = ["borrowed", "call1", "call2", "call3", "close", "inner", "jit", "lend_tables", "lend_work"]
