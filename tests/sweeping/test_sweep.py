"""Sweeps: the same rows on every executor; whatever is killed, nothing is lost and nothing runs twice."""

import os
import signal
import sys
import time
from concurrent.futures import BrokenExecutor, ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
import sweep_toy
from sweep_runs import after, descendants, gone, interrupt, run, same, start, stored
from sweep_toy import Parameters, toys

from buckler.studies.striking import slider_crank
from buckler.studies.sweeping.sweep import Part, SweepError, sweep

linux = pytest.mark.skipif(not Path("/proc").exists(), reason="looks for processes in /proc")


def test_rows_do_not_depend_on_the_executor():
    cases = [Parameters(length=1, noise=1, pause=0.01 * (i % 3), seed=i) for i in range(20)]
    here = same(sweep(sweep_toy, cases))
    assert len(set(here)) == 20
    assert here == same(sweep(sweep_toy, cases, workers=2))
    for pool in (ThreadPoolExecutor(4), ProcessPoolExecutor(2, get_context("spawn"))):
        with pool:
            assert here == same(sweep(sweep_toy, cases, executor=pool))


def test_the_engine_gives_the_same_bits_in_a_process_as_here():
    cases = [slider_crank.Parameters(models=("strut",), thickness=t) for t in (2e-4, 3e-4)]
    here = [{name: repr(float(m.value)) for name, m in slider_crank.run(case).metrics.items()} for case in cases]
    rows = sweep("slider-crank", cases, workers=2)
    assert [{name: repr(float(m.value)) for name, m in row.metrics.items()} for row in rows] == here
    forces = [row.value("strut.contact_force_180") for row in rows]
    assert forces[1] / forces[0] == pytest.approx(1.5**3, rel=1e-3)  # the load of a pinned strip grows as its thickness cubed


def test_every_ending_is_a_row_and_only_the_case_that_kills_its_process_is_blamed():
    endings = ("fine", "dies", "suspect", "fails", "raises", "dies", "fine", "fine")
    rows = sweep(sweep_toy, [Parameters(length=i, ending=ending) for i, ending in enumerate(endings)], workers=2)
    assert [row.status for row in rows] == ["OK", "CRASHED", "SUSPECT", "TIMED_OUT", "ERROR", "CRASHED", "OK", "OK"]
    assert rows[2].message == "energy grew by 3 %"
    assert rows[4].message.startswith("ZeroDivisionError: no stiffness left (sweep_toy.py:")
    assert rows[5].message.startswith("its process died twice") and rows[5].parameters["length"] == 5
    assert rows[6].value("strut.force") == 61


def test_an_executor_that_takes_no_more_cases_ends_the_sweep_with_an_error():
    class Broken(ThreadPoolExecutor):
        """Executor that takes the import of the study and the first case, and breaks while it is idle."""

        taken = 0

        def submit(self, *job):
            self.taken += 1
            if self.taken > 2:
                raise BrokenExecutor("no more workers")
            return super().submit(*job)

    with Broken() as pool, pytest.raises(SweepError, match=r"Broken has lost its workers; 2 of 3 cases did not run"):
        sweep(sweep_toy, [Parameters(length=i) for i in range(3)], executor=pool)


def test_a_study_that_workers_cannot_load_stops_the_sweep_before_any_case():
    module = ModuleType("nowhere_to_be_found")
    module.Parameters = Parameters
    sys.modules[module.__name__] = module  # this process has it, a worker has not
    try:
        with pytest.raises(SweepError, match="workers cannot load nowhere_to_be_found: ModuleNotFoundError"):
            sweep(module, toys(2), workers=1)
    finally:
        del sys.modules[module.__name__]


def test_interrupt_ends_workers_at_once_and_keeps_what_has_ended(tmp_path):
    cases, pressed = [Parameters(length=1), Parameters(length=2, pause=100)], []
    progress = after(1, lambda: pressed.append(time.monotonic()) or interrupt())
    with pytest.raises(KeyboardInterrupt):
        sweep(sweep_toy, cases, workers=2, store=tmp_path / "s.sqlite", progress=progress)
    assert time.monotonic() - pressed[0] < 50  # half the time that the second case takes
    assert stored(tmp_path / "s.sqlite") == same(sweep(sweep_toy, cases[:1]))


def test_parts_are_read_as_one(tmp_path, monkeypatch):
    path, cases = tmp_path / "s.sqlite", toys(7, noise=1)
    parts = [sweep(sweep_toy, cases, store=path, part=Part(i, 3)) for i in (1, 2)]
    assert [[row.number for row in rows] for rows in parts] == [[0, 3, 6], [1, 4]]
    ran = []
    monkeypatch.setattr(sweep_toy, "run", lambda p, progress, run=sweep_toy.run: ran.append(p.length) or run(p))
    rows = sweep(sweep_toy, cases, store=path)
    assert ran == [2 / 8, 5 / 8]  # the part that never ran
    assert same(rows) == same(sweep(sweep_toy, cases))


def begun(process, path):
    """Wait until a sweep has opened its store."""
    while not path.with_name(f"{path.name}-wal").exists() and process.poll() is None:
        time.sleep(0.02)


@linux
@pytest.mark.parametrize(("times", "cases"), [(2, 60), pytest.param(20, 300, marks=pytest.mark.slow)])
def test_killed_at_random_moments_and_resumed_it_is_as_if_undisturbed(tmp_path, times, cases):
    path, rng = tmp_path / "s.sqlite", np.random.default_rng(times)
    words = ["sweep", "toy", "--vary", f"length=0:1:{cases}", "--noise", "1", "--pause", "0.1", "--workers", "2"]
    words += ["--store", path, "--out", tmp_path]
    for _ in range(times):
        process = start(*words)
        begun(process, path)
        time.sleep(rng.uniform(0.3, 1.5))
        others = descendants(process.pid)
        if others and rng.random() < 0.5:
            os.kill(int(rng.choice(others)), signal.SIGKILL)
            time.sleep(rng.uniform(0.05, 0.5))
        others = descendants(process.pid)
        assert process.poll() in (None, 0), process.communicate()  # it outlives any of its processes; on a quick machine it ends
        process.kill()
        process.communicate()
        assert gone(others)
    code, _, err = run(*words)
    assert code == 0, err
    quick = [Parameters(length=float(f"{i / (cases - 1):.12g}"), noise=1) for i in range(cases)]
    assert [row.replace("'pause': 0.1", "'pause': 0.0") for row in stored(path)] == same(sweep(sweep_toy, quick))
    assert sorted(tmp_path.glob("s.sqlite*")) == [path]


@linux
@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_command_says_how_to_resume(tmp_path, how):
    path = tmp_path / "s.sqlite"
    words = ["sweep", "toy", "--vary", "length=0:1:20", "--pause", "0.3", "--workers", "2", "--store", path, "--out", tmp_path]
    process = start(*words)
    begun(process, path)
    size = path.with_name("s.sqlite-wal").stat().st_size
    while path.with_name("s.sqlite-wal").stat().st_size < size + 20_000:  # the plan and some cases are written
        time.sleep(0.05)
    others = descendants(process.pid)
    os.killpg(process.pid, how) if how == signal.SIGINT else process.terminate()  # a terminal signals all, a batch system one
    out, err = process.communicate()
    assert (process.returncode, out) == (130, "")
    command = f"  python -m studies {' '.join(map(str, words))}"
    assert err.strip().splitlines() == [f"interrupted; what has ended is in {path}; the same command resumes:", command]
    assert gone(others)
    before = stored(path)
    assert 0 < len(before) < 20
    assert run(*words)[0] == 0
    assert len(stored(path)) == 20 and set(before) <= set(stored(path))
