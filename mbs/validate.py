"""Input checks whose messages have one form: parameter, value, allowed range, unit."""

import math
from collections.abc import Iterable
from contextlib import suppress
from numbers import Integral, Real
from typing import Any

from .units import Measured

LARGEST = 1e30
"""Largest magnitude of any input, and the inverse of the smallest: products of a few such numbers do not overflow."""


def number(
    name: str, value: float | Real, low: float, high: float, unit: str, *, open_low: bool = False, open_high: bool = False
) -> float:
    """Return `value` as a float if it is finite and in [low, high], an open end excluded; else raise a ValueError."""
    if isinstance(value, Measured) and not value.fits(unit):
        has_hertz = "rad/s" in unit and value.fits("Hz")  # a speed of rotation given as a frequency
        turns = "; turns in a time are written as '60 rpm' or '1 rev/s'" if has_hertz else ""
        raise ValueError(f"{name} = {value.given}: must be {'a plain number' if unit == '1' else f'in {unit}'}{turns}")
    checked, is_number = math.nan, isinstance(value, Real) and not isinstance(value, bool)
    if is_number:
        checked = math.inf
        with suppress(OverflowError):  # of a whole number too large for a float
            checked = float(value)
    at_an_end = (open_low and checked == low) or (open_high and checked == high)
    if not (low <= checked <= high and math.isfinite(checked)) or at_an_end:
        suffix = "" if unit in ("", "1") else f" {unit}"  # "1": a plain number; "": messages name no unit
        shown = value.given if isinstance(value, Measured) else f"{short(value)}{suffix if is_number else ''}"
        has_no_bound = low == -math.inf or high == math.inf
        if math.isinf(checked) and has_no_bound:
            raise ValueError(f"{name} = {shown}: must be finite")
        left, right = "(" if open_low or low == -math.inf else "[", ")" if open_high or high == math.inf else "]"
        raise ValueError(
            f"{name} = {shown}: must {'lie' if is_number else 'be a number'} in {left}{low:g}, {high:g}{right}{suffix}"
        )
    if open_low and low == 0 and checked < 1 / LARGEST:
        raise ValueError(f"{name} = {short(value)}: must be at least {1 / LARGEST:g}; a smaller one counts as zero")
    if abs(checked) > LARGEST:
        raise ValueError(f"{name} = {short(value)}: must be at most {LARGEST:g} in magnitude, so that no product overflows")
    return checked


def positive(name: str, value: float, unit: str) -> float:
    """Return `value` if it is finite and above zero; ValueError otherwise."""
    return number(name, value, 0.0, math.inf, unit, open_low=True)


def whole(name: str, value: object, low: int, high: int) -> int:
    """Return `value` if it is an integer in [low, high]; ValueError otherwise."""
    if isinstance(value, bool) or not isinstance(value, Integral) or not low <= int(value) <= high:
        raise ValueError(f"{name} = {short(value)}: must be a whole number in [{low}, {high}]")
    return int(value)


def word(name: str, value: object) -> str:
    """Return `value` if it is a name; ValueError otherwise."""
    if not isinstance(value, str) or not value or not value.isprintable():
        raise ValueError(f"{name} = {short(value)}: must be a name")
    return value


def one_of(name: str, value: object, kinds: tuple[type, ...]) -> Any:
    """Return `value` if it is an instance of one of some types; ValueError, naming them, otherwise."""
    if not isinstance(value, kinds):
        allowed = " or ".join(kind.__name__ for kind in kinds)
        found = f"the class {value.__name__}, not an instance" if isinstance(value, type) else f"a {type(value).__name__}"
        raise ValueError(f"{name} = {short(value)}: must be {allowed}; this is {found}")
    return value


def as_tuple(name: str, values: object) -> tuple[Any, ...]:
    """Return `values` as a tuple if it is iterable and not a text; ValueError otherwise."""
    if isinstance(values, str | bytes) or not isinstance(values, Iterable):
        raise ValueError(f"{name} = {short(values)}: must be a list")
    return tuple(values)


def short(value: object) -> str:
    """Return a value as text, in one line of at most 120 characters."""
    try:
        text = repr(value)
    except ValueError:  # a whole number of thousands of digits
        return "a number too large to write"
    text = " ".join(text.split())
    return text if len(text) <= 120 else f"{text[:117]}..."


def near(word: str, names: Iterable[str], most: int = 1, likeness: float = 0.6) -> list[str]:
    """Find at most `most` names that are spelt like a word; `likeness` is the least ratio of `difflib`, 0 to 1."""
    from difflib import get_close_matches  # loading takes milliseconds, and only a mistake needs it

    return get_close_matches(word, list(names), most, likeness)
