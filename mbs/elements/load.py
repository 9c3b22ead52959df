"""Base of loads: forces on bodies, functions of the user, and laws with states."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any, ClassVar

import numpy as np

from ..declare import Declared, Quantity, declared, field, quantities
from ..functions import Argument, Called, Components, Expression, Table, kinks, numbers_of
from ..functions.fields import Law, Rates
from ..geometry import Array
from ..validate import function as call_checked
from ..validate import short
from .element import GROUND, Element, Parts, Push, Recorded, place
from .signal import Kind, Signal

SIDE = 1e-9
"""Distance in time from a sample at which the sides of a jump are evaluated, over the duration of the run."""


class Load(Element):
    """Base of loads."""

    def pushes(self, name: str, record: Recorded) -> Iterator[Push]:
        """Yield the forces on bodies, the ground left out."""
        raise NotImplementedError


def on_both(ends: Sequence[str], force: Array, torque: Array) -> Iterator[Push]:
    """Yield a force and a torque on the first of two point references and their opposites on the other, the ground left out."""
    for at, sign in zip(ends, (1.0, -1.0), strict=True):
        if place(at).body != GROUND:
            yield Push(at, sign * force, sign * torque)


def sample(function: Callable[..., object], *columns: Array) -> Array:
    """Evaluate a user's function at many arguments, (times,) or (times, 2); nan where it raises."""
    found: list[Any] = []
    for arguments in zip(*(column.tolist() for column in columns), strict=True):
        try:
            found.append(np.asarray(function(*arguments), dtype=float))
        except Exception:
            found.append(np.array(np.nan))
    shape = max((value.shape for value in found), key=len)
    return np.array([np.broadcast_to(value, shape) for value in found])


@declared
class States(Declared):
    """States of a load's law: each has a rate and an initial value. Formulas call them state1, state2 and so on.

    Examples
    --------
    >>> States(rates=lambda time, angle, speed, s: 1.0 - speed, initial=(0.0,)).initial
    (0.0,)
    """

    rates: Callable[..., object] = field(
        Rates("t"), "of the states, 1/s: functions of the same arguments as the load's, or one that returns them all"
    )
    initial: Sequence[float] = quantities("", least=1, doc="value of each at t = 0", default=(0.0,))


class Stateful(Load):
    """A load whose value is constant, or a function of time, motion and states.

    `law` has variables, unit and size of the function without states; `measured` the variables before the states.
    """

    law: ClassVar[Law]
    measured: ClassVar[str]

    value: Any
    states: States | None

    def agree(self) -> None:
        """Raise a ValueError if states are given without a function, or the function has other arguments."""
        if self.states is not None and not callable(self.value):
            raise ValueError(f"{self.where}: value = {short(self.value)}: must be a function where there are states")
        if self.states is None and callable(self.value):
            self.law.check_call(f"{self.where}: value", self.value)

    @property
    def has_states(self) -> bool:
        """True if the law has states."""
        return self.states is not None

    def kinks(self, duration: float) -> tuple[float, ...]:
        """Return the times in a run at which the load jumps, has a kink or changes quickly."""
        more = () if self.states is None else kinks(self.states.rates, duration)
        return tuple(sorted({*kinks(self.value, duration), *more}))

    def push(self, name: str, record: Recorded, times: Array) -> Push:
        """Return the force on the body, at times that may differ a little from the samples, s."""
        raise NotImplementedError

    def pushes(self, name: str, record: Recorded) -> Iterator[Push]:
        """Yield the force on the body."""
        yield self.push(name, record, record.time)

    def work_of(self, name: str, record: Recorded) -> Array:
        """Compute the work, J; at jumps of the function each step uses the power on its own side."""
        power, last = self.push(name, record, record.time).power(record), float(record.time[-1])
        if not self.kinks(last):
            return record.work(power)
        sides = (np.clip(record.time + side, 0.0, last) for side in (-SIDE * last, SIDE * last))
        before, after = (self.push(name, record, times).power(record) for times in sides)
        return record.work(power, (before, after))

    def initial(self, mechanism: Parts) -> list[float]:
        """Return the arguments of the function at t = 0, without the states."""
        raise NotImplementedError

    def measures(self, record: Recorded) -> tuple[Array, ...]:
        """Return the arguments of the function over time, without time and states, each (times,)."""
        raise NotImplementedError

    @property
    def variables(self) -> list[str]:
        """Names of the arguments of the function and of the rates."""
        if self.states is None:
            return self.law.of.split(", ")
        return [*self.measured.split(", "), *(f"state{k + 1}" for k in range(len(self.states.initial)))]

    def start(self, mechanism: Parts) -> list[float]:
        """Return all arguments at t = 0, with zeros for the unknown velocities."""
        states = () if self.states is None else self.states.initial
        return [*self.initial(mechanism), *states][: len(self.variables)]

    def functions(self) -> list[Callable[..., float]]:
        """Return the components of the load, then the rates of the states, each a function of `variables`."""
        own = numbers_of(self.value, self.variables, self.law.size)
        return own if self.states is None else [*own, *numbers_of(self.states.rates, self.variables, len(self.states.initial))]

    def check_states(self, mechanism: Parts) -> None:
        """Raise a ValueError if the function or that of the rates fails at t = 0, or returns another number of values."""
        if self.states is None:
            return
        start = self.start(mechanism)
        self._check("value", self.value, start, self.law.size, self.law.unit)
        self._check("states.rates", self.states.rates, start, len(self.states.initial), "")

    def _check(self, key: str, function: Callable[..., object], start: Sequence[float], size: int, unit: str) -> None:
        name, formulas = f"{self.where}: {key}", isinstance(function, Expression | Components)
        try:
            parts: list[Any] = numbers_of(function, self.variables) if formulas else [function]
        except ValueError as error:
            raise ValueError(f"{name}: {error}") from None
        found = [call_checked(name, part, *start)(*start) for part in parts]
        value, at = found[0] if len(found) == 1 else found, f"{name} at t = 0"
        if np.shape(value) != ((size,) if size > 1 else ()):
            raise ValueError(f"{at} = {short(value)}: must be {f'{size} numbers' if size > 1 else 'a number'}")
        for each in np.ravel(value).tolist():
            Quantity(unit).read(at, each)

    def evaluate(self, name: str, record: Recorded, times: Array) -> Array:
        """Evaluate the function in a run, (times,) or (times, size), at times that may differ a little from the samples, s."""
        if self.states is None:
            return sample(self.value, times, *self.measures(record)[: len(self.variables) - 1])
        columns = times, *self.measures(record), *record.channel(name, "states").T[: len(self.states.initial)]
        found = np.column_stack([sample(each, *columns) for each in self.functions()[: self.law.size]])
        return found[:, 0] if self.law.size == 1 else found

    def user_functions(self, name: str, record: Recorded) -> Iterator[Called]:
        """Yield the function and the rates of the states, unless they are functions of time alone."""
        of_time = isinstance(self.value, Table) or getattr(self.value, "variables", self.variables) in (["t"], ("t",))
        if not callable(self.value) or (of_time and self.states is None):
            return
        measures = self.measures(record)
        half = len(measures) // 2
        arguments = [Argument(x, rate) for x, rate in zip(measures[:half], measures[half:], strict=True)]
        arguments += [Argument(rate) for rate in measures[half:]]
        if self.states is not None:
            columns, count = record.channel(name, "states").T, len(self.states.initial)
            arguments += [Argument(x, rate) for x, rate in zip(columns[:count], columns[count:], strict=True)]
        for function in self.functions() if self.states is not None else (self.value,):
            yield function, arguments

    def state_signals(self, name: str, record: Recorded) -> Iterator[Signal]:
        """Yield the states and their rates."""
        columns = record.channel(name, "states").T
        count = len(columns) // 2
        for k, (x, rate) in enumerate(zip(columns[:count], columns[count:], strict=True), 1):
            yield Signal(f"{name}.state{k}", x, "", Kind.STATE, rate=f"{name}.rate{k}", scale=float(np.abs(x).max()))
            yield Signal(f"{name}.rate{k}", rate, "1/s", Kind.RATE, scale=float(np.abs(rate).max()))
