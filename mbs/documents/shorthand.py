"""Expansion of short forms in documents: `[defaults]` of bodies and joints, `pins`, and values of `[parameters]`.

`expand` writes out defaults and pins; then `substitute` puts the values of parameters in the place of their names. Messages begin
with the path of a value in the document. A measured text is a number with a unit, such as '5 mm'.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from itertools import chain
from typing import Any

from ..declare import Schema, declarations, did_you_mean, known_kinds, show
from ..functions.formulas import CONSTANTS, FUNCTIONS, NoFormulaError, function_of, names_in, parse
from ..functions.values import SIGNATURES
from ..units import is_measured, measured
from ..validate import LARGEST
from .document import PARAMETERS

VARIABLES = frozenset(chain.from_iterable(SIGNATURES))
"""Variables of formulas, which are no names of parameters."""
WORD = re.compile(r"(?<![\w.:])[A-Za-z_]\w*(?![\w:])")
"""Name inside a formula. A name beside a colon is part of a point reference, such as `coupler:A`, and no name of a number."""
QUANTITY = re.compile(r"(?<![\w.])((?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?) +([A-Za-z%]+)\b")
"""Number with a unit inside a formula, as in `d + 5 mm`."""


def substitute(content: Mapping[str, Any]) -> dict[str, Any]:
    """Return a document with the values of parameters in the place of their names and formulas."""
    rest = {key: each for key, each in content.items() if key != PARAMETERS}
    names = _names(rest)
    values = _read_parameters(content.get(PARAMETERS, {}), names)
    return {key: _fill(each, values, names, key) for key, each in rest.items()} if values else rest


def free_parameters(content: Mapping[str, Any]) -> list[str]:
    """List the paths of parameters that are numbers, not formulas; without zeros, of which there are no relative changes."""
    raw = content.get(PARAMETERS, {})
    numbers = {name: measured(each) if isinstance(each, str) and is_measured(each) else each for name, each in raw.items()}
    return [f"{PARAMETERS}.{name}" for name, value in numbers.items() if isinstance(value, int | float) and value != 0]


def _read_parameters(raw: object, names: set[str]) -> dict[str, Any]:
    """Read the table of parameters: numbers, numbers with a unit as written, and values of formulas of earlier parameters."""
    if not isinstance(raw, Mapping):
        raise ValueError(f'{PARAMETERS} = {show(raw)}: must be a table of numbers, as d = "40 mm"')
    values: dict[str, Any] = {}
    for name, each in raw.items():
        path = f"{PARAMETERS}.{name}"
        other_meanings = {
            "the name of a point or link": names, "a variable of formulas": VARIABLES,
            "a name that formulas know": {*CONSTANTS, *FUNCTIONS},
        }  # fmt: skip
        if meaning := next((meaning for meaning, used in other_meanings.items() if name in used), ""):
            raise ValueError(f"{path}: is {meaning}, too; choose another name, as {name}_0")
        if not WORD.fullmatch(name):
            raise ValueError(f"{path}: no name for a formula; a name has letters, digits and _, and begins with a letter")
        is_formula = isinstance(each, str) and not is_measured(each)
        values[name] = value = _evaluate(each, values, path) if is_formula else each
        if isinstance(value, str) and is_measured(value):
            _number(value, path)  # raises an error if the unit is wrong
        elif isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < LARGEST:
            raise ValueError(f"{path} = {show(each)}: must be a number, one with a unit such as '40 mm', or a formula of others")
    return values


def _names(content: Mapping[str, Any]) -> set[str]:
    """Return the names of points and links, which look like formulas and are not."""
    links = {str(name): link for name, link in _table(content, "links").items() if isinstance(link, Mapping)}
    names = {*links, *_table(content, "points")}
    for link in links.values():
        points = link.get("start"), link.get("end"), *_table(link, "carries")
        names |= {point for point in points if isinstance(point, str)}
    return names


def _table(content: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    """Return a table of a document, empty if the value is no table, which the reader of the field reports."""
    table = content.get(key)
    return table if isinstance(table, Mapping) else {}


def _fill(each: Any, values: Mapping[str, Any], names: set[str], path: str) -> Any:
    """Fill in the values of parameters in a part of a document."""
    if isinstance(each, Mapping):
        # the value of `kind` is the name of a class, even if a parameter has the same name
        return {key: inner if key == "kind" else _fill(inner, values, names, f"{path}.{key}") for key, inner in each.items()}
    if isinstance(each, list):
        return [_fill(inner, values, names, f"{path}[{k}]") for k, inner in enumerate(each)]
    return _evaluate(each, values, path) if isinstance(each, str) and each not in names else each


def _evaluate(text: str, values: Mapping[str, Any], path: str) -> Any:
    """Return the value of a text with parameters put in; a text that is no formula, or has no parameters, is unchanged.

    The name of a parameter gives its value as written. A formula of parameters gives a number. If it also has variables, it
    stays a formula, with the numbers of the parameters.
    """
    if text.strip() in values:
        return values[text.strip()]
    is_parameter = path.startswith(PARAMETERS)
    uses_parameters = bool(set(WORD.findall(text)) & set(values))
    if not is_parameter and not uses_parameters:
        return text
    formula = QUANTITY.sub(lambda match: repr(_number(match[0], path)), text)
    # variables `state1`, `state2`, ... of a load whose force depends on states with differential equations of their own
    states = re.findall(r"\bstate\d+\b", formula)
    try:
        used = names_in(parse(formula, {*values, *VARIABLES, *states}))
        numbers = {name: _number(values[name], path) for name in used & set(values)}
        if used - set(numbers):  # a function of variables: its parameters become numbers
            return WORD.sub(lambda match: f"({numbers[match[0]]!r})" if match[0] in numbers else match[0], formula)
        return function_of(formula, tuple(numbers))(*numbers.values())
    except NoFormulaError:
        return text  # such as plain words; the reader of the field checks them
    except (ArithmeticError, ValueError) as error:  # such as a name that is not known, or 1/0
        raise ValueError(f"{path} = {show(text)}: {error}") from None


def _number(value: Any, path: str) -> float:
    """Return a number, or a text of a number with a unit, in SI."""
    try:
        return float(measured(value) if isinstance(value, str) else value)
    except ValueError as error:
        raise ValueError(f"{path} = {show(value)}: {error}") from None


DEFAULTS, PINS = "defaults", "pins"
SHORT = (DEFAULTS, PINS)
"""Keys of the short forms that `expand` removes."""
KINDS = ("section", "body", "joint")
"""Tables that may have defaults."""


def expand(content: Mapping[str, Any]) -> dict[str, Any]:
    """Return a document with full joints and bodies in the place of `pins` and `defaults`."""
    expanded = {key: each for key, each in content.items() if key not in SHORT}
    links = content.get("links")
    if isinstance(links, list) and not all(isinstance(each, Mapping) and "name" in each for each in links):
        raise ValueError("links = [...]: must be tables by name, as [links.crank]")
    defaults = _read_defaults(content.get(DEFAULTS, {}))
    link_names: list[str] = []
    if isinstance(links, Mapping):
        link_names = list(links)
        expanded["links"] = {name: _complete_link(link, defaults) for name, link in links.items()}
    elif isinstance(links, list):
        link_names = [str(link["name"]) for link in links]
        expanded["links"] = [_complete_link(link, defaults) for link in links]
    joints = expanded.get("joints", [])
    if isinstance(joints, list) and (joints or PINS in content):  # another value is refused by the reader of `joints`
        usual = defaults.get("joint", {})
        pins = [{"kind": "Revolute", **usual, **pin} for pin in _pins(content.get(PINS, []), link_names)]
        expanded["joints"] = [*(_complete(joint, usual) for joint in joints), *pins]
    return expanded


def schema() -> Schema:
    """Return the JSON schemas of the short forms and of the parameters."""
    pins = {"type": "array", "items": {"type": "string", "pattern": "^[^:]+:.+"}, "description": 'As "A: crank coupler".'}
    about = "Usual fields of links and joints; a link or joint may have others."
    table = {"type": "object", "properties": {key: {"type": "object"} for key in KINDS}, "additionalProperties": False}
    value = {"anyOf": [{"type": "number"}, {"type": "string"}]}
    named = {"type": "object", "additionalProperties": value, "description": 'Named numbers, as d = "40 mm".'}
    return {DEFAULTS: {**table, "description": about}, PINS: pins, PARAMETERS: named}


def _read_defaults(defaults: object) -> dict[str, Any]:
    """Return the table of defaults; ValueError unless it has tables of known keys."""
    if not isinstance(defaults, Mapping):
        raise ValueError(f"{DEFAULTS} = {show(defaults)}: must be a table of {', '.join(KINDS)}")
    for key, each in defaults.items():
        if key not in KINDS:
            raise ValueError(f"{DEFAULTS}.{key}: unknown key{did_you_mean(str(key), KINDS)}; known: {', '.join(KINDS)}")
        if not isinstance(each, Mapping):
            raise ValueError(f"{DEFAULTS}.{key} = {show(each)}: must be a table")
    return dict(defaults)


def _complete_link(link: object, defaults: Mapping[str, Any]) -> Any:
    """Return a link whose body and section are completed by the defaults."""
    if not isinstance(link, Mapping) or not isinstance(link.get("body", {}), Mapping):
        return link
    raw = link.get("body", {})
    body = _complete(raw, defaults.get("body", {}))
    if not body:
        return link
    kind, section = known_kinds().get(str(body.get("kind"))), body.get("section", {})
    is_given_by_mass = bool({"mass", "inertia"} & set(raw))  # a rigid body has a section, or a mass and an inertia
    takes_section = kind is not None and "section" in declarations(kind) and not is_given_by_mass
    if "section" in defaults and takes_section and isinstance(section, Mapping):
        body = {**body, "section": _complete(section, defaults["section"])}
    return {**link, "body": body}


def _complete(raw: Any, usual: Mapping[str, Any]) -> Any:
    """Return a table completed by the keys and values of `usual`, but unchanged if it names another kind than `usual`."""
    may_complete = isinstance(raw, Mapping) and ("kind" not in raw or raw["kind"] == usual.get("kind"))
    return {**usual, **raw} if may_complete else raw


def _pins(pins: object, links: Sequence[str]) -> Iterator[dict[str, str]]:
    """Yield the joints of texts such as `"A: crank coupler"`, between the first link and each of the others."""
    if not isinstance(pins, list):
        raise ValueError(f'{PINS} = {show(pins)}: must be a list, as ["A: crank coupler"]')
    bodies = ["ground", *links]
    for k, text in enumerate(pins):
        point, colon, words = text.partition(":") if isinstance(text, str) else ("", "", "")
        names = words.replace(",", " ").split()
        if not colon or not point.strip() or len(names) < 2:
            raise ValueError(f'{PINS}[{k}] = {show(text)}: write a point and two links or more, as "A: crank coupler"')
        for name in names:
            if name not in bodies:
                message = f"unknown link '{name}'{did_you_mean(name, bodies)}; known: {', '.join(bodies)}"
                raise ValueError(f"{PINS}[{k}] = {show(text)}: {message}")
        for other in names[1:]:
            yield {"point": point.strip(), "first": names[0], "second": other}
