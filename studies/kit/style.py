"""The style of figures, for studies: see `buckler.mbs.view.style`."""

from typing import TYPE_CHECKING, Any

from buckler.mbs.view.style import COLOURS, STYLE, WIDTH, house_style, subplots

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
else:
    Axes = Figure = Any  # nothing here needs matplotlib before it draws

__all__ = ["COLOURS", "STYLE", "WIDTH", "Axes", "Figure", "house_style", "plain_ticks", "subplots"]


def plain_ticks(axis: Any, subs: tuple[float, ...] = (1, 2, 5)) -> None:
    """Write the ticks of a logarithmic axis of a decade or two as plain numbers, by default at 1, 2 and 5."""
    from matplotlib.ticker import LogLocator, NullFormatter

    axis.set_major_locator(LogLocator(subs=subs))
    axis.set_major_formatter("{x:g}")
    axis.set_minor_formatter(NullFormatter())
