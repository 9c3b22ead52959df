"""Places in a mechanism's document: what stands there, what it may be, in which unit; and values as they are typed."""

from __future__ import annotations

import contextlib
import json
import tomllib
from collections.abc import Mapping
from typing import Any

from buckler.mbs.files.declared import Declared, declared
from buckler.mbs.files.decode import mechanism
from buckler.mbs.files.document import changed, get, steps
from buckler.mbs.mechanism import Mechanism
from buckler.mbs.units import measured, parse_quantity, parse_unit
from buckler.studies.kit.parameters import Spec


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
            mechanism(changed(document, {path.strip(): found[path.strip()]}))
        except ValueError as error:
            raise ValueError(f"--set {text}: {error}") from None
    return found


def spec(document: Mapping[str, Any], path: str) -> Spec:
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
    unit = _fitting(about.unit, now) if about else "1"
    number = (isinstance(now, int | float) and not isinstance(now, bool)) or (isinstance(now, str) and _is_quantity(now))
    if not number and not (about and about.unit and now is None):
        return Spec(lambda x: typed(x) if isinstance(x, str) else x, str, "what the file takes there", "VALUE", path, "varied")
    whole = isinstance(now, int) and about is not None and not about.unit
    known = unit if _is_unit(unit) else ""

    def read(given: object) -> Any:
        if isinstance(given, str) and not whole:
            return parse_quantity(given, known) if known else float(measured(given))
        if isinstance(given, str):
            return int(given)
        return given

    def show(value: Any) -> str:
        return f"{value:.12g}" if unit in ("", "1") else f"{value:.12g} {unit}"

    return Spec(read, show, "what the file takes there", unit or "N", about.help if about else path, "varied", known)


def _fitting(unit: str, now: Any) -> str:
    """Of several units, as `rad/s or m/s` of a drive's speed, that of the value there; all of them where it has none."""
    for each in unit.split(" or ") if isinstance(now, str) else ():
        with contextlib.suppress(ValueError):
            parse_quantity(now, each)
            return each
    return unit


def _is_quantity(text: str) -> bool:
    try:
        measured(text)
    except ValueError:
        return False
    return True


def _is_unit(text: str) -> bool:
    try:
        parse_unit(text)
    except ValueError:
        return False
    return bool(text)


def _declared(document: Mapping[str, Any], path: str) -> Declared | None:
    """The field a place belongs to, found in the mechanism the document describes."""
    found: Any = mechanism(document)
    about: Declared | None = None
    way = steps(document, path)
    if way[0] == "points":
        return declared(Mechanism)["points"]
    for step in way:
        if way[0] == "links" and found.__class__ is tuple and isinstance(step, str):
            found = {link.name: link for link in found}[step]
        elif isinstance(step, int):
            found = found[step]
        elif isinstance(found, Mapping):
            found = found[step]
        elif step == "kind":
            return None
        else:
            found, about = _field(found, step, path)
    return about


def _field(found: Any, name: str, path: str) -> tuple[Any, Declared | None]:
    """A field of an object, or of the one inner object that a file leaves out (the Inertia of a Rigid)."""
    if hasattr(found, name) and hasattr(type(found), "__dataclass_fields__"):
        return getattr(found, name), declared(type(found)).get(name)
    inner = [getattr(found, key) for key in declared(type(found))]
    for each in inner:
        if hasattr(each, name) and hasattr(type(each), "__dataclass_fields__"):
            return getattr(each, name), declared(type(each)).get(name)
    raise ValueError(f"{path}: '{name}' is not known there; known: {', '.join(declared(type(found)))}")


def to_json(document: Mapping[str, Any]) -> str:
    """A document as one line of JSON, the same for the same content."""
    return json.dumps(document, ensure_ascii=False, sort_keys=False)
