"""What `machine` offers, without a compiler: functions stay as they are written."""

from __future__ import annotations

from ctypes import CFUNCTYPE, c_double
from typing import Any


def same(thing: Any) -> Any:
    """The thing itself: nothing is compiled, and Python counts references."""
    return thing


jit = inner = close = borrowed = lend_tables = lend_work = same


def call1(address: Any, a: Any) -> Any:
    """f(a) of the function at this address."""
    return CFUNCTYPE(c_double, c_double)(int(address))(a)


def call2(address: Any, a: Any, b: Any) -> Any:
    """f(a, b) of the function at this address."""
    return CFUNCTYPE(c_double, c_double, c_double)(int(address))(a, b)


def call3(address: Any, a: Any, b: Any, c: Any) -> Any:
    """f(a, b, c) of the function at this address."""
    return CFUNCTYPE(c_double, c_double, c_double, c_double)(int(address))(a, b, c)
