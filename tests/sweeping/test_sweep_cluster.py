"""A sweep on a Dask cluster: a real scheduler and real workers on the loopback, and what happens when they die."""

import json
import subprocess
import sys
import time

import pytest
import sweep_toy
from sweep_runs import ENVIRONMENT, run, same, start, stored
from sweep_toy import Parameters

from buckler.studies.sweeping.executors import Dask, SweepError
from buckler.studies.sweeping.sweep import sweep

pytest.importorskip("distributed")


class Cluster:
    """A scheduler and workers, each a process of its own."""

    def __init__(self, folder):
        self.folder, self.processes = folder, []
        file = folder / "scheduler.json"
        self.scheduler = self._start("scheduler", "--port", "0", "--no-show", "--scheduler-file", str(file))
        self.address = json.loads(_wait_for(file))["address"]

    def worker(self):
        return self._start("worker", self.address, "--nthreads", "1", "--no-nanny", "--local-directory", str(self.folder))

    def _start(self, kind, *words):
        command = [sys.executable, "-m", f"distributed.cli.dask_{kind}", "--host", "127.0.0.1", "--no-dashboard", *words]
        with (self.folder / f"{kind}.log").open("a") as log:
            process = subprocess.Popen(command, env=ENVIRONMENT, cwd=self.folder, stdout=log, stderr=log)
        self.processes.append(process)
        return process

    def stop(self):
        for process in reversed(self.processes):
            process.kill()
            process.wait()


def _wait_for(file):
    end = time.monotonic() + 60
    while time.monotonic() < end:
        if file.exists() and file.read_text().endswith("}"):
            return file.read_text()
        time.sleep(0.05)
    raise TimeoutError(file)


@pytest.fixture
def cluster(tmp_path):
    folder = tmp_path / "dask"
    folder.mkdir()
    found = Cluster(folder)
    yield found
    found.stop()


def toys(n, **shared):
    return [Parameters(length=float(f"{i / (n - 1):.12g}"), **shared) for i in range(n)]


def command(cluster, path, *words):
    return ["sweep", "toy", *words, "--noise", "1", "--scheduler", cluster.address, "--store", path, "--out", path.parent]


def test_cluster_gives_the_rows_of_this_process_though_a_worker_dies(cluster, tmp_path):
    path = tmp_path / "s.sqlite"
    first, _ = cluster.worker(), cluster.worker()

    class Killing:
        def __call__(self, items, total=None, label=""):
            for i, item in enumerate(items):
                yield item
                if i == 5:
                    first.kill()

    cases = [Parameters(length=c.length, ending=e, noise=1) for c in toys(12) for e in ("fine", "suspect", "raises")]
    by_file = Dask(cluster.folder / "scheduler.json")
    rows = sweep(sweep_toy, cases, workers=by_file, store=path, progress=Killing())
    assert same(rows) == stored(path) == same(sweep(sweep_toy, cases, workers=0))
    assert {row.status for row in rows} == {"OK", "SUSPECT", "ERROR"}


@pytest.mark.slow
def test_a_case_that_kills_its_workers_is_named_and_the_others_run(cluster):
    for _ in range(6):  # Dask gives a case up when four workers have died of it
        cluster.worker()
    cases = [*toys(8, noise=1), Parameters(length=2, noise=1, ending="dies")]
    rows = sweep(sweep_toy, cases, workers=Dask(cluster.address))
    assert [row.status for row in rows] == ["OK"] * 8 + ["CRASHED"]
    assert same(rows[:8]) == same(sweep(sweep_toy, cases[:8], workers=0))
    assert rows[8].message == "its process died several times: killed, out of memory, or a fault in compiled code"


@pytest.mark.slow
def test_a_cluster_left_without_workers_is_given_up_after_a_while(cluster, tmp_path):
    worker = cluster.worker()
    path = tmp_path / "s.sqlite"

    class Killing:
        def __call__(self, items, total=None, label=""):
            for item in items:
                yield item
                worker.kill()

    with pytest.raises(SweepError, match=r"the Dask cluster at tcp://\S+ has had no workers for 15 s"):
        sweep(sweep_toy, toys(20, pause=0.2), workers=Dask(cluster.address, patience=15), store=path, progress=Killing())
    kept = stored(path)
    assert 0 < len(kept) < 20
    cluster.worker()
    rows = sweep(sweep_toy, toys(20, pause=0.2), workers=Dask(cluster.address), store=path)
    assert same(rows) == same(sweep(sweep_toy, toys(20, pause=0.2), workers=0))


@pytest.mark.slow
def test_a_scheduler_that_dies_ends_the_sweep_with_what_is_stored(cluster, tmp_path):
    path = tmp_path / "s.sqlite"
    cluster.worker()
    process = start(*command(cluster, path, "--vary", "length=0:1:30", "--pause", "0.2"))
    process.stderr.readline()
    journal = path.with_name("s.sqlite-wal")
    size = journal.stat().st_size
    while journal.stat().st_size == size:
        time.sleep(0.05)
    cluster.scheduler.kill()
    _, err = process.communicate(timeout=120)
    assert process.returncode == 1
    assert f"\ntoy: the Dask cluster at {cluster.address} is gone\nthe same command resumes:\n" in err
    assert "Traceback" not in err
    kept = stored(path)
    assert 0 < len(kept) < 30


@pytest.mark.slow
def test_what_a_cluster_lacks_is_said_in_one_line(cluster, tmp_path):
    words = ["sweep", "toy", "--vary", "length=1,2", "--out", tmp_path]
    code, out, err = run(*words, "--scheduler", "tcp://127.0.0.1:9")
    assert (code, out) == (1, "")
    said = err.splitlines()
    assert said[0] == "2 cases, 0 of them stored already"
    assert said[2].startswith("toy: no Dask scheduler at tcp://127.0.0.1:9: ")
    assert len(said) == 5
    code, out, err = run(*words, "--scheduler", "nonsense://127.0.0.1:9")
    assert (code, out) == (1, "")
    assert "toy: no Dask scheduler at nonsense://127.0.0.1:9: " in err
    assert "Traceback" not in err
    with pytest.raises(SweepError, match=f"the Dask cluster has no workers; start some with `dask worker {cluster.address}`"):
        sweep(sweep_toy, toys(2), workers=Dask(cluster.address, patience=0.5))
    code, out, err = run(*words, "--scheduler", cluster.address, "--workers", "2")
    assert (code, out, err) == (2, "", "error: --workers: the cluster has its own; give it or --scheduler\n")
