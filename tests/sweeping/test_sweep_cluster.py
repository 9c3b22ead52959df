"""Sweeps on a Dask cluster: a real scheduler and real workers on the loopback, some of which are killed."""

import subprocess
import sys
import time

import pytest
import sweep_toy
from sweep_runs import ENVIRONMENT, after, same, stored
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

    endings = ("fine", "suspect", "raises")
    cases = [Parameters(length=i / 11, ending=ending, noise=1) for i in range(12) for ending in endings]
    with distributed.Client(scheduler_file=str(cluster.file)) as client:
        executor = client.get_executor(pure=False)
        rows = sweep(sweep_toy, cases, executor=executor, store=tmp_path / "s.sqlite", progress=after(6, first.kill))
    assert same(rows) == stored(tmp_path / "s.sqlite") == same(sweep(sweep_toy, cases))
    assert {row.status for row in rows} == {"OK", "SUSPECT", "ERROR"}
