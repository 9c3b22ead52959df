"""Numbers that are known otherwise: how far each is off beside what is allowed, as arrays and as a figure."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import nan

import numpy as np

from buckler.mbs.geometry import Array

from ..kit.report import StudyResult
from ..kit.style import Figure, subplots


def as_signals(errors: Mapping[str, float], allowed: Callable[[str], float | None]) -> dict[str, Array]:
    """Errors and what is allowed of them, nan where nothing is asked."""
    bounds = [allowed(name) for name in errors]
    return {"error": np.array(list(errors.values())), "allowed": np.array([nan if x is None else x for x in bounds])}


def figure(result: StudyResult, names: list[str], xlabel: str, row: int = 10) -> Figure:
    """Error of each number as a point, what is allowed as a bar; a row is so many mm high."""
    fig, ax = subplots(height=row * len(names) + 25)
    places = np.arange(len(names))
    ax.semilogx(np.maximum(result.signals["error"], 1e-16), places, "o", label="found")
    ax.semilogx(result.signals["allowed"], places, "|", color="C3", markersize=12, markeredgewidth=2, label="allowed")
    ax.set_yticks(places, names)
    ax.invert_yaxis()
    ax.set(xlabel=xlabel)
    ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
    return fig
