"""Functions of `compiling` without a compiler, which return functions unchanged."""

from typing import TypeVar

from ..geometry import Array

T = TypeVar("T")


def plain(function: T) -> T:
    """Return the function unchanged."""
    return function


jit = kernel_function = inline = compile_law = plain


def copy(source: Array, target: Array) -> None:
    """Copy an array into another of its shape."""
    target[...] = source


def view(array: Array, first: int, count: int) -> Array:
    """Return `count` elements of an array from `first`."""
    return array[first : first + count]
