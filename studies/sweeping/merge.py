"""Stores of the parts of a sweep put together into one: `sweep ... --part 2/8` in each job, then `merge`."""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

from buckler.studies.kit.words import Command
from buckler.studies.sweeping.rows import FIELDS
from buckler.studies.sweeping.store import Store, StoreError

CLOSE = 1e-9
"""Relative difference up to which the same case computed twice has the same numbers."""


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
