"""`buckler show FILE`: a drawing of the mechanism, and what it is made of in words and numbers."""

from __future__ import annotations

from collections.abc import Iterator
from math import pi
from pathlib import Path
from typing import Any

from buckler.mbs.elements import KINDS
from buckler.mbs.mechanism import Mechanism
from buckler.studies.kit.report import Table


def show(path: Path, out: Path | None = None) -> str:
    """Draw the mechanism of a file and describe it.

    Parameters
    ----------
    path : Path
        A mechanism, .toml or .json.
    out : Path, optional
        Where the drawing goes; by default beside the file, as .png.

    Returns
    -------
    text : str

    Raises
    ------
    ValueError
        If the file holds no mechanism.
    """
    mechanism = Mechanism.load(path)
    parts = [str(links(mechanism)), *others(mechanism), mobility(mechanism), lowest(mechanism)]
    drawing = draw(mechanism, out or path.with_suffix(".png"))
    return "\n".join(part for part in (*parts, drawing and f"\ndrawn in {drawing}") if part)


def links(mechanism: Mechanism) -> Table:
    """A row a link: its points, kind, length and mass."""
    rows = []
    for link in mechanism.links:
        length = mechanism.length(link.name)
        points = "-".join((link.start, *link.carries, link.end))
        rows.append((link.name, points, type(link.body).__name__, length, link.mass(length)))
    return Table(("link", "points", "kind", "length [m]", "mass [kg]"), rows)


def others(mechanism: Mechanism) -> Iterator[str]:
    """A line a list of further elements: kinds and names."""
    yield ""
    for name in KINDS:
        found = [element for element in getattr(mechanism, name) if name != "links"]
        if found:
            names = [f"{type(element).__name__} {element.key}" for element in found]
            yield f"{name}: {'; '.join(names)}"


def mobility(mechanism: Mechanism) -> str:
    """Coordinates, constraints and mobility of the ideal linkage, drives not counted; '' where they are not known.

    All links are taken as rigid and joints with clearance as pins.
    """
    try:
        from buckler.mbs.kinematics import closure, start
    except ImportError:
        return ""
    try:
        undriven = Mechanism(**{**vars(mechanism), "drives": (), "velocities": {}})
        _, rows, _ = start.jacobian(undriven)
        rank = closure.rank(rows)
    except (ValueError, AttributeError):
        return ""
    count, coordinates = rows.shape
    extra = f", {count - rank} of them redundant" if count > rank else ""
    free = coordinates - rank
    drives = len(mechanism.drives)
    means = "" if free == drives else f"; {drives} driven" if drives else "; none driven"
    return f"as an ideal rigid linkage: coordinates {coordinates}, constraints {count}{extra}, mobility {free}{means}"


def lowest(mechanism: Mechanism) -> str:
    """The lowest natural frequencies with the drives held; '' where the solver for them is not installed or refuses."""
    try:
        from buckler.mbs import frequencies

        found = frequencies(mechanism, count=4)
    except Exception:  # no equilibrium, no Numba, an element that the statics does not know: show tells the rest all the same
        return ""
    values = [f"{w / (2 * pi):.4g}" for w in found.angular if w == w and w > 1e-3]
    return f"lowest frequencies, drives held: {', '.join(values)} Hz" if values else ""


def draw(mechanism: Any, out: Path) -> Path | None:
    """Draw it, if this version can."""
    if not hasattr(mechanism, "plot"):
        return None
    figure = mechanism.plot()
    figure = getattr(figure, "figure", figure)
    figure.savefig(out)
    return out
