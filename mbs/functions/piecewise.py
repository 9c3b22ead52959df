"""Functions whose jumps and kinks are at times that the user names."""

from collections.abc import Callable, Sequence
from math import ceil, inf
from typing import Any

import numpy as np

from ..declare import Declared, declared, field, quantities, quantity
from .edge_search import count_others, evaluate, sharpen
from .fields import Callables
from .values import UserFunction, component_functions


@declared
class Piecewise(UserFunction, Declared):
    """Function whose times of jumps and kinks are given; in other functions they are searched, which may miss short pulses.

    Force("A", Piecewise(lambda t: (9.0 if t % 0.5 < 1e-6 else 0.0, 0.0), breaks=(0.0, 1e-6), period=0.5))
    """

    value: Callable[..., Any] = field(Callables(), "function of time, or of time and states, or a formula")
    breaks: Sequence[float] = quantities("s", least=1, doc="times of jumps and kinks")
    period: float | None = quantity("s", above=0, doc="time after which the breaks recur", default=None)

    def agree(self) -> None:
        """Raise a ValueError unless all breaks lie within one period."""
        if self.period is not None and max(self.breaks) - min(self.breaks) >= self.period:
            raise ValueError(f"breaks: must lie within one period of {self.period:g} s")

    @property
    def variables(self) -> tuple[str, ...]:
        """Variables of the value if it is a formula; a Python function has none and raises AttributeError."""
        return tuple(self.value.variables)  # type: ignore[attr-defined]

    def kinks_until(self, duration: float) -> tuple[float, ...]:
        """Return the times of breaks in (0, duration) [s]; for an infinite duration `breaks` as given, not repeated.

        The time of a jump is the last floating-point number before the jump.
        """
        if duration == inf:
            return tuple(map(float, self.breaks))
        breaks = np.array(self.breaks, dtype=float)
        if self.period is not None:
            starts = self.period * np.arange(ceil(duration / self.period) + 1)[:, None]
            breaks = (breaks % self.period + starts).ravel()
        others = count_others(self.value)  # other arguments are zero
        times_before, _ = sharpen(lambda t: evaluate(self.value, t, *[0.0 * t] * others), np.sort(breaks), duration)
        return tuple(times_before.tolist())

    def components(self, variables: Sequence[str], size: int) -> list[Callable[..., Any]]:
        """Return the components of the value, as Python functions."""
        return component_functions(self.value, variables, size)

    def __call__(self, *values: Any) -> Any:
        """Return the value at time and states."""
        return self.value(*values)
