"""Specifications of compound values: vectors, lists, mappings, and alternatives; `spec` describes attributes and methods."""

from collections.abc import Collection, Mapping, Sequence, Set
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
        self.component = Quantity(self.unit)
        # which `Spec.schema` returns
        self.json = {"type": "array", "prefixItems": [self.component.schema()] * 2, "minItems": 2, "maxItems": 2}

    def fits(self, raw: object) -> bool:
        """Return True for a list of two quantities."""
        return is_list(raw) and len(raw) == 2 and all(map(self.component.fits, raw))

    def read(self, name: str, raw: object) -> tuple[float, float]:
        """Return two components in SI units."""
        if not is_list(raw) or len(raw) != 2:
            raise self.refusal(name, raw)
        return self.component.read(f"{name}.x", raw[0]), self.component.read(f"{name}.y", raw[1])

    def write(self, name: str, value: Any) -> list[float]:
        """Return the components as a list."""
        return [float(component) for component in value]


class Direction(Vector):
    """A direction (x, y), stored as a unit vector."""

    def read(self, name: str, raw: object) -> tuple[float, float]:
        """Return a unit vector [1]."""
        x, y = super().read(name, raw)
        length = Quantity("1", 0.0, open_low=True).read(f"{name} (length)", (x * x + y * y) ** 0.5)
        return (x, y) if abs(length - 1.0) < 1e-15 else (x / length, y / length)  # unit vectors stay as they are


@dataclass(eq=False, repr=False)
class Several(Spec):
    """A list of `least` to `most` items with one specification, all different if `distinct` is true."""

    item: Spec
    least: int = 0
    most: int | None = None
    distinct: bool = False

    def __post_init__(self) -> None:
        self.unit, self.metavar = self.item.unit, f"{self.item.metavar},..."
        self.allowed = f"one or more of {self.item.allowed}" if self.item.allowed else ""  # approximate: `least` may be 0

    @property
    def words(self) -> str:  # type: ignore[override]
        """Text after 'must be' in messages: length of the list, and its items."""
        count = f" of {self.least}" if self.least == self.most else f" of at least {self.least}" if self.least else ""
        return f"a list{count}, each {self.item.words}"

    def fits(self, raw: object) -> bool:
        """Return True for a list; `read` checks its items."""
        return is_list(raw)

    def read(self, name: str, raw: object) -> tuple[Any, ...]:
        """Return the checked items of a list."""
        if not is_list(raw) or len(raw) < self.least or (self.most is not None and len(raw) > self.most):
            raise self.refusal(name, raw)
        found = tuple(self.item.read(f"{name}[{k}]", each) for k, each in enumerate(raw))
        if self.distinct and len(set(found)) < len(found):
            raise ValueError(f"{name} = {show(raw)}: must not contain an item twice")
        return found

    def write(self, name: str, value: Any) -> list[Any]:
        """Return the items in the form of documents."""
        return [self.item.write(f"{name}[{k}]", each) for k, each in enumerate(value)]

    def schema(self) -> Schema:
        """Return the JSON schema of a list."""
        return {"type": "array", "items": self.item.schema()}


@dataclass(eq=False, repr=False)
class Named(Spec):
    """A mapping of names to values of one specification; messages call the names by the noun `name_noun`, as 'points'."""

    item: Spec
    name_noun: str = "names"

    def __post_init__(self) -> None:
        self.unit = self.item.unit

    @property
    def words(self) -> str:  # type: ignore[override]
        """Text after 'must be' in messages: names and items."""
        return f"a table of {self.name_noun}, each {self.item.words}"

    def fits(self, raw: object) -> bool:
        """Return True for a table."""
        return isinstance(raw, Mapping)

    def read(self, name: str, raw: object) -> dict[str, Any]:
        """Return the checked items of a table by their names."""
        if not isinstance(raw, Mapping):
            raise self.refusal(name, raw)
        return {word(f"{name}: a name", key): self.item.read(f"{name}.{key}", each) for key, each in raw.items()}

    def write(self, name: str, value: Any) -> dict[str, Any]:
        """Return the items in the form of documents, by their names."""
        return {key: self.item.write(f"{name}.{key}", each) for key, each in value.items()}

    def schema(self) -> Schema:
        """Return the JSON schema of a table."""
        return {"type": "object", "additionalProperties": self.item.schema()}


@dataclass(eq=False, repr=False)
class Either(Spec):
    """Alternatives, of which the first that fits a value reads or writes it."""

    specs: tuple[Spec, ...]

    def __post_init__(self) -> None:
        self.unit = next((spec.unit for spec in self.specs if spec.unit), "")
        self.allowed = next((spec.allowed for spec in self.specs if spec.allowed), "")
        self.metavar = self.specs[0].metavar

    @property
    def words(self) -> str:  # type: ignore[override]
        """Text after 'must be' in messages: all alternatives but None."""
        return " or ".join(dict.fromkeys(spec.words for spec in self.specs if not isinstance(spec, Nothing)))

    def fits(self, raw: object) -> bool:
        """Return True if one of the alternatives fits."""
        return any(spec.fits(raw) for spec in self.specs)

    def read(self, name: str, raw: object) -> Any:
        """Return the value that the first fitting alternative reads."""
        return self._fitting(name, raw).read(name, raw)

    def write(self, name: str, value: Any) -> Any:
        """Return what the first fitting alternative writes; `fits` accepts stored values as well as raw ones."""
        return self._fitting(name, value).write(name, value)

    def schema(self) -> Schema:
        """Return the JSON schema of the alternatives."""
        return any_of([spec.schema() for spec in self.specs])

    def _fitting(self, name: str, raw: object) -> Spec:
        """Return the first alternative that fits a value, or the only one besides None."""
        for spec in self.specs:
            if spec.fits(raw):
                return spec
        others = [spec for spec in self.specs if not isinstance(spec, Nothing)]
        if len(others) == 1:
            return others[0]  # whose `read` gives the best message
        raise self.refusal(name, raw)


def any_of(schemas: list[Schema]) -> Schema:
    """Return the JSON schema of values for which one of several schemas holds, without nested or double alternatives."""
    flat = [part for each in schemas for part in (each["anyOf"] if list(each) == ["anyOf"] else [each])]
    unique = [part for k, part in enumerate(flat) if part not in flat[:k]]
    return unique[0] if len(unique) == 1 else {"anyOf": unique}


def is_list(raw: object) -> TypeGuard[Sequence[Any]]:
    """Return True for a list, a tuple or an array; a set has no order."""
    return isinstance(raw, Collection) and not isinstance(raw, str | bytes | Mapping | Set)
