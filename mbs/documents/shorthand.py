"""Short forms of files: `[defaults]` of bodies, sections and joints, `pins`, materials by name, as the tables they stand for."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from ..declare import declarations, known_kinds
from ..declare.spec import Schema, did_you_mean, show
from .document import PARAMETERS

DEFAULTS, PINS = "defaults", "pins"
SHORT = (DEFAULTS, PINS)
KINDS = ("section", "body", "joint")
"""Tables that may have defaults."""


def expand(content: Mapping[str, Any]) -> dict[str, Any]:
    """Return the document without its short forms; a ValueError begins with the place."""
    found = {key: each for key, each in content.items() if key not in SHORT}
    if isinstance(content.get("links"), list) and not all("name" in each for each in content["links"]):
        raise ValueError("links = [...]: must be tables by name, as [links.crank]")
    defaults = _read_defaults(content.get(DEFAULTS, {}))
    if defaults and isinstance(found.get("links"), Mapping):
        found["links"] = {name: _link(link, defaults) for name, link in found["links"].items()}
    joints = found.get("joints", [])
    if isinstance(joints, list) and (joints or PINS in content):
        usual = defaults.get("joint", {})
        pins = [{"kind": "Revolute", **usual, **pin} for pin in _pins(content.get(PINS, []), found.get("links"))]
        found["joints"] = [*(_fill(joint, usual) for joint in joints), *pins]
    return found


def schema() -> Schema:
    """JSON schemas of the short forms."""
    pins = {"type": "array", "items": {"type": "string", "pattern": "^[^:]+:.+"}, "description": 'As "A: crank coupler".'}
    about = "What links and joints have that do not say otherwise."
    table = {"type": "object", "properties": {key: {"type": "object"} for key in KINDS}, "additionalProperties": False}
    value = {"anyOf": [{"type": "number"}, {"type": "string"}]}
    named = {"type": "object", "additionalProperties": value, "description": 'Named numbers, as d = "40 mm".'}
    return {DEFAULTS: {**table, "description": about}, PINS: pins, PARAMETERS: named}


def _read_defaults(defaults: object) -> dict[str, Any]:
    if not isinstance(defaults, Mapping):
        raise ValueError(f"{DEFAULTS} = {show(defaults)}: must be a table of {', '.join(KINDS)}")
    for key, each in defaults.items():
        if key not in KINDS:
            raise ValueError(f"{DEFAULTS}.{key}: unknown key{did_you_mean(str(key), KINDS)}; known: {', '.join(KINDS)}")
        if not isinstance(each, Mapping):
            raise ValueError(f"{DEFAULTS}.{key} = {show(each)}: must be a table")
    return dict(defaults)


def _link(link: object, defaults: Mapping[str, Any]) -> Any:
    """Return a link with the body and the section that it leaves to the defaults."""
    if not isinstance(link, Mapping) or not isinstance(link.get("body", {}), Mapping):
        return link
    body = _fill(link.get("body", {}), defaults.get("body", {}))
    if not body:
        return link
    if "section" in defaults and _takes_section(link.get("body", {}), body):
        body = {**body, "section": _fill(body.get("section", {}), defaults["section"])}
    return {**link, "body": body}


def _takes_section(given: Mapping[str, object], body: Mapping[str, object]) -> bool:
    """Return True if a body has a section, and no mass in its place."""
    kind = known_kinds().get(str(body.get("kind")))
    if kind is None or "section" not in declarations(kind) or not isinstance(body.get("section", {}), Mapping):
        return False
    return not {"mass", "inertia"} & set(given)


def _fill(given: Any, usual: Mapping[str, Any]) -> Any:
    """Fill what a table lacks from another, unless it is of another kind."""
    if not isinstance(given, Mapping) or given.get("kind", usual.get("kind")) != usual.get("kind"):
        return given
    return {**usual, **given}


def _pins(pins: object, links: object) -> Iterator[dict[str, str]]:
    """Joints of `"A: crank coupler"`: the first link with each of the others."""
    if not isinstance(pins, list):
        raise ValueError(f'{PINS} = {show(pins)}: must be a list, as ["A: crank coupler"]')
    bodies = ["ground", *(links if isinstance(links, Mapping) else ())]
    for k, text in enumerate(pins):
        point, colon, words = text.partition(":") if isinstance(text, str) else ("", "", "")
        names = words.replace(",", " ").split()
        if not colon or not point.strip() or len(names) < 2:
            raise ValueError(f'{PINS}[{k}] = {show(text)}: write a point and two links or more, as "A: crank coupler"')
        for name in names:
            if name not in bodies:
                said = f"unknown link '{name}'{did_you_mean(name, bodies)}; known: {', '.join(bodies)}"
                raise ValueError(f"{PINS}[{k}] = {show(text)}: {said}")
        for other in names[1:]:
            yield {"point": point.strip(), "first": names[0], "second": other}
