"""Derivatives of readings by numbers: rows with errors, spreads, a table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf, nan, sqrt
from typing import NamedTuple


class Derivative(NamedTuple):
    """Derivative of one reading by one number.

    Attributes
    ----------
    reading, number : str
    value, at : float
        Values of the reading and of the number, SI.
    unit, by_unit : str
        Units of both.
    derivative, error : float
        d reading/d number and its error; nan and inf where there is none.
    below, above : float
        One-sided derivatives.
    note : str
        Reason why there is none; '' where there is one.
    """

    reading: str
    number: str
    value: float
    at: float
    unit: str
    by_unit: str
    derivative: float = nan
    error: float = inf
    below: float = nan
    above: float = nan
    note: str = ""

    @property
    def relative(self) -> float:
        """Relative change of the reading by a relative change of the number; nan where one of them is zero."""
        return self.derivative * self.at / self.value if self.value and self.at else nan

    @property
    def relative_error(self) -> float:
        """Error of `relative`."""
        return self.error * abs(self.at / self.value) if self.value and self.at else nan

    @property
    def share(self) -> float | None:
        """Relative error of the derivative; None where it is zero."""
        return abs(self.error / self.derivative) if self.derivative else None


@dataclass(frozen=True)
class Sensitivities:
    """Derivatives of some readings by some numbers.

    Attributes
    ----------
    rows : sequence of Derivative
        By reading, in it the largest effect first.
    spreads : dict of str to float
        Standard deviations of numbers, SI, where they were given.
    """

    rows: Sequence[Derivative]
    spreads: Mapping[str, float]

    def __getitem__(self, key: tuple[str, str]) -> Derivative:
        """Return the derivative of a reading by a number."""
        for row in self.rows:
            if (row.reading, row.number) == key:
                return row
        raise KeyError(f"no derivative of '{key[0]}' by '{key[1]}'")

    def spread(self, reading: str) -> float:
        """Return the standard deviation of a reading for independent small deviations of the numbers, first order."""
        return sqrt(sum(each**2 for each in self.contributions(reading).values()))

    def contributions(self, reading: str) -> dict[str, float]:
        """Return the standard deviation of a reading due to each number, the largest first."""
        if not self.spreads:
            raise ValueError("no standard deviations; give by={path: standard deviation}")
        found = {row.number: abs(row.derivative) * self.spreads[row.number] for row in self.rows if row.reading == reading}
        return dict(sorted(found.items(), key=lambda item: -item[1]))

    def table(self) -> tuple[list[str], list[list[str]]]:
        """Return heads and rows of text, the largest effect first."""
        heads = ["reading", "number", "d ln/d ln", "derivative", "error", "unit", ""]
        return heads, [
            [row.reading, row.number, f"{row.relative:+.4g}", f"{row.derivative:.6g}", f"{row.error:.1e}",
             _per(row.unit, row.by_unit), row.note]
            for row in self.rows
        ]  # fmt: skip

    def __str__(self) -> str:
        """Return the table."""
        heads, rows = self.table()
        widths = [max(len(row[k]) for row in (heads, *rows)) for k in range(len(heads))]
        return "\n".join("  ".join(f"{cell:{w}}" for cell, w in zip(row, widths, strict=True)).rstrip() for row in (heads, *rows))


def _per(unit: str, by: str) -> str:
    """Return the unit of a quotient."""
    top, bottom = unit or "?", by or "?"
    return top if bottom == "1" else f"{top}/({bottom})" if " " in bottom or "/" in bottom else f"{top}/{bottom}"
