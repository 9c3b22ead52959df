"""Store of a sweep: it resumes and grows, refuses another sweep, and names any fault of the file or the disk."""

import math
import sqlite3
from dataclasses import replace

import numpy as np
import pytest
import sweep_toy
from sweep_runs import after, interrupt, run, same, stored
from sweep_toy import Parameters

from buckler.studies.kit.report import Metric
from buckler.studies.sweeping.store import About, Store, StoreError, read
from buckler.studies.sweeping.sweep import Row, SweepError, sweep

ABOUT = About("toy", {"python": "3.11", "exudyn": "1.13.6"}, {"length": "m", "order": ""})


def toys(*lengths, **shared):
    return [Parameters(length=length, **shared) for length in lengths]


@pytest.fixture
def path(tmp_path):
    return tmp_path / "s.sqlite"


@pytest.fixture
def ran(monkeypatch):
    """Lengths for which the toy study has run."""
    found = []
    monkeypatch.setattr(sweep_toy, "run", lambda p, progress, run=sweep_toy.run: found.append(p.length) or run(p))
    return found


def test_cases_that_have_ended_never_run_again(path, ran):
    with pytest.raises(KeyboardInterrupt):
        sweep(sweep_toy, toys(1, 2, 3, 4), store=path, progress=after(2, interrupt))
    assert ran == [1, 2]
    rows = sweep(sweep_toy, toys(1, 2, 3, 4), store=path)
    assert ran == [1, 2, 3, 4]
    assert same(rows) == same(sweep(sweep_toy, toys(1, 2, 3, 4)))


def test_failed_cases_have_ended_unless_retried(path, ran):
    cases = [Parameters(length=i, ending=ending) for i, ending in enumerate(("fine", "raises", "suspect", "fails"))]
    for _ in range(2):
        sweep(sweep_toy, cases, store=path)
    assert ran == [0, 1, 2, 3]
    rows = sweep(sweep_toy, cases, store=path, retry=True)
    assert ran == [0, 1, 2, 3, 1, 3]
    assert [row.status for row in rows] == ["OK", "ERROR", "SUSPECT", "TIMED_OUT"]


def test_values_come_back_as_they_were_and_are_written_once(path):
    metrics = {
        "tenth": Metric(0.1, "N", exact=1 / 3),
        "nan": Metric(math.nan, "1"),
        "zero": Metric(0.0, "N", absolute=6e-8),
        "infinite": Metric(-math.inf, "J", published=1e-300),
        "numpy": Metric(np.float64(2) / 3, "m"),
    }
    (case,) = toys(1)
    row = Row(0, case.plain(), "OK", "µ\n'\"", metrics, {"steps": np.int64(3), "rates": np.array([1.5, 2])}, 0.25, {"host": "a"})
    with Store(path) as store:
        store.plan(ABOUT, [case])
        store.record(row)
        store.record(replace(row, status="ERROR", message="came too late"))
    (found,), units = read(path)
    assert units == {"length": "m", "order": ""}
    assert repr(found.metrics) == repr(metrics | {"numpy": Metric(2 / 3, "m")})
    assert (found.status, found.message, found.wall_s, found.work) == ("OK", "µ\n'\"", 0.25, {"steps": 3, "rates": [1.5, 2]})
    assert found.parameters["models"] == ["strut"]
    with sqlite3.connect(path) as connection:  # the tables are documented: other programs may read them
        value = "json_extract(parameters, '$.length'), json_extract(result, '$.metrics.tenth.value')"
        assert connection.execute(f"SELECT {value} FROM cases WHERE status = 'OK'").fetchall() == [(1.0, 0.1)]
    connection.close()


@pytest.mark.parametrize(
    ("about", "cases", "message"),
    [
        (ABOUT._replace(study="other"), toys(1, 2), "holds a sweep of toy, not of other; name another file"),
        (ABOUT._replace(versions={"exudyn": "1.14"}), toys(1, 2), "was made with exudyn 1.13.6, this is 1.14; name another file"),
    ],
)
def test_a_store_of_another_sweep_is_refused_and_left_alone(path, about, cases, message):
    with Store(path) as store:
        store.plan(ABOUT, toys(1, 2))
        store.record(Row(0, toys(1)[0].plain(), "OK"))
    with Store(path) as store, pytest.raises(StoreError) as error:
        store.plan(about, cases)
    assert str(error.value) == f"{path} {message}"
    assert [row.number for row in read(path)[0]] == [0]


def test_foreign_and_damaged_files_are_refused(path):
    path.write_text("not a database at all, but of some length " * 30)
    with pytest.raises(StoreError, match="is no sweep's store: file is not a database"):
        Store(path)
    assert path.read_text().startswith("not a database")
    path.unlink()
    with sqlite3.connect(path) as connection:
        connection.execute("CREATE TABLE recipes (name TEXT)")
    connection.close()
    with pytest.raises(StoreError, match="is an SQLite file, but no sweep's store"):
        read(path)
    path.unlink()
    sweep(sweep_toy, toys(*range(8), noise=1), store=path)
    with path.open("r+b") as file:
        file.seek(path.stat().st_size // 2)
        file.write(bytes(range(256)) * (path.stat().st_size // 512))
    with pytest.raises(StoreError, match="is damaged"):
        read(path)


def test_a_second_sweep_on_the_file_is_refused(path):
    with Store(path) as store:
        store.plan(ABOUT, toys(1, 2))
        code, out, err = run("sweep", "toy", "--vary", "length=1,2", "--workers", "1", "--store", path, "--out", path.parent)
        assert (code, out) == (2, "")
        assert err == f"error: {path} is in use: another sweep works on it; wait for its end, or name another file\n"


def test_a_full_disk_stops_the_sweep_with_all_that_was_written(path, monkeypatch):
    """SQLite's own limit stands for the disk's."""
    cases, record = toys(*np.arange(200) / 100), Store.record

    def limited(store, row):
        if row.number == 0:
            pages = store.connection.execute("PRAGMA page_count").fetchone()[0]
            store.connection.execute(f"PRAGMA max_page_count = {pages + 4}")
        record(store, row)

    monkeypatch.setattr(Store, "record", limited)
    with pytest.raises(SweepError, match=r"cannot write .*s\.sqlite: database or disk is full"):
        sweep(sweep_toy, cases, store=path)
    monkeypatch.undo()
    kept, expected = stored(path), same(sweep(sweep_toy, cases))
    assert 10 < len(kept) < 200
    assert kept == expected[: len(kept)]
    assert same(sweep(sweep_toy, cases, store=path)) == expected
