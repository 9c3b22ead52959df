"""The style of all figures: fit for print, legible to the colour-blind.

Figures of `subplots` are made without pyplot, so that no window opens and no global state of matplotlib changes.
"""

from __future__ import annotations

from contextlib import AbstractContextManager
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WIDTH = 160.0
"""Width of a figure [mm]."""
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
"""Palette of Okabe and Ito, https://jfly.uni-koeln.de/color/, without its yellow, which is too pale on white paper."""
STYLE: Any = {
    "font.size": 9.0, "axes.titlesize": 9.0, "axes.labelsize": 9.0, "xtick.labelsize": 8.0, "ytick.labelsize": 8.0,
    "legend.fontsize": 8.0, "legend.frameon": False, "axes.prop_cycle": f"cycler(color={list(COLOURS)})",
    "axes.spines.top": False, "axes.spines.right": False, "axes.linewidth": 0.6, "axes.axisbelow": True,
    "axes.grid": True, "grid.color": "#dddddd", "grid.linewidth": 0.5, "lines.linewidth": 1.2, "lines.markersize": 4.0,
    "savefig.dpi": 200, "pdf.fonttype": 42,  # TrueType: journals reject Type 3
}  # fmt: skip
"""Settings of matplotlib, by the names of its parameters: sizes of text and widths of lines are in points."""


def house_style() -> AbstractContextManager[None]:
    """Return a context manager in which figures are drawn and saved in this style."""
    from matplotlib import rc_context  # slow to load

    return rc_context(STYLE)


def subplots(rows: int = 1, columns: int = 1, height: float = 90.0, **options: Any) -> tuple[Figure, Any]:
    """Make a figure, `WIDTH` wide and of a height [mm], and its axes; further options are those of `Figure.subplots`."""
    from matplotlib.figure import Figure

    with house_style():
        figure = Figure(figsize=(WIDTH / 25.4, height / 25.4), layout="constrained")  # mm to inches
        return figure, figure.subplots(rows, columns, **options)
