"""Objects as fields of others: their allowed classes, and the conversion between objects and tables of a file.

The kind of an object is the name of its class. A protocol is allowed as a class: objects with its members fit.
"""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from .compound import any_of
from .declared import RefusalError, declarations, known_kinds
from .spec import Schema, Spec, did_you_mean, show


@dataclass(eq=False, repr=False)
class Part(Spec):
    """An object of one of several classes or protocols; in a file a table, with its kind unless its keys fit one class only."""

    kinds: tuple[Any, ...]
    example: str = ""

    @property
    def words(self) -> str:  # type: ignore[override]
        """Text after 'must be' in messages: an example, or the kinds."""
        names = sorted(self.kinds_by_name())
        in_files = f" (in files a table{' with its kind' if len(names) > 1 else ''})" if names else ""
        return (self.example or " or ".join(names or [kind.__name__ for kind in self.kinds])) + in_files

    def kinds_by_name(self) -> dict[str, type]:
        """Return the allowed classes that files may name, by name."""
        return {key: kind for key, kind in known_kinds().items() if any(_is_kind_of(kind, base) for base in self.kinds)}

    def fits(self, raw: object) -> bool:
        """Return True for an object of an allowed class, or a table that does not name another kind."""
        if isinstance(raw, Mapping):
            return "kind" not in raw or raw["kind"] in self.kinds_by_name()
        return not isinstance(raw, type) and any(_is_kind_of(raw, base) for base in self.kinds)

    def read(self, name: str, raw: object) -> Any:
        """Return the object, built if it is given by a table."""
        if isinstance(raw, Mapping):
            return build(name, raw, self.kinds_by_name())
        if not self.fits(raw):
            what = raw.__name__ if isinstance(raw, type) else show(raw)
            raise ValueError(f"{name} = {what}: {self._explain(raw)}")
        try:
            hash(raw)  # objects are keys of caches, so that their parts must be hashable, too
        except TypeError:
            raise ValueError(f"{name} = {show(raw)}: must be hashable; make its class a frozen dataclass") from None
        return raw

    def write(self, name: str, value: object) -> Any:
        """Return the object as a table, with its kind unless the table shows the kind without it.

        The kind is left out if it is the only one allowed. It is also left out if the field has the kind's name, as `section`
        has that of `Section`, and the keys fit no other kind.
        """
        kinds, kind = self.kinds_by_name(), type(value)
        if kind not in kinds.values():
            raise nameless(name, value)  # a ValueError
        content = fields_written(name, value)
        field_has_name_of_kind = name.rpartition(".")[2] == kind.__name__.lower()
        if len(kinds) == 1 or (field_has_name_of_kind and _list_fitting(content, kinds) == [kind]):
            return content
        return {"kind": kind.__name__, **content}

    def schema(self) -> Schema:
        """Return the JSON schema: references to the schemas of the kinds."""
        return any_of([{"$ref": f"#/$defs/{key}"} for key in sorted(self.kinds_by_name())])

    def _explain(self, raw: object) -> str:
        """Explain why an object is not allowed, for messages."""
        if isinstance(raw, type):
            example = f", as {self.example}" if self.example else ""
            return f"must be an instance{example}, not the class"
        protocols = [base for base in self.kinds if _is_protocol(base)]
        if protocols and not isinstance(raw, str | int | float | list | tuple | None):
            nearest = min(protocols, key=lambda each: len(_missing(raw, each)))
            return f"must be a {nearest.__name__}; it lacks {', '.join(map(repr, _missing(raw, nearest)))}"
        return f"must be {self.words}" + ("" if raw is None else f"; this is a {type(raw).__name__}")


def _is_protocol(kind: object) -> bool:
    return bool(getattr(kind, "_is_protocol", False))  # set by `typing`


def _missing(found: object, protocol: object) -> list[str]:
    """Return the members of a protocol that an object or a class lacks; a field without default is no attribute of its class."""
    members = getattr(protocol, "__protocol_attrs__", None) or vars(protocol)  # Python 3.11 has no __protocol_attrs__
    fields = getattr(found, "__dataclass_fields__", {})
    return sorted(m for m in members if not m.startswith("_") and not hasattr(found, m) and m not in fields)


def _is_kind_of(found: object, base: Any) -> bool:
    """Return True if an object or a class is of a class, or has the members of a protocol."""
    if _is_protocol(base):
        return not _missing(found, base)
    return issubclass(found, base) if isinstance(found, type) else isinstance(found, base)


def build(name: str, table: Mapping[str, object], kinds: Mapping[str, type], extra: Iterable[str] = ("kind",)) -> Any:
    """Make an object from its table; a ValueError is one line that begins with the path.

    `name` is the path of the table, `kinds` are the allowed classes. `extra` are keys that a file may have, but which are
    removed before the fields are read; messages list them as known.
    """
    raw = dict(table)
    kind = _kind(name, raw, kinds)
    fields = declarations(kind)
    dot = f"{name}." if name else ""
    for key in raw:
        if key not in fields:
            known = [*fields, *extra]
            raise ValueError(f"{dot}{key}: unknown key{did_you_mean(str(key), known)}; known: {', '.join(known)}")
    values = {key: fields[key].spec.read(f"{dot}{key}", value) for key, value in raw.items()}
    for key, field in fields.items():
        if field.required and key not in values:
            doc = f" ({field.doc})" if field.doc else ""
            raise ValueError(f"{name}{': ' if name else ''}lacks '{key}'{doc}")
    try:
        return kind(**values)
    except RefusalError as error:  # of a part that contradicts others; `error.place` is the part's path below the table
        path = ".".join(filter(None, (name, error.place)))
        raise ValueError(f"{path}: {error}" if path else str(error)) from None
    except (ValueError, TypeError, ArithmeticError) as error:  # of fields that contradict each other, or of a user's class
        message = " ".join(str(error).split())
        first_word = re.match(r"\w+", message)
        begins_with_field = first_word is not None and first_word[0] in values
        begin = dot if begins_with_field else f"{name}: " if name else ""
        raise ValueError(f"{begin}{message}") from None


def _kind(name: str, raw: dict[str, object], kinds: Mapping[str, type]) -> type:
    """Remove the kind from a table and return the class of that name, or without a kind the only class that fits the keys."""
    given = raw.pop("kind", None)
    if given is not None:
        if not isinstance(given, str) or given not in kinds:
            reason = f"unknown kind{did_you_mean(str(given), kinds)}; known: {', '.join(sorted(kinds))}"
            raise ValueError(f"{name}.kind = {show(given)}: {reason}")
        return kinds[given]
    candidates = list(kinds.values()) if len(kinds) == 1 else _list_fitting(raw, kinds)
    if not candidates:  # a key is wrong: take the only class that has any of the keys, so that `build` names the wrong key
        candidates = [kind for kind in kinds.values() if set(raw) & set(declarations(kind))]
    if len(candidates) != 1:
        raise ValueError(f"{name}: lacks 'kind'; known: {', '.join(sorted(kinds))}")
    return candidates[0]


def _list_fitting(raw: Mapping[str, object], kinds: Mapping[str, type]) -> list[type]:
    """List the classes that have all keys of a table as fields and require no other field."""
    fields = {kind: declarations(kind) for kind in kinds.values()}
    required = {kind: {key for key, field in each.items() if field.required} for kind, each in fields.items()}
    return [kind for kind in fields if required[kind] <= set(raw) <= set(fields[kind])]


def fields_written(name: str, found: Any) -> dict[str, Any]:
    """Return the fields that differ from their defaults in the form of documents; ValueError for a value without such a form."""
    content = {}
    for key, declaration in declarations(type(found)).items():
        value = getattr(found, key)
        if declaration.required or not _same(value, declaration.default):
            content[key] = declaration.spec.write(f"{name}.{key}" if name else key, value)
    return content


def nameless(name: str, found: object) -> ValueError:
    """Return the error for a value whose class or function has no name in files."""
    what = f"the function {found.__name__}" if hasattr(found, "__name__") else f"a {type(found).__name__}"
    advice = "a formula (Expression) or a Table" if callable(found) else "a class made known by buckler.mbs.declare.register"
    return ValueError(f"{name}: {what} has no name in a file; take {advice}")


def _same(a: Any, b: Any) -> bool:
    """Return True for equal values of one type, equal numbers, such as 1 and 1.0, and mappings with equal entries."""
    if isinstance(a, Mapping) and isinstance(b, Mapping):
        return dict(a) == dict(b)
    are_numbers = isinstance(a, int | float) and isinstance(b, int | float)
    return a is b or ((are_numbers or type(a) is type(b)) and bool(a == b))
