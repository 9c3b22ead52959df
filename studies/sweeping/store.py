"""One SQLite file a sweep: every case planned in it before the first runs, and each written down as it ends.

Table `cases` has a row a case: number, parameters (JSON, the key), status (NULL until it has ended), message, metrics
(JSON, each with unit and error), work (JSON), wall_s, provenance (JSON: versions, hash of the sources, host, time of
ending) and, if asked for, signals (npz). Table `about` says of what study, versions and units it is.

A store has one user at a time: SQLite's own exclusive lock, which the operating system drops if the process is killed.
Rows go through a write-ahead log: a killed process leaves all of them, a power cut may take those of the last seconds.
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Self

from ..kit.parameters import StudyParameters
from .rows import FIELDS, Row, canonical, packed, to_json, unpacked

APPLICATION, SCHEMA = 0x4275636B, 1  # SQLite keeps both in the header of the file
WAIT = 1.0
"""How long to wait, s, for another user of the file to be gone."""


ENDING = FIELDS[2:]
"""What becomes known of a case when it ends."""
UPSERT = "ON CONFLICT (parameters) DO UPDATE SET"


class StoreError(ValueError):
    """A store that cannot be used as asked, or written; the message says why in one line."""


@dataclass(frozen=True)
class About:
    """What all cases of a store share.

    Attributes
    ----------
    study : str
    versions : of Python, Buckler and the packages its numbers come from
    units : unit of each parameter, "" where it has none
    signals : whether the signals of each case are kept
    """

    study: str
    versions: Mapping[str, str | None]
    units: Mapping[str, str]
    signals: bool = False


class Store:
    """A sweep's file, open and locked; a context manager.

    Parameters
    ----------
    path : the file, made if it is not there; without it the rows are kept in memory
    write : whether it may change; a file that may not is only looked at, and must be there

    Raises
    ------
    StoreError
        If it is in use, no store, damaged, of another format, or cannot be written.
    """

    def __init__(self, path: Path | None = None, write: bool = True) -> None:
        self.path, self.write, place = path, write, ":memory:"
        if path is not None:
            if not write and not path.is_file():
                raise StoreError(f"{path}: no such file")
            # What a killed sweep left in its journal can be read only by someone who may write; a closed store has none.
            mode = "rwc" if write else "rw" if path.with_name(f"{path.name}-wal").exists() else "ro"
            place = f"{path.absolute().as_uri()}?mode={mode}"
        try:
            self.connection = sqlite3.connect(place, uri=True, timeout=WAIT, isolation_level=None)
        except sqlite3.Error as error:
            raise StoreError(explain(error, path)) from None
        try:
            if write:
                self._lock()
            self._check_format()
        except BaseException:
            self.connection.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *raised: object) -> None:
        self.close()

    def close(self) -> None:
        """Leave one plain file; a journal it could not fold in, on a full disk say, stays beside it and is kept."""
        with suppress(StoreError):
            if self.write:
                self.ask("PRAGMA journal_mode = DELETE")
        self.connection.close()

    def ask(self, statement: str, values: Sequence[Any] | Mapping[str, Any] = ()) -> list[tuple[Any, ...]]:
        """Rows of a statement; what SQLite raises names the file."""
        try:
            return self.connection.execute(statement, values).fetchall()
        except sqlite3.Error as error:
            raise StoreError(explain(error, self.path)) from None

    def _lock(self) -> None:
        self.ask("PRAGMA locking_mode = EXCLUSIVE")  # also spares the shared memory that network file systems lack
        self.ask("BEGIN EXCLUSIVE")
        self.ask("COMMIT")
        self.ask("PRAGMA journal_mode = WAL")
        self.ask("PRAGMA synchronous = NORMAL")

    def _check_format(self) -> None:
        """Make the tables of a new file; refuse what is no store, of another format, or damaged."""
        if self.write and not self.ask("SELECT * FROM sqlite_master"):
            with self.transaction():
                self.ask("CREATE TABLE about (name TEXT PRIMARY KEY, value TEXT NOT NULL)")
                self.ask(
                    "CREATE TABLE cases (number INTEGER NOT NULL, parameters TEXT PRIMARY KEY, status TEXT, message TEXT, "
                    "metrics TEXT, work TEXT, wall_s REAL, provenance TEXT, signals BLOB)"
                )
                self.ask(f"PRAGMA application_id = {APPLICATION}")
                self.ask(f"PRAGMA user_version = {SCHEMA}")
        ((application,),), ((schema,),) = (self.ask(f"PRAGMA {name}") for name in ("application_id", "user_version"))
        if application != APPLICATION:
            raise StoreError(f"{self.path} is an SQLite file, but no sweep's store")
        if schema != SCHEMA:
            raise StoreError(f"{self.path} has format {schema}, this version of Buckler reads and writes format {SCHEMA}")
        ((verdict,),) = self.ask("PRAGMA quick_check(1)")
        if verdict != "ok":
            raise StoreError(f"{self.path} is damaged: {verdict.splitlines()[-1]}")

    @contextmanager
    def transaction(self) -> Iterator[None]:
        """All of a block's statements, or none."""
        self.ask("BEGIN")
        try:
            yield
            self.ask("COMMIT")
        finally:
            if self.connection.in_transaction:  # SQLite itself rolls back on a full disk
                self.ask("ROLLBACK")

    def about(self) -> dict[str, Any]:
        """What its cases share, by the names of `About`."""
        return {name: json.loads(value) for name, value in self.ask("SELECT name, value FROM about")}

    def plan(self, about: About, cases: Sequence[StudyParameters], retry: bool = False) -> list[int]:
        """Write the cases down, unless they are; which of them are still to be run.

        Parameters
        ----------
        about : About
        cases : all of the sweep. A store may grow: what it holds must be among them.
        retry : whether cases that ended neither OK nor SUSPECT are to be run again

        Returns
        -------
        pending : numbers of the cases that have not ended

        Raises
        ------
        StoreError
            If the store holds cases of another sweep or version.
        """
        keys = [canonical(case) for case in cases]
        _no_doubles(keys)
        with self.transaction():
            self._compare(about)
            stored = {key for (key,) in self.ask("SELECT parameters FROM cases")}
            if not stored <= set(keys):
                raise StoreError(f"{self.path} holds another sweep, {_differs(stored, keys)}; name another with --store")
            for name, value in asdict(about).items():
                self.ask("INSERT OR REPLACE INTO about VALUES (?, ?)", (name, json.dumps(value)))
            for number, key in enumerate(keys):  # a store that grows, or was merged: every case may have another place now
                self.ask(f"INSERT INTO cases (number, parameters) VALUES (?, ?) {UPSERT} number = excluded.number", (number, key))
            if retry:
                self.ask("UPDATE cases SET status = NULL WHERE status NOT IN ('OK', 'SUSPECT')")
            return [n for (n,) in self.ask("SELECT number FROM cases WHERE status IS NULL ORDER BY number")]

    def _compare(self, about: About) -> None:
        """Refuse a store whose numbers came about in another way."""
        found = self.about()
        if not found:
            return
        if found["study"] != about.study:
            raise StoreError(f"{self.path} holds a sweep of {found['study']}, not of {about.study}; name another file")
        for name, version in about.versions.items():
            if found["versions"].get(name) != version:
                raise StoreError(
                    f"{self.path} was made with {name} {found['versions'].get(name)}, this is {version}; name another file"
                )
        if found["signals"] != about.signals:
            kept = "keeps" if found["signals"] else "does not keep"
            raise StoreError(
                f"{self.path} {kept} signals; name another file or {'add' if found['signals'] else 'drop'} --signals"
            )

    def record(self, row: Row) -> None:
        """Write down a case that has ended; it stays written if the process is killed right after."""
        values = dict(zip(FIELDS, packed(row), strict=True))
        sets = ", ".join(f"{name} = :{name}" for name in ENDING)
        self.ask(f"UPDATE cases SET {sets} WHERE number = :number AND status IS NULL", values)

    def take(self, values: Sequence[object]) -> None:
        """Take a case over from another store, unless it has ended here."""
        sets = ", ".join(f"{name} = excluded.{name}" for name in ENDING)
        places = ", ".join("?" for _ in FIELDS)
        self.ask(f"INSERT INTO cases ({', '.join(FIELDS)}) VALUES ({places}) {UPSERT} {sets} WHERE cases.status IS NULL", values)

    def rows(self, signals: bool = False) -> list[Row]:
        """Every case that has ended, in the order of the plan, with its signals only if asked for."""
        columns = ", ".join(name if signals or name != "signals" else "NULL" for name in FIELDS)
        return [unpacked(row) for row in self.ask(f"SELECT {columns} FROM cases WHERE status IS NOT NULL ORDER BY number")]

    def sources(self) -> set[str]:
        """Hashes of the sources the stored cases come from."""
        source = "json_extract(provenance, '$.sources')"
        return {each for (each,) in self.ask(f"SELECT DISTINCT {source} FROM cases WHERE status IS NOT NULL")}


def explain(error: sqlite3.Error, path: Path | None) -> str:
    """What SQLite's error means for someone with a sweep."""
    text = str(error)
    if "locked" in text:
        return f"{path} is in use: another sweep works on it; wait for its end, or name another file"
    if "not a database" in text:
        return f"{path} is no sweep's store: {text}"
    if "malformed" in text:
        return f"{path} is damaged: {text}"
    return f"cannot write {path}: {text}"


def _no_doubles(keys: Sequence[str]) -> None:
    places: dict[str, int] = {}
    for i, key in enumerate(keys):
        if key in places:
            raise ValueError(f"cases {places[key]} and {i} are the same: {key}")
        places[key] = i


def _differs(stored: Iterable[str], given: Iterable[str]) -> str:
    """The first parameter of which the stored cases have values that the given ones lack."""
    there, here = ([json.loads(key) for key in keys] for keys in (stored, given))
    for name in there[0]:
        lacking = {to_json(case[name]) for case in there} - {to_json(case.get(name)) for case in here}
        if lacking:
            return f"with {name} = {_some(lacking)}, which is not asked for now"
    return "the same values of each parameter in other combinations"


def _some(values: Iterable[str]) -> str:
    listed = sorted(values, key=lambda text: (len(text), text))
    return ", ".join(listed[:3]) + (", ..." if len(listed) > 3 else "")
