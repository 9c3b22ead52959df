"""Functions of `compiling` without a compiler: functions stay as they are written."""

from __future__ import annotations

from typing import TypeVar

from ..geometry import Array

T = TypeVar("T")


def plain(function: T) -> T:
    """The function itself."""
    return function


jit = draft = inline = compile_below = plain


def copy(source: Array, target: Array) -> None:
    """Copy an array into another of its shape."""
    target[...] = source


def view(array: Array, first: int, count: int) -> Array:
    """Return elements of an array from one on."""
    return array[first : first + count]
