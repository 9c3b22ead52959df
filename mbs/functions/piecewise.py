"""Functions with given times of jumps and kinks."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import ceil, inf
from typing import Any

import numpy as np

from ..declare import Declared, declared, field, quantities, quantity
from .breaks import evaluate, others_of, sharpen
from .fields import Callables
from .values import UserFunction


@declared
class Piecewise(UserFunction, Declared):
    """Function with given times of jumps and kinks, which may be too short for the search in other functions.

    Force("A", Piecewise(lambda t: (9.0 if t % 0.5 < 1e-6 else 0.0, 0.0), breaks=(0.0, 1e-6), period=0.5))
    """

    value: Callable[..., Any] = field(Callables(), "function of time, or of time and states, or a formula")
    breaks: Sequence[float] = quantities("s", least=1, doc="times of jumps and kinks")
    period: float | None = quantity("s", above=0, doc="after which they recur", default=None)

    def agree(self) -> None:
        """Raise a ValueError unless breaks lie within the period."""
        if self.period is not None and max(self.breaks) - min(self.breaks) >= self.period:
            raise ValueError(f"breaks: must lie within one period of {self.period:g} s")

    @property
    def variables(self) -> tuple[str, ...]:
        """Variables of a formula."""
        return tuple(self.value.variables)  # type: ignore[attr-defined]

    def kinks_until(self, duration: float) -> tuple[float, ...]:
        """Return the breaks in a run [s]; for a jump the last time before it."""
        breaks = np.array(self.breaks, dtype=float)
        if self.period is not None and duration < inf:
            breaks = (breaks % self.period + self.period * np.arange(ceil(duration / self.period) + 1)[:, None]).ravel()
        if not duration < inf:
            return tuple(breaks.tolist())
        states = others_of(self.value)
        found, _ = sharpen(lambda t: evaluate(self.value, t, *[0.0 * t] * states), np.sort(breaks), duration)
        return tuple(found.tolist())

    def __call__(self, *values: Any) -> Any:
        """Return the value."""
        return self.value(*values)
