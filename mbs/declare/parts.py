"""Objects as fields of others: their allowed classes, and the conversion between objects and tables of a file."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from .compound import any_of
from .declared import RefusalError, declarations, known_kinds
from .spec import Schema, Spec, did_you_mean, show

GONE = {
    ("Section", "mass"): "mass and inertia belong to a rigid body itself",
    ("Belt", "stiffness"): "a belt is inextensible, a TorsionSpring between a pulley and its shaft yields",
    ("Belt", "damping"): "a belt is inextensible, a TorsionSpring between a pulley and its shaft has damping",
}
"""Advice for keys of earlier versions of files, by kind and key."""


@dataclass(eq=False, repr=False)
class Part(Spec):
    """An object of one of several classes or protocols; in a file a table with its kind, or with keys of one kind only."""

    kinds: tuple[Any, ...]
    example: str = ""

    @property
    def words(self) -> str:  # type: ignore[override]
        """Kinds of the part, for messages."""
        names = sorted(self.kinds_by_name())
        files = f" (in files a table{' with its kind' if len(names) > 1 else ''})" if names else ""
        return (self.example or " or ".join(names or [kind.__name__ for kind in self.kinds])) + files

    def kinds_by_name(self) -> dict[str, type]:
        """Return the allowed classes, by name."""
        return {key: kind for key, kind in known_kinds().items() if any(_is_kind_of(kind, base) for base in self.kinds)}

    def fits(self, given: object) -> bool:
        """Return True for an object of an allowed class, or a table of one."""
        if isinstance(given, Mapping):
            return "kind" not in given or given["kind"] in self.kinds_by_name()
        return not isinstance(given, type) and any(_is_kind_of(given, base) for base in self.kinds)

    def read(self, name: str, given: object) -> Any:
        """Return a part, built if the input is a table."""
        if isinstance(given, Mapping):
            return build(name, given, self.kinds_by_name())
        if not self.fits(given):
            what = given.__name__ if isinstance(given, type) else show(given)
            raise ValueError(f"{name} = {what}: {self._lacking(given)}")
        try:
            hash(given)
        except TypeError:
            raise ValueError(f"{name} = {show(given)}: must be hashable; make its class a frozen dataclass") from None
        return given

    def write(self, name: str, value: object) -> Any:
        """Return a part as a table with its kind."""
        kinds = self.kinds_by_name()
        if type(value) not in kinds.values():
            raise nameless(name, value)
        content = fields_written(name, value)
        plain = list(kinds) == [type(value).__name__]
        if not plain and name.rpartition(".")[2] == type(value).__name__.lower():
            plain = _fitting(content, kinds) == [type(value)]
        return content if plain else {"kind": type(value).__name__, **content}

    def schema(self) -> Schema:
        """Return references to the JSON schemas of the kinds."""
        return any_of([{"$ref": f"#/$defs/{key}"} for key in sorted(self.kinds_by_name())])

    def _lacking(self, given: object) -> str:
        """Explain why an object is not allowed."""
        if isinstance(given, type):
            return f"must be an instance{self.example and f', as {self.example}'}, not the class"
        protocols = [base for base in self.kinds if _is_protocol(base)]
        if protocols and not isinstance(given, str | int | float | list | tuple | None):
            nearest = min(protocols, key=lambda each: len(_missing(given, each)))
            return f"must be a {nearest.__name__}; it lacks {', '.join(map(repr, _missing(given, nearest)))}"
        return f"must be {self.words}" + ("" if given is None else f"; this is a {type(given).__name__}")


def _is_protocol(kind: object) -> bool:
    return bool(getattr(kind, "_is_protocol", False))


def _missing(found: object, protocol: object) -> list[str]:
    """Return the members of a protocol that an object or a dataclass lacks."""
    members = getattr(protocol, "__protocol_attrs__", None) or vars(protocol)  # the former from Python 3.12 on
    fields = getattr(found, "__dataclass_fields__", {})
    return sorted(m for m in members if not m.startswith("_") and not hasattr(found, m) and m not in fields)


def _is_kind_of(found: object, base: Any) -> bool:
    """Return True if an object or a class is of a class, or has the members of a protocol."""
    if _is_protocol(base):
        return not _missing(found, base)
    return issubclass(found, base) if isinstance(found, type) else isinstance(found, base)


# --- from tables to objects and back ------------------------------------------------------------------------------------


def build(name: str, table: Mapping[str, object], kinds: Mapping[str, type], extra: Iterable[str] = ("kind",)) -> Any:
    """Make one object from its table.

    Raises
    ------
    ValueError
        In one line that begins with the place.
    """
    given = dict(table)
    kind = _kind(name, given, kinds)
    fields = declarations(kind)
    dot = f"{name}." if name else ""
    for key in given:
        if key not in fields:
            if gone := GONE.get((kind.__name__, str(key))):
                raise ValueError(f"{dot}{key}: is gone; {gone}")
            both = [*fields, *extra]
            raise ValueError(f"{dot}{key}: unknown key{did_you_mean(str(key), both)}; known: {', '.join(both)}")
    values = {key: fields[key].spec.read(f"{dot}{key}", value) for key, value in given.items()}
    for key, field in fields.items():
        if field.required and key not in values:
            raise ValueError(f"{name}{': ' if name else ''}lacks '{key}'{field.doc and f' ({field.doc})'}")
    try:
        return kind(**values)
    except RefusalError as error:
        raise ValueError(f"{dot}{error.place}: {error}" if dot + error.place else str(error)) from None
    except (ValueError, TypeError, ArithmeticError) as error:  # of fields that do not go together
        message = " ".join(str(error).split())
        first = re.match(r"\w+", message)
        raise ValueError(f"{dot if first and first[0] in values else name and f'{name}: '}{message}") from None


def _kind(name: str, given: dict[str, object], kinds: Mapping[str, type]) -> type:
    """Return the class that a table names, or the only one that fits it."""
    word = given.pop("kind", None)
    if word is not None:
        if not isinstance(word, str) or word not in kinds:
            reason = f"unknown kind{did_you_mean(str(word), kinds)}; known: {', '.join(sorted(kinds))}"
            raise ValueError(f"{name}.kind = {show(word)}: {reason}")
        return kinds[word]
    sharing = [kind for kind in kinds.values() if set(given) & set(declarations(kind))]  # for the message, if it is one
    fitting = list(kinds.values()) if len(kinds) == 1 else _fitting(given, kinds) or sharing
    if len(fitting) != 1:
        raise ValueError(f"{name}: lacks 'kind'; known: {', '.join(sorted(kinds))}")
    return fitting[0]


def _fitting(given: Mapping[str, object], kinds: Mapping[str, type]) -> list[type]:
    """Return the classes that have these keys and require no other."""
    fields = {kind: declarations(kind) for kind in kinds.values()}
    return [
        kind for kind, each in fields.items() if {key for key, field in each.items() if field.required} <= set(given) <= set(each)
    ]


def fields_written(name: str, found: Any) -> dict[str, Any]:
    """Return the fields that differ from their defaults, as in a document; ValueError for a value without a name in files."""
    kind = type(found)
    content = {}
    for key, declaration in declarations(kind).items():
        value = getattr(found, key)
        if declaration.required or not _same(value, declaration.default):
            content[key] = declaration.spec.write(f"{name}.{key}" if name else key, value)
    return content


def nameless(name: str, found: object) -> ValueError:
    """Return the error for a value without a name in files."""
    what = f"the function {found.__name__}" if hasattr(found, "__name__") else f"a {type(found).__name__}"
    advice = "a formula (Expression) or a Table" if callable(found) else "a class made known by buckler.mbs.declare.register"
    return ValueError(f"{name}: {what} has no name in a file; take {advice}")


def _same(a: Any, b: Any) -> bool:
    if isinstance(a, Mapping) or isinstance(b, Mapping):
        return dict(a) == dict(b)
    numbers = isinstance(a, int | float) and isinstance(b, int | float)
    return a is b or ((numbers or type(a) is type(b)) and bool(a == b))
