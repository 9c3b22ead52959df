"""Commands `show`, `equilibrium`, `path`, `frequencies`, `periodic`, `response` on a file; options `--schema`, `--compile`."""

import argparse
import json
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from math import inf
from pathlib import Path
from typing import Any

import numpy as np

from buckler import mbs
from buckler.mbs.assembly import SAME_POSE
from buckler.mbs.declare import Quantity
from buckler.mbs.elements import KINDS
from buckler.mbs.scene.scene import Scene
from buckler.mbs.schema import schema
from buckler.mbs.sensitivity.numbers import find_entry
from buckler.mbs.spectral.beforehand import compile_all
from buckler.mbs.units import measured
from buckler.mbs.validate import number

from ..kit.cli import Command, add_repeated
from ..kit.report import Table
from .files import FileContent, ask, file_command, open_file


def _declare(kind: str, parser: argparse.ArgumentParser) -> None:
    """Add the options of the command of this name."""
    add = parser.add_argument
    add("--degree", type=int, help="degree of the strips' polynomials; by default it is raised until the error is small")
    add("--csv", metavar="FILE", type=Path, help="also write the numbers there")
    if kind == "equilibrium":
        add("--load", type=float, default=1.0, help="factor of all loads; default 1")
    if kind == "frequencies":
        add("--count", type=int, default=6, help="number of modes, rigid motions among them; default 6")
    if kind in ("periodic", "response"):
        add("--period", required=True, help="period of the drive, or first guess of it [s]")
    if kind not in ("path", "response"):
        return
    unit = "frequency [Hz]" if kind == "response" else "travel [rad or m]"
    add("--to", required=True, help=f"end of the path: factor of the load, {unit}, or value of --parameter, in SI or with a unit")
    varied = parser.add_mutually_exclusive_group()
    default = "the frequency changes by default" if kind == "response" else "default all"
    varied.add_argument("--load", action="append", help=f"the load that grows, as force.A; may be repeated; {default}")
    varied.add_argument("--parameter", metavar="PATH", help="the number that changes, as links.strip.body.section.thickness")
    if kind == "path":
        varied.add_argument("--drive", help="the drive that moves")
        add("--branches", action="store_true", help="also follow the paths that leave its branchings")
    add("--steps", type=int, default=250, help="largest number of steps; default 250")
    add("--plot", metavar="FILE", type=Path, help="draw the diagram there; needs --point")
    add("--point", metavar="LINK:POINT", help="the point whose places are drawn and written")


def _answer(method: Callable[..., Any], names: Sequence[str], options: argparse.Namespace, file: FileContent) -> int:
    """Call a method of statics with the options of these names, print and write its answer; return the exit status."""
    is_path_or_response = "to" in options
    if "period" in options:
        options.period = Quantity("s").read("--period", options.period)
    if is_path_or_response:
        if (options.plot or options.csv) and not options.point:
            raise ValueError("--point LINK:POINT is missing: whose places are drawn or written")
        options.to = _end(file.mechanism, options)
    arguments = {name: getattr(options, name) for name in names}
    found, exit_status = ask(method, options, file.mechanism, **arguments)  # the answer; after Ctrl-C, its best so far
    if is_path_or_response and options.plot and len(found.parameter):
        found.plot(*_point(options, file.mechanism)).figure.savefig(options.plot)
        print(f"drawn in {options.plot}", file=sys.stderr)
    if options.csv:
        options.csv.write_text("\n".join(_csv(found, options)) + "\n", encoding="utf-8")
    print(found)
    for each in getattr(found, "branches", ()):
        print(f"\n{each}")
    return exit_status or int(found.status != "OK")


def _end(mechanism: mbs.Mechanism, options: argparse.Namespace) -> float:
    """Read the end of a path, `--to`, in the unit of what changes along it."""
    is_response = "period" in options
    if options.parameter:
        unit = find_entry(mechanism.to_dict(), options.parameter).unit
    elif is_response and not options.load:  # the frequency of the periodic motion
        unit = "Hz"
    else:  # the travel of a drive, or the factor of loads
        unit = "rad or m" if not is_response and options.drive else "1"
    try:
        return float(number("--to", measured(options.to), -inf, inf, unit))
    except ValueError as error:  # a message of `number` begins with --to, one of `measured` does not
        raise ValueError(str(error) if str(error).startswith("--to") else f"--to {options.to}: {error}") from None


def _point(options: argparse.Namespace, mechanism: mbs.Mechanism) -> tuple[str, str]:
    link, _, point = options.point.partition(":")
    known = [f"{each.name}:{name}" for each in mechanism.links for name in each.points]
    if options.point not in known:
        raise ValueError(f"--point {options.point}: unknown; there are: {', '.join(known)}")
    return link, point


def _csv(found: Any, options: argparse.Namespace) -> list[str]:
    """Write an answer as CSV, a line for each equilibrium of a path, each periodic motion of a response, or each number."""
    if "to" not in options:
        return ["what,value", *(f'"{name}","{value}"' for name, value in found.rows())]
    link_and_point = _point(options, found.scene.mechanism)
    if "period" in options:
        positions = found.amplitude(*link_and_point)  # of x and y [m]
        head = "amplitude x [m],amplitude y [m],largest multiplier,error"
        stability = [(float(abs(each.multipliers).max(initial=0.0)), each.error) for each in found.motions]
    else:
        positions = found.point(*link_and_point)
        head = "x [m],y [m],growth [1/s],negative eigenvalues"
        stability = list(zip(found.growth.tolist(), found.unstable.tolist(), strict=True))  # `unstable` counts those of K
    rows = zip(found.parameter.tolist(), positions.tolist(), stability, strict=True)
    return [f"{found.abscissa},{head}", *(",".join(map(repr, [parameter, *xy, *numbers])) for parameter, xy, numbers in rows)]


def describe(mechanism: mbs.Mechanism) -> str:
    """Describe a mechanism: its links, other elements, mobility, lowest frequencies, poses, and remarks on the input."""
    rows = []
    for link in mechanism.links:
        length, points = mechanism.length(link.name), "-".join((link.start, *link.carries, link.end))
        rows.append((link.name, points, type(link.body).__name__, length, link.mass(length)))
    lines = [str(Table(("link", "points", "kind", "length [m]", "mass [kg]"), rows)), ""]
    for name in KINDS:
        elements = () if name == "links" else getattr(mechanism, name)  # links are in the table
        if others := [f"{type(each).__name__} {each.key}" for each in elements]:
            lines.append(f"{name}: {'; '.join(others)}")
    drive_count, moves_freely = len(mechanism.drives), True
    with suppress(ValueError, AttributeError):  # a user's element may lack equations: then the line is left out
        linkage = Scene.of(replace(mechanism, drives=(), velocities={})).linkage  # links are rigid, joints ideal, drives free
        constraints, coordinates = linkage.jacobian(linkage.reference).shape
        mobility = linkage.count_free_motions()
        redundant = constraints - coordinates + mobility  # constraints less the Jacobian's rank, coordinates - mobility
        extra = f", {redundant} of them redundant" if redundant else ""
        ending = "" if mobility == drive_count else f"; {drive_count or 'none'} driven"
        moves_freely = mobility > drive_count
        numbers = f"coordinates {coordinates}, constraints {constraints}{extra}, mobility {mobility}"
        lines.append(f"as an ideal rigid linkage: {numbers}{ending}")
    if moves_freely or any(link.body.flexible for link in mechanism.links):
        lines += _frequencies(mechanism)
    lines += [*_poses(mechanism), *(f"note: {each}" for each in Scene.of(mechanism).remarks)]
    return "\n".join(lines)


def _poses(mechanism: mbs.Mechanism) -> Iterator[str]:
    """Write the points that follow from lengths, and each other pose as the entry `near` that chooses it in a file."""
    found = mechanism.assemblies()
    if found.points:
        yield f"assembled: {_places(found.points)}"
    for other in found.others:
        rounding = SAME_POSE * np.abs([*other.values(), *found.points.values()]).max()  # relative to the largest coordinate
        moved = {name: xy for name, xy in other.items() if not np.allclose(xy, found.points[name], rtol=0, atol=rounding)}
        yield f"another pose: near = {{ {_places(moved)} }}"


def _places(points: Mapping[str, tuple[float, float]]) -> str:
    return ", ".join(f"{point} = [{x:.5g}, {y:.5g}]" for point, (x, y) in points.items())


def _frequencies(mechanism: mbs.Mechanism) -> list[str]:
    """Write the lowest natural frequencies with the drives at rest, or the reason why there are none."""
    try:
        found = mbs.frequencies(mechanism, count=4)
    except ValueError as error:  # an element for which statics has no equations
        return [f"lowest frequencies: {error}"]
    if not len(found.hertz):
        return [f"lowest frequencies: {found.message}"] if found.message else []
    head = f"lowest frequencies, drives held{': ' + found.message if found.message else ''}"
    return [head, *(f"  {name}: {value}" for name, value in found.rows())]


def _declare_show(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", metavar="FILE", type=Path, help="a mechanism, .toml or .json")
    add_repeated(parser, "--set", "PATH=VALUE", "another value of an entry of the file", dest="changes")
    parser.add_argument("--out", metavar="FILE", type=Path, help="the drawing; default FILE.png beside it")


def _show(options: argparse.Namespace) -> int:
    mechanism = open_file(options.file, options.changes).mechanism
    print(describe(mechanism))
    drawing = options.out or options.file.with_suffix(".png")
    mechanism.plot().figure.savefig(drawing)
    print(f"\ndrawn in {drawing}")
    return 0


show = Command(_declare_show, _show)


def print_schema() -> int:
    """Print the JSON schema of mechanism files."""
    print(json.dumps(schema(), indent=2, ensure_ascii=False))
    return 0


def compile_solver() -> int:
    """Compile the solver for this machine, and store the compiled code for later runs."""
    try:
        spent = compile_all()
    except ModuleNotFoundError as error:
        raise ValueError(str(error)) from None
    print(f"compiled in {spent:.0f} s; it is kept for later runs" if spent else "all is compiled already")
    return 0


def _command(kind: str, method: Callable[..., object], *names: str) -> Command:
    """Make the command of a method of statics, which takes the options of these names."""
    return file_command(partial(_declare, kind), partial(_answer, method, ("degree", *names)), has_duration=False)


equilibrium = _command("equilibrium", mbs.equilibrium, "load")
frequencies = _command("frequencies", mbs.frequencies, "count")
periodic = _command("periodic", mbs.periodic, "period")
path = _command("path", mbs.path, "to", "load", "drive", "parameter", "steps", "branches")
response = _command("response", mbs.response, "to", "period", "load", "parameter", "steps")
