"""SQLite file of a sweep: all cases are in it before the first runs, and each result is written as it ends.

Table `cases` has for each case: number, parameters (JSON, the key), status (NULL until it has ended) and result (JSON of message,
metrics, work, wall_s, provenance). Table `about` names study, versions and units. A store has one user at a time, by SQLite's
exclusive lock, which the system drops with the process. Rows go through a write-ahead log: a killed process leaves all of them.
"""

from __future__ import annotations

import json
import math
import sqlite3
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, NamedTuple, Self

from ..kit.parameters import StudyParameters
from ..kit.report import Metric, plain

APPLICATION = 0x4275636B
"""Mark of a store in the header of its file, SQLite's `application_id`."""
FORMAT = 2
"""Version of the tables, SQLite's `user_version`; 1 had a column for each part of a result, and signals."""
WAIT = 1.0
"""Time to wait for another user of the file [s]."""


@dataclass(frozen=True)
class Row:
    """One case that has ended: its number in the plan, its parameters, and what `StudyResult` has.

    The status is the study's own, ERROR for an exception, CRASHED for a process that died. `wall_s` is the run time in its
    worker [s]; `provenance` has versions, hash of the sources, host and time of ending.
    """

    number: int
    parameters: Mapping[str, Any]
    status: str
    message: str = ""
    metrics: Mapping[str, Metric] = field(default_factory=dict)
    work: Mapping[str, Any] = field(default_factory=dict)
    wall_s: float = math.nan
    provenance: Mapping[str, Any] = field(default_factory=dict)

    def value(self, metric: str) -> float:
        """Return the value of a metric, NaN if the case has none of that name."""
        return self.metrics[metric].value if metric in self.metrics else math.nan


def to_json(content: object) -> str:
    """Write strict JSON that keeps every float: NaN and infinities become strings."""
    return json.dumps(plain(content, str), ensure_ascii=False, separators=(",", ":"), allow_nan=False)


class StoreError(ValueError):
    """A store that cannot be used as asked, or written; the message says why in one line."""


class Part(NamedTuple):
    """Share of the cases for one of several jobs: every `of`-th case, from the `number`-th on."""

    number: int
    of: int

    @classmethod
    def read(cls, text: str) -> Part:
        """Read `2/8`."""
        number, _, of = text.partition("/")
        if not (number.isdigit() and of.isdigit() and 1 <= int(number) <= int(of)):
            raise ValueError(f"--part {text}: write I/N, such as 2/8 for the second of eight parts")
        return cls(int(number), int(of))

    def store(self, whole: Path) -> Path:
        """Return the store of this part, in the folder of that of the whole sweep."""
        return whole.with_name(f"{whole.stem}-part-{self.number}-of-{self.of}{whole.suffix}")


class About(NamedTuple):
    """Study, versions of all packages and units of the parameters, which all cases of a store share."""

    study: str
    versions: Mapping[str, str | None]
    units: Mapping[str, str]


class Store:
    """File of a sweep, made if it is not there, open and locked; without a path rows stay in memory.

    A StoreError says that it is in use, no store, damaged, of another format, or cannot be written.
    """

    def __init__(self, path: Path | None = None) -> None:
        self.path = path
        try:
            self.connection = sqlite3.connect(path or ":memory:", timeout=WAIT, isolation_level=None)
        except sqlite3.Error as error:
            raise StoreError(_explain(error, path)) from None
        try:
            self._open()
        except BaseException:
            self.connection.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *raised: object) -> None:
        """Close the store, leaving one file; on a full disk also the journal."""
        with suppress(StoreError):
            self.ask("PRAGMA journal_mode = DELETE")
        self.connection.close()

    def ask(self, statement: str, values: Sequence[Any] | Mapping[str, Any] = ()) -> list[tuple[Any, ...]]:
        """Execute a statement; errors of SQLite name the file."""
        try:
            return self.connection.execute(statement, values).fetchall()
        except sqlite3.Error as error:
            raise StoreError(_explain(error, self.path)) from None

    def _open(self) -> None:
        """Lock the file, make the tables of a new one; a StoreError for a foreign or damaged one."""
        self.ask("PRAGMA locking_mode = EXCLUSIVE")  # also spares the shared memory that network file systems lack
        with self._transaction("EXCLUSIVE"):
            if not self.ask("SELECT * FROM sqlite_master"):
                self.ask("CREATE TABLE about (name TEXT PRIMARY KEY, value TEXT NOT NULL)")
                self.ask("CREATE TABLE cases (number INTEGER, parameters TEXT PRIMARY KEY, status TEXT, result TEXT)")
                self.ask(f"PRAGMA application_id = {APPLICATION}")
                self.ask(f"PRAGMA user_version = {FORMAT}")
        ((application,),), ((version,),) = (self.ask(f"PRAGMA {name}") for name in ("application_id", "user_version"))
        if application != APPLICATION:
            raise StoreError(f"{self.path} is an SQLite file, but no sweep's store")
        if version != FORMAT:
            raise StoreError(f"{self.path} has format {version}, this version of Buckler reads and writes format {FORMAT}")
        ((verdict,),) = self.ask("PRAGMA quick_check(1)")
        if verdict != "ok":
            raise StoreError(f"{self.path} is damaged: {verdict.splitlines()[-1]}")
        self.ask("PRAGMA journal_mode = WAL")
        self.ask("PRAGMA synchronous = NORMAL")

    @contextmanager
    def _transaction(self, kind: str = "") -> Iterator[None]:
        self.ask(f"BEGIN {kind}")
        with self.connection:  # rolls back what an error leaves open
            yield
            self.ask("COMMIT")

    def about(self) -> dict[str, Any]:
        """Read what its cases share, by the names of `About`."""
        return {name: json.loads(value) for name, value in self.ask("SELECT name, value FROM about")}

    def plan(self, about: About, cases: Sequence[StudyParameters], retry: bool = False) -> None:
        """Write all cases of a sweep to the file, unless they are there; with `retry` failed ones run again.

        A StoreError refuses cases of another sweep or version. Cases may be added; stored ones must be asked for.
        """
        texts = [to_json(case.plain()) for case in cases]  # equal for equal parameters however they were given
        keys = {text: number for number, text in enumerate(texts)}
        if first := [number for number, text in enumerate(texts) if keys[text] != number]:
            raise ValueError(f"case {first[0]} is given twice: {texts[first[0]]}")
        with self._transaction():
            self._compare(about)
            foreign = [key for (key,) in self.ask("SELECT parameters FROM cases") if key not in keys]
            if foreign:
                raise StoreError(f"{self.path} holds another sweep, {_difference(foreign[0], keys)}; name another with --store")
            for name, value in about._asdict().items():
                self.ask("INSERT OR REPLACE INTO about VALUES (?, ?)", (name, json.dumps(value)))
            insert = "INSERT INTO cases (number, parameters) VALUES (?, ?) ON CONFLICT (parameters) DO UPDATE SET number = ?"
            for key, number in keys.items():  # in a store that grows every case may have another number
                self.ask(insert, (number, key, number))
            if retry:
                self.ask("UPDATE cases SET status = NULL WHERE status NOT IN ('OK', 'SUSPECT')")

    def _compare(self, about: About) -> None:
        """Raise a StoreError if another study or other versions made the store."""
        found = self.about()
        if found and found["study"] != about.study:
            raise StoreError(f"{self.path} holds a sweep of {found['study']}, not of {about.study}; name another file")
        for name, version in about.versions.items() if found else ():
            if found["versions"].get(name) != version:
                was = found["versions"].get(name)
                raise StoreError(f"{self.path} was made with {name} {was}, this is {version}; name another file")

    def take(self, path: Path, about: About) -> None:
        """Copy the results of planned cases from another store of the same study, such as that of a part."""
        with Store(path) as part:
            if part.about().get("study") == about.study:
                part._compare(about)
                with self._transaction():
                    for row in part.rows():
                        self.record(row)

    def record(self, row: Row) -> None:
        """Write a case that has ended, unless it has; it stays written if the process is killed right after."""
        update = "UPDATE cases SET status = ?, result = ? WHERE parameters = ? AND status IS NULL"
        content = asdict(row)
        key, _ = to_json(content.pop("parameters")), content.pop("number")
        self.ask(update, (content.pop("status"), to_json(content), key))

    def rows(self) -> list[Row]:
        """Read every case that has ended, in the order of the plan."""
        rows = []
        for number, parameters, status, text in self.ask("SELECT * FROM cases WHERE status IS NOT NULL ORDER BY number"):
            content = json.loads(text)
            for name, each in content["metrics"].items():
                numbers: Any = {key: value if key == "unit" or value is None else float(value) for key, value in each.items()}
                content["metrics"][name] = Metric(**numbers)
            rows.append(Row(number, json.loads(parameters), status, **content | {"wall_s": float(content["wall_s"])}))
        return rows


def read(path: Path) -> tuple[list[Row], dict[str, str]]:
    """Read the rows of a store that have ended, and the units of the parameters."""
    if not path.is_file():
        raise StoreError(f"{path}: no such file")
    with Store(path) as book:
        return book.rows(), book.about().get("units", {})


def _explain(error: sqlite3.Error, path: Path | None) -> str:
    """Say what SQLite's error means for a sweep."""
    text = str(error)
    if "locked" in text:
        return f"{path} is in use: another sweep works on it; wait for its end, or name another file"
    if "not a database" in text:
        return f"{path} is no sweep's store: {text}"
    return f"{path} is damaged: {text}" if "malformed" in text else f"cannot write {path}: {text}"


def _difference(foreign: str, keys: Iterable[str]) -> str:
    asked = [json.loads(key) for key in keys]
    for name, value in json.loads(foreign).items():
        if all(case.get(name) != value for case in asked):
            return f"with {name} = {value}, which is not asked for now"
    return "with the same values in other combinations"
