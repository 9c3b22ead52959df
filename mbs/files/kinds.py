"""Which classes a file may name, and which of them may stand where."""

from __future__ import annotations

import collections.abc
import dataclasses
import importlib
import inspect
import pkgutil
import types
import typing
from collections.abc import Callable
from functools import cache
from typing import Any, TypeVar

from buckler.elastica import law, pinned
from buckler.mbs import elements, laws
from buckler.mbs.functions import Components, Expression, Table

Class = TypeVar("Class", bound=type)
FUNCTIONS: dict[str, Callable[..., Any]] = {"fast": law.fast, "quartic": law.quartic, "exact": pinned.load}
"""Functions a file names: the load of a Strut."""
_REGISTERED: dict[str, type] = {}


def register(kind: Class) -> Class:
    """Let files name a class of your own, a frozen dataclass such as a contact law; a decorator.

    Raises
    ------
    ValueError
        If it is no dataclass, or its name is taken.
    """
    if not dataclasses.is_dataclass(kind):
        raise ValueError(f"{kind.__name__}: must be a frozen dataclass")
    if known().get(kind.__name__, kind) is not kind:
        raise ValueError(f"{kind.__name__}: there is a {known()[kind.__name__].__module__}.{kind.__name__} already")
    _REGISTERED[kind.__name__] = kind
    return kind


def known() -> dict[str, type]:
    """Every class a file may name, by its name."""
    return {**_own(), **_REGISTERED}


@cache
def _own() -> dict[str, type]:
    found: dict[str, type] = {"Table": Table, "Expression": Expression, "Components": Components}
    for module in pkgutil.iter_modules(elements.__path__, f"{elements.__name__}."):
        content = vars(importlib.import_module(module.name))
        found |= {name: kind for name, kind in content.items() if _is_kind(kind) and kind.__module__ == module.name}
    return found | {name: kind for name in laws.__all__ if _is_kind(kind := getattr(laws, name))}


def _is_kind(thing: Any) -> bool:
    """A dataclass that people make; one that lists Attributes only is made by the program."""
    if not isinstance(thing, type) or not dataclasses.is_dataclass(thing) or inspect.isabstract(thing):
        return False
    text = thing.__doc__ or ""
    return not thing.__name__.startswith("_") and ("Attributes\n" not in text or "Parameters\n" in text)


def alternatives(hint: Any) -> list[Any]:
    """Parts of a union, or the hint alone."""
    if isinstance(hint, types.UnionType) or typing.get_origin(hint) is typing.Union:
        return [part for each in typing.get_args(hint) for part in alternatives(each)]
    return [hint]


def allowed(hint: Any) -> dict[str, type]:
    """Classes that may stand where a hint is: itself, what derives from it, or what has the members of a protocol."""
    found: dict[str, type] = {}
    for part in alternatives(hint):
        if isinstance(part, type) and part not in (str, float, int, bool, type(None), tuple, list, dict):
            found |= {name: kind for name, kind in known().items() if _stands_for(kind, part)}
    return found


def _stands_for(kind: type, wanted: type) -> bool:
    if getattr(wanted, "_is_protocol", False):
        members = getattr(wanted, "__protocol_attrs__", None) or {m for m in vars(wanted) if not m.startswith("_")}
        return all(hasattr(kind, m) or m in kind.__dataclass_fields__ for m in members)  # type: ignore[attr-defined]
    return issubclass(kind, wanted)


def takes(hint: Any, *plain: Any) -> bool:
    """Whether one of some plain types may stand there; Any takes all."""
    return any(part is Any or part in plain for part in alternatives(hint))


def takes_function(hint: Any) -> bool:
    """Whether a function may stand there, or a formula in its place."""
    return any(part is Any or part is Expression or _is_callable(part) for part in alternatives(hint))


def _is_callable(part: Any) -> bool:
    return (typing.get_origin(part) or part) is collections.abc.Callable
