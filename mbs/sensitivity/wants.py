"""Constraints of a design: readings between two values."""

from __future__ import annotations

import re
from math import inf, isfinite
from typing import NamedTuple, cast

from ..units import Measured, measured
from .reading import WrongReadingError

EXACT = 1e-3
"""Relative tolerance of a value that is required without one."""
KEPT = 1e-6
"""Relative violation at which a constraint still counts as met: the accuracy of a search."""
BINDS = 1e-3
"""Relative distance from an end within which a constraint binds."""
NARROW = 0.1
"""Relative width up to which a band stands for a value, and binds."""
FAR = 1e3
"""Violation by a reading without a value."""
WANTED = re.compile(r"\s*(?P<reading>.+?)\s*(?P<sign><=|>=|=)\s*(?P<value>[^=±]+?)\s*(?:(?:±|\+-|\+/-)\s*(?P<off>.+?))?\s*")


class Want(NamedTuple):
    """Constraint of a reading to lie between two values.

    Attributes
    ----------
    text : str
    name : str
        Name of the reading.
    low, high : float
    given : str
        Value with its unit, as given; '' without unit.
    """

    text: str
    name: str
    low: float
    high: float
    given: str = ""

    @property
    def ends(self) -> list[tuple[float, float, float]]:
        """Finite ends: side, value, and scale of a violation; side * (reading - value) >= 0 where it is met."""
        sizes = [abs(each) for each in (self.low, self.high) if isfinite(each) and each]
        pairs = [(1.0, self.low), (-1.0, self.high)]
        return [(side, end, abs(end) or min(sizes, default=1.0)) for side, end in pairs if isfinite(end)]

    @property
    def is_band(self) -> bool:
        """True if both ends are finite."""
        return isfinite(self.high - self.low)

    def miss(self, value: float) -> float:
        """Compute the relative violation by a value; 0 within."""
        return max(0.0, *(side * (end - value) / scale for side, end, scale in self.ends)) if isfinite(value) else FAR

    def residual(self, value: float) -> tuple[float, float]:
        """Compute the distance from the middle of a narrow band over half its width, else the violation over `EXACT`; slope."""
        if not isfinite(value):
            return FAR, 0.0
        if self.is_band and self.is_narrow:
            slope = 2.0 / max(self.high - self.low, KEPT * self.ends[0][2])
            return (value - 0.5 * (self.low + self.high)) * slope, slope
        side, end, scale = max(self.ends, key=lambda one: one[0] * (one[1] - value) / one[2])
        off = side * (end - value) / (scale * EXACT)
        return (off + 1.0, -side / (scale * EXACT)) if off > -1.0 else (0.0, 0.0)

    @property
    def is_narrow(self) -> bool:
        """True if it is a narrow band about a value."""
        return self.is_band and self.high - self.low <= NARROW * max(abs(self.low), abs(self.high))

    def binds(self, value: float) -> bool:
        """Check whether a value lies at an end."""
        return self.is_narrow or any(abs(value - end) <= BINDS * scale for _, end, scale in self.ends)

    def describe(self, value: float, unit: str) -> str:
        """Describe a value outside, with its violation."""
        return f"{value:.6g}{unit}, {100 * self.miss(value):.2g} % off" if isfinite(value) else "it has no value there"

    def check_unit(self, unit: str) -> None:
        """Raise a WrongReadingError if its value has another kind of unit than its reading."""
        if unit and self.given and not cast(Measured, measured(self.given)).fits(unit):
            raise WrongReadingError(f"subject_to '{self.text}': {self.name} is in {unit}")


def parse_want(given: str | tuple[str, float, float]) -> Want:
    """Parse one constraint.

    Raises
    ------
    ValueError
        If the text is no constraint.
    """
    if not isinstance(given, str):
        name, low, high = given
        return Want(f"{low:g} <= {name} <= {high:g}", name, float(low), float(high))
    found = WANTED.fullmatch(given)
    try:
        if found is None:
            raise ValueError("has none of =, <=, >= with a value behind it")
        value, off = measured(found["value"]), found["off"]
        width = EXACT * abs(value) if off is None else _width(off, value)
        if width < 0:
            raise ValueError("a tolerance is positive")
    except ValueError as error:
        raise ValueError(f"subject_to '{given}': {error}; write for instance 'max(B.contact_force) = 1.5 N ± 1 %'") from None
    sign = found["sign"]
    low, high = (value - width, value + width) if sign == "=" else (value, inf) if sign == ">=" else (-inf, value)
    return Want(given.strip(), found["reading"], float(low), float(high), getattr(value, "given", ""))


def _width(text: str, value: float) -> float:
    """Read a tolerance, absolute or in per cent of the value."""
    number, percent, _ = text.partition("%")
    return float(number) / 100 * abs(value) if percent else float(measured(text))
