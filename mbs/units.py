"""Numbers with units, as people write them: `0.3 mm`, `12 rpm`, `253 N.s/m`, `5 lbf.in`.

`measured("0.3 mm")` is the float 3e-4, which keeps its dimension until a check compares it with that of the expected unit.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from contextlib import suppress
from functools import lru_cache
from typing import NamedTuple


class Unit(NamedTuple):
    """Unit in SI, factor * 10**power. The power of ten is separate so that 300um is exactly the float 3e-4."""

    factor: float
    power: float
    dimension: tuple[float, ...]
    """Exponents of metre, kilogram, second, ampere and radian; an angle differs from a plain number."""


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
    "Ohm": Unit(1, 0, (2, 1, -3, -2, 0)),
    "min": Unit(60, 0, (0, 0, 1, 0, 0)),
    "deg": Unit(math.pi / 180, 0, (0, 0, 0, 0, 1)),
    "r": Unit(2 * math.pi, 0, (0, 0, 0, 0, 1)),
    "rev": Unit(2 * math.pi, 0, (0, 0, 0, 0, 1)),
    "rpm": Unit(math.pi / 30, 0, (0, 0, -1, 0, 1)),
    "Nm": Unit(1, 0, (2, 1, -2, 0, 0)),
    "Nmm": Unit(1, -3, (2, 1, -2, 0, 0)),
    "Ns": Unit(1, 0, (1, 1, -1, 0, 0)),
    "h": Unit(3600, 0, (0, 0, 1, 0, 0)),
    "t": Unit(1, 3, (0, 1, 0, 0, 0)),
    "bar": Unit(1, 5, (-1, 1, -2, 0, 0)),
    "in": Unit(0.0254, 0, (1, 0, 0, 0, 0)),
    "ft": Unit(0.3048, 0, (1, 0, 0, 0, 0)),
    "lb": Unit(0.45359237, 0, (0, 1, 0, 0, 0)),
    "lbf": Unit(4.4482216152605, 0, (1, 1, -2, 0, 0)),
}
"""Units by name. t is the tonne, lb the pound of mass, lbf that of force (lb times 9.80665 m/s^2); all by definition."""
PREFIXES = {"n": -9, "u": -6, "m": -3, "c": -2, "k": 3, "M": 6, "G": 9}
"""Powers of ten of the decimal prefixes."""
NEVER_PREFIXED = {"1", "%", "min", "deg", "r", "rev", "rpm", "h", "t", "in", "ft", "lb", "lbf"}
"""Units that take no prefix."""
SPELLINGS = str.maketrans({"·": ".", "*": ".", "µ": "u", "μ": "u", "²": "2", "³": "3", "°": "deg", "Ω": "Ohm"})

NUMBER = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+))(?:[eE]([+-]?\d+))?\s*")
"""Number at the start of a text: its digits and its exponent."""
FACTOR = re.compile(r"\s*([./]?)\s*([A-Za-z]+|%|1)(?:\^?(-?\d+(?:\.\d+)?))?\s*")
"""One factor of a unit: `.` or `/`, symbol, exponent."""
COMMA = re.compile(r"\s*([+-]?\d+),(\d+(?:[eE][+-]?\d+)?)\s*(?![\s,]*[\d(])[^,()]*")
"""Single number with a decimal comma and perhaps a unit, such as `0,3 mm`. The lookahead excludes a further number, the class
behind it commas and parentheses: lists and arguments of functions do not match."""


def _symbol(name: str) -> Unit:
    """Return the unit of a symbol, with or without a decimal prefix; a known symbol first, so that `min` is no milli-inch."""
    if name in SYMBOLS:
        return SYMBOLS[name]
    prefix, base = name[0], name[1:]
    if prefix in PREFIXES and base in SYMBOLS and base not in NEVER_PREFIXED:
        unit = SYMBOLS[base]
        return unit._replace(power=unit.power + PREFIXES[prefix])
    known = ", ".join(symbol for symbol in SYMBOLS if symbol not in ("1", "%"))
    raise ValueError(f"unknown unit '{name}'; known: {known}, with prefixes {' '.join(PREFIXES)}")


@lru_cache(maxsize=256)
def parse_unit(text: str) -> Unit:
    """Read a unit such as `N.s/mm`, `kg/m^3` or `N/mm^1.5`; a `/` divides by the next factor only."""
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
            factor /= unit.factor**e
            e = -e
        else:
            factor *= unit.factor**e
        power += e * unit.power
        dimension = [total + e * part for total, part in zip(dimension, unit.dimension, strict=True)]
        position = match.end()
    return Unit(factor, power, tuple(dimension))


MULTIPLIED = re.compile(r"(\*\s*[ts]\b)|(\b[ts]\s*\*)")
"""Product with the variable t or s: '0.1*s' is a formula, '0.1 s' a time."""
LIKE_UNITS = re.compile(r"[-+.\d\s]*\d(?:e[-+]?\d+)?[\w\s/^.·²³°%µ]*")
"""Number and a unit, which may be unknown or misspelt."""


def parse_quantity(text: str, unit: str) -> float:
    """Read a number with or without a unit, such as `300 r/min`, and return it in `unit`; ValueError for another dimension."""
    target = parse_unit(unit)
    value, source = _read(text, target)
    if source and source.dimension != target.dimension:
        raise ValueError(f"'{written_unit(text)}' is no unit for a quantity in {unit if unit != '1' else 'plain numbers'}")
    return value


def _read(text: str, target: Unit) -> tuple[float, Unit | None]:
    """Read a number, in the target unit, and the unit behind it, if any; the digits are read with the final power of ten."""
    match = NUMBER.match(text)
    if match is None:
        raise ValueError("not a number")
    if comma := COMMA.fullmatch(text):
        raise ValueError(f"a number with a comma; write {comma[1]}.{comma[2]}, with a point")
    digits, exponent, unit = match[1], int(match[2] or 0), text[match.end() :].strip()
    if not unit:
        return float(f"{digits}e{exponent}"), None
    source = parse_unit(unit)
    shift = source.power - target.power
    decades = math.floor(shift)  # the rest is a fraction of a decade in units such as N/mm^1.5
    return float(f"{digits}e{exponent + decades}") * 10 ** (shift - decades) * (source.factor / target.factor), source


class Measured(float):
    """Number in SI with the text that gave it and its dimension, which checks compare with the expected one."""

    given: str
    dimension: tuple[float, ...]

    def __new__(cls, value: float, given: str, dimension: tuple[float, ...]) -> Measured:
        """Make a number that keeps its text and its dimension."""
        number = super().__new__(cls, value)
        number.given, number.dimension = given, dimension
        return number

    def __repr__(self) -> str:
        return f"'{self.given}'"

    def __reduce__(self) -> tuple[type[float], tuple[float]]:
        return float, (float(self),)  # pickled as a plain number in SI

    def fits(self, unit: str) -> bool:
        """Return True if the number has the dimension of a unit; `unit` may be `rad/s or m/s`, or `N/m^n` with any n."""
        for one in unit.split(" or "):
            base, any_power, _ = one.strip().partition("^n")
            with suppress(ValueError):  # of an unknown unit, which fits nothing
                if self.dimension == parse_unit(base).dimension:
                    return True
                if any_power and "/" in base:  # N/m^n: the denominator may have any power, so that its base units are free
                    numerator, denominator = (parse_unit(part).dimension for part in base.split("/"))
                    pairs = zip(self.dimension, numerator, denominator, strict=True)
                    return all(have == above for have, above, below in pairs if below == 0)
        return False


def measured(text: str) -> float:
    """Read a number with an optional unit, in SI; raise a ValueError if it is no number or its unit is unknown."""
    value, source = _read(text, SYMBOLS["1"])
    return value if source is None else Measured(value, text.strip(), source.dimension)


USUAL = (
    "1", "m", "rad", "s", "kg", "m/s", "rad/s", "Hz", "m/s^2", "N", "N m", "N/m", "N s/m", "N m/rad", "N m s/rad", "Pa", "kg/m^3",
    "kg m^2", "W", "V", "A", "Ohm", "m^2", "m^4", "N m^2",
)  # fmt: skip
"""SI units in which quantities of mechanisms are shown."""


def unit_of(text: str) -> str:
    """Return the SI unit of a number that is written with a unit; '' if it has none, or none of `USUAL`."""
    found = measured(text)
    return next((unit for unit in USUAL if isinstance(found, Measured) and found.fits(unit)), "")


def written_unit(text: str) -> str:
    """Return the unit behind a number as text; '' if there is none."""
    match = NUMBER.match(text)
    return text[match.end() :].strip() if match else ""


def label_with_unit(name: str, unit: str) -> str:
    """Return the label of a quantity in drawings and tables, with its unit: `force [N]`; a plain number has no unit."""
    return name if unit in ("", "1") else f"{name} [{unit}]"


def unit_suffix(units: Mapping[str, str], name: str) -> str:
    """Return a space and the unit of a named quantity, to follow its value; '' for a plain number."""
    unit = units.get(name, "")
    return f" {unit}" if unit not in ("", "1") else ""


def is_measured(text: str) -> bool:
    """Return True if a text is, or looks like, a number with a unit, and is no formula."""
    if MULTIPLIED.search(text):
        return False
    try:
        measured(text)
    except ValueError:
        return LIKE_UNITS.fullmatch(text.strip()) is not None or COMMA.fullmatch(text) is not None
    return True
