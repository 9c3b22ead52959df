"""SQLite file of a sweep: all cases are written to it before the first runs, and the result of each case when it ends.

Table `cases` has for each case: number, parameters (JSON, the key), status (NULL until it has ended) and result (JSON of message,
metrics, work, wall_s, provenance). Table `about` has study, versions and units. SQLite's exclusive lock admits one process at a
time; the system releases it when the process ends. SQLite's write-ahead log keeps all rows of a process that is killed.
"""

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
"""SQLite's `application_id` in the header of a store, by which it is recognised: "Buck" in ASCII."""
FORMAT = 2
"""Version of the tables, SQLite's `user_version`; version 1 had a column for each part of a result, and signals."""


@dataclass(frozen=True)
class Row:
    """Case that has ended: its number among the cases of the sweep, its parameters, and its result.

    The status is that of the study, ERROR after an exception, CRASHED if the process died. A SUSPECT case has ended, but a check
    doubts its numbers; all but OK and SUSPECT have failed.
    """

    number: int
    parameters: Mapping[str, Any]
    status: str
    message: str = ""
    metrics: Mapping[str, Metric] = field(default_factory=dict)
    work: Mapping[str, Any] = field(default_factory=dict)  # counts, such as steps
    wall_s: float = math.nan  # run time in the worker [s]
    provenance: Mapping[str, Any] = field(default_factory=dict)  # versions, hash of the source files, host, time of the end

    def value(self, metric: str) -> float:
        """Return the value of a metric, NaN if the case has no metric of that name."""
        return self.metrics[metric].value if metric in self.metrics else math.nan


def to_json(content: object) -> str:
    """Write strict JSON that keeps every float: NaN and infinities become strings."""
    return json.dumps(plain(content, convert=str), ensure_ascii=False, separators=(",", ":"), allow_nan=False)


class StoreError(ValueError):
    """Store that cannot be opened, used for this sweep, or written; the message says why in one line."""


class Part(NamedTuple):
    """Part I/N of the cases, with I = `number` and N = `of`: every N-th case, from the I-th on."""

    number: int
    of: int

    @classmethod
    def read(cls, text: str) -> Self:
        """Read a part from a text such as `2/8`."""
        number, _, of = text.partition("/")
        if not (number.isdigit() and of.isdigit() and 1 <= int(number) <= int(of)):
            raise ValueError(f"--part {text}: write I/N, such as 2/8 for the second of eight parts")
        return cls(int(number), int(of))

    def store(self, path: Path) -> Path:
        """Return the path of the store of this part, beside the store of the sweep."""
        return path.with_name(f"{path.stem}-part-{self.number}-of-{self.of}{path.suffix}")


class About(NamedTuple):
    """Study, versions of all packages and units of the parameters, which all cases of a store share."""

    study: str
    versions: Mapping[str, str | None]
    units: Mapping[str, str]


class Store:
    """File of a sweep, open and locked; a new file is created, and without a path rows are in memory only.

    A StoreError says that the file is in use, no store, damaged, of another format, or cannot be written.
    """

    def __init__(self, path: Path | None = None) -> None:
        self.path = path
        try:
            # waits up to 1 s for another process that uses the file
            self.connection = sqlite3.connect(path or ":memory:", timeout=1.0, isolation_level=None)
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
        """Merge the write-ahead log into the file and close it; on a full disk the log remains beside the file."""
        with suppress(StoreError):
            self.ask("PRAGMA journal_mode = DELETE")
        self.connection.close()

    def ask(self, statement: str, values: Sequence[Any] | Mapping[str, Any] = ()) -> list[tuple[Any, ...]]:
        """Execute an SQL statement and return its rows; a StoreError names the file."""
        try:
            return self.connection.execute(statement, values).fetchall()
        except sqlite3.Error as error:
            raise StoreError(_explain(error, self.path)) from None

    def _open(self) -> None:
        """Lock the file and create the tables of a new one; a StoreError for a damaged file or one that is no store."""
        self.ask("PRAGMA locking_mode = EXCLUSIVE")  # the log then needs no shared memory, which network file systems lack
        with self._transaction("EXCLUSIVE"):
            if not self.ask("SELECT * FROM sqlite_master"):
                self.ask("CREATE TABLE about (name TEXT PRIMARY KEY, value TEXT NOT NULL)")
                self.ask("CREATE TABLE cases (number INTEGER, parameters TEXT PRIMARY KEY, status TEXT, result TEXT)")
                self.ask(f"PRAGMA application_id = {APPLICATION}")
                self.ask(f"PRAGMA user_version = {FORMAT}")
        if self._pragma("application_id") != APPLICATION:
            raise StoreError(f"{self.path} is an SQLite file, but no sweep's store")
        if (version := self._pragma("user_version")) != FORMAT:
            raise StoreError(f"{self.path} has format {version}, this version of Buckler reads and writes format {FORMAT}")
        if (verdict := self._pragma("quick_check(1)")) != "ok":
            raise StoreError(f"{self.path} is damaged: {verdict.splitlines()[-1]}")
        self.ask("PRAGMA journal_mode = WAL")
        self.ask("PRAGMA synchronous = NORMAL")

    def _pragma(self, name: str) -> Any:
        return self.ask(f"PRAGMA {name}")[0][0]

    @contextmanager
    def _transaction(self, kind: str = "") -> Iterator[None]:
        self.ask(f"BEGIN {kind}")
        with self.connection:  # rolls back after an error
            yield
            self.ask("COMMIT")  # by `ask`, so that an error of it is a StoreError

    def about(self) -> dict[str, Any]:
        """Read the fields of `About`, by name."""
        return {name: json.loads(value) for name, value in self.ask("SELECT name, value FROM about")}

    def plan(self, about: About, cases: Sequence[StudyParameters], retry: bool = False) -> None:
        """Write to the file all cases that are not in it; with `retry` failed cases run again.

        The cases must include all that are stored; others may be added. A StoreError refuses another sweep or other versions.
        """
        keys: dict[str, int] = {}
        for number, case in enumerate(cases):
            text = to_json(case.plain())  # equal for equal parameters
            if text in keys:
                raise ValueError(f"case {keys[text]} is given twice: {text}")
            keys[text] = number
        with self._transaction():
            self._compare(about)
            if foreign := [key for (key,) in self.ask("SELECT parameters FROM cases") if key not in keys]:
                raise StoreError(f"{self.path} holds another sweep, {_difference(foreign[0], keys)}; name another with --store")
            for name, value in about._asdict().items():
                self.ask("INSERT OR REPLACE INTO about VALUES (?, ?)", (name, json.dumps(value)))
            insert = "INSERT INTO cases (number, parameters) VALUES (?, ?) ON CONFLICT (parameters) DO UPDATE SET number = ?"
            for key, number in keys.items():  # the number of a stored case changes where cases are added before it
                self.ask(insert, (number, key, number))
            if retry:
                self.ask("UPDATE cases SET status = NULL WHERE status NOT IN ('OK', 'SUSPECT')")

    def _compare(self, about: About) -> None:
        """Raise a StoreError if another study, or another version of a package in `about`, made the store."""
        found = self.about()
        if found and found["study"] != about.study:
            raise StoreError(f"{self.path} holds a sweep of {found['study']}, not of {about.study}; name another file")
        for name, version in about.versions.items() if found else ():
            if (old := found["versions"].get(name)) != version:
                raise StoreError(f"{self.path} was made with {name} {old}, this is {version}; name another file")

    def copy(self, path: Path, about: About) -> None:
        """Copy the results of cases of this sweep from the store of a part, an existing file; skip that of another study."""
        with Store(path) as part:
            if part.about().get("study") == about.study:
                part._compare(about)
                with self._transaction():
                    for row in part.rows():
                        self.record(row)

    def record(self, row: Row) -> None:
        """Write the result of a case, unless it has one; the row survives if the process is killed."""
        update = "UPDATE cases SET status = ?, result = ? WHERE parameters = ? AND status IS NULL"
        content = asdict(row)
        del content["number"]  # `plan` has written it
        key, status = to_json(content.pop("parameters")), content.pop("status")
        self.ask(update, (status, to_json(content), key))

    def rows(self) -> list[Row]:
        """Read all cases that have ended, in the order of the sweep."""
        rows = []
        for number, parameters, status, text in self.ask("SELECT * FROM cases WHERE status IS NOT NULL ORDER BY number"):
            content = json.loads(text)
            for name, each in content["metrics"].items():  # `to_json` writes nan and inf as texts, which `float` reads
                unit = each.pop("unit")
                numbers: Any = {key: x if x is None else float(x) for key, x in each.items()}
                content["metrics"][name] = Metric(unit=unit, **numbers)
            content["wall_s"] = float(content["wall_s"])
            rows.append(Row(number, json.loads(parameters), status, **content))
        return rows


def read(path: Path) -> tuple[list[Row], dict[str, str]]:
    """Read the rows of all cases in a store that have ended, and the units of the parameters."""
    if not path.is_file():
        raise StoreError(f"{path}: no such file")
    with Store(path) as store:
        return store.rows(), store.about().get("units", {})


def _explain(error: sqlite3.Error, path: Path | None) -> str:
    """Explain an error of SQLite in terms of the store."""
    text = str(error)
    if "locked" in text:
        return f"{path} is in use: another sweep works on it; wait for its end, or name another file"
    if "not a database" in text:
        return f"{path} is no sweep's store: {text}"
    return f"{path} is damaged: {text}" if "malformed" in text else f"cannot write {path}: {text}"


def _difference(foreign: str, keys: Iterable[str]) -> str:
    """Describe how a stored case differs from the cases of the sweep, both given as JSON of their parameters."""
    cases = [json.loads(key) for key in keys]
    for name, value in json.loads(foreign).items():
        if all(case.get(name) != value for case in cases):
            return f"with {name} = {value}, which is not asked for now"
    return "with the same values in other combinations"
