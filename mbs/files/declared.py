"""What a class says of its fields: type, unit, range and help, read from its numpydoc docstring and its annotations.

The docstring is the one declaration of unit and help. The file reader's messages, the JSON schema and `buckler schema` come
from it, and a test holds it against what the class refuses. Both styles are read:

    gap : float                               stiffness : float > 0, N/m^1.5, K
        Radial clearance, m: bush minus pin.
"""

from __future__ import annotations

import dataclasses
import inspect
import re
import typing
from functools import cache
from typing import Any, NamedTuple

from buckler.mbs.units import parse_unit

HEADER = re.compile(r"^(\w[\w, ]*?) : (.+)$")
RANGE = re.compile(r"(?<!\w)(>=|>|<=|<) *(-?\d[\d.e+-]*)")
BETWEEN = re.compile(r"(-?\d[\d.e+-]*) (<=?) \w+ (<=?) (-?\d[\d.e+-]*)")
BRACKET = re.compile(r"in ([\[(])\s*([^,\s]+), *([^\])\s]+)\s*([\])])")
WORDS = {"positive": (0.0, True), "not negative": (0.0, False), "at least zero": (0.0, False)}
UNITLESS = "1"


class Declared(NamedTuple):
    """A field of a class.

    Attributes
    ----------
    name : str
    hint : type
        Its annotation, resolved.
    unit : str
        '' where it is no quantity, or none is named.
    low, high : float or None
        Ends of the range allowed, where it is named.
    open_low : bool
        Whether `low` itself is not allowed.
    help : str
    required : bool
    default : object
    """

    name: str
    hint: Any
    unit: str
    low: float | None
    high: float | None
    open_low: bool
    help: str
    required: bool
    default: Any


_READ: dict[Any, dict[str, Declared]] = {}


def declared(kind: Any) -> dict[str, Declared]:
    """Fields of a dataclass that its maker is given, by name."""
    if kind not in _READ:
        _READ[kind] = _read(kind)
    return _READ[kind]


def _read(kind: Any) -> dict[str, Declared]:
    hints = typing.get_type_hints(kind)
    told = described(kind)
    found = {}
    for field in dataclasses.fields(kind):
        if not field.init:
            continue
        header, text = told.get(field.name, ("", ""))
        low, high, open_low = _range(f"{header}. {text}")
        hint = hints[field.name]
        unit = _unit(header, text) if takes_number(hint) else ""
        found[field.name] = Declared(field.name, hint, unit, low, high, open_low, _help(header, text), *_default(field))
    return found


def _default(field: Any) -> tuple[bool, Any]:
    if field.default is not dataclasses.MISSING:
        return False, field.default
    if field.default_factory is not dataclasses.MISSING:
        return False, field.default_factory()
    return True, None


@cache
def described(kind: type) -> dict[str, tuple[str, str]]:
    """What the docstrings of a class and its bases say of each parameter: what stands behind the colon, and the text below."""
    found: dict[str, tuple[str, str]] = {}
    for base in reversed(kind.__mro__):
        if base.__doc__ and "Parameters\n" in (text := inspect.cleandoc(base.__doc__)):
            found |= _parameters(text)
    return found


def _parameters(text: str) -> dict[str, tuple[str, str]]:
    block = re.split(r"\n\S[^\n]*\n-{3,}\n", text.partition("Parameters\n")[2].partition("\n")[2])[0]
    found: dict[str, tuple[str, str]] = {}
    names: list[str] = []
    for line in block.splitlines():
        if match := HEADER.match(line):
            names = [name.strip() for name in match[1].split(",")]
            found |= dict.fromkeys(names, (match[2], ""))
        elif line.startswith(" "):
            found |= {name: (found[name][0], f"{found[name][1]} {line.strip()}".strip()) for name in names}
    return found


def takes_number(hint: Any) -> bool:
    """Whether a number may stand there, alone or in a sequence; not whole numbers."""
    if hint in (float, Any):
        return True
    return any(takes_number(part) for part in typing.get_args(hint) if part is not type(None))


def _unit(header: str, text: str) -> str:
    """The first unit named: behind the type, else in the text."""
    for part in [*header.split(", ")[1:], *re.split(r"[,:;.] |[.:;]$|[()]", text)]:
        words = part.strip().removesuffix(".")
        alternatives = words.split(" or ")
        if words and all(map(_is_unit, alternatives)):
            return words
    return UNITLESS


def _is_unit(text: str) -> bool:
    if not re.fullmatch(r"1|(?:k?[A-Z][a-z]?|Ohm|kg|rad|m|s|1)(?:[ /^\d.n-]+(?:kg|rad|[a-zA-Z]{1,2})?)*", text.strip()):
        return False
    try:
        parse_unit(text.strip().replace("^n", ""))
    except ValueError:
        return False
    return True


def _range(text: str) -> tuple[float | None, float | None, bool]:
    if match := BRACKET.search(text):
        try:
            return float(match[2]), float(match[3]), match[1] == "("
        except ValueError:
            pass
    if match := BETWEEN.search(text):
        return float(match[1]), float(match[4]), match[2] == "<"
    low: float | None = None
    high: float | None = None
    open_low = False
    for sign, digits in RANGE.findall(text):
        if sign.startswith(">"):
            low, open_low = float(digits), sign == ">"
        elif sign == "<=":
            high = float(digits)
    for word, (bound, excluded) in WORDS.items():
        if low is None and re.search(rf"\b{word}\b(?! (?:to|in))", text):
            low, open_low = bound, excluded
    return low, high, open_low


def _help(header: str, text: str) -> str:
    said = text or ", ".join(header.split(", ")[1:])
    return " ".join(said.split())
