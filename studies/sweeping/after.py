"""What is done with the stores of sweeps: written as tables for other programs, or those of the parts put together into one.

Tables are CSV with units in the headers. Parts are what `sweep ... --part 2/8` has
written in each job.
"""

from __future__ import annotations

import argparse
import csv
import io
import json
import math
import sys
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

from ..kit.report import atomic
from ..kit.words import Command
from .rows import FIELDS, Row
from .store import Store, StoreError

CLOSE = 1e-9
"""Relative difference up to which the same case computed twice has the same numbers."""


# --- tables ------------------------------------------------------------------------------------------------------------


class Column(NamedTuple):
    """One column of a table; None where a row has no such value."""

    name: str
    unit: str
    values: Sequence[object]


def csv_of(columns: Sequence[Column]) -> bytes:
    """Write columns as CSV, units in the headers. Numbers keep every bit."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(column.name if column.unit in ("", "1") else f"{column.name} [{column.unit}]" for column in columns)
    writer.writerows(zip(*(column.values for column in columns), strict=True))
    return text.getvalue().encode()


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
    names = list(rows[0].parameters) if rows else []
    found = [Column("number", "", [row.number for row in rows])]
    found += [Column(name, units.get(name, ""), [_plain(row.parameters.get(name)) for row in rows]) for name in names]
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


def _plain(value: object) -> Any:
    """Several values in one cell, separated by commas."""
    return ",".join(map(str, value)) if isinstance(value, list) else value


def write(table: Sequence[Column], path: Path) -> None:
    """Write the table, whole or not at all.

    Raises
    ------
    ValueError
        If the name does not end in .csv.
    OSError
        If it cannot be written.
    """
    if path.suffix != ".csv":
        raise ValueError(f"--out {path}: the name must end in .csv")
    content = csv_of(table)
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


# --- parts -------------------------------------------------------------------------------------------------------------


class Merged(NamedTuple):
    """What a merged store holds."""

    cases: int
    ended: int


def merge(parts: Sequence[Path], out: Path) -> Merged:
    """Put the cases of several stores into one.

    Parameters
    ----------
    parts : sequence of Path
        Stores of one sweep: same study, versions, units; signals kept in all or in none.
    out : Path
        Where to, its folder made if need be; a store that is there already stays and takes what it lacks.

    Returns
    -------
    Merged

    Raises
    ------
    StoreError
        If a part is of another sweep, or two have ended the same case with another status or other numbers; `out` is then as it
        was.
    """
    new = not out.exists()
    with suppress(OSError):  # opening the store then says why not
        out.parent.mkdir(parents=True, exist_ok=True)
    try:
        with Store(out) as book, book.transaction():
            for path in parts:
                with Store(path, write=False) as part:
                    _same_sweep(book, part)
                    for row in part.ask(f"SELECT {', '.join(FIELDS)} FROM cases ORDER BY number"):
                        _refuse_contradiction(book, dict(zip(FIELDS, row, strict=True)), path)
                        book.take(row)
            return Merged(*book.ask("SELECT count(*), count(status) FROM cases")[0])
    except BaseException:
        if new:
            out.unlink(missing_ok=True)
        raise


def _same_sweep(book: Store, part: Store) -> None:
    """Refuse a part of another sweep; the first one says what the sweep is."""
    mine, theirs = book.about(), part.about()
    for name, value in theirs.items() if not mine else ():
        book.ask("INSERT INTO about VALUES (?, ?)", (name, json.dumps(value)))
    for name, value in mine.items():
        if theirs.get(name) != value:
            said = f"{name} {_told(theirs.get(name))}, not {_told(value)}"
            raise StoreError(f"{part.path} is of another sweep than {book.path}: {said}")


def _told(value: object) -> str:
    return ", ".join(f"{k} {v}" for k, v in value.items()) if isinstance(value, dict) else str(value)


def _refuse_contradiction(book: Store, row: Mapping[str, object], path: Path) -> None:
    """Refuse a case that has ended in both, and not alike."""
    for found in book.ask("SELECT status, metrics FROM cases WHERE parameters = ?", (row["parameters"],)):
        difference = None in (found[0], row["status"]) or _difference(found, row)
        if isinstance(difference, str) and difference:
            raise StoreError(f"{path} contradicts another part in case {row['number']}: {difference}; {row['parameters']}")


def _difference(found: Sequence[str], row: Mapping[str, Any]) -> str:
    """What tells two endings of one case apart; '' if nothing does."""
    if found[0] != row["status"]:
        return f"{row['status']}, elsewhere {found[0]}"
    mine, theirs = json.loads(found[1]), json.loads(row["metrics"])
    for name in {**mine, **theirs}:
        if name not in mine or name not in theirs:
            return f"{name} in one of them only"
        a, b = float(mine[name]["value"]), float(theirs[name]["value"])
        if not (math.isclose(a, b, rel_tol=CLOSE) or (math.isnan(a) and math.isnan(b))):
            return f"{name} = {b:.12g}, elsewhere {a:.12g}"
    return ""


# --- the commands ------------------------------------------------------------------------------------------------------


def _declare_export(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("store", metavar="FILE", type=Path, help="a sweep's store")
    parser.add_argument("--out", metavar="FILE", type=Path, required=True, help="FILE.csv")
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


def _declare_merge(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("parts", metavar="FILE", nargs="+", type=Path, help="stores that `sweep ... --part I/N` has written")
    about = "where to; if it is there, it takes what it lacks"
    parser.add_argument("--out", metavar="FILE", type=Path, required=True, help=about)


def _merge(options: argparse.Namespace) -> int:
    """Put stores together and say what they hold."""
    found = merge(options.parts, options.out)
    left = f"; {found.cases - found.ended} have not ended" if found.cases > found.ended else ""
    print(f"{len(options.parts)} stores, {found.cases} cases, merged into {options.out}{left}")
    return 0


export, merging = Command(_declare_export, _export), Command(_declare_merge, _merge)
