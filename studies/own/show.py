"""`buckler show FILE`: a drawing of the mechanism, its parts in words and numbers; `buckler --schema`, `buckler --compile`."""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path

from buckler import mbs
from buckler.mbs.assembly import SAME
from buckler.mbs.elements import KINDS
from buckler.mbs.mechanism import Mechanism
from buckler.mbs.scene.linkage import rank
from buckler.mbs.scene.scene import Scene
from buckler.mbs.scene.start import jacobian
from buckler.mbs.schema import schema
from buckler.mbs.spectral.beforehand import compile_all

from ..kit.report import Table
from ..kit.words import Command


def describe(mechanism: Mechanism) -> str:
    """Describe a mechanism: links, further elements, mobility, lowest frequencies, poses, and remarks on the input."""
    lines = [str(_links(mechanism)), *_others(mechanism)]
    found = mobility(mechanism)
    if found:
        lines.append(_mobility_text(*found, len(mechanism.drives)))
    movable = not found or found[0] - found[2] > len(mechanism.drives) or any(link.body.flexible for link in mechanism.links)
    lines += _frequencies(mechanism) if movable else []
    lines += [*_poses(mechanism), *(f"note: {each}" for each in Scene.of(mechanism).remarks)]
    return "\n".join(lines)


def _links(mechanism: Mechanism) -> Table:
    rows = []
    for link in mechanism.links:
        length = mechanism.length(link.name)
        rows.append(
            (link.name, "-".join((link.start, *link.carries, link.end)), type(link.body).__name__, length, link.mass(length))
        )
    return Table(("link", "points", "kind", "length [m]", "mass [kg]"), rows)


def _others(mechanism: Mechanism) -> Iterator[str]:
    """Write a line for each list of further elements: kinds and names."""
    yield ""
    for name in KINDS:
        if found := [f"{type(each).__name__} {each.key}" for each in getattr(mechanism, name) if name != "links"]:
            yield f"{name}: {'; '.join(found)}"


def _poses(mechanism: Mechanism) -> Iterator[str]:
    """Write the points that follow from lengths, and the other poses as a file chooses them."""
    found = mechanism.assemblies()
    if found.points:
        yield f"assembled: {_places(found.points)}"
    for other in found.others:
        yield f"another pose: near = {{ {_places({p: at for p, at in other.items() if _differ(at, found.points[p])})} }}"


def _places(points: Mapping[str, tuple[float, float]]) -> str:
    return ", ".join(f"{point} = [{x:.5g}, {y:.5g}]" for point, (x, y) in points.items())


def _differ(one: tuple[float, float], other: tuple[float, float]) -> bool:
    return max(abs(one[0] - other[0]), abs(one[1] - other[1])) > SAME * max(map(abs, (*one, *other)))


def mobility(mechanism: Mechanism) -> tuple[int, int, int] | None:
    """Count coordinates, constraints and their rank; None where the linkage cannot be assembled.

    All links are rigid, joints with clearance are pins, drives do not count.
    """
    try:
        rows, _ = jacobian(Scene.of(replace(mechanism, drives=(), velocities={})).linkage)
        return rows.shape[1], rows.shape[0], rank(rows)
    except (ValueError, AttributeError):
        return None


def _mobility_text(coordinates: int, constraints: int, rank: int, drives: int) -> str:
    extra = f", {constraints - rank} of them redundant" if constraints > rank else ""
    driven = "" if coordinates - rank == drives else f"; {drives or 'none'} driven"
    count = f"coordinates {coordinates}, constraints {constraints}{extra}, mobility {coordinates - rank}"
    return f"as an ideal rigid linkage: {count}{driven}"


def _frequencies(mechanism: Mechanism) -> list[str]:
    """Write the lowest natural frequencies with the drives fixed, or why there are none."""
    try:
        found = mbs.frequencies(mechanism, count=4)
    except ValueError as error:  # of an element that statics does not know
        return [f"lowest frequencies: {error}"]
    if not len(found.hertz):
        return [f"lowest frequencies: {found.message}"] * bool(found.message)
    head = f"lowest frequencies, drives held{': ' + found.message if found.message else ''}"
    return [head, *(f"  {name}: {value}" for name, value in found.rows())]


# --- commands ---------------------------------------------------------------------------------------------------------


def _declare(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", metavar="FILE", type=Path, help="a mechanism, .toml or .json")
    parser.add_argument("--out", metavar="FILE", type=Path, help="the drawing; default FILE.png beside it")


def _show(options: argparse.Namespace) -> int:
    mechanism = Mechanism.load(options.file)
    print(describe(mechanism))
    drawing = options.out or options.file.with_suffix(".png")
    mechanism.plot().figure.savefig(drawing)
    print(f"\ndrawn in {drawing}")
    return 0


show = Command(_declare, _show)


def print_schema() -> int:
    """Print the JSON schema of mechanism files."""
    print(json.dumps(schema(), indent=2, ensure_ascii=False))
    return 0


def compile_solver() -> int:
    """Compile the solver for this machine; compiled code is stored for later runs."""
    try:
        spent = compile_all()
    except ModuleNotFoundError as error:
        raise ValueError(str(error)) from None
    print(f"compiled in {spent:.0f} s; it is kept for later runs" if spent else "all is compiled already")
    return 0
