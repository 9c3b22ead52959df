"""Parameters of a study: declared once, with unit, range and help; Python, TOML and the command line read them alike.

    @dataclass(frozen=True)
    class Parameters(StudyParameters):
        thickness: float = quantity(3e-4, "m", 1e-5, 1e-2, "strip thickness")
        models: tuple[str, ...] = choices(("strut",), ("stitched", "strut", "beam"), "models to run")

`Parameters(thickness="0.3mm")` holds 3e-4, and `Parameters(thickness=-1)` raises a ValueError that names the parameter,
its value, the allowed range and the unit. The mechanism is that of `buckler.mbs.declare`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from buckler.mbs.declare import Declaration, Declared, Quantity, Several, Spec, Whole, declarations, field
from buckler.mbs.declare.spec import Choice, Text
from buckler.mbs.units import parse_quantity

__all__ = [
    "Cases", "Repeated", "StudyParameters", "choice", "choices", "integer", "parse_quantity", "quantities", "quantity", "specs",
    "text",
]  # fmt: skip
PLAIN = "parameters"
"""The group of what is declared in none."""


class Repeated(Several):
    """Several, of which one may stand alone; the command line takes its option more than once."""

    repeats = True

    def read(self, name: str, given: object) -> tuple[Any, ...]:
        """Return a tuple."""
        return super().read(name, tuple(given) if isinstance(given, Iterable) and not isinstance(given, str) else (given,))


class _Listed(Repeated):
    """One or more, none of them twice; commas part them in a text."""

    repeats = False

    def read(self, name: str, given: object) -> tuple[Any, ...]:
        """Return a tuple."""
        return super().read(name, given.split(",") if isinstance(given, str) else given)


def _several(item: Spec) -> Spec:
    return _Listed(item, least=1, distinct=True)


# Each of these returns a dataclass field; the declared type is the value's, as with `dataclasses.field` itself.


def quantity(default: float, unit: str, low: float, high: float, help: str, group: str = PLAIN) -> Any:
    """Declare a number with a unit, allowed from `low` to `high`, both included."""
    return field(Quantity(unit, low, high), help, default, group=group)


def quantities(default: tuple[float, ...], unit: str, low: float, high: float, help: str, group: str = PLAIN) -> Any:
    """Declare one or more numbers with a unit: `0.1mm,0.3mm`."""
    return field(_several(Quantity(unit, low, high)), help, default, group=group)


def integer(default: int, low: int, high: int, help: str, group: str = PLAIN) -> Any:
    """Declare a whole number, allowed from `low` to `high`, both included."""
    return field(Whole(low, high), help, default, group=group)


def choice(default: str, options: Sequence[str], help: str, group: str = PLAIN) -> Any:
    """Declare one word of several."""
    return field(Choice(tuple(options)), help, default, group=group)


def choices(default: tuple[str, ...], options: Sequence[str], help: str, group: str = PLAIN) -> Any:
    """Declare one or more words of several: `strut,beam`."""
    return field(_several(Choice(tuple(options))), help, default, group=group)


def text(default: str, help: str, group: str = PLAIN) -> Any:
    """Declare any words, such as the name of a file."""
    return field(Text(), help, default, group=group)


@dataclass(frozen=True)
class StudyParameters(Declared):
    """Base of every study's `Parameters`: reads and checks each field when made.

    Raises
    ------
    ValueError
        In one line: parameter, value, allowed range and unit.
    """

    in_files = False

    def agree(self) -> None:
        """Parameters that go together, as the study says."""
        self.check()

    def check(self) -> None:
        """Check parameters against each other; a study overrides it and raises a ValueError with one line."""

    def plain(self) -> dict[str, Any]:
        """All of them by name, as a store and a file keep them."""
        return asdict(self)

    def check_counts(self, *names: str) -> None:
        """Check that all of some quantities without unit are whole numbers."""
        for name in names:
            counts = getattr(self, name)
            if any(x != int(x) for x in counts):
                raise ValueError(f"{name} = {','.join(f'{x:g}' for x in counts)}: must be whole numbers")


@dataclass(frozen=True)
class Cases:
    """Makes the cases of a sweep from values by name, as a `Parameters` class does from its parameters."""

    make: Callable[..., StudyParameters]
    places: Mapping[str, Declaration]

    def __call__(self, **values: Any) -> StudyParameters:
        """Make a case."""
        return self.make(values)


def specs(kind: type[StudyParameters] | Cases) -> Mapping[str, Declaration]:
    """What may vary, with what is declared of it."""
    return kind.places if isinstance(kind, Cases) else declarations(kind)
