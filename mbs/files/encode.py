"""From a mechanism to a document: plain dictionaries, lists, numbers and names, fit for TOML and JSON."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from numbers import Integral, Real
from typing import Any

import numpy as np

from buckler.mbs.elements import KINDS, Motion
from buckler.mbs.files.declared import declared
from buckler.mbs.files.decode import NONE, by_keys, is_function, short_form
from buckler.mbs.files.kinds import FUNCTIONS, allowed, known, takes_function
from buckler.mbs.functions import Components, Expression, Slope
from buckler.mbs.functions import Integral as Integrated
from buckler.mbs.mechanism import Mechanism


def document(mechanism: Mechanism) -> dict[str, Any]:
    """Describe a mechanism; what is empty or has its default is left out.

    Raises
    ------
    ValueError
        If it holds what a file has no name for, such as a Python function; names its place.
    """
    content: dict[str, Any] = {}
    if any(mechanism.gravity):
        content["gravity"] = list(mechanism.gravity)
    content["points"] = {name: list(place) for name, place in mechanism.points.items()}
    if mechanism.velocities:
        content["velocities"] = {k: _value(v, Any, f"velocities.{k}") for k, v in mechanism.velocities.items()}
    for name in KINDS:
        elements = getattr(mechanism, name)
        if name == "links":
            content[name] = {link.name: _element(link, name, f"links.{link.name}", ("name",)) for link in elements}
        elif elements:
            content[name] = [_element(each, name, f"{name}[{k}]") for k, each in enumerate(elements)]
    return content


def _element(element: Any, name: str, path: str, left_out: tuple[str, ...] = ()) -> dict[str, Any]:
    kind = {} if len(KINDS[name]) == 1 else {"kind": type(element).__name__}
    return kind | {key: each for key, each in _fields(element, path).items() if key not in left_out}


def _fields(found: Any, path: str) -> dict[str, Any]:
    """Fields of an object that differ from their defaults."""
    content = {}
    for name, field in declared(type(found)).items():
        each = getattr(found, name)
        if field.required or not _same(each, field.default):
            content[name] = _value(each, field.hint, f"{path}.{name}")
    return content


def _same(a: Any, b: Any) -> bool:
    if isinstance(a, Mapping) or isinstance(b, Mapping):
        return dict(a) == dict(b)
    return (type(a) is type(b) and bool(a == b)) or (isinstance(a, Real) and isinstance(b, Real) and a == b)


def _value(found: Any, hint: Any, path: str) -> Any:
    """A field's value as a document has it."""
    if found is None:
        return NONE
    if isinstance(found, str | bool):
        return found
    if isinstance(found, Integral):
        return int(found)
    if isinstance(found, Real):
        return float(found)
    if isinstance(found, np.ndarray):
        return found.tolist()
    if isinstance(found, Mapping):
        return _mapping(found, path)
    if isinstance(found, tuple | list):
        return [_value(each, Any, f"{path}[{k}]") for k, each in enumerate(found)]
    if isinstance(found, Expression) and takes_function(hint) and is_function(found.text):
        return found.text
    if isinstance(found, Components) and takes_function(hint):
        return [_value(each, hint, f"{path}[{k}]") for k, each in enumerate(found.parts)]
    for name, function in FUNCTIONS.items():
        if found is function:
            return name
    return _object(found, hint, path)


def _mapping(found: Mapping[str, Any], path: str) -> Any:
    """A mapping of names; a list of them where nothing is said of each."""
    if found and all(each is None for each in found.values()):
        return list(found)
    return {name: _value(each, Any, f"{path}.{name}") for name, each in found.items()}


def _object(found: Any, hint: Any, path: str) -> Any:
    """A table for an object, with its kind where several may stand there."""
    name = type(found).__name__
    if known().get(name) is not type(found):
        what = f"the function {found.__name__}" if hasattr(found, "__name__") else f"a {name}"
        advice = "a formula (Expression) or a Table" if callable(found) else "a class made known by buckler.mbs.files.register"
        raise ValueError(f"{path}: {what} has no name in a file; take {advice}")
    if isinstance(found, Motion):
        return _motion(found, path)
    kinds, content = allowed(hint), _short(found, path) or _fields(found, path)
    told = list(kinds) == [name] and not takes_function(hint)
    if path.rpartition(".")[2] == name.lower() and len(kinds) > 1:
        told = _told_by_keys(content, kinds) is type(found)
    return content if told else {"kind": name, **content}


def _told_by_keys(content: Mapping[str, Any], kinds: Mapping[str, type]) -> type | None:
    try:
        return by_keys(content, kinds, "")
    except ValueError:
        return None


def _short(found: Any, path: str) -> dict[str, Any] | None:
    """The fields of an inner object in place of it, where the class has an `of` that takes them."""
    if not hasattr(type(found), "of"):
        return None
    inner = [getattr(found, name) for name in declared(type(found))]
    if len(inner) == 1 and dataclasses.is_dataclass(inner[0]) and declared(type(inner[0])) == short_form(type(found)):
        return _fields(inner[0], path)
    return None


def _motion(motion: Motion, path: str) -> Any:
    """A motion by the one of its two functions from which the other follows."""
    hint = declared(Motion)["position"].hint
    if isinstance(motion.position, Integrated) and motion.position.of == motion.speed:
        return _value(motion.speed, hint, f"{path}.speed")
    content = {"kind": "Motion", "position": _value(motion.position, hint, f"{path}.position")}
    derived = isinstance(motion.speed, Slope) and motion.speed.of == motion.position
    if isinstance(motion.position, Expression):
        derived = motion.position.derivative() == motion.speed
    return content if derived else content | {"speed": _value(motion.speed, hint, f"{path}.speed")}
