"""From a document, plain dictionaries and lists as TOML and JSON have them, to a mechanism; every error names its place."""

from __future__ import annotations

import dataclasses
import inspect
import re
import typing
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from buckler.mbs.elements import KINDS, Motion
from buckler.mbs.files.declared import Declared, declared
from buckler.mbs.files.kinds import FUNCTIONS, allowed, alternatives, known, takes, takes_function
from buckler.mbs.files.words import is_mapping, is_sequence, nearest, short, shown, table, wanted
from buckler.mbs.functions import Components, Expression
from buckler.mbs.mechanism import Mechanism
from buckler.mbs.units import Measured, measured

RUN = "run"
"""The table of a file that says how it is run: duration, accuracy and so on; no part of the mechanism."""
NONE = "none"
Component = float | Callable[..., Any]
"""What stands in a list of which one entry is a function, such as the two components of a force."""


def mechanism(document: Any) -> Mechanism:
    """Make the mechanism a document describes.

    Raises
    ------
    ValueError
        In one line that begins with the place in the document, such as `links.coupler.body.section.thickness`.
    """
    content = dict(table(document, ""))
    content.pop(RUN, None)
    content.pop("about", None)
    names = [field.name for field in dataclasses.fields(Mechanism)]
    _check_keys(content, names, "", ("points", "links"), ("about", RUN))
    given: dict[str, Any] = {}
    for name in names:
        if name in content:
            given[name] = _list(name, content[name]) if name in KINDS else value(content[name], _hints()[name], name)
    return _made(Mechanism, given, "")


def _hints() -> dict[str, Any]:
    return {**typing.get_type_hints(Mechanism), "velocities": Mapping[str, float | tuple[float, float]]}


def _list(name: str, content: Any) -> list[Any]:
    """The elements of one of a mechanism's lists: a list of tables, or tables by name."""
    kinds = {kind.__name__: kind for kind in KINDS[name]}
    if name == "links" and isinstance(content, Mapping):
        for key, each in content.items():
            if isinstance(each, Mapping) and each.get("name", key) != key:
                raise ValueError(f"{name}.{key}: has another name, {each['name']!r}")
        paths = {key: f"{name}.{key}" for key in content}
        entries = [(path, dict(table(content[key], path)) | {"name": key}) for key, path in paths.items()]
    elif isinstance(content, Sequence) and not isinstance(content, str):
        entries = [(f"{name}[{k}]", dict(table(each, f"{name}[{k}]"))) for k, each in enumerate(content)]
    else:
        raise ValueError(f"{name} = {short(content)}: must be {'tables by name' if name == 'links' else 'a list of tables'}")
    return [_one(each, kinds, path) for path, each in entries]


def value(content: Any, hint: Any, path: str) -> Any:
    """What stands at a place, by the annotation of the field it is for."""
    if isinstance(content, Mapping):
        return _from_table(content, hint, path)
    if isinstance(content, str):
        return _from_text(content, hint, path)
    if isinstance(content, list | tuple):
        return _from_list(content, hint, path)
    if content is None or isinstance(content, bool | int | float):
        return _plain(content, hint, path)
    raise ValueError(f"{path} = {short(content)}: a {type(content).__name__} has no place here")


def _plain(content: Any, hint: Any, path: str) -> Any:
    """A number, a truth value or nothing, where one may stand."""
    if content is None and takes(hint, type(None)):
        return content
    if isinstance(content, bool) and takes(hint, bool):
        return content
    if isinstance(content, int | float) and not isinstance(content, bool) and takes(hint, int, float):
        return content
    raise ValueError(f"{path} = {shown(content)}: must be {wanted(hint)}")


def _from_text(content: str, hint: Any, path: str) -> Any:
    """A name, a number with its unit, a named function or a formula."""
    text = content.strip()
    if text == NONE and takes(hint, type(None)) and Any not in alternatives(hint):
        return None
    if takes(hint, str) and Any not in alternatives(hint):
        return content
    if takes_function(hint) and text in FUNCTIONS:
        return FUNCTIONS[text]
    reason = ""
    if takes(hint, float) and not (takes_function(hint) and multiplied(text)):
        try:
            return measured(text)
        except ValueError as error:
            reason = str(error)
    if takes_function(hint):
        try:
            return Expression(text)
        except ValueError as error:
            unit = reason.startswith("unknown unit") and re.fullmatch(r"[-+.\d\s]*(?:e[-+]?\d+)?[\w\s/^.·²³°%µ]*", text)
            raise ValueError(f"{path} = {shown(content)}: {reason if unit else error}") from None
    raise ValueError(f"{path} = {shown(content)}: {reason + '; ' if reason else ''}must be {wanted(hint)}")


def _from_list(content: Sequence[Any], hint: Any, path: str) -> Any:
    """A list of numbers, names or tables, or the components of a function."""
    sequences = [part for part in alternatives(hint) if part is Any or is_sequence(part)]
    if not sequences:
        raise ValueError(f"{path} = {short(content)}: must be {wanted(hint)}")
    if takes_function(hint) and any(is_function(each) for each in content):
        return Components(tuple(value(each, Component, f"{path}[{k}]") for k, each in enumerate(content)))
    reasons = []
    for hints in (_items(part, len(content)) for part in sequences):
        if hints is None:
            continue
        try:
            found = tuple(value(each, h, f"{path}[{k}]") for k, (each, h) in enumerate(zip(content, hints, strict=True)))
        except ValueError as error:
            reasons.append(error)
            continue
        return found
    if reasons:
        raise reasons[0]
    raise ValueError(f"{path} = {short(content)}: must be {wanted(hint)}")


def multiplied(text: str) -> bool:
    """Whether a text multiplies the variable t or s: '0.1*s' is a formula, '0.1 s' a time."""
    return bool(re.search(r"(\*\s*[ts]\b)|(\b[ts]\s*\*)", text))


def is_function(content: Any) -> bool:
    """Whether an entry of a list can only be a function: a table with a kind, or a text that is no number."""
    if not isinstance(content, str):
        return isinstance(content, Mapping)
    if multiplied(content):
        return True
    try:
        measured(content)
    except ValueError:
        return True
    return False


def _items(part: Any, count: int) -> list[Any] | None:
    """The annotation of each entry of a list of that length; None if the length is wrong."""
    arguments = typing.get_args(part)
    if not arguments:
        return [Any] * count
    if typing.get_origin(part) is tuple and not (len(arguments) == 2 and arguments[1] is ...):
        return list(arguments) if len(arguments) == count else None
    return [arguments[0]] * count


def _from_table(content: Mapping[str, Any], hint: Any, path: str) -> Any:
    """An object by its `kind` or its keys, or a mapping of names."""
    for part in alternatives(hint):
        if is_mapping(part):
            arguments = typing.get_args(part) or (str, Any)
            return {str(k): value(v, arguments[1], f"{path}.{k}") for k, v in content.items()}
    kinds = known() if Any in alternatives(hint) else allowed(hint)
    if takes_function(hint) and "kind" in content:
        kinds = known()
    if not kinds:
        raise ValueError(f"{path}: must be {wanted(hint)}, not a table")
    return _one(content, kinds, path)


def _one(content: Mapping[str, Any], kinds: Mapping[str, type], path: str) -> Any:
    """Make one object from its table."""
    given = dict(content)
    name = given.pop("kind", None)
    if name is None:
        kind = by_keys(given, kinds, path)
    elif not isinstance(name, str) or name not in kinds:
        raise ValueError(
            f"{path}.kind = {shown(name)}: unknown kind{nearest(str(name), kinds)}; known: {', '.join(sorted(kinds))}"
        )
    else:
        kind = kinds[name]
    maker = getattr(kind, "of", None)
    fields = declared(kind)
    if maker is not None and set(given) & set(short := short_form(kind)) and not set(given) & set(fields):
        return _made(maker, _values(given, short, path), path)
    values = _motion(given, path) if kind is Motion else _values(given, fields, path)
    return _made(kind, values, path)


def short_form(kind: type) -> dict[str, Declared]:
    """Fields of the object that a class with an `of` takes in place of its own only field, as Rigid takes an Inertia's."""
    names = set(inspect.signature(kind.of).parameters)  # type: ignore[attr-defined]
    for field in declared(kind).values():
        for inner in allowed(field.hint).values():
            if set(declared(inner)) == names:
                return declared(inner)
    return {}


def by_keys(given: Mapping[str, Any], kinds: Mapping[str, type], path: str) -> type:
    """The only class that may stand here, or the only one that has these keys."""
    if len(kinds) == 1:
        return next(iter(kinds.values()))
    fitting = []
    for kind in kinds.values():
        fields = declared(kind)
        required = {name for name, field in fields.items() if field.required}
        if required <= set(given) <= set(fields):
            fitting.append(kind)
    if len(fitting) == 1:
        return fitting[0]
    raise ValueError(f"{path}: lacks 'kind'; known: {', '.join(sorted(kinds))}")


def _values(given: Mapping[str, Any], fields: Mapping[str, Declared], path: str) -> dict[str, Any]:
    """Read every key of a table."""
    required = [name for name, field in fields.items() if field.required]
    _check_keys(given, list(fields), path, required, ("kind",), fields)
    return {name: value(content, fields[name].hint, f"{path}.{name}") for name, content in given.items()}


def _motion(given: Mapping[str, Any], path: str) -> dict[str, Any]:
    """Position and speed of a motion, the one that is missing from the other."""
    fields = declared(Motion)
    _check_keys(given, list(fields), path, () if given else fields, ("kind",), fields)
    found = {name: value(content, fields[name].hint, f"{path}.{name}") for name, content in given.items()}
    for name, other, way in (("position", "speed", "derivative"), ("speed", "position", "integral")):
        if other not in found:
            try:
                found[other] = getattr(found[name], way)()
            except ValueError as error:
                raise ValueError(f"{path}.{name}: {error}") from None
    return found


def _check_keys(
    given: Mapping[str, Any],
    names: Sequence[str],
    path: str,
    required: Iterable[str],
    extra: Sequence[str] = (),
    fields: Mapping[str, Declared] | None = None,
) -> None:
    """Refuse keys that are unknown, naming their neighbours, and tables that lack one."""
    for key in given:
        if key not in names:
            both = [*names, *extra]
            raise ValueError(f"{path}{'.' if path else ''}{key}: unknown key{nearest(str(key), both)}; known: {', '.join(both)}")
    for key in required:
        if key not in given:
            about = fields[key] if fields else None
            said = f" ({about.help.rstrip('.')})" if about and about.help else ""
            raise ValueError(f"{path + ': ' if path else ''}lacks '{key}'{said}")


# --- making -------------------------------------------------------------------------------------------------------------


def _made(kind: Any, given: dict[str, Any], path: str) -> Any:
    """Call a class; numbers with units first, so that what checks them sees the units, then as plain floats."""
    try:
        found = kind(**given)
        plain = {name: _bare(each) for name, each in given.items()}
        return found if all(plain[name] is given[name] for name in given) else kind(**plain)
    except (ValueError, TypeError, ArithmeticError) as error:
        raise ValueError(_placed(" ".join(str(error).split()), list(given), path, given)) from None
    except AttributeError as error:
        raise ValueError(f"{path or 'mechanism'}: {error}") from None


def _bare(content: Any) -> Any:
    """The same without units; the very same object where there are none."""
    if isinstance(content, Measured):
        return float(content)
    if isinstance(content, tuple | list):
        plain = type(content)(_bare(each) for each in content)
        return content if all(a is b for a, b in zip(plain, content, strict=True)) else plain
    if isinstance(content, Mapping):
        found = {key: _bare(each) for key, each in content.items()}
        return content if all(found[key] is content[key] for key in content) else found
    return content


def _placed(message: str, names: Sequence[str], path: str, given: Mapping[str, Any]) -> str:
    """A message with its place in front: the field it names, if it names one."""
    dot = f"{path}." if path else ""
    if match := re.match(r"(\w+)(?:\['([^']*)'\])?((?:\.\w+|\[\d+\])*)(?= = |: | \()", message):
        name, key, rest = match[1], match[2], match[3]
        if name in names:
            return f"{dot}{name}{f'.{key}' if key else ''}{rest}{message[match.end() :]}"
    if (match := re.match(r"(\w+) (?:of|at|on) ", message)) and match[1] in names:
        return f"{dot}{match[1]}: {message}"
    if match := re.search(r": (\w+)(?= = | is not a |: )", message):
        if match[1] in names:
            return f"{dot}{match[1]}: {message}"
    if path:
        return f"{path}: {message}"
    return f"{_culprit(message, given)}: {message}"


def _culprit(message: str, given: Mapping[str, Any]) -> str:
    """The element of a mechanism that refuses it with this message."""
    whole = object.__new__(Mechanism)
    for field in dataclasses.fields(Mechanism):
        fallback: Any = () if field.name in KINDS else {}
        object.__setattr__(whole, field.name, _bare(given.get(field.name, fallback)))
    for name in KINDS:
        for k, element in enumerate(given.get(name, ())):
            try:
                element.check(whole)
            except Exception as error:
                if " ".join(str(error).split()) == message:
                    where = f"{name}.{element.name}" if name == "links" else f"{name}[{k}]"
                    return f"{where}{_field(element, message)}"
    return "links" if message.startswith(("link names", "links")) else "mechanism"


def _field(element: Any, message: str) -> str:
    """The field of an element whose value a message calls unknown, with a dot in front."""
    if match := re.search(r"unknown [\w ]+ '([^']*)'", message):
        for field in dataclasses.fields(element):
            each = getattr(element, field.name)
            if each == match[1] or (isinstance(each, str) and each.rpartition(":")[2] == match[1]):
                return f".{field.name}"
    return ""
