"""The bifurcation diagram of a path: stable parts whole, unstable ones dashed, critical points marked."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from scipy.interpolate import CubicSpline

MARKS = {"limit": "^", "branching": "s", "flutter": "D", "fold": "^", "doubling": "v"}
DENSE = 200
"""Points of a drawn piece."""


def plot_path(path: Any, link: str, point: str, axis: str = "y", ax: Any = None) -> Axes:
    """Draw a point's place over the parameter of a path and of the paths that leave it; returns the axes."""
    ax = plt.subplots(constrained_layout=True)[1] if ax is None else ax
    column, seen = "xy".index(axis), set[str]()
    for each in (path, *getattr(path, "branches", ())):
        heights, criticals, what = each.heights(link, point)
        for curve, stable in _pieces(each, heights[:, column]):
            label = "stable" if stable else "unstable"
            style: dict[str, Any] = {"linestyle": "-", "color": "C0"} if stable else {"linestyle": "--", "color": "C3"}
            ax.plot(*curve, label=None if label in seen else label, **style)
            seen.add(label)
        for critical, at in zip(each.points, criticals, strict=True):
            label = critical.kind
            ax.plot(
                critical.rest.parameter, at[column], MARKS[label], color="k", markersize=5, label=None if label in seen else label
            )
            seen.add(label)
    ax.set(xlabel="parameter", ylabel=f"{what}{axis} of {link}:{point} [m]")
    ax.legend()
    return ax


def _pieces(path: Any, places: Any) -> list[tuple[Any, bool]]:
    """Curves (2, points) between critical points, and whether they are stable.

    A critical point lies between the two equilibria to which the way by it is the shortest detour.
    """
    span = float(np.ptp(path.parameter)) or 1.0
    whole = np.column_stack([path.q, path.parameter / span])
    steps = np.linalg.norm(np.diff(whole, axis=0), axis=1)
    way, stable = np.concatenate([[0.0], np.cumsum(steps)]), path.stable
    cuts, crossed = [way[0], way[-1]], set[int]()
    for critical in path.points:
        at = np.append(critical.rest.q, critical.rest.parameter / span)
        away = np.linalg.norm(whole - at, axis=1)
        k = int(np.argmin(away[:-1] + away[1:] - steps))
        cuts.append(way[k] + steps[k] * away[k] / (away[k] + away[k + 1]))
        crossed.add(k)
    changes = set(np.flatnonzero(stable[1:] != stable[:-1]).tolist())
    cuts += [(way[k] + way[k + 1]) / 2 for k in changes - crossed]
    curve, pieces = CubicSpline(way, np.column_stack([path.parameter, places])), list[tuple[Any, bool]]()
    for start, end in pairwise(sorted(cuts)):
        inside = stable[(way > start) & (way < end)]
        drawn = curve(np.linspace(start, end, DENSE)).T
        pieces.append((drawn, bool(inside.all() if len(inside) else not (pieces and pieces[-1][1]))))
    return pieces
