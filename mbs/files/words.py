"""Words for what is wrong with a file: what may stand at a place, what is nearest to a misspelt name."""

from __future__ import annotations

import collections.abc
import typing
from collections.abc import Iterable, Mapping
from difflib import get_close_matches
from typing import Any

from buckler.mbs.files.kinds import allowed, alternatives, takes_function


def is_sequence(part: Any) -> bool:
    """Whether an annotation is a sequence's."""
    origin = typing.get_origin(part) or part
    return isinstance(origin, type) and origin is not str and issubclass(origin, collections.abc.Sequence)


def is_mapping(part: Any) -> bool:
    """Whether an annotation is a mapping's."""
    origin = typing.get_origin(part) or part
    return isinstance(origin, type) and issubclass(origin, collections.abc.Mapping)


def wanted(hint: Any) -> str:
    """What may stand at a place, in words."""
    words = []
    for part in alternatives(hint):
        if part is float:
            words.append("a number, or one with a unit such as '0.3 mm'")
        elif part is int:
            words.append("a whole number")
        elif part is bool:
            words.append("true or false")
        elif part is str:
            words.append("a name")
        elif is_sequence(part):
            words.append("a list")
        elif is_mapping(part):
            words.append("a table of names")
    if takes_function(hint):
        words.append("a formula such as '2*sin(3*t)'")
    if names := sorted(allowed(hint)):
        words.append(f"a table {{kind = ...}} of {', '.join(names)}" if len(names) > 1 else f"a table ({names[0]})")
    return " or ".join(dict.fromkeys(words)) or "something else"


def table(content: Any, path: str) -> Mapping[str, Any]:
    """The content, if it is a table; ValueError otherwise."""
    if not isinstance(content, Mapping):
        raise ValueError(f"{path or 'file'} = {short(content)}: must be a table")
    return content


def nearest(word: str, names: Iterable[str]) -> str:
    """', did you mean ...?' with the closest of some names, or nothing."""
    close = get_close_matches(word, list(names), n=1)
    return f", did you mean '{close[0]}'?" if close else ""


def shown(content: Any) -> str:
    """A value as a file has it, not too long."""
    return "true" if content is True else "false" if content is False else short(content)


def short(content: Any) -> str:
    """A value in at most 80 characters."""
    text = " ".join(repr(content).split())
    return text if len(text) <= 80 else f"{text[:77]}..."
