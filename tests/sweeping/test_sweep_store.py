"""The sweep's file: resumes, grows, refuses what is not its own, and says what is wrong with it."""

import csv
import io
import json
import math
import os
import resource
import shutil
import sqlite3
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import sweep_toy
from sweep_runs import run, same, stored
from sweep_toy import Parameters

from buckler.studies.kit.report import Metric
from buckler.studies.sweeping import after
from buckler.studies.sweeping.store import About, Store, StoreError
from buckler.studies.sweeping.sweep import Row, SweepError, sweep

ABOUT = About("toy", {"python": "3.11", "exudyn": "1.13.6"}, {"length": "m", "order": ""})


def toys(*lengths, **shared):
    return [Parameters(length=length, **shared) for length in lengths]


@pytest.fixture
def path(tmp_path):
    return tmp_path / "s.sqlite"


@pytest.fixture
def counted(monkeypatch):
    """Lengths the toy study has been run for."""
    found = []
    monkeypatch.setattr(sweep_toy, "run", lambda p, run=sweep_toy.run: found.append(p.length) or run(p))
    return found


def go(path, cases, **options):
    return sweep(sweep_toy, cases, workers=0, store=path, **options)


# --- resuming -----------------------------------------------------------------------------------------------------------


def test_what_has_ended_is_never_computed_again(path, counted):
    class Ends:
        def __call__(self, items, total=None, label=""):
            for i, item in enumerate(items):
                yield item
                if i == 1:
                    raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        go(path, toys(1, 2, 3, 4), progress=Ends())
    assert counted == [1, 2]
    rows = go(path, toys(1, 2, 3, 4))
    assert counted == [1, 2, 3, 4]
    assert same(rows) == same(sweep(sweep_toy, toys(1, 2, 3, 4), workers=0))
    counted.clear()
    assert same(go(path, toys(1, 2, 3, 4))) == same(rows)
    assert counted == []


def test_a_store_grows_to_more_cases_in_the_new_order(path, counted):
    go(path, toys(2, 4))
    rows = go(path, toys(1, 2, 3, 4))
    assert counted == [2, 4, 1, 3]
    assert [(row.number, row.parameters["length"]) for row in rows] == [(0, 1), (1, 2), (2, 3), (3, 4)]


def test_failed_cases_have_ended_unless_retried(path, counted):
    cases = [Parameters(length=i, ending=ending) for i, ending in enumerate(("fine", "raises", "suspect", "fails"))]
    go(path, cases)
    go(path, cases)
    assert counted == [0, 1, 2, 3]
    rows = go(path, cases, retry=True)
    assert counted == [0, 1, 2, 3, 1, 3]
    assert [row.status for row in rows] == ["OK", "ERROR", "SUSPECT", "TIMED_OUT"]


def test_parameters_are_the_same_however_they_are_written(path, counted):
    go(path, [Parameters(length=0.3, models="strut")])
    go(path, [Parameters(length="300mm", models=["strut"])])
    assert counted == [0.3]


def test_every_value_comes_back_as_it_was(path):
    metrics = {
        "tenth": Metric(0.1, "N", exact=1 / 3),
        "nan": Metric(math.nan, "1"),
        "infinite": Metric(-math.inf, "J", published=1e-300),
        "numpy": Metric(np.float64(2) / 3, "m"),
    }
    with Store(path) as store:
        store.plan(ABOUT, toys(1))
        store.record(
            Row(0, {}, "OK", "µ\n'\"", metrics, {"steps": np.int64(3), "rates": np.array([1.5, 2])}, 0.25, {"host": "a"})
        )
    with Store(path) as store:
        assert store.plan(ABOUT, toys(1)) == []
        (row,) = store.rows()
    assert repr(row.metrics) == repr(metrics | {"numpy": Metric(2 / 3, "m")})
    assert (row.message, row.wall_s) == ("µ\n'\"", 0.25)
    assert row.work == {"steps": 3, "rates": [1.5, 2]}
    assert row.parameters["models"] == ["strut"]


def test_a_case_is_writtenonce(path):
    with Store(path) as store:
        store.plan(ABOUT, toys(1))
        store.record(Row(0, {}, "OK"))
        store.record(Row(0, {}, "ERROR", "came too late"))
        assert [row.status for row in store.rows()] == ["OK"]


# --- refusing -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("about", "cases", "message"),
    [
        (replace(ABOUT, study="other"), toys(1, 2), "holds a sweep of toy, not of other; name another file"),
        (
            replace(ABOUT, versions=ABOUT.versions | {"exudyn": "1.14"}),
            toys(1, 2),
            "was made with exudyn 1.13.6, this is 1.14; name another file",
        ),
        (replace(ABOUT, signals=True), toys(1, 2), "does not keep signals; name another file or drop --signals"),
        (
            ABOUT,
            toys(1, 2, speed=2),
            "holds another sweep, with speed = 1.0, which is not asked for now; name another with --store",
        ),
        (ABOUT, toys(1, 3), "holds another sweep, with length = 2.0, which is not asked for now; name another with --store"),
    ],
)
def test_a_store_of_something_else_is_refused_and_left_alone(path, about, cases, message):
    with Store(path) as store:
        store.plan(ABOUT, toys(1, 2))
        store.record(Row(0, {}, "OK"))
    before = path.read_bytes()
    with Store(path) as store, pytest.raises(StoreError) as error:
        store.plan(about, cases)
    assert str(error.value) == f"{path} {message}"
    after = path.read_bytes()
    with Store(path) as store:
        assert store.plan(ABOUT, toys(1, 2)) == [1]
    assert len(before) == len(after)


def test_a_store_of_another_format_is_refused(path):
    Store(path).close()
    with sqlite3.connect(path) as connection:
        connection.execute("PRAGMA user_version = 7")
    connection.close()
    with pytest.raises(StoreError, match="has format 7, this version of Buckler reads and writes format 1"):
        Store(path)


def test_other_files_are_refused_untouched(path):
    path.write_text("not a database at all, but of some length " * 30)
    text = path.read_text()
    with pytest.raises(StoreError, match="is no sweep's store: file is not a database"):
        Store(path)
    assert path.read_text() == text
    path.unlink()
    with sqlite3.connect(path) as connection:
        connection.execute("CREATE TABLE recipes (name TEXT)")
    connection.close()
    for use in (Store, after.read):
        with pytest.raises(StoreError, match="is an SQLite file, but no sweep's store"):
            use(path)


def test_a_damaged_store_is_refused_by_sweep_and_export(path):
    go(path, toys(*range(8), noise=1))
    size = path.stat().st_size
    with path.open("r+b") as file:
        file.seek(size // 2)
        file.write(bytes(range(256)) * (size // 512))
    for use in (Store, after.read):
        with pytest.raises(StoreError, match="is damaged"):
            use(path)


def test_two_sweeps_on_one_file_are_refused_clearly(path):
    """Between processes, where it happens: the second one is told, and nothing of the first one's is touched."""
    words = ["sweep", "toy", "--vary", "length=1,2,3", "--workers", "1", "--store", path, "--out", path.parent]
    with Store(path) as store:
        store.plan(ABOUT, toys(1, 2))
        store.record(Row(0, {}, "OK"))
        for command in (words, ["export", path, "--out", path.with_suffix(".csv")]):
            code, out, err = run(*command)
            assert (code, out) == (2, "")
            assert err == f"error: {path} is in use: another sweep works on it; wait for its end, or name another file\n"
        assert not path.with_suffix(".csv").exists()
        store.record(Row(1, {}, "OK"))
    assert [row.number for row in after.read(path)[0]] == [0, 1]


# --- disks --------------------------------------------------------------------------------------------------------------


def test_a_full_disk_stops_the_sweep_with_all_that_was_written(path, monkeypatch):
    """SQLite's own limit stands for the disk's."""
    cases = toys(*np.arange(200) / 100)
    record = Store.record

    def limited(store, row):
        if row.number == 0:
            pages = store.connection.execute("PRAGMA page_count").fetchone()[0]
            store.connection.execute(f"PRAGMA max_page_count = {pages + 4}")
        record(store, row)

    monkeypatch.setattr(Store, "record", limited)
    with pytest.raises(SweepError, match=r"cannot write .*s\.sqlite: database or disk is full"):
        go(path, cases)
    monkeypatch.undo()
    kept = stored(path)
    assert 10 < len(kept) < 200
    expected = same(sweep(sweep_toy, cases, workers=0))
    assert kept == expected[: len(kept)]
    assert same(go(path, cases)) == expected


def test_a_file_that_may_not_grow_further_says_so_and_is_resumed(path):
    """The whole command under a limit of the file size, as a quota sets it."""
    words = ["sweep", "toy", "--vary", "length=0:1:60", "--signals", "--workers", "1", "--store", path, "--out", path.parent]
    code, out, err = run(*words, preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (120_000, 120_000)))
    assert (code, out) == (1, "")
    assert f"toy: cannot write {path}: " in err
    assert "the same command resumes:" in err
    assert "Traceback" not in err
    kept = stored(path)
    assert 0 < len(kept) < 60
    assert run(*words)[0] == 0
    resumed = stored(path)
    assert all(row in resumed for row in kept)  # a case whose writing failed may come before one that was kept
    assert len(resumed) == 60


@pytest.fixture
def forbidden():
    """A folder in which this process may only read; root would be let through, so it steps back for a while."""
    folder = Path(tempfile.mkdtemp())
    folder.chmod(0o755)
    yield folder
    if os.geteuid() != os.getuid():
        os.seteuid(os.getuid())
    shutil.rmtree(folder)


def test_a_store_that_cannot_be_written_says_so_but_can_be_exported(forbidden):
    path = forbidden / "s.sqlite"
    rows = go(path, toys(1, 2))
    path.chmod(0o444)
    if os.getuid() == 0:
        os.seteuid(65534)
    else:
        forbidden.chmod(0o555)
    with pytest.raises(StoreError, match=r"cannot write .*: attempt to write a readonly database"):
        go(path, toys(1, 2, 3))
    with pytest.raises(StoreError, match=r"cannot write .*: unable to open database file"):
        go(forbidden / "new.sqlite", toys(1))
    assert same(after.read(path)[0]) == same(rows)


# --- export -------------------------------------------------------------------------------------------------------------


@pytest.fixture
def mixed(path):
    """A store with two models, a failure and something that is no number."""
    cases = [*toys(1, 6, models=("strut", "beam")), *toys(2, ending="raises"), *toys(3, models="beam")]
    return path, go(path, cases, signals=True)


def test_csv_has_units_in_its_headers_and_every_digit(mixed):
    path, rows = mixed
    out = path.with_suffix(".csv")
    after.write(after.columns(*after.read(path)), out)
    lines = list(csv.DictReader(io.StringIO(out.read_text())))
    assert [float(line["length [m]"]) for line in lines] == [1, 6, 2, 3]
    assert [line["models"] for line in lines] == ["strut,beam", "strut,beam", "strut", "beam"]
    assert [line["strut.force [N]"] for line in lines] == ["11.0", "61.0", "", ""]
    assert [line["beam.time [s]"] for line in lines] == ["0.5", "nan", "", "0.25"]
    assert [line["status"] for line in lines] == ["OK", "OK", "ERROR", "OK"]
    assert [line["strut.force relative error"] for line in lines] == ["0.0", "0.0", "", ""]
    assert [float(line["wall_s [s]"]) for line in lines] == [row.wall_s for row in rows]
    assert {line["numpy version"] for line in lines} == {np.__version__}


def test_signals_of_each_case_come_out_as_they_were(mixed, tmp_path):
    path, _ = mixed
    assert after.write_signals(path, tmp_path / "signals") == 3
    assert sorted(p.name for p in (tmp_path / "signals").iterdir()) == [f"case-00000{i}.npz" for i in (0, 1, 3)]
    with np.load(tmp_path / "signals" / "case-000001.npz") as signals:
        assert set(signals) == {"time", "force"}
        assert signals["force"].tolist() == [0, 6, 12, 18, 24]


def test_export_as_a_command(mixed, tmp_path):
    path, _ = mixed
    out = tmp_path / "out.csv"
    code, said, err = run("export", path, "--out", out, "--signals", tmp_path / "npz")
    assert (code, err) == (0, "")
    assert said == f"4 cases written to {out}, the signals of 3 to {tmp_path / 'npz'}\n"
    for words, message in [
        ((tmp_path / "none.sqlite", "--out", out), f"error: {tmp_path / 'none.sqlite'}: no such file\n"),
        ((path, "--out", tmp_path / "out.xls"), f"error: --out {tmp_path / 'out.xls'}: the name must end in .csv\n"),
    ]:
        code, said, err = run("export", *words)
        assert (code, said, err) == (2, "", message)


def test_sql_reads_the_store_without_buckler(mixed):
    """The layout is promised: other programs may rely on it."""
    path, _ = mixed
    with sqlite3.connect(path) as connection:
        found = connection.execute(
            "SELECT json_extract(parameters, '$.length'), json_extract(metrics, '$.\"beam.force\".value') FROM cases "
            "WHERE status = 'OK' ORDER BY number"
        ).fetchall()
        about = dict(connection.execute("SELECT name, value FROM about"))
    connection.close()
    assert found == [(1.0, 11.0), (6.0, 61.0), (3.0, 31.0)]
    assert json.loads(about["study"]) == "sweep_toy"
