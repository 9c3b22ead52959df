"""Short labels beside points of a figure, each where it covers least."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from buckler.mbs.geometry import Array

SIZE = 7.0
"""Of the text, pt."""
SIDES = ((1, 1), (-1, 1), (1, -1), (-1, -1), (1, 0), (-1, 0), (0, 1), (0, -1))
"""Where a label may stand from its point, the usual place first."""
AWAY = 4.0
"""Of a label from its point, pt."""


class Label(NamedTuple):
    """A text at a point of an axes."""

    x: float
    y: float
    text: str
    colour: str


def write_labels(ax: Any, labels: Sequence[Label], lines: Sequence[Array]) -> None:
    """Write labels beside their points, one after the other, where each covers fewest earlier labels, points and lines.

    Parameters
    ----------
    ax : with everything drawn that the labels must not cover
    labels : sequence of Label
    lines : what is drawn, in the axes' data, shape (points, 2)
    """
    from matplotlib.path import Path
    from matplotlib.patheffects import withStroke

    ax.figure.draw_without_rendering()  # the layout decides how far points are apart
    paths = [Path(ax.transData.transform(line[np.isfinite(line).all(axis=1)])) for line in lines]
    points, taken = np.concatenate([path.vertices for path in paths]), list[Any]()
    for label in labels:
        text = ax.annotate(label.text, (label.x, label.y), (0, 0), textcoords="offset points", fontsize=SIZE)
        text.set(color=label.colour, path_effects=[withStroke(linewidth=2, foreground="white")])

        def moved(side: tuple[int, int], text: Any = text) -> Any:
            right, up = side
            ha, va = ("right", "center", "left")[right + 1], ("top", "center", "bottom")[up + 1]
            text.set(position=(AWAY * right, AWAY * up), ha=ha, va=va)
            return text.get_window_extent()

        def covers(side: tuple[int, int], moved: Any = moved) -> tuple[int, int]:
            box = moved(side)
            crossed = sum(path.intersects_bbox(box, filled=False) for path in paths)
            return box.count_overlaps(taken), box.count_contains(points) + crossed

        taken.append(moved(min(SIDES, key=covers)))
