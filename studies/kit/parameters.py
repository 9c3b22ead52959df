"""Parameters of a study: declared once, with unit, range and help; Python, TOML and the command line read them alike.

    @dataclass(frozen=True)
    class Parameters(StudyParameters):
        thickness: float = quantity(3e-4, "m", 1e-5, 1e-2, "strip thickness")
        models: tuple[str, ...] = choices(("strut",), ("stitched", "strut", "beam"), "models to run")

`Parameters(thickness="0.3mm")` holds 3e-4, and `Parameters(thickness=-1)` raises a ValueError that names the parameter,
its value, the allowed range and the unit.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass, field, fields, replace
from numbers import Integral, Real
from typing import Any, TypeGuard, TypeVar

from buckler.mbs.units import parse_quantity, parse_unit

Number = TypeVar("Number", int, float)


@dataclass(frozen=True)
class Spec:
    """What a parameter may be, how it is read and how it is shown."""

    read: Callable[[object], Any]
    """Turns what was given into the value, or raises a ValueError with the reason."""
    show: Callable[[Any], str]
    allowed: str
    metavar: str
    help: str
    group: str
    unit: str = ""
    """Of a quantity; empty for anything else."""


def _quantity(unit: str, low: float, high: float, help: str, group: str) -> Spec:
    """A number in `unit`, or a string such as `0.3mm`, in a closed range."""
    parse_unit(unit)  # a misspelt unit shows when the study is imported, not when someone first gives one

    def read(given: object) -> float:
        if isinstance(given, str):
            value = parse_quantity(given, unit)
        elif _is_number(given):
            value = float(given)
        else:
            raise ValueError("not a number")
        return _within(value, low, high)

    def show(value: Any) -> str:
        digits = f"{value:.12g}" if _is_number(value) else str(value)
        return digits if unit == "1" else f"{digits} {unit}"

    return Spec(read, show, f"{low:.12g} to {show(high)}", "NUMBER" if unit == "1" else unit, help, group, unit)


def _is_number(given: object) -> TypeGuard[Real]:
    return isinstance(given, Real) and not isinstance(given, bool)  # to Python, True is the number 1


def _within(value: Number, low: Number, high: Number) -> Number:
    if not (low <= value <= high and math.isfinite(value)):
        raise ValueError("out of range")
    return value


def _integer(low: int, high: int, help: str, group: str) -> Spec:
    """A whole number in a closed range; 8.0 and 1e3 are none."""

    def read(given: object) -> int:
        if isinstance(given, str) and re.fullmatch(r"\s*[+-]?\d+\s*", given):
            return _within(int(given), low, high)
        if isinstance(given, Integral) and not isinstance(given, bool):
            return _within(int(given), low, high)
        raise ValueError("not a whole number")

    return Spec(read, str, f"{low} to {high}", "N", help, group)


def _choice(options: Sequence[str], help: str, group: str) -> Spec:
    """One word of several."""

    def read(given: object) -> str:
        if not isinstance(given, str) or given.strip() not in options:
            raise ValueError("not one of the options")
        return given.strip()

    return Spec(read, str, ", ".join(options), "NAME", help, group)


def _several(item: Spec) -> Spec:
    """One or more of something else, comma separated or a sequence, none of them twice."""

    def read(given: object) -> tuple[Any, ...]:
        if isinstance(given, str):
            given = given.split(",")
        values = tuple(item.read(part) for part in (given if isinstance(given, Iterable) else (given,)))
        if not values:
            raise ValueError("none given")
        if len(set(values)) < len(values):
            raise ValueError("one of them given twice")
        return values

    def show(value: Any) -> str:
        return ",".join(map(item.show, value)) if isinstance(value, tuple | list) else item.show(value)

    return replace(item, read=read, show=show, allowed=f"one or more of {item.allowed}", metavar=f"{item.metavar},...")


# Each of these returns a dataclass field; the declared type is the value's, as with `dataclasses.field` itself.


def quantity(default: float, unit: str, low: float, high: float, help: str, group: str = "parameters") -> float:
    """Declare a number with a unit, allowed from `low` to `high`, both included."""
    return field(default=default, metadata={"spec": _quantity(unit, low, high, help, group)})


def quantities(
    default: tuple[float, ...], unit: str, low: float, high: float, help: str, group: str = "parameters"
) -> tuple[float, ...]:
    """Declare one or more numbers with a unit: `0.1mm,0.3mm`."""
    return field(default=default, metadata={"spec": _several(_quantity(unit, low, high, help, group))})


def integer(default: int, low: int, high: int, help: str, group: str = "parameters") -> int:
    """Declare a whole number, allowed from `low` to `high`, both included."""
    return field(default=default, metadata={"spec": _integer(low, high, help, group)})


def choice(default: str, options: Sequence[str], help: str, group: str = "parameters") -> str:
    """Declare one word of several."""
    return field(default=default, metadata={"spec": _choice(tuple(options), help, group)})


def choices(default: tuple[str, ...], options: Sequence[str], help: str, group: str = "parameters") -> tuple[str, ...]:
    """Declare one or more words of several: `strut,beam`."""
    return field(default=default, metadata={"spec": _several(_choice(tuple(options), help, group))})


def text(default: str, help: str, group: str = "parameters") -> str:
    """Declare any words, such as the name of a file."""

    def read(given: object) -> str:
        if not isinstance(given, str):
            raise ValueError("not text")
        return given.strip()

    return field(default=default, metadata={"spec": Spec(read, lambda value: value or "none", "any text", "TEXT", help, group)})


@dataclass(frozen=True)
class StudyParameters:
    """Base of every study's `Parameters`: reads and checks each field when made.

    Raises
    ------
    ValueError
        In one line: parameter, value, reason, allowed range and unit.
    """

    def __post_init__(self) -> None:
        for name, spec in specs(type(self)).items():
            object.__setattr__(self, name, _read(name, spec, getattr(self, name)))
        self.check()

    def check(self) -> None:
        """Check parameters against each other; a study overrides it and raises a ValueError with one line."""

    def plain(self) -> dict[str, Any]:
        """All of them by name, as a store and a file keep them."""
        return asdict(self)

    def check_counts(self, *names: str) -> None:
        """Check that all of some quantities without unit are whole numbers."""
        for name in names:
            counts = getattr(self, name)
            if any(x != int(x) for x in counts):
                raise ValueError(f"{name} = {','.join(f'{x:g}' for x in counts)}: must be whole numbers")


def specs(kind: type[StudyParameters]) -> dict[str, Spec]:
    """Names of a `Parameters` class, or of what makes the like, with what each may be."""
    if hasattr(kind, "specs"):
        return dict(kind.specs())
    return {declared.name: declared.metadata["spec"] for declared in fields(kind)}


def _read(name: str, spec: Spec, given: object) -> Any:
    try:
        return spec.read(given)
    except ValueError as reason:
        shown = given if isinstance(given, str) else spec.show(given)
        raise ValueError(f"{name} = {shown}: {reason}; allowed: {spec.allowed}") from None
