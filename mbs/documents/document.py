"""Documents: read from files, written to them, changed by path."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..declare.spec import did_you_mean

BARE = re.compile(r"[A-Za-z0-9_-]+")
PARAMETERS = "parameters"
"""Table of named numbers, whose names are also paths: `d` is `parameters.d`."""
TABLES = ("points", "links", "velocities", "run", PARAMETERS)
"""Tables that are never written on one line."""
WIDTH = 100
"""Characters of a line: a longer table is written on several lines."""


def _write(content: Mapping[str, Any], path: tuple[str, ...], lines: list[str]) -> None:
    """Write first the values that fit on a line, then the tables."""
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
        return name in TABLES or len(_inline(each)) + len(name) > WIDTH or "body" in each
    return isinstance(each, list) and bool(each) and all(isinstance(entry, Mapping) for entry in each)


def _key(name: str) -> str:
    return name if BARE.fullmatch(name) else _text(name)


def _text(text: str | int) -> str:
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _inline(each: Any) -> str:
    """Write a value on one line."""
    if isinstance(each, float):
        return repr(each)
    if isinstance(each, str | int):  # as JSON has them, truth values among them
        return _text(each)
    if isinstance(each, Mapping):
        return "{ " + ", ".join(f"{_key(k)} = {_inline(v)}" for k, v in each.items()) + " }" if each else "{}"
    return f"[{', '.join(map(_inline, each))}]"


ENDINGS = (".toml", ".json")


def write(content: Mapping[str, object], path: Path) -> Path:
    """Write a document as TOML or JSON, by the ending of the file's name; ValueError if that is another."""
    path.write_text(text(content, _ending(path)), encoding="utf-8")
    return path


def text(content: Mapping[str, object], ending: str) -> str:
    """Return a document, a mapping of strings, numbers, truth values, lists and mappings, as the text of a file."""
    if ending == ".toml":
        lines: list[str] = []
        _write(content, (), lines)
        return "\n".join(lines).lstrip("\n") + "\n"
    return json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


QUOTES = 'a number with a unit, and every name, needs quotes: "0.3 mm"'
CURES = {
    "after a statement": QUOTES, "Unclosed": f"a bracket or a comma is missing, or {QUOTES}", "Invalid value": QUOTES,
    "Cannot overwrite": "a name stands twice there; give each once", "Cannot declare": "a table stands twice; give each once",
}  # fmt: skip
"""Advice for mistakes in TOML, by words of the parser's message."""


def read(path: Path) -> dict[str, Any]:
    """Read the document in a file, as yet unchecked."""
    import tomllib  # three milliseconds of an import that only files cost

    ending = _ending(path)
    try:
        content = path.read_text(encoding="utf-8-sig")  # some editors begin files with a byte order mark
        found = tomllib.loads(content) if ending == ".toml" else json.loads(content, object_pairs_hook=_no_doubles)
    except (ValueError, RecursionError) as error:  # RecursionError: brackets without end
        reason = " ".join(str(error).split())
        cure = next((cure for sign, cure in CURES.items() if ending == ".toml" and sign in reason), "")
        reason += f"; {cure}" if cure else ""
        raise ValueError(f"{path}: no valid {ending[1:].upper()}: {reason}") from None
    if not isinstance(found, dict):
        raise ValueError(f"{path}: must be a table, not a {type(found).__name__}")
    return found


def _ending(path: Path) -> str:
    if path.suffix.lower() not in ENDINGS:
        raise ValueError(f"{path}: a mechanism's file ends in {' or '.join(ENDINGS)}")
    return path.suffix.lower()


def _no_doubles(pairs: list[tuple[str, object]]) -> dict[str, object]:
    found = dict(pairs)
    if len(found) < len(pairs):
        names = [name for name, _ in pairs]
        raise ValueError(f"the key '{next(name for name in names if names.count(name) > 1)}' stands twice")
    return found


# --- places in a document -----------------------------------------------------------------------------------------------


def get(content: Any, path: str) -> Any:
    """Return the value at a path, as `links.coupler.body.section.thickness` or `joints[1].gap`; KeyError if there is none."""
    for step in steps(content, path):
        content = content[step]
    return content


def change(content: object, changes: Mapping[str, object]) -> Any:
    """Return a copy of a document with other values at some paths; ValueError if one leads nowhere, with its neighbours."""
    found = json.loads(json.dumps(content))
    for path, value in changes.items():
        *way, last = steps(found, path)
        place = found
        for step in way:
            place = place[step]
        place[last] = value
    return found


def steps(content: Any, path: str) -> list[str | int]:
    """Return the keys and numbers of a path; the last key may be new."""
    words = re.findall(r"\[\d+\]|[^.\[\]]+", path)
    if not words:
        raise ValueError(f"'{path}' is no path; write for instance links.coupler.body.section.thickness")
    named = content.get(PARAMETERS, {}) if isinstance(content, Mapping) else {}
    if len(words) == 1 and path in named and path not in content:
        words = [PARAMETERS, path]
    if words[0] == PARAMETERS and len(words) > 1 and words[1] not in named:
        known = ", ".join(named) or "none"
        raise ValueError(f"{path}: not in the file{did_you_mean(words[1], named)}; there are: {known}")
    found: list[str | int] = []
    for k, word in enumerate(words):
        where = ".".join(words[: k + 1]).replace(".[", "[")
        last = k == len(words) - 1
        step = _step(content, word, where, last)
        found.append(step)
        if not last:
            content = content[step]
    return found


def _step(content: object, word: str, where: str, last: bool) -> str | int:
    if isinstance(content, list):
        return _in_list(content, word, where)
    if not isinstance(content, Mapping):
        raise ValueError(f"{where}: there is nothing below a {'number' if isinstance(content, int | float) else 'name'}")
    if word not in content and not last:
        home = next((key for key, each in content.items() if isinstance(each, Mapping) and word in each), "")
        meant = f", did you mean '{home}.{word}'?" if home and word == where else did_you_mean(word, content)
        raise ValueError(f"{where}: not in the file{meant}; there are: {', '.join(content)}")
    return word


def _in_list(content: list[object], word: str, where: str) -> int:
    """Return an entry of a list by its number, from 0, or by the point, link or target it names."""
    digits = word.strip("[]")
    if digits.isdecimal():
        if int(digits) >= len(content):
            raise ValueError(f"{where}: there are only {len(content)}, counted from 0")
        return int(digits)
    named: dict[str, list[int]] = {}
    for k, entry in enumerate(content):
        for key in ("point", "link", "target", "a", "name"):
            if isinstance(entry, Mapping) and isinstance(entry.get(key), str):
                named.setdefault(entry[key], []).append(k)
    if len(named.get(word, [])) != 1:
        several = f"{len(named[word])} of them; " if word in named else ""
        raise ValueError(f"{where}: {several}give the number, [0] to [{len(content) - 1}]; names: {', '.join(named) or 'none'}")
    return int(named[word][0])
