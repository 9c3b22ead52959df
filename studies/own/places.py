"""Places in a mechanism's document: what stands there, what it may be, in which unit; and values as they are typed."""

from __future__ import annotations

import contextlib
import json
import tomllib
from collections.abc import Mapping
from dataclasses import is_dataclass
from typing import Any

from buckler.mbs.declare import Declaration, Quantity, Spec, Whole, declarations
from buckler.mbs.documents.document import changed, get, steps
from buckler.mbs.mechanism import Mechanism
from buckler.mbs.units import parse_quantity
from buckler.studies.kit.parameters import Parameter


def typed(text: str) -> Any:
    """A value as it is typed: a TOML value, or else a text, such as 0.3mm or Beam."""
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except ValueError:
        return text.strip()


def set_all(document: Mapping[str, Any], texts: list[str]) -> dict[str, Any]:
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


class Typed(Spec):
    """Whatever the file takes there, as it is typed."""

    allowed = "what the file takes there"

    def fits(self, given: Any) -> bool:
        """Yes."""
        return True

    def read(self, name: str, given: Any) -> Any:
        """Return a TOML value, or else the text."""
        return typed(given) if isinstance(given, str) else given


def spec(document: Mapping[str, Any], path: str) -> Parameter:
    """What may stand at a place of a document: a number with its unit, or a word.

    Raises
    ------
    ValueError
        If there is no such place.
    """
    about = _declared(document, path)
    try:
        now = get(document, path)
    except KeyError:
        if about is None:
            raise ValueError(f"{path}: not in the file") from None
        now = about.default
    unit = _fitting(about.spec.unit, now) if about else ""
    number = Quantity(unit).fits(now)
    if about and isinstance(now, int) and Whole().fits(now) and not about.spec.unit:
        return Parameter(about.spec, about.doc, "varied")
    if not number and not (about and unit and now is None):
        return Parameter(Typed(), path, "varied")
    return Parameter(Quantity(unit), about.doc if about else path, "varied")


def _fitting(unit: str, now: Any) -> str:
    """Of several units, as `rad/s or m/s` of a drive's speed, that of the value there; all of them where it has none."""
    for each in unit.split(" or ") if isinstance(now, str) else ():
        with contextlib.suppress(ValueError):
            parse_quantity(now, each)
            return each
    return unit


def _declared(document: Mapping[str, Any], path: str) -> Declaration | None:
    """The field a place belongs to, found in the mechanism the document describes."""
    found: Any = Mechanism.from_dict(document)
    about: Declaration | None = None
    way = steps(document, path)
    for step in way:
        if way[0] == "links" and found.__class__ is tuple and isinstance(step, str):
            found = {link.name: link for link in found}[step]
        elif isinstance(step, int) or isinstance(found, Mapping):
            found = found[step]
        elif step == "kind":
            return None
        else:
            found, about = _field(found, step, path)
    return about


def _field(found: Any, name: str, path: str) -> tuple[Any, Declaration | None]:
    """A field of an object, or of the one inner object that a file leaves out (the Inertia of a Rigid)."""
    inner = [getattr(found, key) for key in getattr(found, "inlined", ())]
    for each in (found, *inner):
        fields = declarations(type(each)) if is_dataclass(each) else {}
        if name in fields:
            return getattr(each, name), fields[name]
    known = ", ".join(declarations(type(found))) if is_dataclass(found) else "nothing"
    raise ValueError(f"{path}: '{name}' is not known there; known: {known}")


def to_json(document: Mapping[str, Any]) -> str:
    """A document as one line of JSON, the same for the same content."""
    return json.dumps(document, ensure_ascii=False, sort_keys=False)
