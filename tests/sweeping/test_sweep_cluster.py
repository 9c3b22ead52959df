"""Sweeps on a Dask cluster: a real scheduler and real workers on the loopback, some of which are killed."""

import subprocess
import sys
import time

import pytest
import sweep_toy
from sweep_runs import ENVIRONMENT, run, same, start, stored
from sweep_toy import Parameters

from buckler.studies.sweeping.sweep import sweep

distributed = pytest.importorskip("distributed")


class Cluster:
    """A scheduler and its workers, each a process of its own."""

    def __init__(self, folder):
        self.folder, self.processes, self.file = folder, [], folder / "scheduler.json"
        self.scheduler = self.start("scheduler", "--port", "0", "--no-show")
        while not (self.file.exists() and self.file.read_text().endswith("}")):
            time.sleep(0.05)

    def worker(self):
        return self.start("worker", "--nthreads", "1", "--no-nanny", "--local-directory", str(self.folder))

    def start(self, kind, *words):
        command = [sys.executable, "-m", f"distributed.cli.dask_{kind}", "--scheduler-file", str(self.file)]
        with (self.folder / f"{kind}.log").open("a") as log:
            words = ("--host", "127.0.0.1", "--no-dashboard", *words)
            process = subprocess.Popen([*command, *words], env=ENVIRONMENT, cwd=self.folder, stdout=log, stderr=log)
        self.processes.append(process)
        return process


@pytest.fixture
def cluster(tmp_path):
    (tmp_path / "dask").mkdir()
    found = Cluster(tmp_path / "dask")
    yield found
    for process in reversed(found.processes):
        process.kill()
        process.wait()


def test_a_cluster_gives_the_rows_of_this_process_though_a_worker_dies(cluster, tmp_path):
    first, _ = cluster.worker(), cluster.worker()

    class Killing:
        def __call__(self, items, total=None, label=""):
            for i, item in enumerate(items):
                yield item
                if i == 5:
                    first.kill()

    endings = ("fine", "suspect", "raises")
    cases = [Parameters(length=i / 11, ending=ending, noise=1) for i in range(12) for ending in endings]
    with distributed.Client(scheduler_file=str(cluster.file)) as client:
        executor = client.get_executor(pure=False)
        rows = sweep(sweep_toy, cases, executor=executor, store=tmp_path / "s.sqlite", progress=Killing())
    assert same(rows) == stored(tmp_path / "s.sqlite") == same(sweep(sweep_toy, cases))
    assert {row.status for row in rows} == {"OK", "SUSPECT", "ERROR"}


@pytest.mark.slow
def test_a_case_that_kills_its_workers_is_named_and_the_others_run(cluster):
    for _ in range(6):  # Dask gives a case up when four workers have died of it
        cluster.worker()
    cases = [*(Parameters(length=i / 7, noise=1) for i in range(8)), Parameters(length=2, noise=1, ending="dies")]
    with distributed.Client(scheduler_file=str(cluster.file)) as client:
        rows = sweep(sweep_toy, cases, executor=client.get_executor(pure=False))
    assert [row.status for row in rows] == ["OK"] * 8 + ["CRASHED"]
    assert same(rows[:8]) == same(sweep(sweep_toy, cases[:8]))


@pytest.mark.slow
def test_the_command_keeps_what_has_ended_when_the_scheduler_dies(cluster, tmp_path):
    path = tmp_path / "s.sqlite"
    cluster.worker()
    words = ["sweep", "toy", "--vary", "length=0:1:30", "--scheduler-file", cluster.file, "--store", path, "--out", tmp_path]
    process = start(*words, "--pause", "0.2")
    time.sleep(8)
    cluster.scheduler.kill()
    _, err = process.communicate(timeout=120)
    assert process.returncode == 1
    assert "the same command resumes:" in err and "Traceback" not in err
    assert 0 < len(stored(path)) < 30
    code, out, err = run(*words, "--workers", "2")
    assert (code, out, err) == (2, "", "error: --workers: the cluster has its own; give it or --scheduler-file\n")
