"""Fields with one declaration, from which Python objects, files, the command line and the reference are made."""

from .compound import Either, Named, Several, Vector
from .declared import Declaration, Declared, RefusalError, declarations, known_kinds, register
from .fields import choice, declared, direction, field, flag, names, part, quantities, quantity, vector, whole
from .parts import Part, build, fields_written, nameless
from .spec import Flag, Name, Nothing, Quantity, Spec, Whole

__all__ = [
    "Declaration", "Declared", "Either", "Flag", "Name", "Named", "Nothing", "Part", "Quantity", "RefusalError", "Several",
    "Spec", "Vector", "Whole", "build", "choice", "declarations", "declared", "direction", "field", "fields_written", "flag",
    "known_kinds", "nameless", "names", "part", "quantities", "quantity", "register", "vector", "whole",
]  # fmt: skip
