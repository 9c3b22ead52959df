"""Fields with one declaration, from which Python objects, files, the command line and the reference are made."""

from .compound import Either, Named, Several, Vector, any_of, is_list
from .declared import Declaration, Declared, RefusalError, declarations, known_kinds, register
from .fields import choice, declared, direction, field, flag, names, part, quantities, quantity, vector, whole
from .parts import Part, build, fields_written, nameless
from .spec import Flag, Name, Nothing, Quantity, Schema, Spec, Whole, did_you_mean, show

__all__ = [
    "Declaration", "Declared", "Either", "Flag", "Name", "Named", "Nothing", "Part", "Quantity", "RefusalError", "Schema",
    "Several", "Spec", "Vector", "Whole", "any_of", "build", "choice", "declarations", "declared", "did_you_mean", "direction",
    "field", "fields_written", "flag", "is_list", "known_kinds", "nameless", "names", "part", "quantities", "quantity",
    "register", "show", "vector", "whole",
]  # fmt: skip
