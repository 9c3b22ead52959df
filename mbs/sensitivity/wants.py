"""Constraints of a design: readings between two values, as they are written."""

from __future__ import annotations

import re
from math import inf, isfinite
from typing import NamedTuple, cast

from ..units import Measured, measured
from .reading import WrongReadingError

EXACT = 1e-3
"""Share of a value by which it may be missed where it is asked for without a tolerance."""
KEPT = 1e-6
"""Share of an end by which a constraint may be missed: what a search and its runs leave."""
BINDS = 1e-3
"""Share of an end within which a constraint binds."""
NARROW = 0.1
"""Share of its ends up to whose width a band was asked for as a value, and binds."""
FAR = 1e3
"""Miss of a reading that has no value."""
WANTED = re.compile(r"\s*(?P<reading>.+?)\s*(?P<sign><=|>=|=)\s*(?P<value>[^=±]+?)\s*(?:(?:±|\+-|\+/-)\s*(?P<off>.+?))?\s*")


class Want(NamedTuple):
    """A reading between two values.

    Attributes
    ----------
    text : str
    name : str
        Name of the reading.
    low, high : float
    given : str
        A value with its unit, as it was given; '' where it had none.
    """

    text: str
    name: str
    low: float
    high: float
    given: str = ""

    @property
    def ends(self) -> list[tuple[float, float, float]]:
        """Finite ends: side, value, and scale of a miss, with side * (reading - value) >= 0 where it is kept."""
        sizes = [abs(each) for each in (self.low, self.high) if isfinite(each) and each]
        pairs = [(1.0, self.low), (-1.0, self.high)]
        return [(side, end, abs(end) or min(sizes, default=1.0)) for side, end in pairs if isfinite(end)]

    @property
    def is_band(self) -> bool:
        """Whether it has two ends."""
        return isfinite(self.high - self.low)

    def miss(self, value: float) -> float:
        """Compute how far a value is outside, relative to the end that it misses; 0 within."""
        return max(0.0, *(side * (end - value) / scale for side, end, scale in self.ends)) if isfinite(value) else FAR

    def residual(self, value: float) -> tuple[float, float]:
        """Compute the distance from the middle of a narrow band over half its width, else the miss over `EXACT`; its slope."""
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
        """Whether it is a band about a value."""
        return self.is_band and self.high - self.low <= NARROW * max(abs(self.low), abs(self.high))

    def binds(self, value: float) -> bool:
        """Check whether a value lies at an end."""
        return self.is_narrow or any(abs(value - end) <= BINDS * scale for _, end, scale in self.ends)

    def describe(self, value: float, unit: str) -> str:
        """Say where a value is that is outside."""
        return f"{value:.6g}{unit}, {100 * self.miss(value):.2g} % off" if isfinite(value) else "it has no value there"

    def check_unit(self, unit: str) -> None:
        """Raise a WrongReadingError if it asks for another kind of unit than its reading has."""
        if unit and self.given and not cast(Measured, measured(self.given)).fits(unit):
            raise WrongReadingError(f"subject_to '{self.text}': {self.name} is in {unit}")


def wanted(given: str | tuple[str, float, float]) -> Want:
    """Read one constraint.

    Raises
    ------
    ValueError
        If it is none.
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
