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
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from types import TracebackType
from typing import Self

from buckler.studies.kit.parameters import StudyParameters
from buckler.studies.sweeping.rows import Row, canonical, read_rows, to_json

APPLICATION, SCHEMA = 0x4275636B, 1  # SQLite keeps both in the header of the file
WAIT = 1.0
"""How long to wait, s, for another user of the file to be gone."""


class StoreError(ValueError):
    """A store that cannot be used as asked, or written; the message says why in one line."""


@dataclass(frozen=True)
class About:
    """What all cases of a store share.

    Attributes
    ----------
    study : str
    versions : dict
        Of Python, Buckler and the packages its numbers come from.
    units : dict
        Unit of each parameter, "" where it has none.
    signals : bool
        Whether the signals of each case are kept.
    """

    study: str
    versions: Mapping[str, str | None]
    units: Mapping[str, str]
    signals: bool = False


class Store:
    """A sweep's file, open and locked; a context manager.

    Parameters
    ----------
    path : Path, optional
        The file, made if it is not there; without it the rows are kept in memory.

    Raises
    ------
    StoreError
        If it is in use, no store, damaged, of another format, or cannot be written.
    """

    def __init__(self, path: Path | None = None) -> None:
        self.path = path
        with self._named():
            self.connection = sqlite3.connect(":memory:" if path is None else path, timeout=WAIT, isolation_level=None)
        try:
            with self._named():
                self._lock()
                self._check_format()
        except BaseException:
            self.connection.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Leave one plain file; a journal it could not fold in, on a full disk say, stays beside it and is kept."""
        try:
            self.connection.execute("PRAGMA journal_mode = DELETE")
        except sqlite3.Error:
            pass
        self.connection.close()

    def _lock(self) -> None:
        execute = self.connection.execute
        execute("PRAGMA locking_mode = EXCLUSIVE")  # also spares the shared memory that network file systems lack
        execute("BEGIN EXCLUSIVE")
        execute("COMMIT")
        execute("PRAGMA journal_mode = WAL")
        execute("PRAGMA synchronous = NORMAL")

    def _check_format(self) -> None:
        execute = self.connection.execute
        if not execute("SELECT count(*) FROM sqlite_master").fetchone()[0]:
            with self._transaction():
                execute("CREATE TABLE about (name TEXT PRIMARY KEY, value TEXT NOT NULL)")
                execute(
                    "CREATE TABLE cases (number INTEGER NOT NULL, parameters TEXT PRIMARY KEY, status TEXT, message TEXT, "
                    "metrics TEXT, work TEXT, wall_s REAL, provenance TEXT, signals BLOB)"
                )
                execute(f"PRAGMA application_id = {APPLICATION}")
                execute(f"PRAGMA user_version = {SCHEMA}")
            return
        check_format(self.connection, self.path)

    @contextmanager
    def _named(self) -> Iterator[None]:
        """Turn what SQLite raises into a StoreError that names the file."""
        try:
            yield
        except sqlite3.Error as error:
            raise StoreError(explain(error, self.path)) from None

    @contextmanager
    def _transaction(self) -> Iterator[None]:
        self.connection.execute("BEGIN")
        try:
            yield
        except BaseException:
            if self.connection.in_transaction:  # SQLite itself rolls back on a full disk
                self.connection.execute("ROLLBACK")
            raise
        self.connection.execute("COMMIT")

    def plan(self, about: About, cases: Sequence[StudyParameters], retry: bool = False) -> list[int]:
        """Write the cases down, unless they are; which of them are still to be run.

        Parameters
        ----------
        about : About
        cases : sequence of StudyParameters
            All of the sweep. A store may grow: what it holds must be among them.
        retry : bool
            Whether cases that ended neither OK nor SUSPECT are to be run again.

        Returns
        -------
        pending : list of int
            Numbers of the cases that have not ended.

        Raises
        ------
        StoreError
            If the store holds cases of another sweep or version.
        """
        keys = [canonical(case) for case in cases]
        _no_doubles(keys)
        with self._named(), self._transaction():
            execute, many = self.connection.execute, self.connection.executemany
            self._compare(about)
            stored = {key for (key,) in execute("SELECT parameters FROM cases")}
            if not stored <= set(keys):
                raise StoreError(f"{self.path} holds another sweep, {_differs(stored, keys)}; name another file")
            many("INSERT OR REPLACE INTO about VALUES (?, ?)", [(k, json.dumps(v)) for k, v in asdict(about).items()])
            new = [(i, key) for i, key in enumerate(keys) if key not in stored]
            if stored:  # it grows, or was merged: every case may have another place now
                many("UPDATE cases SET number = ? WHERE parameters = ?", list(enumerate(keys)))
            many("INSERT INTO cases (number, parameters) VALUES (?, ?)", new)
            if retry:
                execute("UPDATE cases SET status = NULL WHERE status NOT IN ('OK', 'SUSPECT')")
            return [n for (n,) in execute("SELECT number FROM cases WHERE status IS NULL ORDER BY number")]

    def _compare(self, about: About) -> None:
        """Refuse a store whose numbers came about in another way."""
        found = {name: json.loads(value) for name, value in self.connection.execute("SELECT name, value FROM about")}
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
        metrics = {name: asdict(metric) for name, metric in row.metrics.items()}
        told = [row.status, row.message, *map(to_json, (metrics, row.work)), row.wall_s, to_json(row.provenance), row.signals]
        with self._named():
            self.connection.execute(
                "UPDATE cases SET status = ?, message = ?, metrics = ?, work = ?, wall_s = ?, provenance = ?, signals = ? "
                "WHERE number = ? AND status IS NULL",
                [*told, row.number],
            )

    def rows(self, signals: bool = False) -> list[Row]:
        """Every case that has ended, in the order of the plan, with its signals only if asked for."""
        with self._named():
            return list(read_rows(self.connection, signals))

    def sources(self) -> set[str]:
        """Hashes of the sources the stored cases come from."""
        with self._named():
            found = self.connection.execute(
                "SELECT DISTINCT json_extract(provenance, '$.sources') FROM cases WHERE status IS NOT NULL"
            )
            return {source for (source,) in found}


def check_format(connection: sqlite3.Connection, path: Path | None) -> None:
    """Refuse what is no store, of another format, or damaged."""
    (application,), (schema,) = (connection.execute(f"PRAGMA {name}").fetchone() for name in ("application_id", "user_version"))
    if application != APPLICATION:
        raise StoreError(f"{path} is an SQLite file, but no sweep's store")
    if schema != SCHEMA:
        raise StoreError(f"{path} has format {schema}, this version of Buckler reads and writes format {SCHEMA}")
    (verdict,) = connection.execute("PRAGMA quick_check(1)").fetchone()
    if verdict != "ok":
        raise StoreError(f"{path} is damaged: {verdict.splitlines()[-1]}")


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
