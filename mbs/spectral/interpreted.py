"""Functions of `compiling` without a compiler: functions stay as they are written."""

from __future__ import annotations

from typing import TypeVar

from ..geometry import Array
from ..laws.calls import call1, call2, call3, call_array

__all__ = [
    "aside",
    "call1",
    "call2",
    "call3",
    "call_array",
    "close",
    "compile_below",
    "copy",
    "inner",
    "jit",
    "lend",
    "owned",
    "part",
    "plain",
]

T = TypeVar("T")


def plain(function: T) -> T:
    """The function itself."""
    return function


def owned(thing: T) -> T:
    """The thing itself: Python counts its references."""
    return thing


jit = inner = aside = close = compile_below = plain
lend = owned


def copy(source: Array, target: Array) -> None:
    """Copy an array into another of its shape."""
    target[...] = source


def part(array: Array, first: int, count: int) -> Array:
    """Return elements of an array from one on."""
    return array[first : first + count]
