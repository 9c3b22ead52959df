"""Classes with fields that `fields` declares: their declarations, and the register of classes that files may name."""

import dataclasses
import inspect
import typing
from collections.abc import Mapping
from typing import Any, ClassVar, TypeVar

from ..imports import extensions
from ..validate import short
from .spec import MOST_WHOLE, Flag, Name, Quantity, Spec, Whole

Class = TypeVar("Class", bound=type)
MISSING: Any = dataclasses.MISSING
DECLARED = "declared"
"""Key in the metadata of a dataclass's field; its value is the tuple (spec, doc, bounds, group) of `Declaration`."""


class RefusalError(ValueError):
    """Error of one field or part of an object; `place` is the path to it, such as `joints[1].point`, or ''."""

    def __init__(self, message: str, place: str = "") -> None:
        super().__init__(message)
        self.place = place


class Declared:
    """Base of classes that `fields.declared` makes dataclasses; their fields are read and checked as an object is made."""

    in_files: ClassVar[bool] = True  # true if a mechanism's file may name the class

    def __init_subclass__(cls, **more: object) -> None:
        """Register a class of Buckler, also an abstract one, which `known_kinds` leaves out."""
        super().__init_subclass__(**more)
        if cls.in_files and cls.__module__.startswith("buckler.") and not cls.__name__.startswith("_"):
            _KINDS[cls.__name__] = cls

    def __post_init__(self) -> None:
        where = f"{' '.join(self.where.split())[:120]}: " if self.where else ""  # it may quote a long raw value, as a name
        for key, declaration in declarations(type(self)).items():
            raw = getattr(self, key)
            value = declaration.spec.read(where + key, raw)
            if value is not raw:
                object.__setattr__(self, key, value)
        for key, declaration in declarations(type(self)).items():
            value = getattr(self, key)
            bounds = {} if value is None else declaration.bounds
            for sign, other in bounds.items():
                lower_bound = getattr(self, other)  # a number: no field that may be None is a bound
                # `read` is called only to raise a ValueError if the value is below the bound
                Quantity(declaration.spec.unit, lower_bound, open_low=sign == ">").read(where + key, value)
        self.agree()

    # `dataclass` would generate these methods for each class anew, which takes a millisecond each

    def _values(self) -> tuple[object, ...]:
        return tuple(getattr(self, key) for key in declarations(type(self)))

    def __eq__(self, other: object) -> bool:
        if type(self) is not type(other):
            return NotImplemented
        return self._values() == other._values()

    def __hash__(self) -> int:
        return hash(self._values())

    def __repr__(self) -> str:
        values = zip(declarations(type(self)), self._values(), strict=True)
        return f"{type(self).__qualname__}({', '.join(f'{key}={value!r}' for key, value in values)})"

    @property
    def where(self) -> str:
        """Name of the object in messages, before the name of a field; '' if the field's name is enough."""
        return ""

    def agree(self) -> None:
        """Raise a ValueError if fields contradict each other; nothing by default."""


class Declaration(typing.NamedTuple):
    """Declaration of a field: `doc` is its meaning, `group` the heading under which options of a command are listed.

    `bounds` maps '>' or '>=' to the name of another field, whose value is the lower bound.
    """

    spec: Spec
    doc: str
    bounds: Mapping[str, str]
    required: bool
    default: Any
    group: str = ""

    @property
    def allowed(self) -> str:
        """Allowed range, with the unit."""
        return self.spec.allowed + self._suffix

    def show(self, value: object) -> str:
        """Write a default value for the help of the command line: 'none' for an empty text, 'None' for None."""
        if isinstance(value, tuple | list):
            return ",".join(map(self.show, value))
        if isinstance(value, str | bool | None):
            return str(value) or "none"
        return f"{value:.6g}{self._suffix}"

    @property
    def _suffix(self) -> str:
        return f" {self.spec.unit}" if self.spec.unit not in ("", "1") else ""

    @property
    def about(self) -> str:
        """Unit, range and default, for the reference; of a field with none of the three the description `spec.words`."""
        ranges = [self.spec.allowed, *(f"{sign} {other}" for sign, other in self.bounds.items())]
        unit = self.spec.unit if self.spec.unit != "1" else ""
        default = "" if self.required else f"default {short(self.default)}"
        return ", ".join(part for part in (unit, *ranges, default) if part) or self.spec.words


_DECLARATIONS: dict[Any, dict[str, Declaration]] = {}


def declarations(kind: Any) -> dict[str, Declaration]:
    """Return the declarations, by name, of the fields that the constructor of a dataclass takes."""
    if kind not in _DECLARATIONS:
        _DECLARATIONS[kind] = {each.name: _declaration(kind, each) for each in dataclasses.fields(kind) if each.init}
    return _DECLARATIONS[kind]


def _declaration(kind: Any, each: Any) -> Declaration:
    """Return the declaration of a dataclass's field `each`."""
    if DECLARED in each.metadata:
        spec, doc, bounds, group = each.metadata[DECLARED]
    else:  # a field of a user's own dataclass is declared by its annotation
        by_type: dict[Any, Spec] = {float: Quantity(""), int: Whole(low=-MOST_WHOLE), bool: Flag(), str: Name()}
        spec, doc, bounds, group = by_type.get(typing.get_type_hints(kind).get(each.name), Spec()), "", {}, ""
    default = each.default if each.default_factory is MISSING else each.default_factory()
    required = default is MISSING
    return Declaration(spec, doc, bounds, required, None if required else default, group)


_KINDS: dict[str, type] = {}
"""Register of the classes with declared fields and of users' classes, by name."""


def register(kind: Class) -> Class:
    """Register a user's frozen dataclass, as a contact law, so that files may name it; ValueError for a taken name."""
    if not dataclasses.is_dataclass(kind):  # one that is not frozen passes; `Part.read` refuses its objects, as they have no hash
        raise ValueError(f"{kind.__name__}: must be a frozen dataclass")
    taken = _KINDS.get(kind.__name__, kind)
    if taken is not kind:
        raise ValueError(f"{kind.__name__}: there is a {taken.__module__}.{kind.__name__} already")
    _KINDS[kind.__name__] = kind
    return kind


def known_kinds() -> dict[str, type]:
    """Return the classes that files may name, by name, of Buckler and of other installed packages."""
    for kind in extensions("buckler.kinds").values():  # classes that other packages give as entry points of this group
        register(kind)
    return {key: kind for key, kind in _KINDS.items() if dataclasses.is_dataclass(kind) and not inspect.isabstract(kind)}
