"""Specifications of fields for functions: Python functions, formulas and tables of values, which are called once as a check."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from dataclasses import field as plain_field
from typing import Any

import numpy as np

from ..declare import Either, Quantity, Schema, Several, Spec, any_of, build, fields_written, is_list, known_kinds, nameless, show
from ..units import is_measured
from ..validate import short
from .values import Components, Expression, component_functions


class Callables(Spec):
    """Specification of a function: Python function, formula, or callable object, in files a mapping with its kind."""

    words = "a formula such as '2*sin(3*t)'"

    def fits(self, raw: object) -> bool:
        """Return True for a function, a formula or the mapping of a callable object."""
        if isinstance(raw, Mapping):
            return raw.get("kind") in _callable_kinds()
        return (callable(raw) and not isinstance(raw, type)) or (isinstance(raw, str) and not is_measured(raw))

    def read(self, name: str, raw: object) -> Any:
        """Return the function, built from a formula or a mapping if necessary."""
        if isinstance(raw, Mapping):
            return build(name, raw, _callable_kinds())
        if isinstance(raw, str):
            try:
                return Expression(raw)
            except ValueError as error:
                raise ValueError(f"{name} = {show(raw)}: {error}") from None
        if not self.fits(raw):
            raise self.refusal(name, raw)
        return raw

    def write(self, name: str, value: object) -> Any:
        """Return the formula or the mapping of a function; raise a ValueError for a Python function, which files cannot hold."""
        if isinstance(value, Expression) and self.fits(value.text):  # '2' alone would be read as a number: it gets a mapping
            return value.text
        if type(value) not in _callable_kinds().values():
            raise nameless(name, value)
        return {"kind": type(value).__name__, **fields_written(name, value)}

    def schema(self) -> Schema:
        """Return the JSON schema of a formula, or the mapping of a callable object."""
        refs: list[Schema] = [{"$ref": f"#/$defs/{kind}"} for kind in sorted(_callable_kinds())]
        return any_of([{"type": "string", "description": "A formula such as '2*sin(3*t)'."}, *refs])


_PARTS = Several(Either((Quantity(""), Callables())))
"""Specification of the components of a function, each a number of any unit or a function."""


@dataclass(eq=False, repr=False)
class Function(Callables):
    """Specification of a function of `variables`, such as 't, angle', that returns `size` numbers of a unit.

    `read` calls it once, with all variables zero. `named` are functions that files may refer to by name.
    """

    variables: str
    unit: str = ""
    size: int = 1
    named: Mapping[str, Callable[..., Any]] = plain_field(default_factory=dict)

    @property
    def words(self) -> str:  # type: ignore[override]
        """Text after 'must be' in messages: variables of the function, and its form in files."""
        return f"a function of {self.variables}, in files {' or '.join(self.named) or 'a formula'}"

    def fits(self, raw: object) -> bool:
        """Return True for a function, or a list with one entry for each component, at least one of them a function."""
        if self.size > 1 and is_list(raw) and len(raw) == self.size:
            return any(super(Function, self).fits(part) for part in raw)
        return super().fits(raw)

    def read(self, name: str, raw: object) -> Any:
        """Return the function, checked by a call, or the function of a name."""
        if isinstance(raw, str) and raw in self.named:
            return self.named[raw]
        function = self.make(name, raw)
        self.check_call(name, function)
        return function

    def check_call(self, name: str, function: object, arguments: Sequence[float] = ()) -> None:
        """Call the function with arguments, by default zeros; ValueError if it fails or does not return `size` numbers."""
        names = self.variables.split(", ")
        arguments = arguments or [0.0] * len(names)
        is_formula = isinstance(function, Expression | Components)  # which may contain some of the variables only
        try:
            parts: list[Any] = component_functions(function, names) if is_formula else [function]
        except ValueError as error:
            raise ValueError(f"{name} = {error}") from None
        values = []
        for part in parts:
            try:
                values.append(part(*arguments))
            except Exception as error:
                called = ", ".join(f"{a:g}" for a in arguments)
                raise ValueError(f"{name}({called}) raises {type(error).__name__}: {error}") from error
        value, label = values[0] if len(values) == 1 else values, f"{name} at {names[0]} = {arguments[0]:g}"
        if np.shape(value) != ((self.size,) if self.size > 1 else ()):
            raise ValueError(f"{label} = {short(value)}: must be {f'{self.size} numbers' if self.size > 1 else 'a number'}")
        for each in np.ravel(value).tolist():
            Quantity(self.unit).read(label, each)

    def make(self, name: str, raw: object) -> Any:
        """Return the function of a raw value, without a call."""
        return Components(_PARTS.read(name, raw)) if is_list(raw) and self.fits(raw) else super().read(name, raw)

    def write(self, name: str, value: object) -> Any:
        """Return the name of a function, or else its formula or mapping."""
        for key, function in self.named.items():
            if value is function:
                return key
        if isinstance(value, Components):
            return _PARTS.write(name, value.parts)
        return super().write(name, value)


class Law(Function):
    """Specification of the law of a load that may have states; the load checks it, as it alone knows their number."""

    @property
    def words(self) -> str:  # type: ignore[override]
        """Text after 'must be' in messages: variables of the law, and its form in files."""
        return f"{super().words}; also of the load's states if it has any"

    def read(self, name: str, raw: object) -> Any:
        """Return the law, built from a formula or a mapping if necessary."""
        return self.make(name, raw)


class Rates(Law):
    """Specification of the rates of all states of a load: one function, or a list with one for each state."""

    words = "a function, or a list of them, in files formulas"

    def fits(self, raw: object) -> bool:
        """Return True for a function or a list; `read` then raises a ValueError for entries that are no functions or numbers."""
        return Callables.fits(self, raw) or (is_list(raw) and len(raw) > 0)

    def schema(self) -> Schema:
        """Return the JSON schema of a function or a list of functions."""
        return any_of([super().schema(), _PARTS.schema()])


def _callable_kinds() -> dict[str, type]:
    # instances of these kinds can be called; a class always can, so that `callable` is no test
    return {key: kind for key, kind in known_kinds().items() if "__call__" in dir(kind)}
