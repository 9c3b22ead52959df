"""`buckler ensemble FILE`: many runs of a file's mechanism with other numbers and other starts, and statistics of readings."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import uniform

from buckler.mbs.ensembles.ensemble import ensemble as run_ensemble
from buckler.mbs.ensembles.result import Ensemble
from buckler.mbs.geometry import Array
from buckler.mbs.units import parse_quantity

from ..kit.options import writable
from ..kit.report import Table
from ..kit.style import house_style, subplots
from ..kit.words import add_repeated
from .verbs import Opened, add_json, file_command, print_json, read_quantities

HEADS = ("reading", "mean", "standard error", "95 % interval", "5 %", "50 %", "95 %")
"""Columns of the printed table; the last three are quantiles over members and windows."""


def _declare(parser: argparse.ArgumentParser) -> None:
    add_json(parser)
    parser.add_argument("--members", type=int, default=1000, help="runs, of each combination of lists; default 1000")
    about = "a number that varies: uniform between LOW and HIGH, or PATH=A,B,C, a list all of whose combinations are run"
    add_repeated(parser, "--vary", "PATH=LOW:HIGH", about)
    about = "a reading, as 'rms(B.normal_force)': max min mean rms end impulse share onsets of a signal; default the file's"
    add_repeated(parser, "--of", "READING", about)
    parser.add_argument("--each", metavar="s", help="window of the readings [s]; default a turn of the first drive")
    parser.add_argument("--skip", type=int, default=1, help="windows at the start that statistics leave out; default 1")
    parser.add_argument("--seed", type=int, default=1, help="seed of numbers and starts; default 1")
    about = "file (.npz) that keeps what was run; the same command goes on from it"
    parser.add_argument("--store", metavar="FILE", type=Path, help=about)
    about = "folder of members.csv, histogram.png, map.png; default results"
    parser.add_argument("--out", metavar="DIR", type=Path, default=Path("results"), help=about)


def _answer(options: argparse.Namespace, file: Opened) -> int:
    readings = list(dict.fromkeys(options.of or file.measures))
    if not readings:
        raise ValueError("--of: no reading; write for instance --of 'rms(B.normal_force)'")
    out = writable(options.out / f"{options.file.stem}-ensemble")
    found = run_ensemble(
        file.mechanism, file.duration, options.members, vary=dict(_read_variation(file.document, text) for text in options.vary),
        of=readings, skip=options.skip, each=parse_quantity(options.each, "s") if options.each else None, seed=options.seed,
        store=options.store,
    )  # fmt: skip
    print(found.message, file=sys.stderr)
    if (found.done & ~found.failed).any():
        _write(found, out)
        if options.json:
            print_json([_summary(found, reading) for reading in readings])
        else:
            print(f"{_table(found)}\nwritten to {out}")
    return 130 if found.interrupted else int(found.failed.any())


def _read_variation(document: Mapping[str, object], text: str) -> tuple[str, object]:
    """Read PATH=LOW:HIGH, a uniform distribution, or PATH=A,B,C, a list."""
    path, _, values = text.partition("=")
    ends = values.split(":")
    if len(ends) > 2 or not values:
        raise ValueError(f"--vary {text}: write PATH=LOW:HIGH or PATH=A,B,C, as joints.B.gap=0.1mm:0.3mm")
    if len(ends) == 1:
        return path, read_quantities(document, path, values.split(","), f"--vary {text}")
    low, high = read_quantities(document, path, ends, f"--vary {text}")
    if not low < high:
        raise ValueError(f"--vary {text}: low must be less than high")
    return path, uniform(low, high - low)


def _summary(found: Ensemble, reading: str) -> dict[str, Any]:
    """Return the statistics of a reading, and its means by combination of lists."""
    low, high = found.interval(reading)
    return {
        "reading": reading, "mean": found.mean(reading), "error": found.error(reading), "low": low, "high": high,
        "quantiles": found.quantiles(reading).tolist(), "members": int(found.done.sum()), "failed": int(found.failed.sum()),
        "cells": [cell._asdict() for cell in found.cells(reading)] if found.members.grid else [],
    }  # fmt: skip


def _table(found: Ensemble) -> str:
    """Make the table: a row a reading; where lists are given, a further table a row a combination."""
    rows = []
    for each in map(lambda reading: _summary(found, reading), found.readings):
        quantiles = [f"{value:.4g}" for value in each["quantiles"]]
        interval = f"{each['low']:.6g} to {each['high']:.6g}"
        rows.append([each["reading"], f"{each['mean']:.6g}", f"{each['error']:.2g}", interval, *quantiles])
    tables = [str(Table(HEADS, rows))]
    if found.members.grid:
        means = [found.cells(reading) for reading in found.readings]
        lines = [
            [*(f"{value:g}" for value in cells[0].values.values()), *(f"{cell.mean:.5g} ± {cell.error:.2g}" for cell in cells)]
            for cells in zip(*means, strict=True)
        ]
        tables.append(str(Table([*found.members.grid, *found.readings], lines)))
    return "\n\n".join(tables)


def _write(found: Ensemble, out: Path) -> None:
    """Write a row a member and window, histograms, and maps where two lists are given."""
    paths, readings = found.members.paths, found.readings
    members, windows = found.values.shape[:2]
    columns: list[Array] = [np.repeat(np.arange(members), windows), np.tile(np.arange(windows), members)]
    columns += [np.repeat(column, windows) for column in found.members.numbers.T]
    columns += [found.values[..., k].ravel() for k in range(len(readings))]
    header = ",".join(["member", "window", *paths, *(f'"{reading}"' for reading in readings)])
    np.savetxt(out / "members.csv", np.column_stack(columns), delimiter=",", header=header, comments="", fmt="%.10g")
    lists: Sequence[str] = list(found.members.grid)
    with house_style():
        for name in ("histogram", "map") if len(lists) == 2 else ("histogram",):
            fig, axes = subplots(len(readings), 1, height=15.0 + 55.0 * len(readings), squeeze=False)
            for reading, ax in zip(readings, axes[:, 0], strict=True):
                found.histogram(reading, ax=ax) if name == "histogram" else found.map(lists[0], lists[1], reading, ax=ax)
            fig.savefig(out / f"{name}.png", dpi=150)


ensemble = file_command(_declare, _answer)
