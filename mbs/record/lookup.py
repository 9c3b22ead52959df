"""Signals by name and between samples."""

from __future__ import annotations

from typing import Any

import numpy as np

Array = np.ndarray[Any, Any]
SMOOTH = ("x", "y", "angle", "deflection", "end_shortening")
"""Signals that have a velocity, whatever strikes: last part of their names."""
OUTSIDE = 1e-9
"""Of the run: how far from its ends a time still counts as within."""


class UnknownSignalError(ValueError, KeyError):
    """A result has no signal of that name."""

    __str__ = Exception.__str__  # a KeyError would quote its sentence


def unknown(name: str, names: list[str]) -> UnknownSignalError:
    """Make the error of a signal that is not there; it names those near it."""
    from difflib import get_close_matches

    owner = str(name).rpartition(".")[0]
    near = [*dict.fromkeys([*get_close_matches(str(name), names, 3), *(n for n in names if n.rpartition(".")[0] == owner)])][:8]
    some = f"near it: {', '.join(near)}" if near else f"there are {', '.join(names[:8])}{', ...' if len(names) > 8 else ''}"
    return UnknownSignalError(f"no signal '{name}'; {some}")


def cubic(time: Array, values: Array, times: Array) -> Array:
    """Interpolate by a cubic spline, constant beyond the ends.

    Parameters
    ----------
    time : array, shape (samples,), samples > 2
        Increasing.
    values : array, shape (samples,) or (samples, signals)
        Finite.
    times : array, shape (times,) or a float
    """
    from scipy.interpolate import CubicSpline  # it takes a while to load, and few need it

    found: Array = CubicSpline(time, values)(np.clip(times, time[0], time[-1]))
    return found
