"""Parameters of a study: each is declared once, with unit, range and help, for Python, TOML and the command line.

With `thickness: float = quantity(3e-4, "m", 1e-5, 1e-2, "strip thickness")` a frozen dataclass takes "0.3mm" and refuses -1.
"""

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from math import cos, degrees, pi, sin
from typing import Any

from buckler.mbs.declare import Declared, Quantity, Several, Whole, declarations, field
from buckler.mbs.declare.spec import Choice

UNGROUPED = "parameters"
"""Heading, in the help, of parameters that are declared without a group."""


class Repeated(Several):
    """List of values, or a single value; on the command line its option is repeated for each value if `repeats` is set."""

    repeats = True

    def read(self, name: str, given: object) -> tuple[Any, ...]:
        """Return the checked values; a single value gives a tuple of one."""
        return super().read(name, tuple(given) if isinstance(given, Iterable) and not isinstance(given, str) else (given,))


class _Listed(Repeated):
    """List of values that a text separates by commas, so that its option is given once."""

    repeats = False

    def read(self, name: str, given: object) -> tuple[Any, ...]:
        """Return the checked values."""
        return super().read(name, given.split(",") if isinstance(given, str) else given)


# Each of these functions returns a dataclass field. Their type is Any, so that a field may be annotated with its value's type.


def quantity(default: float, unit: str, low: float, high: float, help: str, group: str = UNGROUPED) -> Any:
    """Declare a number with a unit, allowed from `low` to `high`, both included."""
    return field(Quantity(unit, low, high), help, default, group=group)


def quantities(default: tuple[float, ...], unit: str, low: float, high: float, help: str, group: str = UNGROUPED) -> Any:
    """Declare one or more different numbers with a unit: `0.1mm,0.3mm`."""
    return field(_Listed(Quantity(unit, low, high), least=1, distinct=True), help, default, group=group)


def counts(default: tuple[int, ...], low: int, high: int, help: str, group: str = UNGROUPED) -> Any:
    """Declare one or more different whole numbers: `4,8`."""
    return field(_Listed(Whole(low, high), least=1, distinct=True), help, default, group=group)


def integer(default: int, low: int, high: int, help: str, group: str = UNGROUPED) -> Any:
    """Declare a whole number, allowed from `low` to `high`, both included."""
    return field(Whole(low, high), help, default, group=group)


def choice(default: str, options: Sequence[str], help: str, group: str = UNGROUPED) -> Any:
    """Declare one word of several."""
    return field(Choice(tuple(options)), help, default, group=group)


def choices(default: tuple[str, ...], options: Sequence[str], help: str, group: str = UNGROUPED) -> Any:
    """Declare one or more different words of several: `strut,beam`."""
    return field(_Listed(Choice(tuple(options)), least=1, distinct=True), help, default, group=group)


@dataclass(frozen=True)
class StudyParameters(Declared):
    """Base class of every study's `Parameters`. It reads and checks each field; errors name parameter, value, range and unit."""

    in_files = False  # studies' parameters are no part of mechanism files

    def share(self, kind: "type[StudyParameters]") -> dict[str, Any]:
        """Return, by name, the parameters that another class of parameters also has."""
        return {name: getattr(self, name) for name in declarations(kind) if name in declarations(type(self))}

    def plain(self) -> dict[str, Any]:
        """Return all parameters by name, as files and the store of a sweep keep them."""
        return asdict(self)


@dataclass(frozen=True)
class Gravity(StudyParameters):
    """Size and direction of gravity in the plane of a published mechanism, which its paper does not give."""

    gravity: float = quantity(0.0, "m/s^2", 0, 100, "gravity in the plane; 0: none, or normal to it", "unpublished")
    gravity_angle: float = quantity(
        -pi / 2, "rad", -7, 7, "angle of gravity to the x axis, along the frame or guide", "unpublished"
    )  # a little more than a turn to either side

    @property
    def gravity_vector(self) -> tuple[float, float]:
        """Gravity as a vector [m/s^2]."""
        return (self.gravity * cos(self.gravity_angle), self.gravity * sin(self.gravity_angle)) if self.gravity else (0.0, 0.0)

    @property
    def gravity_text(self) -> str:
        """Size and direction of gravity, as text."""
        return f"{self.gravity:g} m/s² at {degrees(self.gravity_angle):.4g} deg" if self.gravity else "none in the plane"
