"""Commands that vary numbers of a mechanism: `sensitivity`, `fit` to data, `optimise`, and `ensemble` with random numbers."""

import argparse
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from functools import partial
from math import isnan
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import uniform

from buckler import mbs
from buckler.mbs.declare import Quantity
from buckler.mbs.documents import document as documents
from buckler.mbs.ensembles.result import Ensemble
from buckler.mbs.sensitivity.data import read_csv
from buckler.mbs.sensitivity.design import BUDGET
from buckler.mbs.sensitivity.residuals import TIME_ZERO

from ..kit.cli import INTERRUPTED, add_repeated
from ..kit.report import Table, to_json
from ..kit.running import make_folder
from ..kit.style import house_style, subplots
from .files import VARIED_HELP, FileContent, ask, file_command, read_quantities, read_range, varied_numbers


def _declare_sensitivity(parser: argparse.ArgumentParser) -> None:
    about = "a number, as links.coupler.body.section.thickness, with its standard deviation if the spread of readings is wanted"
    add_repeated(parser, "--by", "PATH[=SPREAD]", f"{about}; default {VARIED_HELP}")
    about = "a reading, as 'max(B.contact_force)', 'when(B.x, 0.1, 1)', 'frequency(1)'; default the measures of the file"
    add_repeated(parser, "--of", "READING", about)


def _sensitivity(options: argparse.Namespace, file: FileContent) -> int:
    """Compute and print derivatives of readings, and the spread of readings that spreads of numbers cause."""
    readings = list(dict.fromkeys(options.of or file.measures))
    if not readings:
        raise ValueError("--of: no reading; write for instance --of 'max(B.contact_force)'")
    document, by = (file.document, _spreads(file.document, options.by)) if options.by else varied_numbers(file)
    found, exit_status = ask(mbs.sensitivities, options, document, file.duration, by=by, of=readings)
    if options.json:
        rows = [row._asdict() | {"relative": row.relative, "relative_error": row.relative_error} for row in found.rows]
        print(to_json(rows), end="")
    else:
        print(found)
        for reading in readings if found.spreads else ():
            parts = ", ".join(f"{path} {value:.3g}" for path, value in found.contributions(reading).items())
            print(f"{reading}: standard deviation {found.spread(reading):.4g}, of which {parts}")
    is_incomplete = any(isnan(row.value) or row.note.startswith("timeout") for row in found.rows)
    return exit_status or int(is_incomplete)


def _spreads(document: Mapping[str, object], texts: Sequence[str]) -> Any:
    """Read the numbers of `--by`: a list of paths, or standard deviations by path."""
    if not any("=" in text for text in texts):
        return list(texts)
    found = {}
    for text in texts:
        path, equals, value = text.partition("=")
        if not equals:
            raise ValueError(f"--by {path}: no standard deviation, but others have one")
        found[path] = read_quantities(document, path, [value], f"--by {path}={value}")[0]
    return found


def _declare_fit(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("data", metavar="DATA.csv", type=Path, help="first column the time; units in brackets, as 'force [N]'")
    add_repeated(parser, "--signal", "[COLUMN=]NAME", "a signal of the mechanism and its column, by default of the same name")
    add_repeated(parser, "--free", "PATH=LOW:HIGH", "a number that is fitted")
    about = "a column whose values separate experiments; a column with the name of a number's path has values of this number"
    add_repeated(parser, "--setting", "COLUMN", about)
    parser.add_argument("--start", metavar="s", type=float, help="time in the data at which the run begins [s]; default 0")
    parser.add_argument(
        "--starts", type=int, default=8, help="starting points of the search over the ranges; default 8; fewer are quicker"
    )
    parser.add_argument("--out", metavar="DIR", type=Path, default=Path("results"), help="folder of the figure; default results")


def _fit(options: argparse.Namespace, file: FileContent) -> int:
    """Fit numbers to data; write a figure, and the mechanism with the fitted numbers. A fit that ends at a timeout is exit 1."""
    if not options.signal:
        raise ValueError("--signal: none; write for instance --signal B.contact_force")
    if not options.free:
        raise ValueError("--free: none; write for instance --free links.coupler.body.imperfection=-1mm:1mm")
    free = dict(read_range(file.document, text) for text in options.free)
    out = make_folder(options.out / f"{options.file.stem}-fit")
    data = read_csv(options.data, options.signal, options.setting, options.start)
    found, exit_status = ask(mbs.fit, options, file.document, data, free=free, starts=options.starts)
    # TIME_ZERO shifts the data and is no number of the mechanism
    numbers = {name: value for name, value in found.values.items() if name != TIME_ZERO}
    mechanism = documents.write(documents.change(file.document, numbers), out / f"{options.file.stem}-fitted.toml")
    figure = out / "fit.png"
    found.plot().savefig(figure)
    if options.json:
        print(to_json({each: getattr(found, each) for each in ("values", "intervals", "units", "unidentified", "rms")}), end="")
    else:
        print(f"{found}\ndata beside the fit: {figure}\nmechanism with these numbers: {mechanism}")
    return exit_status or int(not found.complete)


def _declare_optimise(parser: argparse.ArgumentParser) -> None:
    add_repeated(parser, "--free", "PATH=LOW:HIGH", "a number that is chosen")
    add = parser.add_argument
    add("--minimise", metavar="READING", default="", help="as 'max(drive.torque)'")
    about = "as 'max(B.contact_force) = 1.5 N ± 1 %%' or 'max(abs(coupler.deflection)) <= 30 mm'"
    add_repeated(parser, "--subject-to", "CONSTRAINT", about, dest="wants")
    add("--starts", type=int, default=8, help="starting points of the search over the ranges; default 8; fewer are quicker")
    about = f"largest number of runs, after which the best so far is shown; default {BUDGET}"
    add("--budget", metavar="RUNS", type=int, default=BUDGET, help=about)
    add("--out", metavar="DIR", type=Path, default=Path("results"), help="folder of the new file; default results")


def _optimise(options: argparse.Namespace, file: FileContent) -> int:
    """Search the numbers of the best design; write the mechanism with them. A design that breaks a constraint is exit 1."""
    if not options.free:
        raise ValueError("--free: none; write for instance --free links.coupler.body.section.thickness=0.2mm:0.5mm")
    free = dict(read_range(file.document, text) for text in options.free)
    found, exit_status = ask(
        mbs.optimise, options, file.document, file.duration, free=free, minimise=options.minimise, subject_to=options.wants,
        starts=options.starts, budget=options.budget,
    )  # fmt: skip
    out = make_folder(options.out) / f"{options.file.stem}-chosen.toml"
    path = documents.write(documents.change(file.document, found.values), out)
    if options.json:
        print(to_json(asdict(found)), end="")
    else:
        print(found, f"mechanism with these numbers: {path}", sep="\n")
    return exit_status or int(not found.possible)


def _declare_ensemble(parser: argparse.ArgumentParser) -> None:
    add = parser.add_argument
    add("--members", type=int, default=1000, help="runs, of each combination of lists; default 1000")
    about = "a number that varies: uniform between LOW and HIGH, or PATH=A,B,C, a list; all combinations of lists are run"
    add_repeated(parser, "--vary", "PATH=LOW:HIGH", about)
    about = "a reading, as 'rms(B.normal_force)': max min mean rms end impulse share onsets of a signal; default the file's"
    add_repeated(parser, "--of", "READING", about)
    add("--each", metavar="s", help="window of the readings [s]; default a turn of the first drive")
    add("--skip", type=int, default=1, help="windows at the start that statistics leave out; default 1")
    add("--seed", type=int, default=1, help="seed of numbers and starts; default 1")
    add("--store", metavar="FILE", type=Path, help="file (.npz) of the finished runs; the same command continues from it")
    about = "folder of members.csv, histogram.png, map.png; default results"
    add("--out", metavar="DIR", type=Path, default=Path("results"), help=about)


def _ensemble(options: argparse.Namespace, file: FileContent) -> int:
    """Run an ensemble; print statistics of its readings, and write its members and figures."""
    readings = list(dict.fromkeys(options.of or file.measures))
    if not readings:
        raise ValueError("--of: no reading; write for instance --of 'rms(B.normal_force)'")
    out = make_folder(options.out / f"{options.file.stem}-ensemble")
    found, _ = ask(  # the exit status is not needed: `found.interrupted` says the same
        mbs.ensemble, options, file.mechanism, file.duration, options.members,
        vary=dict(_read_variation(file.document, text) for text in options.vary),
        of=readings, skip=options.skip, each=options.each and Quantity("s").read("--each", options.each), seed=options.seed,
        store=options.store,
    )  # fmt: skip
    print(found.message, file=sys.stderr)
    if (found.done & ~found.failed).any():
        _write(found, out)
        if options.json:
            print(to_json([_summary(found, reading) for reading in readings]), end="")
        else:
            print(f"{_table(found)}\nwritten to {out}")
    return INTERRUPTED if found.interrupted else int(found.timed_out or found.failed.any())


def _read_variation(document: Mapping[str, object], text: str) -> tuple[str, object]:
    """Read one `--vary`: the path of a number, and a list of values or a uniform distribution."""
    path, _, values = text.partition("=")
    if values and ":" not in values:
        return path, read_quantities(document, path, values.split(","), f"--vary {text}")
    path, (low, high) = read_range(document, text, "--vary")
    return path, uniform(low, high - low)


def _summary(found: Ensemble, reading: str) -> dict[str, Any]:
    """Return statistics of a reading; `cells` are means for each combination of the lists of `--vary`, the `grid`."""
    low, high = found.interval(reading)
    return {
        "reading": reading, "mean": found.mean(reading), "error": found.error(reading), "low": low, "high": high,
        "quantiles": found.quantiles(reading).tolist(), "members": int(found.done.sum()), "failed": int(found.failed.sum()),
        "cells": [cell._asdict() for cell in found.cells(reading)] if found.members.grid else [],
    }  # fmt: skip


def _table(found: Ensemble) -> str:
    """Tabulate means and quantiles of the readings, and the means of each combination of lists."""
    rows = []
    for each in (_summary(found, reading) for reading in found.readings):
        interval = f"{each['low']:.6g} to {each['high']:.6g}"
        rows.append([found.labels[each["reading"]], each["mean"], f"{each['error']:.2g}", interval, *each["quantiles"]])
    tables = [Table(("reading", "mean", "standard error", "95 % interval", "5 %", "50 %", "95 %"), rows)]
    if found.members.grid:
        by_combination = zip(*(found.cells(reading) for reading in found.readings), strict=True)  # each a cell for each reading
        lines = [[*cells[0].values.values(), *(f"{x.mean:.5g} ± {x.error:.2g}" for x in cells)] for cells in by_combination]
        tables.append(Table([found.labels[name] for name in (*found.members.grid, *found.readings)], lines))
    return "\n\n".join(map(str, tables))


def _write(found: Ensemble, out: Path) -> None:
    """Write members.csv, one line for each window of each member; histograms; and maps where two lists vary."""
    columns, readings = found.columns(), found.readings
    header = ",".join(f'"{name}"' if name in readings else name for name in columns)
    np.savetxt(out / "members.csv", np.column_stack([*columns.values()]), delimiter=",", header=header, comments="", fmt="%.10g")
    drawings: dict[str, Callable[..., object]] = {"histogram": found.histogram}
    if len(found.members.grid) == 2:
        x, y = found.members.grid
        drawings["map"] = partial(found.map, x, y)
    with house_style():
        for name, draw in drawings.items():
            fig, axes = subplots(len(readings), 1, height=15.0 + 55.0 * len(readings), squeeze=False)  # [mm]
            for reading, ax in zip(readings, axes[:, 0], strict=True):
                draw(reading, ax=ax)
            fig.savefig(out / f"{name}.png", dpi=150)


sensitivity = file_command(_declare_sensitivity, _sensitivity, has_json=True)
fit = file_command(_declare_fit, _fit, has_duration=False, has_json=True)
optimise = file_command(_declare_optimise, _optimise, has_json=True)
ensemble = file_command(_declare_ensemble, _ensemble, has_json=True)
