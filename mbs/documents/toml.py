"""Writes TOML (toml.io, version 1.0); the standard library only reads it."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from typing import Any

BARE = re.compile(r"[A-Za-z0-9_-]+")
WIDTH = 100
"""Of a line: a table that would be longer gets lines of its own."""


def dumps(content: Mapping[str, object]) -> str:
    """A document as text.

    Parameters
    ----------
    content : mapping
        Of names to strings, numbers, truth values, lists and mappings of these.
    """
    lines: list[str] = []
    _write(content, (), lines)
    return "\n".join(lines).lstrip("\n") + "\n"


def _write(content: Mapping[str, Any], path: tuple[str, ...], lines: list[str]) -> None:
    """What fits on a line first, then the tables."""
    tables = {name: each for name, each in content.items() if _is_table(name, each)}
    for name, each in content.items():
        if name not in tables:
            lines.append(f"{_key(name)} = {_inline(each)}")
    for name, each in tables.items():
        inner = (*path, name)
        title = ".".join(map(_key, inner))
        for entry in [each] if isinstance(each, Mapping) else each:
            plain = (
                isinstance(each, Mapping) and entry and all(isinstance(v, Mapping) and _is_table("", v) for v in entry.values())
            )
            if not plain or (not path and not entry):
                lines += ["", f"[{title}]" if isinstance(each, Mapping) else f"[[{title}]]"]
            _write(entry, inner, lines)


def _is_table(name: str, each: object) -> bool:
    if isinstance(each, Mapping):
        return name in ("points", "links", "velocities", "run") or len(_inline(each)) + len(name) > WIDTH or "body" in each
    return isinstance(each, list) and bool(each) and all(isinstance(entry, Mapping) for entry in each)


def _key(name: str) -> str:
    return name if BARE.fullmatch(name) else _text(name)


def _text(text: str) -> str:
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _inline(each: Any) -> str:
    """A value on one line."""
    if isinstance(each, bool):
        return "true" if each else "false"
    if isinstance(each, int):
        return str(each)
    if isinstance(each, float):
        return repr(each)
    if isinstance(each, str):
        return _text(each)
    if isinstance(each, Mapping):
        return "{ " + ", ".join(f"{_key(k)} = {_inline(v)}" for k, v in each.items()) + " }" if each else "{}"
    return f"[{', '.join(map(_inline, each))}]"
