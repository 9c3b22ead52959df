"""A JSON schema of mechanism files (json-schema.org, draft 2020-12), for editors that complete and check TOML and JSON."""

from .declare import Declaration, Quantity, Schema, declarations, known_kinds
from .documents import shorthand
from .mechanism import RUN, Mechanism


def schema() -> Schema:
    """Return the schema of a mechanism file."""
    fields = {key: _describe(field) for key, field in declarations(Mechanism).items()}
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Mechanism",
        "type": "object",
        "properties": {
            "about": {"type": "string", "description": "What it is, in words."},
            RUN: _run(),
            **fields,
            **shorthand.schema(),  # tables that shorten files: `parameters`, `pins`, and `defaults` of links and joints
        },
        "required": [key for key, field in declarations(Mechanism).items() if field.required],
        "additionalProperties": False,
        "$defs": {name: _object(name, kind) for name, kind in sorted(known_kinds().items())},
    }


def _run() -> Schema:
    """Return the schema of the table `run`."""
    quantity = Quantity("").schema()  # a number, or a text with any unit
    formulas = {"anyOf": [{"type": "string"}, {"type": "array", "items": {"type": "string"}}]}
    return {
        "type": "object",
        "description": "How `buckler run` runs it.",
        "properties": {
            "duration": quantity,
            "accuracy": quantity,
            "of": {**formulas, "description": "Signals that must reach the accuracy."},
            "solver": {"anyOf": [{"enum": ["exudyn", "spectral", "closure"]}, {"type": "object"}]},  # table: its settings
            "verify": {"type": "boolean", "description": "Whether another solver checks the run."},
            "ledger": {"type": "boolean", "description": "Whether the energies of the run are kept."},
            "measure": {**formulas, "description": "Readings to print."},
        },
        "additionalProperties": False,
    }


def _object(name: str, kind: type) -> Schema:
    """Return the schema of an element, a body or a law, described by the first paragraph of its docstring."""
    fields = declarations(kind)
    about = (kind.__doc__ or "").strip().partition("\n\n")[0].replace("\n", " ")
    # a file names a link by the key of its table, and its table `defaults` may give the field `body` of links
    optional = ("name", "body") if name == "Link" else ()
    required = [key for key, field in fields.items() if field.required and key not in optional]
    content = {"kind": {"const": name}, **{key: _describe(field) for key, field in fields.items()}}
    shape = {"type": "object", "properties": content, "required": required, "additionalProperties": False}
    return {"description": about, **shape}


def _describe(field: Declaration) -> Schema:
    """Return the schema of a field's value, with its meaning, unit and default."""
    has_unit = field.spec.unit not in ("", "1")  # "": none or any; "1": a ratio
    unit = f"Unit: {field.spec.unit}." if has_unit else ""
    description = " ".join(filter(None, (field.doc, unit)))
    found = dict(field.spec.schema()) | ({"description": description} if description else {})
    has_default = not field.required and isinstance(field.default, bool | int | float | str)
    return found | ({"default": field.default} if has_default else {})
