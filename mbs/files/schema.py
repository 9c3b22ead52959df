"""A JSON schema of mechanism files (json-schema.org, draft 2020-12), for editors that complete and check TOML and JSON.

Types come from the annotations, units, ranges and help from the docstrings: see `declared`.
"""

from __future__ import annotations

import typing
from collections.abc import Mapping
from typing import Any

from buckler.mbs.elements import KINDS
from buckler.mbs.files.declared import Declared, declared
from buckler.mbs.files.decode import RUN, short_form
from buckler.mbs.files.kinds import FUNCTIONS, allowed, alternatives, known, takes, takes_function
from buckler.mbs.files.words import is_mapping, is_sequence
from buckler.mbs.mechanism import Mechanism

DIALECT = "https://json-schema.org/draft/2020-12/schema"
Schema = dict[str, Any]


def schema() -> Schema:
    """The schema of a whole file."""
    fields = declared(Mechanism)
    properties: Schema = {"about": {"type": "string", "description": "What it is, in words."}, RUN: _run()}
    for name, field in fields.items():
        if name == "links":
            kind = {"$ref": "#/$defs/Link"}
            properties[name] = {"type": "object", "additionalProperties": kind, "description": "Links by name."}
        elif name in KINDS:
            properties[name] = {"type": "array", "items": _any([_ref(kind.__name__) for kind in KINDS[name]])}
        else:
            properties[name] = _described(field)
    return {
        "$schema": DIALECT,
        "title": "Mechanism",
        "type": "object",
        "properties": properties,
        "required": ["points", "links"],
        "additionalProperties": False,
        "$defs": {name: _object(name, kind) for name, kind in sorted(known().items())},
    }


def _run() -> Schema:
    quantity = _number()
    formulas = {"anyOf": [{"type": "string"}, {"type": "array", "items": {"type": "string"}}]}
    return {
        "type": "object",
        "description": "How `buckler run` runs it.",
        "properties": {
            "duration": quantity,
            "accuracy": quantity,
            "of": formulas,
            "solver": {"anyOf": [{"enum": ["exudyn", "spectral"]}, {"type": "object"}]},
            "verify": {"type": "boolean"},
            "ledger": {"type": "boolean"},
            "measure": formulas,
        },
        "additionalProperties": False,
    }


def _object(name: str, kind: type) -> Schema:
    """One kind: its fields, or those of the object it holds where it takes them directly."""
    main = _fields(name, declared(kind), kind.__name__ == "Link")
    about = (kind.__doc__ or "").strip().partition("\n\n")[0].replace("\n", " ")
    short = short_form(kind) if hasattr(kind, "of") else {}
    if kind.__name__ == "Motion":
        main["required"] = []
    return {"description": about, **({"anyOf": [main, _fields(name, short, False)]} if short else main)}


def _fields(name: str, fields: Mapping[str, Declared], named: bool) -> Schema:
    properties = {key: _described(field) for key, field in fields.items()}
    required = [key for key, field in fields.items() if field.required and not (named and key == "name")]
    content = {"kind": {"const": name}, **properties}
    return {"type": "object", "properties": content, "required": required, "additionalProperties": False}


def _described(field: Declared) -> Schema:
    """The schema of a field's value, with its unit, range and help."""
    found = _value(field.hint, field)
    said = [part for part in (field.help, f"Unit: {field.unit}." if field.unit not in ("", "1") else "") if part]
    if said:
        found["description"] = " ".join(said)
    if not field.required and isinstance(field.default, bool | int | float | str):
        found["default"] = field.default
    return found


def _value(hint: Any, field: Declared | None = None) -> Schema:
    """What may stand where an annotation is."""
    parts: list[Schema] = []
    for part in alternatives(hint):
        if part is Any:
            return {}
        if part is type(None):
            parts.append({"enum": [None, "none"]})
        elif part is bool:
            parts.append({"type": "boolean"})
        elif part is int:
            parts.append({"type": "integer"})
        elif part is float:
            parts.append(_number(field))
        elif part is str:
            parts.append({"type": "string"})
        elif is_mapping(part):
            parts.append({"type": "object", "additionalProperties": _value((typing.get_args(part) or (str, Any))[1])})
        elif is_sequence(part):
            parts.append(_list(part))
    if takes_function(hint):
        about = f"A formula such as '2*sin(3*t)'{' or one of ' + ', '.join(FUNCTIONS) if not takes(hint, float) else ''}."
        parts += [{"type": "string", "description": about}, {"type": "array"}, _ref("Table")]
    names = allowed(hint) if not takes_function(hint) else {**allowed(hint), **_callables()}
    parts += [_ref(name) for name in sorted(names)]
    return _any(parts)


def _callables() -> dict[str, type]:
    return {name: kind for name, kind in known().items() if "__call__" in dir(kind) and name not in ("Table", "Expression")}


def _list(part: Any) -> Schema:
    arguments = typing.get_args(part)
    if typing.get_origin(part) is tuple and not (len(arguments) == 2 and arguments[1] is ...):
        return {
            "type": "array",
            "prefixItems": [_value(a) for a in arguments],
            "minItems": len(arguments),
            "maxItems": len(arguments),
        }
    return {"type": "array", **({"items": _value(arguments[0])} if arguments else {})}


def _number(field: Declared | None = None) -> Schema:
    """A number, or a text of a number and its unit."""
    number: Schema = {"type": "number"}
    if field is not None and field.low is not None:
        number["exclusiveMinimum" if field.open_low else "minimum"] = field.low
    if field is not None and field.high is not None:
        number["maximum"] = field.high
    return {"anyOf": [number, {"type": "string", "pattern": r"^\s*[+-]?(\d|\.\d)"}]}


def _ref(name: str) -> Schema:
    return {"$ref": f"#/$defs/{name}"}


def _any(parts: list[Schema]) -> Schema:
    unique = [part for k, part in enumerate(parts) if part not in parts[:k]]
    return unique[0] if len(unique) == 1 else {"anyOf": unique} if unique else {}
