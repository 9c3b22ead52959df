"""What `compiling` offers, without a compiler: functions stay as they are written."""

from __future__ import annotations

from ctypes import CFUNCTYPE, POINTER, c_double
from typing import TypeVar

from ..geometry import Array

T = TypeVar("T")


def plain(function: T) -> T:
    """The function itself."""
    return function


def owned(thing: T) -> T:
    """The thing itself: Python counts its references."""
    return thing


jit = inner = aside = close = plain
lend = owned


def copy(source: Array, target: Array) -> None:
    """Copy an array into another of its shape."""
    target[...] = source


def part(array: Array, first: int, count: int) -> Array:
    """So many elements of an array from one on."""
    return array[first : first + count]


def call1(address: int, a: float) -> float:
    """f(a) of the function at this address."""
    return CFUNCTYPE(c_double, c_double)(int(address))(a)


def call2(address: int, a: float, b: float) -> float:
    """f(a, b) of the function at this address."""
    return CFUNCTYPE(c_double, c_double, c_double)(int(address))(a, b)


def call3(address: int, a: float, b: float, c: float) -> float:
    """f(a, b, c) of the function at this address."""
    return CFUNCTYPE(c_double, c_double, c_double, c_double)(int(address))(a, b, c)


def called(address: int, given: Array) -> float:
    """Value, of the numbers in an array, of the function at this address."""
    return CFUNCTYPE(c_double, POINTER(c_double))(int(address))(given.ctypes.data_as(POINTER(c_double)))
