"""`buckler sensitivity`, `fit`, `optimise`: numbers of a file's mechanism varied, fitted to data, chosen."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from math import isnan
from pathlib import Path
from typing import Any

from buckler.mbs.documents import document as documents
from buckler.mbs.documents.document import change
from buckler.mbs.sensitivity.data import read_csv
from buckler.mbs.sensitivity.derivatives import sensitivities
from buckler.mbs.sensitivity.design import BUDGET
from buckler.mbs.sensitivity.design import optimise as designed
from buckler.mbs.sensitivity.fitting import fit as fitted
from buckler.mbs.sensitivity.residuals import TIME_ZERO

from ..kit.options import writable
from ..kit.words import add_repeated
from .verbs import VARIED, Opened, add_json, count, file_command, print_json, read_quantities, read_range, varied_numbers


def _declare_sensitivity(parser: argparse.ArgumentParser) -> None:
    add_json(parser)
    about = "a number, as links.coupler.body.section.thickness, with its standard deviation if the spread of readings is wanted"
    add_repeated(parser, "--by", "PATH[=SPREAD]", f"{about}; default {VARIED}")
    about = "a reading, as 'max(B.contact_force)', 'when(B.x, 0.1, 1)', 'frequency(1)'; default the measures of the file"
    add_repeated(parser, "--of", "READING", about)


def _sensitivity(options: argparse.Namespace, file: Opened) -> int:
    readings = list(dict.fromkeys(options.of or file.measures))
    if not readings:
        raise ValueError("--of: no reading; write for instance --of 'max(B.contact_force)'")
    document, by = (file.document, _spreads(file.document, options.by)) if options.by else varied_numbers(file)
    with count("runs"):
        found = sensitivities(document, file.duration, by=by, of=readings)
    if options.json:
        print_json([row._asdict() | {"relative": row.relative, "relative_error": row.relative_error} for row in found.rows])
    else:
        print(found)
        for reading in readings if found.spreads else ():
            parts = ", ".join(f"{path} {value:.3g}" for path, value in found.contributions(reading).items())
            print(f"{reading}: standard deviation {found.spread(reading):.4g}, of which {parts}")
    return int(any(isnan(row.value) for row in found.rows))


def _spreads(document: Mapping[str, object], texts: Sequence[str]) -> Any:
    """Read `--by`: paths, or paths with their standard deviations."""
    pairs = [text.partition("=") for text in texts]
    if not any(equals for _, equals, _ in pairs):
        return [path for path, _, _ in pairs]
    found = {}
    for path, equals, value in pairs:
        if not equals:
            raise ValueError(f"--by {path}: no standard deviation, but others have one")
        found[path] = read_quantities(document, path, [value], f"--by {path}={value}")[0]
    return found


def _declare_fit(parser: argparse.ArgumentParser) -> None:
    add_json(parser)
    parser.add_argument("data", metavar="DATA.csv", type=Path, help="first column the time; units in brackets, as 'force [N]'")
    add_repeated(parser, "--signal", "[COLUMN=]NAME", "a signal of the mechanism and its column, by default of the same name")
    add_repeated(parser, "--free", "PATH=LOW:HIGH", "a number that is fitted")
    about = "a column that separates the experiments, and sets the number of this path if it is one"
    add_repeated(parser, "--setting", "COLUMN", about)
    add_repeated(parser, "--profile", "PATH", "a number whose profile likelihood is wanted")
    parser.add_argument("--start", metavar="s", type=float, help="time of the data at which the run begins [s]; default 0")
    parser.add_argument("--starts", type=int, default=8, help="points over the ranges from which the fit starts; default 8")
    parser.add_argument("--out", metavar="DIR", type=Path, default=Path("results"), help="folder of the figure; default results")


def _fit(options: argparse.Namespace, file: Opened) -> int:
    if not options.signal:
        raise ValueError("--signal: none; write for instance --signal B.contact_force")
    if not options.free:
        raise ValueError("--free: none; write for instance --free links.coupler.body.imperfection=-1mm:1mm")
    free = dict(read_range(file.document, text) for text in options.free)
    out = writable(options.out / f"{options.file.stem}-fit")
    with count("runs"):
        data = read_csv(options.data, options.signal, options.setting, options.start)
        found = fitted(file.document, data, free=free, starts=options.starts, profiles=options.profile)
    kept = {name: value for name, value in found.values.items() if name in free and name != TIME_ZERO}
    mechanism = documents.write(change(file.document, kept), out / f"{options.file.stem}-fitted.toml")
    found.plot().savefig(figure := out / "fit.png")
    if options.json:
        print_json({each: getattr(found, each) for each in ("values", "intervals", "units", "unidentified", "rms")})
    else:
        print(f"{found}\ndata beside the fit: {figure}\nmechanism with these numbers: {mechanism}")
    return 0


def _declare_optimise(parser: argparse.ArgumentParser) -> None:
    add_json(parser)
    add_repeated(parser, "--free", "PATH=LOW:HIGH", "a number that is chosen")
    parser.add_argument("--minimise", metavar="READING", default="", help="as 'max(drive.torque)'")
    about = "as 'max(B.contact_force) = 1.5 N ± 1 %%' or 'max(abs(coupler.deflection)) <= 30 mm'"
    add_repeated(parser, "--subject-to", "CONSTRAINT", about, dest="wants")
    parser.add_argument("--starts", type=int, default=8, help="points over the ranges from which the search starts; default 8")
    about = f"largest number of runs, after which the best so far is shown; default {BUDGET}"
    parser.add_argument("--budget", metavar="RUNS", type=int, default=BUDGET, help=about)
    parser.add_argument(
        "--out", metavar="DIR", type=Path, default=Path("results"), help="folder of the new file; default results"
    )


def _optimise(options: argparse.Namespace, file: Opened) -> int:
    if not options.free:
        raise ValueError("--free: none; write for instance --free links.coupler.body.section.thickness=0.2mm:0.5mm")
    free = dict(read_range(file.document, text) for text in options.free)
    with count("runs"):
        found = designed(file.document, file.duration, free=free, minimise=options.minimise, subject_to=options.wants,
                         starts=options.starts, budget=options.budget)  # fmt: skip
    chosen = change(file.document, found.values)
    path = documents.write(chosen, writable(options.out) / f"{options.file.stem}-chosen.toml")
    if options.json:
        print_json(asdict(found))
    else:
        print(found, f"mechanism with these numbers: {path}", sep="\n")
    return 0 if found.possible else 1


sensitivity = file_command(_declare_sensitivity, _sensitivity)
fit = file_command(_declare_fit, _fit, runs=False)
optimise = file_command(_declare_optimise, _optimise)
