"""Signals by name and between samples."""

from __future__ import annotations

from typing import Any

import numpy as np

Array = np.ndarray[Any, Any]
SMOOTH = ("x", "y", "angle", "deflection", "end_shortening")
"""Signals that have a velocity, whatever strikes: last part of their names."""
SPEEDS = {"x": "vx", "y": "vy", "angle": "spin"}
"""Last part of the names of places, and of their speeds."""
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


def hermite(time: Array, values: Array, speeds: Array, times: Array) -> tuple[Array, Array]:
    """Interpolate by the cubics that have the values and the speeds of the samples; return values and speeds there.

    Parameters
    ----------
    time : array, shape (samples,), samples > 1
        Increasing.
    values, speeds : array, shape (samples, ...)
    times : array, shape (times,) or a float
        Within those of the samples.
    """
    k = np.clip(np.searchsorted(time, times, side="right") - 1, 0, len(time) - 2)
    h = (time[k + 1] - time[k]).reshape((*np.shape(times), *[1] * (values.ndim - 1)))
    s = (times - time[k]).reshape(h.shape) / h
    step, before, after = values[k + 1] - values[k], h * speeds[k], h * speeds[k + 1]
    bend, twist = 3 * step - 2 * before - after, before + after - 2 * step
    return values[k] + s * (before + s * (bend + s * twist)), (before + s * (2 * bend + 3 * s * twist)) / h
