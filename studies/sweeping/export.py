"""A sweep's store as a table for other programs: CSV with units in the headers, Parquet with units in the metadata."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from buckler.mbs.view.tables import Column, csv_of, parquet_of
from buckler.studies.kit.report import atomic
from buckler.studies.kit.words import Command
from buckler.studies.sweeping.rows import Row
from buckler.studies.sweeping.store import Store

KINDS = (".csv", ".parquet")


def read(path: Path) -> tuple[list[Row], dict[str, str]]:
    """Read a store without changing it.

    Returns
    -------
    rows : list of Row
        Every case that has ended, in the order of the plan.
    units : dict
        Of the parameters.

    Raises
    ------
    StoreError
        If it is not there, in use, damaged, or no store.
    """
    with Store(path, write=False) as store:
        return store.rows(), store.about().get("units", {})


def columns(rows: Sequence[Row], units: dict[str, str]) -> list[Column]:
    """Number, parameters, status, metrics each with its relative error, run time, provenance."""
    found = [Column("number", "", [row.number for row in rows])]
    found += [Column(name, units.get(name, ""), [_plain(row.parameters.get(name)) for row in rows]) for name in _names(rows)]
    found += [Column("status", "", [row.status for row in rows]), Column("message", "", [row.message for row in rows])]
    metrics = {name: metric.unit for row in rows for name, metric in row.metrics.items()}
    for name, unit in metrics.items():
        each = [row.metrics.get(name) for row in rows]
        found.append(Column(name, unit, [None if m is None else m.value for m in each]))
        if any(m is not None and m.error is not None for m in each):
            found.append(Column(f"{name} relative error", "1", [None if m is None else m.error for m in each]))
    found.append(Column("wall_s", "s", [row.wall_s for row in rows]))
    for name in ("ended", "host", "sources"):
        found.append(Column(name, "", [row.provenance.get(name) for row in rows]))
    packages = dict.fromkeys(name for row in rows for name in row.provenance.get("versions", {}))
    found += [Column(f"{name} version", "", [row.provenance.get("versions", {}).get(name) for row in rows]) for name in packages]
    return found


def _names(rows: Sequence[Row]) -> list[str]:
    return list(rows[0].parameters) if rows else []


def _plain(value: object) -> Any:
    """Several values in one cell, separated by commas."""
    return ",".join(map(str, value)) if isinstance(value, list) else value


def write(table: Sequence[Column], path: Path) -> None:
    """Write the table, whole or not at all.

    Raises
    ------
    ValueError
        If the name ends in neither .csv nor .parquet, or pyarrow is not there for the latter.
    OSError
        If it cannot be written.
    """
    if path.suffix not in KINDS:
        raise ValueError(f"--out {path}: the name must end in {' or '.join(KINDS)}")
    try:
        content = csv_of(table, ("", "1")) if path.suffix == ".csv" else parquet_of(table, "--out", {})
    except ImportError as error:
        raise ValueError(str(error)) from None
    with atomic(path) as file:
        file.write(content)


def write_signals(path: Path, folder: Path) -> int:
    """Write the signals a store keeps, case-000012.npz for case 12; how many there were."""
    folder.mkdir(parents=True, exist_ok=True)
    with Store(path, write=False) as store:
        kept = store.ask("SELECT number FROM cases WHERE signals IS NOT NULL")
        for (number,) in kept:
            ((content,),) = store.ask("SELECT signals FROM cases WHERE number = ?", (number,))
            with atomic(folder / f"case-{number:06d}.npz") as file:
                file.write(content)
    return len(kept)


# --- the command ------------------------------------------------------------------------------------------------------


def _declare(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("store", metavar="FILE", type=Path, help="a sweep's store")
    parser.add_argument("--out", metavar="FILE", type=Path, required=True, help="FILE.csv or FILE.parquet")
    parser.add_argument("--signals", metavar="DIR", type=Path, help="also write each case's signals there, as npz")


def _export(options: argparse.Namespace) -> int:
    """Write a store as a table; say what it holds."""
    rows, units = read(options.store)
    try:
        write(columns(rows, units), options.out)
        count = write_signals(options.store, options.signals) if options.signals else 0
    except OSError as error:
        print(f"cannot write {error.filename or options.out}: {error.strerror}", file=sys.stderr)
        return 1
    more = f", the signals of {count} to {options.signals}" if options.signals else ""
    print(f"{len(rows)} cases written to {options.out}{more}")
    return 0


export = Command(_declare, _export)
