"""The bifurcation diagram of a path: stable parts whole, unstable ones dashed, critical points marked."""

from __future__ import annotations

from typing import Any

import matplotlib.pyplot as plt
import numpy as np

MARKS = {"limit": "^", "branching": "s", "flutter": "D"}


def plot_path(path: Any, link: str, point: str, axis: str = "y", ax: Any = None) -> Any:
    """Draw a point's place over the parameter of a path and of the paths that leave it; returns the axes."""
    ax = plt.subplots(constrained_layout=True)[1] if ax is None else ax
    column, seen = "xy".index(axis), set()
    for each in (path, *path.branches):
        places, stable = each.point(link, point)[:, column], each.stable
        for whole in (True, False):
            part = stable if whole else ~stable
            shown = part | np.roll(part, 1)  # a piece ends where the next one begins
            shown[0] = part[0]
            label = "stable" if whole else "unstable"
            ax.plot(
                each.parameter, np.where(shown, places, np.nan), "-" if whole else "--", color="C0" if whole else "C3",
                label=None if label in seen or not part.any() else label,
            )  # fmt: skip
            seen |= {label} if part.any() else set()
        for critical in each.points:
            label, at = critical.kind, each.place(critical.rest.q, link, point)
            ax.plot(
                critical.rest.parameter, at[column], MARKS[label], color="k", markersize=5, label=None if label in seen else label
            )
            seen.add(label)
    ax.set(xlabel="parameter", ylabel=f"{axis} of {link}:{point} [m]")
    ax.legend()
    return ax
