"""Specifications of the values of fields: one object reads, checks, writes and describes a value.

A raw value is a value as a user writes it in Python, a file or the command line: `Quantity("m").read("gap", "0.1 mm")` is 1e-4.
`name` is the path of the field, with which a ValueError begins. A `Measured` is a float that remembers the unit of its text.
"""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import inf
from numbers import Integral, Real
from typing import Any

from ..units import Measured, is_measured, measured, parse_unit
from ..validate import LARGEST, near, number, short, whole, word

Schema = dict[str, Any]
"""JSON schema, or a part of one."""
MOST_WHOLE = 10**9
"""Largest magnitude of whole numbers without bounds of their own: larger than any count, so that it refuses mistakes only."""


class Spec:
    """Specification of the values of a field; this base class takes any value as it is."""

    unit: str = ""  # of a quantity
    allowed: str = ""  # range or options, for the tables of the reference
    words: str = "any value"  # text after 'must be' in messages
    metavar: str = "VALUE"  # placeholder of a value in the help of the command line
    json: Mapping[str, Any] = {}  # schema of the usual raw values, if it does not depend on other specifications

    def fits(self, raw: object) -> bool:
        """Return True if a raw or stored value has the right type; `read` may still refuse it, with a better message."""
        return True

    def read(self, name: str, raw: object) -> Any:
        """Return the value as it is stored; ValueError in one line if it is not allowed."""
        return raw

    def write(self, name: str, value: Any) -> Any:
        """Return a stored value in the form of documents: a dictionary, list, text, number or truth value."""
        return value

    def schema(self) -> Schema:
        """Return the JSON schema of raw values in files."""
        return dict(self.json)

    def refusal(self, name: str, raw: object, why: str = "") -> ValueError:
        """Return the error for a raw value of the wrong type."""
        return ValueError(f"{name} = {show(raw)}: {why}must be {self.words}")


@dataclass(eq=False, repr=False)
class Quantity(Spec):
    """A number with a unit, from `low` to `high`; if an end is open, it is not allowed itself.

    The unit is '1' for a number without a unit, '' for any unit; ' or ' separates alternatives, as in 'rad/s or m/s'. `hint` is
    appended to messages about a number out of the range.
    """

    unit: str = "1"
    low: float = -inf
    high: float = inf
    open_low: bool = False
    open_high: bool = False
    nonzero: bool = False
    hint: str = ""

    words = "a number, or one with a unit such as '0.3 mm'"

    def __post_init__(self) -> None:
        for unit in self.unit.split(" or "):
            parse_unit(unit.replace("^n", ""))  # raises for a misspelt unit; N/m^n has the exponent n of a contact law
        self.metavar = "NUMBER" if self.unit in ("", "1") else self.unit
        if self.nonzero:  # these quantities have no bounds
            self.allowed = "not zero"
        elif self.low > -inf and self.high < inf:
            lowest = f"{'above ' if self.open_low else ''}{self.low:.6g}"
            self.allowed = f"{lowest} to {'below ' if self.open_high else ''}{self.high:.6g}"
        elif self.low > -inf:
            self.allowed = f"{'>' if self.open_low else '>='} {self.low:.6g}"
        elif self.high < inf:
            self.allowed = f"{'<' if self.open_high else '<='} {self.high:.6g}"

    def fits(self, raw: object) -> bool:
        """Return True for a number, or a text of a number with a unit."""
        return is_measured(raw) if isinstance(raw, str) else isinstance(raw, Real) and not isinstance(raw, bool)

    def read(self, name: str, raw: object) -> float:
        """Return a number in SI units, within its bounds."""
        if type(raw) is float and self.low < raw < self.high and 1 / LARGEST < abs(raw) < LARGEST:
            return raw  # the usual case, fast; `number` refuses magnitudes above LARGEST = 1e30, and may refuse those below 1e-30
        if not isinstance(raw, str | Real) or isinstance(raw, bool):
            raise self.refusal(name, raw)
        if isinstance(raw, str):
            try:
                raw = measured(raw)
            except ValueError as error:
                raise self.refusal(name, raw, f"{error}; ") from None
        try:
            # a plain float has no unit: `number` then compares none
            value = float(raw) if isinstance(raw, Measured) and self.unit == "" else raw
            found = number(name, value, self.low, self.high, self.unit, open_low=self.open_low, open_high=self.open_high)
        except ValueError as error:
            raise ValueError(f"{error}; {self.hint}" if self.hint else str(error)) from None
        if self.nonzero and found == 0:
            raise ValueError(f"{name} = 0: must not be zero")
        return raw if "^n" in self.unit and isinstance(raw, Measured) else found  # a contact law compares n with its exponent

    def write(self, name: str, value: Any) -> float:
        """Return the number in SI units; an int in a user's own dataclass, which need not pass `read`, stays an int."""
        return int(value) if isinstance(value, Integral) else float(value)

    def schema(self) -> Schema:
        """Return the JSON schema of a number within its bounds."""
        bounded: Schema = {"type": "number"}
        if self.low > -inf:
            bounded["exclusiveMinimum" if self.open_low else "minimum"] = self.low
        if self.high < inf:
            bounded["exclusiveMaximum" if self.open_high else "maximum"] = self.high
        # a text is a number with a unit, or a formula: the pattern is of its beginning, and `read` checks all of it
        return {"anyOf": [bounded, {"type": "string", "pattern": r"^\s*[-+(]*[\w.]"}]}


@dataclass(eq=False, repr=False)
class Whole(Spec):
    """A whole number from `low` to `high`, given as an int or its text; 8.0 and 1e3 are floats and are refused."""

    low: int = 0
    high: int = MOST_WHOLE

    words, metavar = "a whole number", "N"

    def __post_init__(self) -> None:
        self.allowed = f"{self.low} to {self.high}"
        self.json = {"type": "integer", "minimum": self.low, "maximum": self.high}

    def fits(self, raw: object) -> bool:
        """Return True for a whole number, or a text of one."""
        if isinstance(raw, str):
            return bool(re.fullmatch(r"\s*[+-]?\d+\s*", raw))
        return isinstance(raw, Integral) and not isinstance(raw, bool)

    def read(self, name: str, raw: object) -> int:
        """Return a whole number within its bounds."""
        return whole(name, int(raw) if isinstance(raw, str) and self.fits(raw) else raw, self.low, self.high)


class Flag(Spec):
    """True or false."""

    words = allowed = "true or false"
    json: Mapping[str, Any] = {"type": "boolean"}

    def fits(self, raw: object) -> bool:
        """Return True for a truth value, or a text of one."""
        return isinstance(raw, bool) or raw in ("true", "false")

    def read(self, name: str, raw: object) -> bool:
        """Return true or false."""
        if not self.fits(raw):
            raise self.refusal(name, raw)
        return raw is True or raw == "true"


class Name(Spec):
    """A name."""

    words, metavar = "a name", "NAME"
    json: Mapping[str, Any] = {"type": "string"}

    def fits(self, raw: object) -> bool:
        """Return True for a text."""
        return isinstance(raw, str)

    def read(self, name: str, raw: object) -> str:
        """Return a checked name."""
        return word(name, raw)


class Text(Name):
    """A text of any words."""

    words, allowed, metavar = "text", "any text", "TEXT"

    def read(self, name: str, raw: object) -> str:
        """Return the text without blanks at its ends."""
        if not isinstance(raw, str):
            raise self.refusal(name, raw)
        return raw.strip()


@dataclass(eq=False, repr=False)
class Choice(Name):
    """One word of several."""

    options: tuple[str, ...]

    def __post_init__(self) -> None:
        self.words, self.allowed = f"one of {', '.join(map(repr, self.options))}", ", ".join(self.options)
        self.json = {"enum": list(self.options)}

    def read(self, name: str, raw: object) -> str:
        """Return one of the options."""
        if not isinstance(raw, str) or raw.strip() not in self.options:
            raise self.refusal(name, raw)
        return raw.strip()


class Nothing(Spec):
    """None, which a file calls 'none'."""

    words = "'none'"
    json: Mapping[str, Any] = {"enum": [None, "none"]}

    def fits(self, raw: object) -> bool:
        """Return True for None or 'none'."""
        return raw is None or (isinstance(raw, str) and raw.strip() == "none")

    def read(self, name: str, raw: object) -> None:
        """Return None: `Either`, the only caller, reads values that fit."""
        return None

    def write(self, name: str, value: Any) -> str:
        """Return 'none'."""
        return "none"


def did_you_mean(raw: str, names: Iterable[str]) -> str:
    """Return the text ', did you mean ...?' with the closest of some names; '' if none is close."""
    close = near(raw, names)
    return f", did you mean '{close[0]}'?" if close else ""


def show(raw: object) -> str:
    """Write a value as in a file, shortened for a message."""
    return "true" if raw is True else "false" if raw is False else short(raw)
