"""What `compiling` offers, without a compiler: functions stay as they are written."""

from __future__ import annotations

from collections.abc import Callable
from ctypes import CFUNCTYPE, c_double
from typing import Any


def plain(function: Callable[..., Any]) -> Any:
    """The function itself."""
    return function


def owned(thing: Any) -> Any:
    """The thing itself: Python counts its references."""
    return thing


jit = inner = aside = close = plain
lend = owned


def copy(source: Any, target: Any) -> None:
    """Copy an array into another of its shape."""
    target[...] = source


def part(array: Any, first: int, count: int) -> Any:
    """So many elements of an array from one on."""
    return array[first : first + count]


def call1(address: Any, a: Any) -> Any:
    """f(a) of the function at this address."""
    return CFUNCTYPE(c_double, c_double)(int(address))(a)


def call2(address: Any, a: Any, b: Any) -> Any:
    """f(a, b) of the function at this address."""
    return CFUNCTYPE(c_double, c_double, c_double)(int(address))(a, b)


def call3(address: Any, a: Any, b: Any, c: Any) -> Any:
    """f(a, b, c) of the function at this address."""
    return CFUNCTYPE(c_double, c_double, c_double, c_double)(int(address))(a, b, c)
