"""Fields, declared once: what may stand there serves Python, files, the command line and the reference."""

from buckler.mbs.declare.compound import Either, Named, Several, Vector
from buckler.mbs.declare.declared import Declaration, Declared, RefusalError, declarations, kinds_of, known, register, specs
from buckler.mbs.declare.fields import (
    choice,
    declared,
    direction,
    field,
    flag,
    names,
    part,
    quantities,
    quantity,
    vector,
    whole,
)
from buckler.mbs.declare.parts import Part, build, fields_written, nameless
from buckler.mbs.declare.spec import Flag, Name, Nothing, Quantity, Spec, Whole

__all__ = [
    "Declaration", "Declared", "Either", "Flag", "Name", "Named", "Nothing", "Part", "Quantity", "RefusalError", "Several",
    "Spec", "Vector", "Whole", "build", "choice", "declarations", "declared", "direction", "field", "fields_written", "flag",
    "kinds_of", "known", "nameless", "names", "part", "quantities", "quantity", "register", "specs", "vector", "whole",
]  # fmt: skip
