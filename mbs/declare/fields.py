"""Declarations of fields, by which values are checked, read from files and written to them.

    @declared
    class Clearance(Joint):
        pin: float = quantity("m", above=0, doc="radius of the pin")

`Clearance(pin=-1, ...)` raises an error with class, field, value, range and unit. Python and files both accept `pin = "5 mm"`.
The declaration also gives the docstring, the schema of files, options of the command line and the reference. `doc` is the
meaning of the field, read after its name. A field without a default is required.
"""

import dataclasses
import inspect
from collections.abc import Mapping
from math import inf
from typing import Any, dataclass_transform

from .compound import Direction, Either, Several, Vector
from .declared import DECLARED, MISSING, Class, declarations
from .parts import Part
from .spec import Choice, Flag, Name, Nothing, Quantity, Spec, Whole


def field(
    spec: Spec, doc: str = "", default: Any = MISSING, default_factory: Any = MISSING, *,
    bounds: Mapping[str, str] | None = None, group: str = "",
) -> Any:  # fmt: skip
    """Declare a field by the specification of its values; it may also be None if that is the default.

    `bounds` maps '>' or '>=' to the name of the field that is the lower bound; `group` is the heading of the option in a help.
    """
    if default is None:
        spec = Either((spec, Nothing()))
    metadata = {DECLARED: (spec, doc, bounds or {}, group)}
    return dataclasses.field(default=default, default_factory=default_factory, metadata=metadata)


def quantity(
    unit: str, *, above: float | str | None = None, low: float | str | None = None, high: float | None = None,
    nonzero: bool = False, doc: str = "", default: object = MISSING,
) -> Any:  # fmt: skip
    """Declare a number with a unit: >= low or > above, and <= high; low or above may name another field as the bound."""
    bounds = {sign: name for sign, name in ((">", above), (">=", low)) if isinstance(name, str)}
    lowest = next((value for value in (above, low) if isinstance(value, int | float)), -inf)
    highest = inf if high is None else high
    spec = Quantity(unit, lowest, highest, open_low=isinstance(above, int | float), nonzero=nonzero)
    return field(spec, doc, default, bounds=bounds)


def quantities(unit: str, *, least: int = 0, most: int | None = None, doc: str = "", default: object = MISSING) -> Any:
    """Declare a list of `least` to `most` numbers with a unit."""
    return field(Several(Quantity(unit), least, most), doc, default)


def vector(unit: str, *, doc: str = "", default: object = MISSING) -> Any:
    """Declare two numbers (x, y) with a unit."""
    return field(Vector(unit), doc, default)


def direction(*, doc: str = "", default: object = MISSING) -> Any:
    """Declare a direction (x, y), which is stored as a unit vector."""
    return field(Direction(), doc, default)


def whole(low: int, high: int, *, doc: str = "", default: object = MISSING) -> Any:
    """Declare a whole number in [low, high]."""
    return field(Whole(low, high), doc, default)


def flag(*, doc: str = "", default: object = MISSING) -> Any:
    """Declare a truth value."""
    return field(Flag(), doc, default)


def names(*, doc: str = "", default: object = MISSING) -> Any:
    """Declare a name, as of a point or a link: the field names one thing."""
    return field(Name(), doc, default)


def choice(*options: str, doc: str = "", default: object = MISSING) -> Any:
    """Declare one of several words."""
    return field(Choice(options), doc, default)


def part(*kinds: object, example: str = "", doc: str = "", default: object = MISSING, default_factory: object = MISSING) -> Any:
    """Declare an object of one of several classes or protocols; messages cite `example`, as in 'must be Coulomb(0.1)'."""
    return field(Part(kinds, example), doc, default, default_factory)


@dataclass_transform(
    frozen_default=True,
    field_specifiers=(field, quantity, quantities, vector, direction, whole, flag, names, choice, part),
)
def declared(kind: Class) -> Class:
    """Make a class a frozen dataclass whose docstring lists its fields; a decorator."""
    # eq, repr: `Declared` defines both for all its classes
    decorated: Any = dataclasses.dataclass(frozen=True, eq=False, repr=False)(kind)
    decorated.__doc__ = _Doc(kind.__doc__ or "")
    return decorated


class _Doc:
    """Docstring to which the fields of its class are added when it is read."""

    def __init__(self, text: str) -> None:
        self.text = text

    def __get__(self, _instance: object, kind: type) -> str:
        text, heading, references = inspect.cleandoc(self.text).partition("\nReferences\n")
        entries = [f"{key} : {each.about}\n    {each.doc}" for key, each in declarations(kind).items()]  # unit, range, default
        fields = ["", "Parameters", "-" * 10, *entries] if entries else []
        return "\n".join([text.rstrip(), *fields, *([heading + references] if references else [])])
