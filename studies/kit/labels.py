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
WIDE, HIGH = 0.62, 1.0
"""A letter's width and a line's height over the size of the text."""
BETWEEN = 12
"""Places looked at along each piece of a line."""


class Label(NamedTuple):
    """A text at a point of an axes."""

    x: float
    y: float
    text: str
    colour: str


def write_labels(ax: Any, labels: Sequence[Label], lines: Sequence[Array]) -> None:
    """Write labels beside their points, one after the other, where each covers fewest points, lines and earlier labels.

    Parameters
    ----------
    ax : Axes
        With everything drawn that the labels must not cover.
    labels : sequence of Label
    lines : sequence of array, shape (points, 2)
        What is drawn, in the axes' data.
    """
    from matplotlib.patheffects import withStroke

    ax.figure.draw_without_rendering()  # the layout decides how far points are apart
    point = ax.figure.dpi / 72
    occupied = np.concatenate([_along(ax.transData.transform(line)) for line in lines]) / point
    taken: list[Array] = []
    for label in labels:
        at = ax.transData.transform((label.x, label.y)) / point
        size = np.array([WIDE * SIZE * len(label.text), HIGH * SIZE])
        boxes = [at + AWAY * np.array(side) + (np.array(side) - 1) / 2 * size for side in SIDES]
        costs = [_cost(box, size, occupied, taken) for box in boxes]
        best = int(np.argmin(costs))
        taken.append(np.array([boxes[best], boxes[best] + size]))
        (right, up), across, along = SIDES[best], ("right", "center", "left"), ("top", "center", "bottom")
        text = ax.annotate(
            label.text, (label.x, label.y), xytext=(AWAY * right, AWAY * up), textcoords="offset points", fontsize=SIZE,
            color=label.colour, ha=across[right + 1], va=along[up + 1],
        )  # fmt: skip
        text.set_path_effects([withStroke(linewidth=2, foreground="white")])


def _along(corners: Array) -> Array:
    """Places along a line, its corners among them, which count for more."""
    share = np.linspace(0, 1, BETWEEN, endpoint=False)[:, None, None]
    return np.concatenate([((1 - share) * corners[:-1] + share * corners[1:]).reshape(-1, 2), np.repeat(corners, 3, axis=0)])


def _cost(box: Array, size: Array, occupied: Array, taken: Sequence[Array]) -> float:
    inside = ((occupied > box - 1) & (occupied < box + size + 1)).all(axis=1).sum()
    overlap = [np.clip(np.minimum(box + size, other[1]) - np.maximum(box, other[0]), 0, None).prod() for other in taken]
    return float(inside + 2 * sum(overlap))
