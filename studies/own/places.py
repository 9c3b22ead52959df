"""Places in a mechanism's document: what stands there, what it may be, in which unit; and values as they are typed."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from buckler.mbs.declare import Declaration, Quantity, Whole, declarations
from buckler.mbs.declare.spec import Anything
from buckler.mbs.documents import document as documents
from buckler.mbs.documents.document import changed
from buckler.mbs.documents.shorthand import expanded
from buckler.mbs.mechanism import RUN, Mechanism
from buckler.mbs.sensitivity.numbers import standing

from .study import Parameters

DECLARED = declarations(Parameters)
OPTIONS = {name: about for name, about in DECLARED.items() if about.group}
"""Of a run, on the command line; files have the same in their table [run], and the solver with its settings."""
SETTINGS = {**OPTIONS, "solver": DECLARED["solver"]}


def opened(path: Path) -> tuple[dict[str, Any], dict[str, Any]]:
    """The document in a file, its short forms written out, and its table [run], read.

    Raises
    ------
    ValueError
        In one line.
    """
    document = expanded(documents.read(path))
    document.pop("about", None)
    run = document.pop(RUN, {})
    if not isinstance(run, dict) or set(run) - set(SETTINGS):
        odd = sorted(set(run) - set(SETTINGS)) if isinstance(run, dict) else [str(run)]
        raise ValueError(f"{RUN}.{odd[0]}: unknown key; known: {', '.join(SETTINGS)}")
    return document, {name: SETTINGS[name].spec.read(f"{RUN}.{name}", value) for name, value in run.items()}


def typed(text: str) -> Any:
    """A value as it is typed: a TOML value, or else a text, such as 0.3mm or Beam."""
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except ValueError:
        return text.strip()


def set_all(document: Mapping[str, object], texts: list[str]) -> dict[str, Any]:
    """Places and values of `--set PATH=VALUE`, each a place of the document or one that may be added to it.

    Raises
    ------
    ValueError
        In one line.
    """
    found: dict[str, Any] = {}
    for text in texts:
        path, equals, value = text.partition("=")
        if not equals or not value.strip():
            raise ValueError(f"--set {text}: write PATH=VALUE, as links.coupler.body.section.thickness=0.2mm")
        found[path.strip()] = typed(value)
        try:
            Mechanism.from_dict(changed(document, {path.strip(): found[path.strip()]}))
        except ValueError as error:
            raise ValueError(f"--set {text}: {error}") from None
    return found


class Typed(Anything):
    """Whatever the file takes there, as it is typed."""

    allowed = "what the file takes there"

    def read(self, name: str, given: object) -> Any:
        """Return a TOML value, or else the text."""
        return typed(given) if isinstance(given, str) else given


def spec(document: Mapping[str, object], path: str) -> Declaration:
    """What may stand at a place of a document: a number with its unit, or a word.

    Raises
    ------
    ValueError
        If there is no such place.
    """
    about, now, unit = standing(document, path)
    what = about.doc if about else path
    if about and isinstance(now, int) and Whole().fits(now) and not about.unit:
        return Declaration(about.spec, what, {}, True, None)
    number = Quantity(unit).fits(now) or (about and unit and now is None)
    return Declaration(Quantity(unit) if number else Typed(), what, {}, True, None)


def to_json(document: Mapping[str, object]) -> str:
    """A document as one line of JSON, the same for the same content."""
    return json.dumps(document, ensure_ascii=False, sort_keys=False)
