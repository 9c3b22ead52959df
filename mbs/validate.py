"""Input checks with one voice: parameter, value, allowed range, unit."""

from __future__ import annotations

import math
from numbers import Integral, Real


def number(name: str, value: float, low: float, high: float, unit: str, *, open_low: bool = False) -> float:
    """Return `value` as a float if it is finite and in [low, high] (or (low, high]).

    Raises
    ------
    ValueError
        Names the parameter, its value, the allowed range and the unit.
    """
    checked = float(value) if isinstance(value, Real) and not isinstance(value, bool) else math.nan
    if not (low <= checked <= high and math.isfinite(checked)) or (open_low and checked == low):
        suffix = "" if unit == "1" else f" {unit}"
        bracket = "(" if open_low else "["
        raise ValueError(f"{name} = {value!r}{suffix}: must lie in {bracket}{low:g}, {high:g}]{suffix}")
    return checked


def positive(name: str, value: float, unit: str) -> float:
    """Return `value` if it is finite and above zero; ValueError otherwise."""
    return number(name, value, 0.0, math.inf, unit, open_low=True)


def non_negative(name: str, value: float, unit: str) -> float:
    """Return `value` if it is finite and not below zero; ValueError otherwise."""
    return number(name, value, 0.0, math.inf, unit)


def whole(name: str, value: int, low: int, high: int) -> int:
    """Return `value` if it is an integer in [low, high]; ValueError otherwise."""
    if isinstance(value, bool) or not isinstance(value, Integral) or not low <= value <= high:
        raise ValueError(f"{name} = {value!r}: must be a whole number in [{low}, {high}]")
    return int(value)
