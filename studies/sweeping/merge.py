"""Stores of the parts of a sweep put together into one: `sweep ... --part 2/8` in each job, then `merge`."""

from __future__ import annotations

import argparse
import json
import math
import sqlite3
from collections.abc import Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, NamedTuple

from buckler.studies.kit.words import Command
from buckler.studies.sweeping.export import reading
from buckler.studies.sweeping.store import Store, StoreError, explain

CLOSE = 1e-9
"""Relative difference up to which the same case computed twice has the same numbers."""
COLUMNS = ("number", "parameters", "status", "message", "metrics", "work", "wall_s", "provenance", "signals")


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
        with Store(out) as book, _all_or_nothing(book.connection, out):
            for path in parts:
                with reading(path) as part:
                    _same_sweep(book.connection, part, out, path)
                    for row in part.execute(f"SELECT {', '.join(COLUMNS)} FROM cases ORDER BY number"):
                        _take(book.connection, dict(zip(COLUMNS, row, strict=True)), path)
            return Merged(*book.connection.execute("SELECT count(*), count(status) FROM cases").fetchone())
    except BaseException:
        if new:
            out.unlink(missing_ok=True)
        raise


@contextmanager
def _all_or_nothing(connection: sqlite3.Connection, path: Path) -> Any:
    connection.execute("BEGIN")
    try:
        yield
        connection.execute("COMMIT")
    except sqlite3.Error as error:
        raise StoreError(explain(error, path)) from None
    finally:
        if connection.in_transaction:
            connection.execute("ROLLBACK")


def _about(connection: sqlite3.Connection) -> dict[str, Any]:
    return {name: json.loads(value) for name, value in connection.execute("SELECT name, value FROM about")}


def _same_sweep(book: sqlite3.Connection, part: sqlite3.Connection, out: Path, path: Path) -> None:
    """Refuse a part of another sweep; the first one says what the sweep is."""
    mine, theirs = _about(book), _about(part)
    if not mine:
        book.executemany("INSERT INTO about VALUES (?, ?)", [(name, json.dumps(value)) for name, value in theirs.items()])
        return
    for name, value in mine.items():
        if theirs.get(name) != value:
            raise StoreError(f"{path} is of another sweep than {out}: {name} {_told(theirs.get(name))}, not {_told(value)}")


def _told(value: Any) -> str:
    return ", ".join(f"{k} {v}" for k, v in value.items()) if isinstance(value, dict) else str(value)


def _take(book: sqlite3.Connection, row: dict[str, Any], path: Path) -> None:
    """Take a case over, unless it is there already."""
    found = book.execute("SELECT status, metrics FROM cases WHERE parameters = ?", (row["parameters"],)).fetchone()
    if found is None:
        book.execute(f"INSERT INTO cases ({', '.join(COLUMNS)}) VALUES ({', '.join('?' * len(COLUMNS))})", list(row.values()))
    elif found[0] is None:
        told = COLUMNS[2:]
        sets = ", ".join(f"{name} = ?" for name in told)
        book.execute(f"UPDATE cases SET {sets} WHERE parameters = ?", [*(row[name] for name in told), row["parameters"]])
    elif row["status"] is not None:
        difference = _difference(found, row)
        if difference:
            raise StoreError(f"{path} contradicts another part in case {row['number']}: {difference}; {row['parameters']}")


def _difference(found: tuple[str, str], row: dict[str, Any]) -> str:
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


def _declare(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("parts", metavar="FILE", nargs="+", type=Path, help="stores that `sweep ... --part I/N` has written")
    about = "where to; if it is there, it takes what it lacks"
    parser.add_argument("--out", metavar="FILE", type=Path, required=True, help=about)


def _merge(options: argparse.Namespace) -> int:
    """Put stores together and say what they hold."""
    found = merge(options.parts, options.out)
    left = f"; {found.cases - found.ended} have not ended" if found.cases > found.ended else ""
    print(f"{len(options.parts)} stores, {found.cases} cases, merged into {options.out}{left}")
    return 0


merging = Command(_declare, _merge)
