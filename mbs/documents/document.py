"""Documents: read from TOML and JSON files, written to them, and changed by path.

A document is a dictionary whose values are texts, numbers, truth values, lists, and again dictionaries; these are called tables.
An entry is an item of a list. A path, such as `links.coupler.body.section.thickness` or `joints[1].gap`, leads to a value. Its
words are keys of tables, the number of an entry in brackets, or a name that the entry has as a value, as in `joints.A.gap`.
"""

import json
import re
from collections.abc import Iterator, Mapping
from functools import reduce
from operator import getitem
from pathlib import Path
from typing import Any

from ..declare.spec import did_you_mean

PARAMETERS = "parameters"
"""Name of the table of named numbers; the path `d` is short for `parameters.d`."""
NAMING = ("point", "link", "target", "a", "name")
"""Keys of an entry by whose values a path may name the entry; `a` is the first end of a spring."""


def _lines(content: Mapping[str, Any], path: tuple[str, ...]) -> Iterator[str]:
    """Yield the lines of the table at a path: values that fit on one line, then tables and lists of tables under titles."""
    tables = {name: each for name, each in content.items() if _is_table(name, each)}
    yield from (f"{_key(name)} = {_inline(each)}" for name, each in content.items() if name not in tables)
    for name, each in tables.items():
        inner = (*path, name)
        title = ".".join(map(_key, inner))
        if isinstance(each, Mapping):
            has_only_tables = bool(each) and all(isinstance(v, Mapping) and _is_table(key, v) for key, v in each.items())
            if not has_only_tables:  # the titles of inner tables imply that of the outer one
                yield from ("", f"[{title}]")
            yield from _lines(each, inner)
        else:
            for entry in each:
                yield from ("", f"[[{title}]]")
                yield from _lines(entry, inner)


def _is_table(name: str, each: object) -> bool:
    """Return True for a table that is written on several lines, and for a list of tables."""
    if isinstance(each, Mapping):
        is_link = "body" in each
        is_always_long = is_link or name in ("points", "links", "velocities", "run", PARAMETERS)  # names: chosen
        return is_always_long or len(_inline(each)) + len(name) > 100  # characters, a convention
    return isinstance(each, list) and bool(each) and all(isinstance(entry, Mapping) for entry in each)


def _key(name: str) -> str:
    needs_no_quotes = re.fullmatch(r"[A-Za-z0-9_-]+", name)
    return name if needs_no_quotes else _text(name)


def _text(text: str | int) -> str:
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")  # TOML forbids the character DEL, JSON does not


def _inline(each: Any) -> str:
    """Write a value on one line."""
    if isinstance(each, float):
        return repr(each)
    if isinstance(each, str | int):  # also truth values, which are ints; TOML writes them as JSON does
        return _text(each)
    if isinstance(each, Mapping):
        return "{ " + ", ".join(f"{_key(k)} = {_inline(v)}" for k, v in each.items()) + " }" if each else "{}"
    return f"[{', '.join(map(_inline, each))}]"


def write(content: Mapping[str, object], path: Path) -> Path:
    """Write a document to a TOML or JSON file, by the ending of its name; ValueError for other endings."""
    path.write_text(text(content, _ending(path)), encoding="utf-8")
    return path


def text(content: Mapping[str, object], ending: str) -> str:
    """Return the text of a document in a file with an ending."""
    if ending == ".toml":
        return "\n".join(_lines(content, ())).lstrip("\n") + "\n"
    return json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


QUOTES = 'a number with a unit, and every name, needs quotes: "0.3 mm"'
ADVICE = {
    "after a statement": QUOTES, "Unclosed": f"a bracket or a comma is missing, or {QUOTES}", "Invalid value": QUOTES,
    "Cannot overwrite": "a name stands twice there; give each once", "Cannot declare": "a table stands twice; give each once",
}  # fmt: skip
"""Advice on mistakes in TOML, by words of the parser's message: "Unclosed" also for a list with `0.3 mm` without quotes."""


def read(path: Path) -> dict[str, Any]:
    """Read the document in a file, without a check of its content; ValueError if it is no valid TOML or JSON."""
    import tomllib  # its import takes three milliseconds

    ending = _ending(path)
    try:
        content = path.read_text(encoding="utf-8-sig")  # some editors begin files with a byte order mark
        found = tomllib.loads(content) if ending == ".toml" else json.loads(content, object_pairs_hook=_without_doubles)
    except (ValueError, RecursionError) as error:  # RecursionError for deeply nested brackets
        reason = " ".join(str(error).split())
        advice = next((advice for words, advice in ADVICE.items() if ending == ".toml" and words in reason), "")
        reason += f"; {advice}" if advice else ""
        raise ValueError(f"{path}: no valid {ending[1:].upper()}: {reason}") from None
    if not isinstance(found, dict):
        raise ValueError(f"{path}: must be a table, not a {type(found).__name__}")
    return found


def _ending(path: Path) -> str:
    if path.suffix.lower() not in (".toml", ".json"):
        raise ValueError(f"{path}: a mechanism's file ends in .toml or .json")
    return path.suffix.lower()


def _without_doubles(pairs: list[tuple[str, object]]) -> dict[str, object]:
    found = dict(pairs)
    if len(found) < len(pairs):
        names = [name for name, _ in pairs]
        raise ValueError(f"the key '{next(name for name in names if names.count(name) > 1)}' stands twice")
    return found


def get(content: Any, path: str) -> Any:
    """Return the value at a path; KeyError if its last word is no key of its table, ValueError for other unknown words."""
    return reduce(getitem, resolve(content, path), content)


def change(content: object, changes: Mapping[str, object]) -> Any:
    """Return a copy of a document with other values at some paths; ValueError for an unknown path, with the known keys."""
    changed = json.loads(json.dumps(content))  # a deep copy, in which tuples are lists
    for path, value in changes.items():
        *keys, last = resolve(changed, path)
        reduce(getitem, keys, changed)[last] = value
    return changed


def resolve(content: Any, path: str) -> list[str | int]:
    """Return the keys of tables and numbers of entries along a path; the last key may be new, except of a parameter."""
    words = re.findall(r"\[\d+\]|[^.\[\]]+", path)
    if not words:
        raise ValueError(f"'{path}' is no path; write for instance links.coupler.body.section.thickness")
    parameters = content.get(PARAMETERS, {}) if isinstance(content, Mapping) else {}
    if len(words) == 1 and path in parameters and path not in content:
        words = [PARAMETERS, path]  # the short path of a parameter
    if words[0] == PARAMETERS and len(words) > 1 and words[1] not in parameters:
        known = ", ".join(parameters) or "none"
        raise ValueError(f"{path}: not in the file{did_you_mean(words[1], parameters)}; there are: {known}")
    keys: list[str | int] = []
    for k, word in enumerate(words):
        where = ".".join(words[: k + 1]).replace(".[", "[")
        is_last = k == len(words) - 1
        keys.append(_find_key(content, word, where, is_last))
        if not is_last:
            content = content[keys[-1]]
    return keys


def _find_key(content: object, word: str, where: str, is_last: bool) -> str | int:
    """Return the key or number that a word of a path names in a table or list; `where` is the path up to the word."""
    if isinstance(content, list):
        return _find_entry(content, word, where)
    if not isinstance(content, Mapping):
        raise ValueError(f"{where}: there is nothing below a {'number' if isinstance(content, int | float) else 'text'}")
    if word not in content and not is_last:
        table = next((key for key, each in content.items() if isinstance(each, Mapping) and word in each), "")
        lacks_table = bool(table) and word == where  # the first word of the path, such as `crank`, is a key of the table `links`
        meant = f", did you mean '{table}.{word}'?" if lacks_table else did_you_mean(word, content)
        raise ValueError(f"{where}: not in the file{meant}; there are: {', '.join(content)}")
    return word


def _find_entry(content: list[object], word: str, where: str) -> int:
    """Return the index of the entry that a word names: its number, `[1]` or `1`, or a value of its keys `NAMING`."""
    digits = word.strip("[]")
    if digits.isdecimal():
        if int(digits) >= len(content):
            raise ValueError(f"{where}: there are only {len(content)}, counted from 0")
        return int(digits)
    named = [[entry.get(key) for key in NAMING] if isinstance(entry, Mapping) else [] for entry in content]
    numbers = [k for k, values in enumerate(named) if word in values]
    if len(numbers) != 1:
        several = f"{len(numbers)} of them; " if numbers else ""
        names = dict.fromkeys(value for values in named for value in values if isinstance(value, str))  # each once
        known = ", ".join(names) or "none"
        raise ValueError(f"{where}: {several}give the number, [0] to [{len(content) - 1}]; names: {known}")
    return numbers[0]
