"""`buckler show FILE`: a drawing of the mechanism, and what it is made of in words and numbers."""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

from buckler.mbs import statics
from buckler.mbs.assembly import SAME
from buckler.mbs.elements import KINDS
from buckler.mbs.kinematics import linkage, start
from buckler.mbs.kinematics.diagnosis import remarks
from buckler.mbs.mechanism import Mechanism
from buckler.mbs.schema import schema
from buckler.mbs.spectral.beforehand import compile_all

from ..kit.report import Table
from ..kit.words import Command


def show(path: Path, out: Path | None = None) -> str:
    """Draw the mechanism of a file and describe it.

    Parameters
    ----------
    path : a mechanism, .toml or .json
    out : where the drawing goes; by default beside the file, as .png

    Returns
    -------
    text : str

    Raises
    ------
    ValueError
        If the file holds no mechanism.
    """
    mechanism = Mechanism.load(path)
    found, drives = mobility(mechanism), len(mechanism.drives)
    held = found is not None and found.free <= drives and not any(link.body.flexible for link in mechanism.links)
    parts = [str(links(mechanism)), *others(mechanism), told(found, drives), "" if held else lowest(mechanism)]
    parts += [*poses(mechanism), *(f"note: {each}" for each in remarks(mechanism, []))]
    drawing = draw(mechanism, out or path.with_suffix(".png"))
    return "\n".join(part for part in (*parts, f"\ndrawn in {drawing}") if part)


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


def poses(mechanism: Mechanism) -> Iterator[str]:
    """Lines on the points that follow from lengths, and on the other poses, as a file chooses them."""
    found = mechanism.assemblies()
    if found.points:
        yield f"assembled: {_places(found.points)}"
    for other in found.others:
        yield f"another pose: near = {{ {_places({p: at for p, at in other.items() if _apart(at, found.points[p])})} }}"


def _places(points: Mapping[str, tuple[float, float]]) -> str:
    return ", ".join(f"{point} = [{x:.5g}, {y:.5g}]" for point, (x, y) in points.items())


def _apart(one: tuple[float, float], other: tuple[float, float]) -> bool:
    return max(abs(one[0] - other[0]), abs(one[1] - other[1])) > SAME * max(map(abs, (*one, *other)))


class Mobility(NamedTuple):
    """Of the ideal linkage, drives not counted: all links rigid, joints with clearance as pins."""

    coordinates: int
    constraints: int
    rank: int

    @property
    def free(self) -> int:
        """Ways in which it can move."""
        return self.coordinates - self.rank


def mobility(mechanism: Mechanism) -> Mobility | None:
    """Count coordinates and constraints; None where the linkage cannot be assembled."""
    try:
        undriven = Mechanism(**{**vars(mechanism), "drives": (), "velocities": {}})
        _, rows, _ = start.jacobian(undriven)
        return Mobility(rows.shape[1], rows.shape[0], linkage.rank(rows))
    except (ValueError, AttributeError):
        return None


def told(found: Mobility | None, drives: int) -> str:
    """The mobility in words; '' where it is not known."""
    if found is None:
        return ""
    extra = f", {found.constraints - found.rank} of them redundant" if found.constraints > found.rank else ""
    means = "" if found.free == drives else f"; {drives} driven" if drives else "; none driven"
    return (
        f"as an ideal rigid linkage: coordinates {found.coordinates}, constraints {found.constraints}{extra}, "
        f"mobility {found.free}{means}"
    )


def lowest(mechanism: Mechanism) -> str:
    """The lowest natural frequencies with the drives held, or why there are none."""
    try:
        found = statics.frequencies(mechanism, count=4)
    except ValueError as error:  # an element that the statics does not know: show tells the rest all the same
        return f"lowest frequencies: {error}"
    if not len(found.hertz):
        return f"lowest frequencies: {found.message}" if found.message else ""
    lines = [f"  {name}: {value}" for name, value in found.rows()]
    return "\n".join([f"lowest frequencies, drives held{': ' + found.message if found.message else ''}", *lines])


def draw(mechanism: Mechanism, out: Path) -> Path:
    """Draw it."""
    mechanism.plot().figure.savefig(out)
    return out


# --- commands ---------------------------------------------------------------------------------------------------------


def _declare(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", metavar="FILE", type=Path, help="a mechanism, .toml or .json")
    parser.add_argument("--out", metavar="FILE", type=Path, help="the drawing; default FILE.png beside it")


def _show(options: argparse.Namespace) -> int:
    print(show(options.file, options.out))
    return 0


def _schema(_options: argparse.Namespace) -> int:
    print(json.dumps(schema(), indent=2, ensure_ascii=False))
    return 0


def _compile(_options: argparse.Namespace) -> int:
    try:
        spent = compile_all()
    except ModuleNotFoundError as error:
        raise ValueError(str(error)) from None
    print(f"compiled in {spent:.0f} s; it is kept for later runs" if spent else "all is compiled already")
    return 0


showing, schemas = Command(_declare, _show), Command(lambda _parser: None, _schema)
compiling = Command(lambda _parser: None, _compile)
