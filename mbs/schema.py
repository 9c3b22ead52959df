"""A JSON schema of mechanism files (json-schema.org, draft 2020-12), for editors that complete and check TOML and JSON."""

from __future__ import annotations

from .declare import Declaration, declarations, known_kinds
from .declare.spec import Quantity, Schema
from .documents import shorthand
from .mechanism import RUN, Mechanism

BY_OTHERS = (("Link", "name"), ("Link", "body"))
"""Required fields that a file may give in another place: as the name of a table, or among the defaults."""
DIALECT = "https://json-schema.org/draft/2020-12/schema"


def schema() -> Schema:
    """Return the schema of a whole file."""
    fields = {key: _describe(each) for key, each in declarations(Mechanism).items()}
    return {
        "$schema": DIALECT,
        "title": "Mechanism",
        "type": "object",
        "properties": {
            "about": {"type": "string", "description": "What it is, in words."},
            RUN: _run(),
            **fields,
            **shorthand.schema(),
        },
        "required": [key for key, each in declarations(Mechanism).items() if each.required],
        "additionalProperties": False,
        "$defs": {name: _object(name, kind) for name, kind in sorted(known_kinds().items())},
    }


def _run() -> Schema:
    quantity = Quantity("").schema()
    formulas = {"anyOf": [{"type": "string"}, {"type": "array", "items": {"type": "string"}}]}
    return {
        "type": "object",
        "description": "How `buckler run` runs it.",
        "properties": {
            "duration": quantity,
            "accuracy": quantity,
            "of": formulas,
            "solver": {"anyOf": [{"enum": ["exudyn", "spectral", "closure"]}, {"type": "object"}]},
            "verify": {"type": "boolean"},
            "ledger": {"type": "boolean"},
            "measure": formulas,
        },
        "additionalProperties": False,
    }


def _object(name: str, kind: type) -> Schema:
    fields = declarations(kind)
    about = (kind.__doc__ or "").strip().partition("\n\n")[0].replace("\n", " ")
    required = [key for key, each in fields.items() if each.required and (name, key) not in BY_OTHERS]
    content = {"kind": {"const": name}, **{key: _describe(each) for key, each in fields.items()}}
    shape = {"type": "object", "properties": content, "required": required, "additionalProperties": False}
    return {"description": about, **shape}


def _describe(field: Declaration) -> Schema:
    """Return the schema of a field's value, with its unit and meaning."""
    words = [part for part in (field.doc, f"Unit: {field.spec.unit}." if field.spec.unit not in ("", "1") else "") if part]
    found = dict(field.spec.schema()) | ({"description": " ".join(words)} if words else {})
    plain = isinstance(field.default, bool | int | float | str) and not field.required
    return found | ({"default": field.default} if plain else {})
