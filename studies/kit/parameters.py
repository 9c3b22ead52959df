"""Parameters of a study: declared once, with unit, range and help; Python, TOML and the command line read them alike.

    @dataclass(frozen=True)
    class Parameters(StudyParameters):
        thickness: float = quantity(3e-4, "m", 1e-5, 1e-2, "strip thickness")
        models: tuple[str, ...] = choices(("strut",), ("stitched", "strut", "beam"), "models to run")

`Parameters(thickness="0.3mm")` holds 3e-4, and `Parameters(thickness=-1)` raises a ValueError that names the parameter,
its value, the allowed range and the unit. The mechanism is that of `buckler.mbs.declare`.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, fields
from typing import Any, NamedTuple

from buckler.mbs.declare import Declared, Quantity, Several, Spec, Whole, field
from buckler.mbs.declare.spec import Choice, Text
from buckler.mbs.units import parse_quantity

__all__ = [
    "Parameter", "StudyParameters", "choice", "choices", "integer", "parse_quantity", "quantities", "quantity", "specs", "text",
]  # fmt: skip


class Parameter(NamedTuple):
    """What a parameter may be, and how it is shown.

    Attributes
    ----------
    spec : Spec
    help, group : str
    """

    spec: Spec
    help: str
    group: str

    @property
    def unit(self) -> str:
        """Of a quantity; '' of anything else."""
        return self.spec.unit

    @property
    def allowed(self) -> str:
        """Its range, with the unit."""
        return self.spec.allowed + (f" {self.unit}" if self.unit not in ("", "1") else "")

    @property
    def metavar(self) -> str:
        """What stands for a value in the help of the command line."""
        one = self.spec.item if isinstance(self.spec, Several) else self.spec
        plain = {Quantity: "NUMBER" if self.unit in ("", "1") else self.unit, Whole: "N", Choice: "NAME", Text: "TEXT"}
        return plain.get(type(one), "VALUE") + (",..." if isinstance(self.spec, Several) else "")

    def read(self, given: object, name: str = "value") -> Any:
        """Return the value; ValueError, in one line that begins with the name, if it may not stand there."""
        return self.spec.read(name, given)

    def show(self, value: Any) -> str:
        """Return it as it may be given."""
        if isinstance(value, tuple | list):
            return ",".join(map(self.show, value))
        if isinstance(value, str | bool) or value is None:
            return str(value) or "none"
        return f"{value:.12g}" + (f" {self.unit}" if self.unit not in ("", "1") else "")


class _Listed(Several):
    """One or more, none of them twice; commas part them in a text, and one may stand alone."""

    def read(self, name: str, given: Any) -> tuple[Any, ...]:
        """Return a tuple."""
        if isinstance(given, str):
            given = given.split(",")
        return super().read(name, tuple(given) if isinstance(given, Iterable) else (given,))


def _several(item: Spec) -> Spec:
    return _Listed(item, least=1, distinct=True)


# Each of these returns a dataclass field; the declared type is the value's, as with `dataclasses.field` itself.


def quantity(default: float, unit: str, low: float, high: float, help: str, group: str = "parameters") -> Any:
    """Declare a number with a unit, allowed from `low` to `high`, both included."""
    return field(Quantity(unit, low, high), help, default, group=group)


def quantities(default: tuple[float, ...], unit: str, low: float, high: float, help: str, group: str = "parameters") -> Any:
    """Declare one or more numbers with a unit: `0.1mm,0.3mm`."""
    return field(_several(Quantity(unit, low, high)), help, default, group=group)


def integer(default: int, low: int, high: int, help: str, group: str = "parameters") -> Any:
    """Declare a whole number, allowed from `low` to `high`, both included."""
    return field(Whole(low, high), help, default, group=group)


def choice(default: str, options: Sequence[str], help: str, group: str = "parameters") -> Any:
    """Declare one word of several."""
    return field(Choice(tuple(options)), help, default, group=group)


def choices(default: tuple[str, ...], options: Sequence[str], help: str, group: str = "parameters") -> Any:
    """Declare one or more words of several: `strut,beam`."""
    return field(_several(Choice(tuple(options))), help, default, group=group)


def text(default: str, help: str, group: str = "parameters") -> Any:
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


def specs(kind: Any) -> dict[str, Parameter]:
    """Names of a `Parameters` class, or of what makes the like, with what each may be."""
    if not isinstance(kind, type):
        return dict(kind.specs())
    metadata = {each.name: each.metadata for each in fields(kind)}
    return {name: Parameter(each["spec"], each["doc"], each.get("group", "")) for name, each in metadata.items()}
