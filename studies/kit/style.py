"""Style of the figures of studies, that of `buckler.mbs.view.style`, and plain numbers at logarithmic axes."""

from typing import TYPE_CHECKING, Any

from buckler.mbs.view.style import COLOURS, house_style, subplots

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
else:
    Axes = Figure = Any  # matplotlib is loaded only when a figure is drawn

__all__ = ["COLOURS", "Axes", "Figure", "house_style", "plain_ticks", "subplots"]


def plain_ticks(axis: Any, subs: tuple[float, ...] = (1, 2, 5)) -> None:
    """Label a logarithmic axis of a decade or two with plain numbers, at `subs` times the powers of ten."""
    from matplotlib.ticker import LogLocator, NullFormatter

    axis.set_major_locator(LogLocator(subs=subs))
    axis.set_major_formatter("{x:g}")
    axis.set_minor_formatter(NullFormatter())
