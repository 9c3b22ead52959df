"""Mechanism files of the command line: their documents and tables [run], and the places in a document that options change."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from buckler.mbs.declare import Declaration, Quantity, Whole, declarations
from buckler.mbs.declare.spec import Anything
from buckler.mbs.documents import document as documents
from buckler.mbs.documents.document import change
from buckler.mbs.documents.shorthand import expand
from buckler.mbs.mechanism import RUN, Mechanism
from buckler.mbs.sensitivity.numbers import standing

from .study import Parameters

DECLARED = declarations(Parameters)
OPTIONS = {name: about for name, about in DECLARED.items() if about.group}
"""Options of a run; a file's table [run] may have them, too."""
SETTINGS = {**OPTIONS, "solver": DECLARED["solver"]}
"""Keys of a file's table [run]."""


@contextmanager
def name_errors(path: Path) -> Iterator[None]:
    """Turn whatever is wrong into a ValueError with the file's name in front, unless it names an option."""
    try:
        yield
    except (ValueError, OSError, ImportError) as error:
        text = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        if isinstance(error, FileNotFoundError) and not path.exists():
            there = ", ".join(sorted(each.name for each in path.parent.glob("*.toml"))[:8])
            text += f"; there are: {there}" if there else "; `buckler new` writes an example"
        raise ValueError(text if text.startswith((str(path), "--")) else f"{path}: {text}") from None


def read_file(path: Path) -> tuple[dict[str, Any], dict[str, Any]]:
    """Read the document of a file, with its short forms expanded, and its table [run]."""
    document = expand(documents.read(path))
    document.pop("about", None)
    run = document.pop(RUN, {})
    if not isinstance(run, dict) or set(run) - set(SETTINGS):
        odd = sorted(set(run) - set(SETTINGS)) if isinstance(run, dict) else [str(run)]
        raise ValueError(f"{RUN}.{odd[0]}: unknown key; known: {', '.join(SETTINGS)}")
    return document, {name: SETTINGS[name].spec.read(f"{RUN}.{name}", value) for name, value in run.items()}


def read_value(text: str) -> Any:
    """Read a TOML value, or a text such as 0.3mm or Beam."""
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except ValueError:
        return text.strip()


def read_changes(document: Mapping[str, object], texts: Sequence[str]) -> dict[str, Any]:
    """Read the places and values of `--set PATH=VALUE`; each place is in the document or may be added to it."""
    found: dict[str, Any] = {}
    for text in texts:
        path, equals, value = text.partition("=")
        if not equals or not value.strip():
            raise ValueError(f"--set {text}: write PATH=VALUE, as links.coupler.body.section.thickness=0.2mm")
        found[path.strip()] = read_value(value)
        try:
            Mechanism.from_dict(change(document, {path.strip(): found[path.strip()]}))
        except ValueError as error:
            raise ValueError(f"--set {text}: {error}") from None
    return found


class Typed(Anything):
    """Any value that the file takes at a place."""

    allowed = "what the file takes there"

    def read(self, name: str, given: object) -> Any:
        """Return a TOML value, or else the text."""
        return read_value(given) if isinstance(given, str) else given


def spec(document: Mapping[str, object], path: str) -> Declaration:
    """Declare a place of a document: a number with its unit, or a word; a ValueError if there is no such place."""
    about, now, unit = standing(document, path)
    doc = about.doc if about else path
    if about and isinstance(now, int) and Whole().fits(now) and not about.unit:
        return Declaration(about.spec, doc, {}, True, None)
    number = Quantity(unit).fits(now) or (about and unit and now is None)
    return Declaration(Quantity(unit) if number else Typed(), doc, {}, True, None)


def to_json(document: Mapping[str, object]) -> str:
    """Write a document as one line of JSON, the same for the same content."""
    return json.dumps(document, ensure_ascii=False, sort_keys=False)
