"""Input checks with one voice: parameter, value, allowed range, unit."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import fields
from numbers import Integral, Real
from typing import Any

from buckler.mbs.units import Measured

LARGEST = 1e30
"""Largest size of any input, and the inverse of the smallest that is not zero: products of a few are numbers still."""


def number(
    name: str, value: float, low: float, high: float, unit: str, *, open_low: bool = False, open_high: bool = False
) -> float:
    """Return `value` as a float if it is finite and in [low, high], without an end that is open; infinite bounds stay open.

    Raises
    ------
    ValueError
        Names the parameter, its value, the allowed range and the unit.
    """
    if isinstance(value, Measured) and not value.fits(unit):
        raise ValueError(f"{name} = {value.given}: must be {'a plain number' if unit == '1' else f'in {unit}'}")
    checked = _as_float(value) if isinstance(value, Real) and not isinstance(value, bool) else math.nan
    at_an_end = (open_low and checked == low) or (open_high and checked == high)
    if not (low <= checked <= high and math.isfinite(checked)) or at_an_end:
        suffix = "" if unit in ("", "1") else f" {unit}"
        shown = value.given if isinstance(value, Measured) else f"{short(value)}{suffix}"
        if math.isinf(checked) and math.inf in (high, -low):
            raise ValueError(f"{name} = {shown}: must be finite")
        left, right = "(" if open_low or low == -math.inf else "[", ")" if open_high or high == math.inf else "]"
        raise ValueError(f"{name} = {shown}: must lie in {left}{low:g}, {high:g}{right}{suffix}")
    if abs(checked) > LARGEST:
        raise ValueError(f"{name} = {short(value)}: must be at most {LARGEST:g} in size; no solver's numbers go farther")
    return checked


def _as_float(value: Real) -> float:
    """A number as a float; infinite where it is too large for one."""
    try:
        return float(value)
    except OverflowError:
        return math.inf


def size(name: str, value: float, unit: str) -> float:
    """Return `value` if it is a size that a mechanism may have, 1e-9 to 1e6 in SI; ValueError otherwise."""
    positive(name, value, unit)
    return number(name, value, 1e-9, 1e6, unit)


def positive(name: str, value: float, unit: str) -> float:
    """Return `value` if it is finite and above zero; ValueError otherwise."""
    found = number(name, value, 0.0, math.inf, unit, open_low=True)
    if found < 1 / LARGEST:
        raise ValueError(f"{name} = {short(value)}: must be at least {1 / LARGEST:g}; it is as good as zero")
    return found


def non_negative(name: str, value: float, unit: str) -> float:
    """Return `value` if it is finite and not below zero; ValueError otherwise."""
    return number(name, value, 0.0, math.inf, unit)


def whole(name: str, value: int, low: int, high: int) -> int:
    """Return `value` if it is an integer in [low, high]; ValueError otherwise."""
    if isinstance(value, bool) or not isinstance(value, Integral) or not low <= value <= high:
        raise ValueError(f"{name} = {short(value)}: must be a whole number in [{low}, {high}]")
    return int(value)


def word(name: str, value: Any) -> str:
    """Return `value` if it is a name; ValueError otherwise."""
    if not isinstance(value, str) or not value or not value.isprintable():
        raise ValueError(f"{name} = {short(value)}: must be a name")
    return value


def pair(name: str, value: Any, unit: str) -> tuple[float, float]:
    """Return `value` as two finite floats; ValueError otherwise."""
    if isinstance(value, str) or not isinstance(value, Iterable) or len(values := tuple(value)) != 2:
        raise ValueError(f"{name} = {short(value)}: must be two numbers (x, y), {unit}")
    x, y = (number(f"{name}.{axis}", v, -math.inf, math.inf, unit) for axis, v in zip("xy", values, strict=True))
    return x, y


def direction(name: str, value: Any) -> tuple[float, float]:
    """Return `value` as a unit vector; ValueError if it has no length."""
    x, y = pair(name, value, "1")
    length = positive(f"{name} (length)", math.hypot(x, y), "1")
    if abs(length - 1.0) < 1e-15:  # a unit vector stays what it is, to the last bit
        return x, y
    return x / length, y / length


def one_of(name: str, value: Any, kinds: tuple[type, ...]) -> Any:
    """Return `value` if it is an instance of one of some types; ValueError, naming them, otherwise."""
    if not isinstance(value, kinds):
        allowed = " or ".join(kind.__name__ for kind in kinds)
        found = f"the class {value.__name__}, not an instance" if isinstance(value, type) else f"a {type(value).__name__}"
        raise ValueError(f"{name} = {short(value)}: must be {allowed}; this is {found}")
    return value


def sequence_of(name: str, values: Any, kinds: tuple[type, ...]) -> tuple[Any, ...]:
    """Return `values` as a tuple if it is a sequence of instances of some types; ValueError otherwise."""
    if isinstance(values, kinds):
        raise ValueError(f"{name} = {short(values)}: must be a list")
    return tuple(one_of(f"{name}[{k}]", value, kinds) for k, value in enumerate(listed(name, values)))


def follows(name: str, law: Any, protocol: type, example: str) -> Any:
    """Return `law` if it has all members of a protocol and can be hashed; ValueError, naming what is missing, otherwise."""
    if isinstance(law, type):
        raise ValueError(f"{name} = {law.__name__}: must be an instance, as {example}, not the class")
    members = sorted(m for m in getattr(protocol, "__protocol_attrs__", vars(protocol)) if not m.startswith("_"))
    missing = [m for m in members if not hasattr(law, m)]
    if missing:
        raise ValueError(f"{name} = {short(law)} is not a {protocol.__name__}: it lacks {', '.join(map(repr, missing))}")
    try:
        hash(law)
    except TypeError:
        raise ValueError(f"{name} = {short(law)}: must be hashable; make its class a frozen dataclass") from None
    return law


def function(name: str, value: Any, *arguments: float) -> Any:
    """Return `value` if it can be called with these numbers; ValueError, with what it raised, otherwise."""
    if not callable(value):
        raise ValueError(f"{name} = {short(value)}: must be a function")
    try:
        value(*arguments)
    except Exception as error:
        called = ", ".join(f"{a:g}" for a in arguments)
        raise ValueError(f"{name}({called}) raises {type(error).__name__}: {error}") from error
    return value


def names_of(what: str, value: Any) -> None:
    """Raise a ValueError if a field of a dataclass that is declared as `str` is no name, or one that may be None is neither."""
    for field in fields(value):
        if field.type == "str" or (field.type == "str | None" and getattr(value, field.name) is not None):
            word(f"{field.name} of {what}", getattr(value, field.name))


def listed(name: str, values: Any) -> tuple[Any, ...]:
    """Return `values` as a tuple if it is a sequence, and no text; ValueError otherwise."""
    if isinstance(values, str | bytes) or not isinstance(values, Iterable):
        raise ValueError(f"{name} = {short(values)}: must be a list")
    return tuple(values)


def short(value: Any) -> str:
    """A value as text, in one line of at most 120 characters."""
    try:
        text = repr(value)
    except ValueError:  # a whole number of thousands of digits
        return "a number too large to write"
    text = " ".join(text.split())
    return text if len(text) <= 120 else f"{text[:117]}..."
