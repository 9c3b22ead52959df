"""Specifications of compound values: vectors, lists, mappings, and alternatives."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeGuard

from ..validate import word
from .spec import Nothing, Quantity, Schema, Spec, show


@dataclass(eq=False, repr=False)
class Vector(Spec):
    """Two numbers (x, y) of a unit."""

    unit: str = "1"

    def __post_init__(self) -> None:
        self.words = f"two numbers (x, y), {self.unit}"

    def fits(self, given: object) -> bool:
        """Return whether an input is a list of two quantities."""
        return is_list(given) and len(given) == 2 and all(Quantity(self.unit).fits(each) for each in given)

    def read(self, name: str, given: object) -> tuple[float, float]:
        """Return two components in SI units."""
        if not is_list(given) or len(given) != 2:
            raise self.refusal(name, given)
        part = Quantity(self.unit)
        return part.read(f"{name}.x", given[0]), part.read(f"{name}.y", given[1])

    def write(self, name: str, value: Any) -> list[float]:
        """Return the components as a list."""
        return [float(part) for part in value]

    def schema(self) -> Schema:
        """Return the JSON schema of a list of two numbers."""
        part = Quantity(self.unit).schema()
        return {"type": "array", "prefixItems": [part, part], "minItems": 2, "maxItems": 2}


class Direction(Vector):
    """A direction (x, y), kept as a unit vector."""

    def read(self, name: str, given: object) -> tuple[float, float]:
        """Return a unit vector [1]."""
        x, y = super().read(name, given)
        length = Quantity("1", 0.0, open_low=True).read(f"{name} (length)", (x * x + y * y) ** 0.5)
        return (x, y) if abs(length - 1.0) < 1e-15 else (x / length, y / length)  # a unit vector is not changed by rounding


@dataclass(eq=False, repr=False)
class Several(Spec):
    """A list of values with one specification, with at least `least` and at most `most` items."""

    item: Spec
    least: int = 0
    most: int | None = None
    distinct: bool = False

    def __post_init__(self) -> None:
        self.unit, self.metavar = self.item.unit, f"{self.item.metavar},..."
        self.allowed = f"one or more of {self.item.allowed}" if self.item.allowed else ""

    @property
    def words(self) -> str:  # type: ignore[override]
        """Length of the list and its items, for messages."""
        count = f" of {self.least}" if self.least == self.most else f" of at least {self.least}" if self.least else ""
        return f"a list{count}, each {self.item.words}"

    def fits(self, given: object) -> bool:
        """Return whether an input is a list."""
        return is_list(given)

    def read(self, name: str, given: object) -> tuple[Any, ...]:
        """Return the checked items of a list."""
        if not is_list(given) or not self.least <= len(given) <= (len(given) if self.most is None else self.most):
            raise self.refusal(name, given)
        found = tuple(self.item.read(f"{name}[{k}]", each) for k, each in enumerate(given))
        if self.distinct and len(set(found)) < len(found):
            raise ValueError(f"{name} = {show(given)}: must be given once each")
        return found

    def write(self, name: str, value: Any) -> list[Any]:
        """Return the items as a file holds them."""
        return [self.item.write(f"{name}[{k}]", each) for k, each in enumerate(value)]

    def schema(self) -> Schema:
        """Return the JSON schema of a list."""
        return {"type": "array", "items": self.item.schema()}


@dataclass(eq=False, repr=False)
class Named(Spec):
    """A mapping of names to values with one specification."""

    item: Spec
    of: str = "names"

    def __post_init__(self) -> None:
        self.unit = self.item.unit

    @property
    def words(self) -> str:  # type: ignore[override]
        """Items of the table, for messages."""
        return f"a table of {self.of}, each {self.item.words}"

    def fits(self, given: object) -> bool:
        """Return whether an input is a table."""
        return isinstance(given, Mapping)

    def read(self, name: str, given: object) -> dict[str, Any]:
        """Return the checked items of a table by their names."""
        if not isinstance(given, Mapping):
            raise self.refusal(name, given)
        return {word(f"{name}: a name", key): self.item.read(f"{name}.{key}", each) for key, each in given.items()}

    def write(self, name: str, value: Any) -> dict[str, Any]:
        """Return the items as a file holds them, by their names."""
        return {key: self.item.write(f"{name}.{key}", each) for key, each in value.items()}

    def schema(self) -> Schema:
        """Return the JSON schema of a table."""
        return {"type": "object", "additionalProperties": self.item.schema()}


@dataclass(eq=False, repr=False)
class Either(Spec):
    """Alternatives: the first specification that fits the value is used."""

    specs: tuple[Spec, ...]

    def __post_init__(self) -> None:
        self.unit = next((spec.unit for spec in self.specs if spec.unit), "")
        self.allowed = next((spec.allowed for spec in self.specs if spec.allowed), "")
        self.metavar = self.specs[0].metavar

    @property
    def words(self) -> str:  # type: ignore[override]
        """Alternatives, for messages."""
        return " or ".join(dict.fromkeys(spec.words for spec in self.specs if not isinstance(spec, Nothing)))

    def fits(self, given: object) -> bool:
        """Return whether an input fits one of the alternatives."""
        return any(spec.fits(given) for spec in self.specs)

    def read(self, name: str, given: object) -> Any:
        """Return an input as the first alternative that it fits reads it."""
        return self._fitting(name, given).read(name, given)

    def write(self, name: str, value: Any) -> Any:
        """Return a value as the first alternative that it fits writes it."""
        return self._fitting(name, value).write(name, value)

    def schema(self) -> Schema:
        """Return the JSON schema of the alternatives."""
        return any_of([spec.schema() for spec in self.specs])

    def _fitting(self, name: str, given: object) -> Spec:
        for spec in self.specs:
            if spec.fits(given):
                return spec
        some = [spec for spec in self.specs if not isinstance(spec, Nothing)]
        if len(some) == 1:
            return some[0]  # for its message
        raise self.refusal(name, given)


def any_of(schemas: list[Schema]) -> Schema:
    """Return any of some schemas."""
    flat = [part for each in schemas for part in (each["anyOf"] if list(each) == ["anyOf"] else [each])]
    unique = [part for k, part in enumerate(flat) if part not in flat[:k]]
    return unique[0] if len(unique) == 1 else {"anyOf": unique}


def is_list(given: object) -> TypeGuard[Sequence[Any]]:
    """Return True for a list, a tuple or an array."""
    return isinstance(given, Collection) and not isinstance(given, str | bytes | Mapping)
