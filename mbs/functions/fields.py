"""Fields for functions: Python functions, formulas and tables, read from files and called once as a check."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from dataclasses import field as plain_field
from typing import Any

from ..declare import Either, Quantity, Several, Spec, Vector, build, fields_written, known_kinds, nameless
from ..declare.compound import any_of, is_list
from ..declare.spec import Schema, show
from ..units import is_measured
from ..validate import function as called
from .values import Components, Expression


class Callables(Spec):
    """Specification of a function: a Python function, a formula, or a callable object such as a Table."""

    words = "a formula such as '2*sin(3*t)'"

    def fits(self, raw: object) -> bool:
        """Return whether an input is a function, a formula or a table of one."""
        if isinstance(raw, Mapping):
            return raw.get("kind") in _callable_kinds()
        return (callable(raw) and not isinstance(raw, type)) or (isinstance(raw, str) and not is_measured(raw))

    def read(self, name: str, raw: object) -> Any:
        """Return the function, built from a formula or a table if necessary."""
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
        """Return a function as its formula or its table."""
        if isinstance(value, Expression) and self.fits(value.text):
            return value.text
        if type(value) not in _callable_kinds().values():
            raise nameless(name, value)
        return {"kind": type(value).__name__, **fields_written(name, value)}

    def schema(self) -> Schema:
        """Return the JSON schema of a formula or a table."""
        refs: list[Schema] = [{"$ref": f"#/$defs/{kind}"} for kind in sorted(_callable_kinds())]
        return any_of([{"type": "string", "description": "A formula such as '2*sin(3*t)'."}, *refs])


_PARTS = Several(Either((Quantity(""), Callables())))


@dataclass(eq=False, repr=False)
class Function(Callables):
    """Specification of a function of the variables `of` that returns `size` numbers of a unit.

    It is called once, with all variables zero. `named` are functions that files may refer to by name.
    """

    of: str
    unit: str = ""
    size: int = 1
    named: Mapping[str, Callable[..., Any]] = plain_field(default_factory=dict)

    @property
    def words(self) -> str:  # type: ignore[override]
        """Arguments of the function and its form in files, for messages."""
        return f"a function of {self.of}" + (f", in files {' or '.join(self.named)}" if self.named else ", in files a formula")

    def fits(self, raw: object) -> bool:
        """Return whether an input is a function, or a list with one for each component."""
        if self.size > 1 and is_list(raw) and len(raw) == self.size:
            return any(super(Function, self).fits(part) for part in raw)
        return super().fits(raw)

    def read(self, name: str, raw: object) -> Any:
        """Return the function, checked by a call, or that of a name."""
        if isinstance(raw, str) and raw in self.named:
            return self.named[raw]
        found = self.make(name, raw)
        self.check_call(name, found)
        return found

    def check_call(self, name: str, found: object) -> None:
        """Call the function with all variables zero; ValueError if it raises, or returns other than `size` numbers."""
        names = self.of.split(", ")
        for each in found.parts if isinstance(found, Components) else [found]:
            try:
                if isinstance(each, Expression):
                    each.of(names)
            except ValueError as error:
                raise ValueError(f"{name} = {error}") from None
        zeros = [0.0] * len(names)
        at = f"{name} at {self.of} = 0"
        value = called(name, found, *zeros)(*zeros)
        Quantity(self.unit).read(at, value) if self.size == 1 else Vector(self.unit).read(at, value)

    def make(self, name: str, raw: object) -> Any:
        """Build the function from any input, without calling it."""
        return Components(_PARTS.read(name, raw)) if is_list(raw) and self.fits(raw) else super().read(name, raw)

    def write(self, name: str, value: object) -> Any:
        """Return the name of a function, else its formula or table."""
        for key, function in self.named.items():
            if value is function:
                return key
        if isinstance(value, Components):
            return _PARTS.write(name, value.parts)
        return super().write(name, value)


class Law(Function):
    """Specification of the law of a load, which may have states; the load checks it, as it knows the states."""

    @property
    def words(self) -> str:  # type: ignore[override]
        """Arguments of the law, for messages."""
        return f"{super().words}, where the load has states of them, too"

    def read(self, name: str, raw: object) -> Any:
        """Return the law, built from a formula or a table if necessary."""
        return self.make(name, raw)


class Rates(Law):
    """Specification of the rates of all states of a load: one function, or a list with one for each state."""

    words = "a function, or a list of them, in files formulas"

    def fits(self, raw: object) -> bool:
        """Return whether an input is a function or a list of them."""
        return Callables.fits(self, raw) or (is_list(raw) and len(raw) > 0)

    def schema(self) -> Schema:
        """Return the JSON schema of a function or a list of them."""
        return any_of([super().schema(), _PARTS.schema()])


def _callable_kinds() -> dict[str, type]:
    """Return the classes with names in files whose objects can be called."""
    return {key: kind for key, kind in known_kinds().items() if "__call__" in dir(kind)}
