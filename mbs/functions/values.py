"""Functions as values that can be compared, saved, pickled and read from a file: formulas and tables.

Example: Motor("crank", voltage=Table((0, 1, 2), (0, 6, 12)), ...). Kinks in this file are all times on which steps of a run end:
kinks, jumps, and both ends of a change of the value that takes less than 1/200 of the run.
"""

from __future__ import annotations

import re
from bisect import bisect_left, bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, is_dataclass
from dataclasses import field as plain_field
from functools import cached_property, lru_cache
from itertools import pairwise
from math import ceil, inf, log2
from typing import Any

import numpy as np

from ..declare import Declared, Name, Quantity, Several, Spec, declared, field, flag, quantities
from .edge_memory import EdgeMemory, current_memory
from .formulas import function_of, names_in, parse

TURN, PATH = ("t", "angle", "speed"), ("t", "x", "y", "vx", "vy")
SIGNATURES = (("t",), ("s",), ("u",), ("x",), ("x", "v"), TURN, PATH)
"""Variables of formulas, in the order of the arguments: time; fraction of a length; end shortening over the length; elongation
and its rate; time, angle and speed of a link; time, place and velocity of a point. States `state1`, `state2`, ... may follow."""
STATE = re.compile(r"\bstate[1-9][0-9]*\b")
"""Names of states in formulas."""
PIECES = 128
"""Number of pieces of a time span whose integrals are stored: an integral up to any time costs at most one new piece."""


def kinks(function: object, duration: float = inf) -> tuple[float, ...]:
    """Return the kinks [s] of a function of time in a run of a duration [s].

    A function may give them by a method `kinks_until(duration)`, all of them for an infinite duration. Other functions are
    searched by `EdgeMemory`; they have none for an infinite duration.
    """
    if hasattr(function, "kinks_until"):
        return tuple(function.kinks_until(duration))
    if not callable(function) or not 0 < duration < inf:
        return ()
    memory = current_memory(default=EdgeMemory())  # that of the running `simulate`, which searches each function once
    return memory.of_time(function, duration).times


class UserFunction:
    """Base of formulas and tables, which are pickled by their fields."""

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), tuple(getattr(self, f.name) for f in fields(self) if f.init)  # type: ignore[arg-type]


_function_of = lru_cache(maxsize=256)(function_of)  # equal formulas have one function, and one machine code


@declared
class Expression(UserFunction, Declared):
    """A formula of the time t [s], or of the variables of one of `SIGNATURES`, in the syntax of `mbs.functions.formulas`."""

    text: str = field(Name(), "such as `2*sin(3*t)` or `-0.1*speed`")

    def agree(self) -> None:
        """Raise a ValueError unless the variables of the formula belong to one signature."""
        _ = self.variables  # the property raises the error

    @cached_property
    def names(self) -> set[str]:
        """Names of the variables and states in the formula."""
        return names_in(parse(self.text, {*STATE.findall(self.text), *(name for names in SIGNATURES for name in names)}))

    @cached_property
    def variables(self) -> tuple[str, ...]:
        """Arguments of the function: the first signature that has all variables of the formula, then the states."""
        states = set(filter(STATE.fullmatch, self.names))
        for names in SIGNATURES:
            if self.names - states <= set(names):
                return (*names, *sorted(states))
        known = "; ".join(", ".join(names) for names in SIGNATURES)
        raise ValueError(f"'{self.text}': {', '.join(sorted(self.names - states))} do not go together; known: {known}")

    def of(self, variables: Sequence[str]) -> Callable[..., Any]:
        """Return the Python function of variables, the same object at each call; ValueError if the formula has others."""
        if unknown := self.names - set(variables):
            raise ValueError(f"'{self.text}': there is no {', '.join(sorted(unknown))}; known: {', '.join(variables)}")
        return _function_of(self.text, tuple(variables))

    def components(self, variables: Sequence[str], _size: int) -> list[Callable[..., Any]]:
        """Return the formula as a Python function, its only component."""
        return [self.of(variables)]

    def __call__(self, *values: Any) -> Any:
        """Return the value for floats or arrays of `variables`; further arguments are ignored."""
        count = len(self.variables)
        if len(values) < count:
            raise ValueError(f"'{self.text}' is a function of {', '.join(self.variables)}")
        if any(isinstance(value, np.ndarray) for value in values):
            with np.errstate(all="ignore"):
                shape = np.broadcast_shapes(*map(np.shape, values))
                found = np.zeros(shape) + _function_of(self.text, self.variables, arrays=True)(*values[:count])
            if np.isfinite(found).all():
                return found
            return np.vectorize(self, otypes=[float])(*values)  # one by one, so that the error names the arguments that fail
        try:
            return _function_of(self.text, self.variables)(*values[:count])
        except (ArithmeticError, ValueError) as error:
            where = ", ".join(f"{n} = {v:g}" for n, v in zip(self.variables, values, strict=False))
            raise ValueError(f"'{self.text}' at {where}: {error}") from None

    def integral(self) -> Integral:
        """Return the integral from 0, by adaptive quadrature."""
        return Integral(self)


@declared
class Table(UserFunction, Declared):
    """Values at times, with interpolation between them; constant before the first time and after the last."""

    times: Sequence[float] = quantities("s", doc="increasing, two at least")
    values: Sequence[float] = quantities("", doc="one for each time")
    smooth: bool = flag(doc="whether a cubic spline joins the values, not straight lines", default=False)

    def agree(self) -> None:
        """Raise a ValueError unless times increase and there is one value for each."""
        if len(self.times) < 2 or len(self.times) != len(self.values):
            raise ValueError(f"times: {len(self.times)}, values: {len(self.values)}; must be two at least, and as many of each")
        if not np.all(np.diff(self.times) > 0):
            raise ValueError("times: must increase")

    @cached_property
    def _curve(self) -> Any:
        """Cubic spline or broken line through the values."""
        from scipy.interpolate import CubicSpline, make_interp_spline  # they take a while to load, and few need them

        return CubicSpline(self.times, self.values) if self.smooth else make_interp_spline(self.times, self.values, k=1)

    def __call__(self, t: Any, *_: Any) -> Any:
        """Return the value at a time or an array of times [s]."""
        first, last = self.times[0], self.times[-1]
        found = self._curve(np.clip(t, first, last)) if self.smooth else np.interp(t, self.times, self.values)
        return found if isinstance(t, np.ndarray) else float(found)

    def kinks_until(self, duration: float) -> tuple[float, ...]:
        """Return the times of the table, or the first and last of a smooth one, within a run of a finite duration [s]."""
        times = (self.times[0], self.times[-1]) if self.smooth else tuple(self.times)
        return times if duration == inf else tuple(t for t in times if 0 < t < duration)

    def integral(self) -> Integral:
        """Return the integral from 0, in closed form."""
        return TableIntegral(self)


@dataclass(frozen=True)
class Integral(UserFunction):
    """Integral from 0 of a function, by adaptive Gauss-Kronrod quadrature (QUADPACK) on pieces, whose integrals are stored."""

    integrand: Callable[..., Any]
    _span: float = plain_field(default=0.0, init=False, repr=False, compare=False)  # [s], divided into `PIECES` pieces
    _kinks: tuple[float, ...] = plain_field(default=(), init=False, repr=False, compare=False)  # of the integrand in the span
    _sums: list[float] = plain_field(default_factory=lambda: [0.0], init=False, repr=False, compare=False)  # up to each piece

    def kinks_until(self, duration: float) -> tuple[float, ...]:
        """Return the kinks of the integrand [s], and divide a run of this duration into pieces, so that `__call__` need not."""
        if duration < inf:
            self._divide(duration)
        return kinks(self.integrand, duration)

    def _divide(self, duration: float) -> None:
        """Divide a time span [s] into pieces, and search it for kinks of the integrand."""
        if duration != self._span:
            object.__setattr__(self, "_span", duration)
            object.__setattr__(self, "_kinks", kinks(self.integrand, duration))
            object.__setattr__(self, "_sums", [0.0])

    def _piece(self, start: float, end: float) -> float:
        """Integrate over a piece, divided at kinks of the integrand."""
        from scipy.integrate import quad  # it takes a while to load, and few need it

        inner = self._kinks[bisect_right(self._kinks, start) : bisect_left(self._kinks, end)]
        # for integrands with vibrations, humps or kinks a tenfold tolerance still gives an error of some 1e-15; they need up to
        # twenty intervals, and the limit, which is chosen, is far above
        options = {"epsabs": 0.0, "epsrel": 1e-11, "limit": 10_000, "full_output": 1}
        return sum(quad(self.integrand, a, b, **options)[0] for a, b in pairwise([start, *inner, end]))

    def __call__(self, t: Any, *_: Any) -> Any:
        """Return the integral from 0 to a time or an array of times t >= 0 [s]."""
        if isinstance(t, np.ndarray):
            return np.vectorize(self, otypes=[float])(t)
        if t == 0:
            return 0.0
        if abs(t) * (1 - 1e-9) > self._span:  # beyond the span by more than rounding
            self._divide(2.0 ** ceil(log2(abs(t))))  # a power of two, so that the span changes seldom
        sums, width = self._sums, self._span / PIECES
        full = max(0, int(t / width))  # full pieces before t; none for t < 0, just before the start of a run
        while len(sums) <= full:
            k = len(sums)
            sums.append(sums[-1] + self._piece((k - 1) * width, k * width))
        return sums[full] + self._piece(full * width, t)


@dataclass(frozen=True)
class TableIntegral(Integral):
    """Integral from 0 of a table: the antiderivative of its spline, and straight lines outside of its times."""

    integrand: Table

    @cached_property
    def _curve(self) -> Any:
        return self.integrand._curve.antiderivative()

    @cached_property
    def _at_zero(self) -> Any:
        return self._since_first(0.0)

    def _divide(self, duration: float) -> None:
        """Do nothing: a table needs no pieces and no search."""

    def _since_first(self, t: Any) -> Any:
        """Return the integral from the first time of the table."""
        table = self.integrand
        first, last = table.times[0], table.times[-1]
        before, after = np.minimum(t - first, 0.0), np.maximum(t - last, 0.0)
        inside = self._curve(np.clip(t, first, last))
        return inside + table.values[0] * before + table.values[-1] * after

    def __call__(self, t: Any, *_: Any) -> Any:
        """Return the integral from 0 to a time or an array of times t [s]."""
        found = self._since_first(t) - self._at_zero
        return found if isinstance(t, np.ndarray) else float(found)


@declared
class Components(UserFunction, Declared):
    """A function with several values, such as the two components of a force."""

    parts: Sequence[float | Callable[..., Any]] = field(Several(Spec()), "each a number or a function of the same variables")

    def agree(self) -> None:
        """Raise a ValueError unless parts are numbers or functions."""
        parts = (part if callable(part) else Quantity("").read(f"parts[{k}]", part) for k, part in enumerate(self.parts))
        object.__setattr__(self, "parts", tuple(parts))

    def kinks_until(self, duration: float) -> tuple[float, ...]:
        """Return the kinks of all parts [s]."""
        return tuple(sorted({t for part in self.parts for t in kinks(part, duration)}))

    def components(self, variables: Sequence[str], _size: int) -> list[Callable[..., Any]]:
        """Return all parts as Python functions."""
        return [each for part in self.parts for each in component_functions(part, variables)]

    def __call__(self, *values: Any) -> tuple[Any, ...]:
        """Return the values of all parts."""
        return tuple(part(*values) if callable(part) else part for part in self.parts)


def component_functions(function: Any, variables: Sequence[str], size: int = 1) -> list[Callable[..., float]]:
    """Return the components of a function or number, each as a Python function of the variables that returns a float.

    A Python function has `size` components. A formula of other variables raises ValueError.
    """
    if hasattr(function, "components"):
        return list(function.components(variables, size))
    if not callable(function):
        return [lambda *_: function]
    return [function] if size == 1 else [_component(function, i) for i in range(size)]


def _component(function: Callable[..., Any], i: int) -> Callable[..., float]:
    return lambda *values: function(*values)[i]  # without a keyword argument, which Numba does not compile


def has_user_code(value: object) -> bool:
    """Return True if a mechanism contains Python functions or objects of classes that are not Buckler's."""
    if is_dataclass(value) and not isinstance(value, type):
        is_foreign = not type(value).__module__.startswith("buckler.")
        return is_foreign or any(has_user_code(getattr(value, f.name)) for f in fields(value))
    if isinstance(value, dict | tuple | list):
        return any(map(has_user_code, value.values() if isinstance(value, dict) else value))
    return callable(value) and not str(getattr(value, "__module__", "")).startswith("buckler.")
