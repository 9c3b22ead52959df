"""`buckler equilibrium FILE`, `path FILE`, `frequencies FILE`, `periodic FILE`: statics of a file from the command line."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from buckler.mbs.mechanism import Mechanism

COMMANDS = {
    "equilibrium": "find where the mechanism of a file rests, and whether that is stable",
    "path": "follow its equilibria as a load grows, a drive moves or a number changes: limits, branchings, flutter",
    "frequencies": "natural frequencies about its equilibrium, with damping and errors",
    "periodic": "find a motion that repeats itself after a period, its multipliers and whether it is stable",
}


def declare(commands: Any) -> None:
    """Add the commands to those of the command line."""
    for name, does in COMMANDS.items():
        command = commands.add_parser(name, help=does, description=f"{does[0].upper()}{does[1:]}.")
        add = command.add_argument
        add("file", metavar="FILE", type=Path, help="a mechanism, .toml or .json")
        add("--degree", type=int, help="of the strips' polynomials; by default it is raised until the error is small")
        add("--csv", metavar="FILE", type=Path, help="also write the numbers there")
        if name == "equilibrium":
            add("--load", type=float, default=1.0, help="factor of all loads; default 1")
            add("--all", action="store_true", help="also list further equilibria")
        elif name == "frequencies":
            add("--count", type=int, default=6, help="how many, rigid motions among them; default 6")
        elif name == "periodic":
            add("--period", type=float, required=True, help="of what drives it, or where the search begins [s]")
            add("--settle", type=int, default=0, help="periods that are run before; default 0")
        else:
            add(
                "--to",
                type=float,
                required=True,
                help="where the path ends: factor of the load, travel [rad or m], or the number [SI]",
            )
            what = command.add_mutually_exclusive_group()
            what.add_argument("--load", action="append", help="the load that grows, as force.A; may be repeated; default all")
            what.add_argument("--drive", help="the drive that moves")
            what.add_argument(
                "--parameter", metavar="PATH", help="the number that changes, as links.strip.body.section.thickness"
            )
            add("--branches", action="store_true", help="also follow the paths that leave its branchings")
            add("--steps", type=int, default=250, help="most steps; default 250")
            add("--plot", metavar="FILE", type=Path, help="draw the bifurcation diagram there; needs --point")
            add("--point", metavar="LINK:POINT", help="the point whose places are drawn and written")
        command.set_defaults(answer=answer, statics=name)


def answer(options: argparse.Namespace) -> int:
    """Ask the statics, print and file the answer; the exit status is 1 where it is not OK."""
    from buckler.mbs.mechanism import Mechanism  # it loads NumPy, which the list of commands does without

    found = _ask(options.statics, Mechanism.load(options.file), options)
    if options.csv:
        _write(found, options)
    print(found)
    for each in (*getattr(found, "others", ()), *getattr(found, "branches", ())):
        print(f"\n{each}")
    return 0 if found.status == "OK" else 1


def _ask(kind: str, mechanism: Mechanism, options: argparse.Namespace) -> Any:
    from buckler import mbs  # loads the compiled solver

    if kind == "equilibrium":
        return mbs.equilibrium(mechanism, options.load, degree=options.degree, all=options.all)
    if kind == "frequencies":
        return mbs.frequencies(mechanism, count=options.count, degree=options.degree)
    if kind == "periodic":
        return mbs.periodic(mechanism, options.period, settle=options.settle, degree=options.degree)
    if (options.plot or options.csv) and not options.point:
        raise ValueError("--point LINK:POINT is missing: whose places are drawn or written")
    found = mbs.path(
        mechanism, to=options.to, load=options.load, drive=options.drive, parameter=options.parameter, steps=options.steps,
        branches=options.branches, degree=options.degree,
    )  # fmt: skip
    if options.plot:
        found.plot(*_point(options, mechanism)).figure.savefig(options.plot)
        print(f"drawn in {options.plot}", file=sys.stderr)
    return found


def _point(options: argparse.Namespace, mechanism: Mechanism) -> tuple[str, str]:
    link, _, point = options.point.partition(":")
    known = [f"{each.name}:{name}" for each in mechanism.links for name in each.points]
    if options.point not in known:
        raise ValueError(f"--point {options.point}: unknown; there are: {', '.join(known)}")
    return link, point


def _write(found: Any, options: argparse.Namespace) -> None:
    """Write a path step by step, anything else row by row."""
    if options.statics == "path":
        places = found.point(*_point(options, found.scene.mechanism))
        lines = ["parameter,x [m],y [m],growth [1/s],negative eigenvalues"]
        lines += [
            f"{p!r},{x!r},{y!r},{g!r},{n}"
            for p, (x, y), g, n in zip(
                found.parameter.tolist(), places.tolist(), found.growth.tolist(), found.unstable, strict=True
            )
        ]
    else:
        lines = ["what,value", *(f'"{name}","{value}"' for name, value in found.rows())]
    options.csv.write_text("\n".join(lines) + "\n", encoding="utf-8")
