"""Specifications of the values of fields: one object reads, checks, writes and describes a value.

`Quantity("m").read("gap", "0.1 mm")` is 1e-4, in Python, a file or the command line; a ValueError begins with the name.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from math import inf
from numbers import Integral, Real
from typing import Any

from ..units import Measured, is_measured, measured, parse_unit
from ..validate import LARGEST, near, number, short, whole, word

Schema = dict[str, Any]


class Spec:
    """Specification of the values of a field.

    `unit` is that of a quantity, `allowed` its range, `words` the text after 'must be' in messages, `metavar` the placeholder of
    a value in the help of the command line.
    """

    unit: str = ""
    allowed: str = ""
    words: str = "something else"
    metavar: str = "VALUE"

    def fits(self, given: object) -> bool:
        """Return True if a value has the right type, so that this specification reads it or has the message."""
        raise NotImplementedError

    def read(self, name: str, given: object) -> Any:
        """Return the value as it is stored; ValueError, in one line that begins with the name, if it is not allowed."""
        raise NotImplementedError

    def write(self, name: str, value: Any) -> Any:
        """Return a stored value in the form that documents have."""
        return value

    def schema(self) -> Schema:
        """Return the JSON schema."""
        return {}

    def refusal(self, name: str, given: object, why: str = "") -> ValueError:
        """Return the error for a value of the wrong type."""
        return ValueError(f"{name} = {show(given)}: {why}must be {self.words}")


@dataclass(eq=False, repr=False)
class Quantity(Spec):
    """A number with a unit, within the bounds `low` and `high`, which are included unless open.

    The unit is '1' for a plain number, '' for any unit; alternatives as 'rad/s or m/s'. `hint` is appended to messages about a
    number out of the range.
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
            parse_unit(unit.replace("^n", ""))  # raises for a misspelt unit
        self.metavar = "NUMBER" if self.unit in ("", "1") else self.unit
        low = f"{'>' if self.open_low else '>='} {self.low:.12g}" if self.low > -inf else ""
        self.allowed = low or (f"<= {self.high:.12g}" if self.high < inf else "")
        if self.low > -inf and self.high < inf:
            self.allowed = f"{'above ' if self.open_low else ''}{self.low:.12g} to {self.high:.12g}"
        if self.nonzero:
            self.allowed = "not zero"

    def fits(self, given: object) -> bool:
        """Return whether an input is a number, or a text of one with its unit."""
        return is_measured(given) if isinstance(given, str) else isinstance(given, Real) and not isinstance(given, bool)

    def read(self, name: str, given: object) -> float:
        """Return a number in SI units, within its bounds."""
        if type(given) is float and self.low < given < self.high and 1 / LARGEST < abs(given) < LARGEST:
            return given
        if not isinstance(given, str | Real) or isinstance(given, bool):
            raise self.refusal(name, given)
        if isinstance(given, str):
            try:
                given = measured(given)
            except ValueError as error:
                raise self.refusal(name, given, f"{error}; ") from None
        try:
            value = float(given) if isinstance(given, Measured) and not self.unit else given
            found = number(name, value, self.low, self.high, self.unit, open_low=self.open_low, open_high=self.open_high)
        except ValueError as error:
            raise ValueError(f"{error}; {self.hint}" if self.hint else str(error)) from None
        if self.nonzero and found == 0:
            raise ValueError(f"{name} = 0: must not be zero")
        return found

    def write(self, name: str, value: Any) -> float:
        """Return the number in SI units."""
        return int(value) if isinstance(value, Integral) else float(value)

    def schema(self) -> Schema:
        """Return the JSON schema of a number within its bounds."""
        plain: Schema = {"type": "number"}
        if self.low > -inf:
            plain["exclusiveMinimum" if self.open_low else "minimum"] = self.low
        if self.high < inf:
            plain["maximum"] = self.high
        return {"anyOf": [plain, {"type": "string", "pattern": r"^\s*[-+(]*[\w.]"}]}


@dataclass(eq=False, repr=False)
class Whole(Spec):
    """A whole number from `low` to `high`; 8.0 and 1e3 are not accepted."""

    low: int = 0
    high: int = 10**9

    words, metavar = "a whole number", "N"

    def __post_init__(self) -> None:
        self.allowed = f"{self.low} to {self.high}"

    def fits(self, given: object) -> bool:
        """Return whether an input is a whole number, or a text of one."""
        if isinstance(given, str):
            return bool(re.fullmatch(r"\s*[+-]?\d+\s*", given))
        return isinstance(given, Integral) and not isinstance(given, bool)

    def read(self, name: str, given: object) -> int:
        """Return a whole number within its bounds."""
        return whole(name, int(given) if isinstance(given, str) and self.fits(given) else given, self.low, self.high)

    def schema(self) -> Schema:
        """Return the JSON schema of a whole number."""
        return {"type": "integer", "minimum": self.low, "maximum": self.high}


class Flag(Spec):
    """True or false."""

    words = "true or false"
    allowed = "true or false"

    def fits(self, given: object) -> bool:
        """Return whether an input is true or false."""
        return isinstance(given, bool) or given in ("true", "false")

    def read(self, name: str, given: object) -> bool:
        """Return true or false."""
        if not self.fits(given):
            raise self.refusal(name, given)
        return given is True or given == "true"

    def schema(self) -> Schema:
        """Return the JSON schema of true or false."""
        return {"type": "boolean"}


class Name(Spec):
    """A name."""

    words, metavar = "a name", "NAME"

    def fits(self, given: object) -> bool:
        """Return whether an input is a text."""
        return isinstance(given, str)

    def read(self, name: str, given: object) -> str:
        """Return a checked name."""
        return word(name, given)

    def schema(self) -> Schema:
        """Return the JSON schema of a text."""
        return {"type": "string"}


class Text(Name):
    """Any words."""

    words, allowed, metavar = "text", "any text", "TEXT"

    def read(self, name: str, given: object) -> str:
        """Return a text without blanks around it."""
        if not isinstance(given, str):
            raise self.refusal(name, given)
        return given.strip()


@dataclass(eq=False, repr=False)
class Choice(Name):
    """One word of several."""

    options: tuple[str, ...]

    def __post_init__(self) -> None:
        self.words, self.allowed = f"one of {', '.join(map(repr, self.options))}", ", ".join(self.options)

    def read(self, name: str, given: object) -> str:
        """Return one of the options."""
        if not isinstance(given, str) or given.strip() not in self.options:
            raise self.refusal(name, given)
        return given.strip()

    def schema(self) -> Schema:
        """Return the JSON schema of the options."""
        return {"enum": list(self.options)}


class Nothing(Spec):
    """None, which a file calls 'none'."""

    words = "'none'"

    def fits(self, given: object) -> bool:
        """Return whether an input is None or 'none'."""
        return given is None or (isinstance(given, str) and given.strip() == "none")

    def read(self, name: str, given: object) -> None:
        """Return None."""
        return None

    def write(self, name: str, value: Any) -> str:
        """Return 'none'."""
        return "none"

    def schema(self) -> Schema:
        """Return the JSON schema of None."""
        return {"enum": [None, "none"]}


class Anything(Spec):
    """Any value, unchanged: for fields without a declaration."""

    def fits(self, given: object) -> bool:
        """Return True: every input will do."""
        return True

    def read(self, name: str, given: object) -> Any:
        """Return the input unchanged."""
        return given


def did_you_mean(given: str, names: Iterable[str]) -> str:
    """', did you mean ...?' with the closest of some names, or nothing."""
    close = near(given, names)
    return f", did you mean '{close[0]}'?" if close else ""


def show(given: object) -> str:
    """Write a value as a file has it, not too long."""
    return "true" if given is True else "false" if given is False else short(given)
