"""Interpolation and integration of sampled signals, and messages for unknown names; samples need not be equidistant."""

from collections.abc import Sequence

import numpy as np

from ..geometry import Array
from ..validate import near

OUTSIDE = 1e-9
"""Largest distance of a time from the ends of a run, over its duration, at which the time counts as within: rounding."""

KINK_RATIO = 10.0
"""Ratio of neighbouring steps from which the sample between them counts as a kink, which parabolas do not cross: a convention.
Solvers sample a kink or jump on both sides, a short time apart."""


class UnknownSignalError(ValueError, KeyError):
    """A result has no signal of a name, or no error of it."""

    __str__ = Exception.__str__  # that of KeyError puts the message in quotes


def unknown(name: str, names: list[str], what: str = "signal") -> UnknownSignalError:
    """Make the exception for a signal, or an 'error of' a signal, that is not among `names`; it suggests up to 8 of them."""
    owner = str(name).rpartition(".")[0]
    close = [*dict.fromkeys([*near(str(name), names, 3), *(n for n in names if n.rpartition(".")[0] == owner)])][:8]
    some = f"near it: {', '.join(close)}" if close else f"there are {', '.join(names[:8])}{', ...' if len(names) > 8 else ''}"
    return UnknownSignalError(f"no {what} '{name}'; {some}")


def slopes(time: Array, values: Array, smooth: bool) -> Array:
    """Compute slopes at the samples, (samples, ...): by parabolas if the signal is smooth, else by Fritsch and Butland.

    The latter keep cubics monotone (SIAM J. Sci. Stat. Comput. 5 (1984) 300, doi 10.1137/0905021). At both ends they are secants.
    """
    if len(time) == 2:
        return np.repeat(np.diff(values, axis=0) / (time[1] - time[0]), 2, axis=0)
    if smooth:
        return np.asarray(np.gradient(values, time, axis=0, edge_order=2))
    h = np.diff(time).reshape((-1, *[1] * (values.ndim - 1)))
    secants = np.diff(values, axis=0) / h
    h1, h2, before, after = h[:-1], h[1:], secants[:-1], secants[1:]
    weight = (h1 + 2 * h2) / (3 * (h1 + h2))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        mean = before * after / (weight * after + (1 - weight) * before)
    return np.concatenate([secants[:1], np.where(before * after > 0, mean, 0.0), secants[-1:]])


def hermite(time: Array, values: Array, rates: Array, times: Array) -> tuple[Array, Array]:
    """Interpolate at `times` by cubics with the values and rates of the samples, at least two; return values and rates."""
    k, h, s = _find_steps(time, times, values.ndim)
    r, start, start_rate, end_rate = 1 - s, values.take(k, 0), rates.take(k, 0), rates.take(k + 1, 0)
    rise = values.take(k + 1, 0) - start
    found = start + s * s * (1 + 2 * r) * rise + h * s * r * r * start_rate - h * s * s * r * end_rate
    found_rates = r * (1 - 3 * s) * start_rate + s * (3 * s - 2) * end_rate + 6 * s * r * (rise / h)
    return np.asarray(found), np.asarray(found_rates)


class Cubics:
    """Interpolation as by `hermite`, for many functions with the same sample times, each in a row: (functions, samples)."""

    def __init__(self, time: Array, times: Array) -> None:
        self.step, h, s = _find_steps(time, times, 1)
        self.of_rise = s * s * (3 - 2 * s)  # weights: of the rise of the value over the step, and of the rates at its ends
        self.of_start_rate, self.of_end_rate = h * s * (1 - s) ** 2, -h * s * s * (1 - s)

    def __call__(self, values: Array, rates: Array) -> Array:
        """Interpolate from values and rates at the samples, each (functions, samples); return values (functions, times)."""
        k, start = self.step, values.take(self.step, 1)
        rise = values.take(k + 1, 1) - start
        by_rates = self.of_start_rate * rates.take(k, 1), self.of_end_rate * rates.take(k + 1, 1)
        return np.asarray(start + self.of_rise * rise + by_rates[0] + by_rates[1])


def _find_steps(time: Array, times: Array, dimensions: int) -> tuple[Array, Array, Array]:
    """Return the index k of the step at each of `times`, its length h and the fraction s passed; h and s broadcast to samples."""
    k = np.clip(np.searchsorted(time, times, side="right") - 1, 0, len(time) - 2)
    h, passed = time[k + 1] - time[k], times - time[k]
    shape = np.shape(k) + (1,) * (dimensions - 1)
    return k, h.reshape(shape), (passed / h).reshape(shape)


def quintic(ends: Sequence[tuple[Array, Array, Array]], h: Array, s: Array) -> tuple[Array, Array]:
    """Interpolate by quintic Hermite polynomials: values, and rates times h, at the fraction s of steps of length h.

    `ends` are (values, rates, second rates) at both ends. The polynomial is q + v s + a s^2 + c3 s^3 + c4 s^4 + c5 s^5.
    """
    (q, q_t, q_tt), (end, end_t, end_tt) = ends
    v, a, change = h * q_t, 0.5 * h**2 * q_tt, end - q
    # at s = 1: c3 + c4 + c5, and the first and the second derivative of c3 s^3 + c4 s^4 + c5 s^5
    d0, d1, d2 = change - v - a, h * end_t - v - 2 * a, h**2 * end_tt - 2 * a
    c3, c4, c5 = 10 * d0 - 4 * d1 + 0.5 * d2, -15 * d0 + 7 * d1 - d2, 6 * d0 - 3 * d1 + 0.5 * d2
    values = q + s * (v + s * (a + s * (c3 + s * (c4 + s * c5))))
    return values, v + s * (2 * a + s * (3 * c3 + s * (4 * c4 + 5 * s * c5)))


def between(time: Array, values: Array, rates: Array | None, times: Array, smooth: bool = False) -> Array:
    """Interpolate samples at `times` by cubic Hermite polynomials, with given rates, or else by `slopes` with `smooth`."""
    if len(time) == 1:
        return np.broadcast_to(values[0], np.shape(times) + values.shape[1:])
    found, _rates = hermite(time, values, slopes(time, values, smooth) if rates is None else rates, times)
    return found


def trapezoidal(time: Array, rate: Array) -> Array:
    """Integrate from the first time, each (times,), by the trapezoidal rule, which a second-order integrator itself uses."""
    return np.append(0.0, np.cumsum(np.diff(time) * (rate[1:] + rate[:-1]) / 2))


def corrected_trapezoidal(time: Array, rate: Array) -> Array:
    """Integrate rates, (..., times), from the first time to the fourth order; rates with numerical noise are for `trapezoidal`.

    The trapezoidal rule is corrected by slopes at both ends of a step: int f dt = h (f0 + f1)/2 + h^2 (f0' - f1')/12 + O(h^5).
    """
    steps = np.diff(time)
    areas = steps * (rate[..., 1:] + rate[..., :-1]) / 2
    if len(steps) > 1:
        areas += _compute_slope_differences(steps, rate) * steps**2 / 12
    found = np.zeros(rate.shape)
    np.cumsum(areas, axis=-1, out=found[..., 1:])
    return found


def _compute_slope_differences(steps: Array, rate: Array) -> Array:
    """Return the slope f0' at the start less f1' at the end of each of two or more steps, (..., steps); `rate` is (..., times).

    The slope at a sample is that of the parabola through the sample and its two neighbours. Between secants of one sign it is
    limited to three times the smaller secant, so that no cubic overshoots where a force becomes constant: C. de Boor, B. Swartz,
    J. Approx. Theory 21 (1977) 411, doi 10.1016/0021-9045(77)90011-9. At a kink or an end of the run the slope is not known.
    If only one slope of a step is known, f is taken for a parabola in this step, for which (f0' + f1')/2 is the secant. If none
    is, f is taken for linear.
    """
    secant, before, after = np.diff(rate) / steps, steps[:-1], steps[1:]
    slope = (after * secant[..., :-1] + before * secant[..., 1:]) / (before + after)
    most = 3 * np.minimum(np.abs(secant[..., :-1]), np.abs(secant[..., 1:]))
    slope = np.where(secant[..., :-1] * secant[..., 1:] >= 0, np.clip(slope, -most, most), slope)
    is_kink = np.ones(len(steps) + 1, dtype=bool)  # of each sample; the first and the last one count as kinks
    is_kink[1:-1] = (after >= KINK_RATIO * before) | (before >= KINK_RATIO * after)
    starts_at_kink, ends_at_kink = is_kink[:-1], is_kink[1:]  # of each step
    start, end = np.zeros_like(secant), np.zeros_like(secant)  # f0' and f1'
    start[..., 1:], end[..., :-1] = slope, slope
    difference = start - end  # if one of them is unknown, from f0' + f1' = 2 secant:
    difference[..., starts_at_kink] = 2 * (secant - end)[..., starts_at_kink]
    difference[..., ends_at_kink] = 2 * (start - secant)[..., ends_at_kink]
    difference[..., starts_at_kink & ends_at_kink] = 0.0
    return difference
