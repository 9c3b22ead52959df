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
from dataclasses import dataclass, field, fields, replace
from functools import lru_cache
from numbers import Integral, Real
from typing import Any, NamedTuple, TypeGuard, TypeVar

Number = TypeVar("Number", int, float)

# --- units ------------------------------------------------------------------------------------------------------------


class Unit(NamedTuple):
    """One unit in SI: factor * 10**power. The decimal power stays apart so that 300um is exactly the float 3e-4."""

    factor: float
    power: float
    dimension: tuple[float, ...]
    """Exponents of metre, kilogram, second, ampere and radian; an angle is kept apart from a plain number."""


SYMBOLS: dict[str, Unit] = {
    "1": Unit(1, 0, (0, 0, 0, 0, 0)),
    "%": Unit(1, -2, (0, 0, 0, 0, 0)),
    "m": Unit(1, 0, (1, 0, 0, 0, 0)),
    "g": Unit(1, -3, (0, 1, 0, 0, 0)),
    "s": Unit(1, 0, (0, 0, 1, 0, 0)),
    "A": Unit(1, 0, (0, 0, 0, 1, 0)),
    "rad": Unit(1, 0, (0, 0, 0, 0, 1)),
    "Hz": Unit(1, 0, (0, 0, -1, 0, 0)),
    "N": Unit(1, 0, (1, 1, -2, 0, 0)),
    "Pa": Unit(1, 0, (-1, 1, -2, 0, 0)),
    "J": Unit(1, 0, (2, 1, -2, 0, 0)),
    "W": Unit(1, 0, (2, 1, -3, 0, 0)),
    "V": Unit(1, 0, (2, 1, -3, -1, 0)),
    "min": Unit(60, 0, (0, 0, 1, 0, 0)),
    "deg": Unit(math.pi / 180, 0, (0, 0, 0, 0, 1)),
    "r": Unit(2 * math.pi, 0, (0, 0, 0, 0, 1)),
    "rev": Unit(2 * math.pi, 0, (0, 0, 0, 0, 1)),
    "rpm": Unit(math.pi / 30, 0, (0, 0, -1, 0, 1)),
}
PREFIXES = {"n": -9, "u": -6, "m": -3, "c": -2, "k": 3, "M": 6, "G": 9}
NEVER_PREFIXED = {"1", "%", "min", "deg", "r", "rev", "rpm"}
SPELLINGS = str.maketrans({"·": ".", "*": ".", "µ": "u", "μ": "u", "²": "2", "³": "3", "°": "deg"})

NUMBER = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+))(?:[eE]([+-]?\d+))?\s*")
FACTOR = re.compile(r"\s*([./]?)\s*([A-Za-z]+|%|1)(?:\^?(-?\d+(?:\.\d+)?))?\s*")


def _symbol(name: str) -> Unit:
    """A bare symbol, with or without a decimal prefix; the whole word first, so that `min` is no milli-inch."""
    if name in SYMBOLS:
        return SYMBOLS[name]
    prefix, base = name[0], name[1:]
    if prefix in PREFIXES and base in SYMBOLS and base not in NEVER_PREFIXED:
        unit = SYMBOLS[base]
        return unit._replace(power=unit.power + PREFIXES[prefix])
    raise ValueError(f"unknown unit '{name}'")


@lru_cache(maxsize=256)
def parse_unit(text: str) -> Unit:
    """Read a unit such as `N.s/mm`, `kg/m^3` or `N/mm^1.5`; each `/` divides by the one factor behind it."""
    factor, power, dimension = 1.0, 0.0, [0.0] * 5
    rest = text.translate(SPELLINGS).strip() or "1"
    position = 0
    while position < len(rest):
        match = FACTOR.match(rest, position)
        if match is None:
            raise ValueError(f"unknown unit '{text}'")
        operator, name, exponent = match.groups()
        unit, e = _symbol(name), float(exponent or 1)
        if operator == "/":
            e, factor = -e, factor / unit.factor**e
        else:
            factor *= unit.factor**e
        power += e * unit.power
        dimension = [total + e * part for total, part in zip(dimension, unit.dimension, strict=True)]
        position = match.end()
    return Unit(factor, power, tuple(dimension))


def parse_quantity(text: str, unit: str) -> float:
    """Read a number with an optional unit and return it in `unit`.

    Parameters
    ----------
    text : str
        Such as `0.3mm`, `3e-4` (then already in `unit`) or `300 r/min`.
    unit : str
        The unit of the result.

    Raises
    ------
    ValueError
        If it is no number, or its unit is unknown or of another kind.
    """
    match = NUMBER.match(text)
    if match is None:
        raise ValueError("not a number")
    digits, exponent = match[1], int(match[2] or 0)
    given = text[match.end() :].strip()
    if not given:
        return float(f"{digits}e{exponent}")
    source, target = parse_unit(given), parse_unit(unit)
    if source.dimension != target.dimension:
        raise ValueError(f"'{given}' is no unit for a quantity in {unit if unit != '1' else 'plain numbers'}")
    shift = source.power - target.power
    whole = math.floor(shift)  # a part of a decade is left over in units such as N/mm^1.5
    return float(f"{digits}e{exponent + whole}") * 10 ** (shift - whole) * (source.factor / target.factor)


# --- declarations -----------------------------------------------------------------------------------------------------


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

    def check_counts(self, *names: str) -> None:
        """Check that all of some quantities without unit are whole numbers."""
        for name in names:
            counts = getattr(self, name)
            if any(x != int(x) for x in counts):
                raise ValueError(f"{name} = {','.join(f'{x:g}' for x in counts)}: must be whole numbers")


def specs(kind: type[StudyParameters]) -> dict[str, Spec]:
    """Names of a `Parameters` class with what each may be."""
    return {declared.name: declared.metadata["spec"] for declared in fields(kind)}


def _read(name: str, spec: Spec, given: object) -> Any:
    try:
        return spec.read(given)
    except ValueError as reason:
        shown = given if isinstance(given, str) else spec.show(given)
        raise ValueError(f"{name} = {shown}: {reason}; allowed: {spec.allowed}") from None
