"""Base classes of loads: forces on bodies, by constants, user's functions, or laws with states."""

from collections.abc import Callable, Iterator, Sequence
from typing import Any, ClassVar

import numpy as np

from ..declare import Declared, declared, field, quantities
from ..functions import Argument, Called, Table, component_functions, kinks
from ..functions.fields import Function, Law, Rates
from ..geometry import Array
from ..validate import short
from .element import GROUND, Element, Parts, Push, Recorded, place
from .signal import Kind, Signal


class Load(Element):
    """Base of loads; `pushes` yields the forces on bodies other than the ground."""


def on_both(ends: Sequence[str], force: Array, torque: Array) -> Iterator[Push]:
    """Yield force and torque on the first of two point references and their opposites on the second; none on the ground."""
    for at, sign in zip(ends, (1.0, -1.0), strict=True):
        if place(at).body != GROUND:
            yield Push(at, sign * force, sign * torque)


def sample(function: Callable[..., object], *columns: Array) -> Array:
    """Evaluate a user's function, of one or two components, for columns of arguments (times,); nan where it raises an error."""
    values: list[Any] = []
    for arguments in zip(*(column.tolist() for column in columns), strict=True):
        try:
            values.append(np.asarray(function(*arguments), dtype=float))
        except Exception:
            values.append(np.array(np.nan))
    shape = max((value.shape for value in values), key=len)  # (2,) for a vector, though errors leave scalars
    return np.array([np.broadcast_to(value, shape) for value in values])


@declared
class States(Declared):
    """States of a load's law, with rates and initial values. Formulas call them state1, state2 and so on.

    >>> States(rates=lambda time, angle, speed, s: 1.0 - speed, initial=(0.0,)).initial
    (0.0,)
    """

    rates: Callable[..., object] = field(
        Rates("t, ..."),  # the load knows the other arguments: its method `Stateful.check_states` checks the rates
        "of the states, 1/s: functions of the load's arguments, or one function that returns all rates",
    )
    initial: Sequence[float] = quantities("", least=1, doc="value of each at t = 0", default=(0.0,))


class Stateful(Load):
    """A load whose value is constant, or a function of time, motion and states.

    `signature` has the variables of a function without states, its unit and number of components. A force depends on the time t,
    a torque on t, angle and speed. With states, the arguments of the function are first the variables in the text
    `variables_with_states`, such as 't, angle, speed', and then the states.
    """

    signature: ClassVar[Law]
    variables_with_states: ClassVar[str]

    value: Any
    states: States | None

    def agree(self) -> None:
        """Raise a ValueError for states without a function, or a function that does not take its arguments."""
        if self.states is not None and not callable(self.value):
            raise ValueError(f"{self.where}: value = {short(self.value)}: must be a function where there are states")
        if self.states is None and callable(self.value):
            self.signature.check_call(f"{self.where}: value", self.value)

    @property
    def has_states(self) -> bool:
        """True if the law has states."""
        return self.states is not None

    def kinks(self, duration: float) -> tuple[float, ...]:
        """Return the times in (0, duration) at which the load or a rate jumps, has a kink or changes quickly [s]."""
        of_rates = () if self.states is None else kinks(self.states.rates, duration)
        return tuple(sorted({*kinks(self.value, duration), *of_rates}))

    def push(self, name: str, record: Recorded, times: Array) -> Push:
        """Return the load on the body for the motion at the samples, with functions of time at `times` [s].

        These are the samples or, for the left and right limits at a jump, instants just before or just after them.
        """
        raise NotImplementedError

    def pushes(self, name: str, record: Recorded) -> Iterator[Push]:
        """Yield the load on the body, from `push` with all functions at the samples."""
        yield self.push(name, record, record.time)

    def work_of(self, name: str, record: Recorded) -> Array:
        """Compute the work (times,) [J]; where a function has edges, also from the powers just before and after each sample."""
        power, last = self.push(name, record, record.time).power(record), float(record.time[-1])
        if not self.kinks(last):
            return record.work(power)
        sides = (np.clip(record.time + side * last, 0.0, last) for side in (-1e-9, 1e-9))  # chosen
        before, after = (self.push(name, record, times).power(record) for times in sides)
        return record.work(power, (before, after))

    def start_motion(self, mechanism: Parts) -> list[float]:
        """Return time and measures of the motion at t = 0, at rest: arguments of the function, here all zero."""
        return [0.0] * len(self.variables_with_states.split(", "))

    def measures(self, record: Recorded) -> tuple[Array, ...]:
        """Return the arguments between time and states, each (times,): all coordinates, then their rates in the same order."""
        raise NotImplementedError

    @property
    def variables(self) -> list[str]:
        """Names of the arguments of the function and of the rates."""
        if self.states is None:
            return self.signature.variables.split(", ")
        return [*self.variables_with_states.split(", "), *(f"state{k + 1}" for k in range(len(self.states.initial)))]

    def start_arguments(self, mechanism: Parts) -> list[float]:
        """Return the arguments of the functions at t = 0, at rest, as many as there are `variables`."""
        initial = () if self.states is None else self.states.initial
        return [*self.start_motion(mechanism), *initial][: len(self.variables)]

    def functions(self) -> list[Callable[..., float]]:
        """Return the components of the load, then the rates of the states, each a function of `variables`."""
        components = component_functions(self.value, self.variables, self.signature.size)
        if self.states is None:
            return components
        return components + component_functions(self.states.rates, self.variables, len(self.states.initial))

    def check_states(self, mechanism: Parts) -> None:
        """Raise a ValueError if, at t = 0, the function or a rate fails or returns another number of values."""
        if self.states is None:
            return
        start = self.start_arguments(mechanism)
        names = ", ".join(self.variables)
        Function(names, self.signature.unit, self.signature.size).check_call(f"{self.where}: value", self.value, start)
        Function(names, size=len(self.states.initial)).check_call(f"{self.where}: states.rates", self.states.rates, start)

    def evaluate(self, name: str, record: Recorded, times: Array) -> Array:
        """Evaluate the load at `times` with motion and states of the samples, (times,) or (times, components)."""
        if not callable(self.value):
            return np.array([self.value] * len(times))
        if self.states is None:  # then a force depends on the time alone, and takes none of the measures
            return sample(self.value, times, *self.measures(record)[: len(self.variables) - 1])
        states, _ = self._read_states(name, record)
        components = self.functions()[: self.signature.size]
        values = np.column_stack([sample(each, times, *self.measures(record), *states) for each in components])
        return values[:, 0] if self.signature.size == 1 else values

    def _read_states(self, name: str, record: Recorded) -> tuple[Array, Array]:
        """Return the states and their rates, each (states, times); none without states."""
        columns = record.channel(name, "states").T
        count = len(columns) // 2  # the channel has all states, then all rates
        return columns[:count], columns[count:]

    def user_functions(self, name: str, record: Recorded) -> Iterator[Called]:
        """Yield the functions, except those of time alone, with their arguments after the time, for the search of edges."""
        # a formula may have fewer variables than the load; it ignores further arguments
        variables = tuple(getattr(self.value, "variables", self.variables))
        is_of_time_alone = isinstance(self.value, Table) or variables == ("t",)
        if not callable(self.value) or (is_of_time_alone and self.states is None):
            return
        measures = self.measures(record)
        half = len(measures) // 2
        coordinates, rates = measures[:half], measures[half:]
        # coordinates and states are given with their rates; the rates of rates are not known
        arguments = [*map(Argument, coordinates, rates), *map(Argument, rates), *map(Argument, *self._read_states(name, record))]
        for function in [self.value] if self.states is None else self.functions():
            yield function, arguments

    def state_signals(self, name: str, record: Recorded) -> Iterator[Signal]:
        """Yield the states and their rates."""
        for k, (x, rate) in enumerate(zip(*self._read_states(name, record), strict=True), 1):
            yield Signal(f"{name}.state{k}", x, "", Kind.STATE, rate=f"{name}.rate{k}", scale=float(np.abs(x).max()))
            yield Signal(f"{name}.rate{k}", rate, "1/s", Kind.RATE, scale=float(np.abs(rate).max()))
