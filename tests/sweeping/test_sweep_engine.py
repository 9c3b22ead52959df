"""Cases over processes: the same rows for any number of them, and whoever dies, nothing lost and nothing twice."""

import os
import signal
import sys
import time
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
import sweep_toy
from sweep_runs import descendants, gone, run, same, start, stored
from sweep_toy import Parameters, toys

from buckler.studies.striking import slider_crank
from buckler.studies.sweeping.executors import Given, SweepError
from buckler.studies.sweeping.sweep import sweep
from buckler.studies.sweeping.worker import sources

linux = pytest.mark.skipif(not Path("/proc").exists(), reason="looks for processes in /proc")


# --- the same rows everywhere -------------------------------------------------------------------------------------------


def test_rows_come_in_the_order_of_the_cases_with_the_studys_own_numbers():
    rows = sweep(sweep_toy, [Parameters(length=x, speed=3, noise=0) for x in (0.5, 0.25, 6)], workers=0)
    assert [row.number for row in rows] == [0, 1, 2]
    assert [row.parameters["length"] for row in rows] == [0.5, 0.25, 6]
    assert [row.value("strut.force") for row in rows] == [5 + 9, 2.5 + 9, 60 + 9]
    assert np.isnan(rows[2].value("strut.time")) and np.isnan(rows[2].value("absent"))
    assert rows[0].metrics["strut.force"].unit == "N"
    assert rows[0].metrics["strut.force"].error == 0
    assert rows[0].work == {"steps": 7}
    assert rows[0].wall_s > 0
    assert rows[0].provenance["versions"]["numpy"] == np.__version__
    assert rows[0].provenance["sources"] == sources()


def test_rows_do_not_depend_on_the_workers():
    cases = [Parameters(length=1, noise=1, pause=0.01 * (i % 3), seed=i) for i in range(20)]
    here, one, two = (same(sweep(sweep_toy, cases, workers=n)) for n in (0, 1, 2))
    assert here == one == two
    assert len(set(here)) == 20


def test_threads_of_another_executor_take_turns():
    """An executor of the standard protocol serves as well; the engine behind a study is not made for threads."""
    at_work, most = [], []
    module = ModuleType("counting")
    module.Parameters = Parameters

    def counted(parameters):
        at_work.append(1)
        time.sleep(0.005)
        most.append(len(at_work))
        at_work.pop()
        return sweep_toy.run(parameters)

    module.run = counted
    sys.modules["counting"] = module
    try:
        with ThreadPoolExecutor(4) as pool:
            rows = sweep(module, toys(8), workers=Given(pool, slots=8))
    finally:
        del sys.modules["counting"]
    assert same(rows) == same(sweep(sweep_toy, toys(8), workers=0))
    assert max(most) == 1


def test_engine_gives_the_same_bits_in_a_worker_as_here():
    """Forked from a server that has the engine loaded, as the default is."""
    cases = [slider_crank.Parameters(models=("strut",), thickness=t) for t in (2e-4, 3e-4)]
    direct = [slider_crank.run(case).metrics for case in cases]
    rows = sweep("slider-crank", cases, workers=2)
    assert [row.status for row in rows] == ["OK", "OK"]
    for row, metrics in zip(rows, direct, strict=True):
        assert {k: repr(float(m.value)) for k, m in row.metrics.items()} == {k: repr(float(m.value)) for k, m in metrics.items()}
    # eq. 2: the load of the pinned strip grows as its thickness cubed
    forces = [row.value("strut.contact_force_180") for row in rows]
    assert forces[1] / forces[0] == pytest.approx(1.5**3, rel=1e-3)


def test_wrong_cases_are_refused():
    with pytest.raises(ValueError, match="case 1 is Parameters, not the Parameters of sweep_toy"):
        sweep(sweep_toy, [Parameters(), slider_crank.Parameters()])
    with pytest.raises(ValueError, match=r'cases 0 and 2 are the same: \{"length":0.25'):
        sweep(sweep_toy, [Parameters(length=x) for x in (0.25, 0.5, "250mm")])
    with pytest.raises(ValueError, match="workers = -1: out of range"):
        sweep(sweep_toy, toys(2), workers=-1)


# --- failures -----------------------------------------------------------------------------------------------------------


def test_every_way_to_end_is_a_row(caplog):
    endings = ("fine", "suspect", "fails", "raises", "dies", "fine")
    rows = sweep(sweep_toy, [Parameters(length=i, ending=ending) for i, ending in enumerate(endings)], workers=2)
    assert [row.status for row in rows] == ["OK", "SUSPECT", "TIMED_OUT", "ERROR", "CRASHED", "OK"]
    assert rows[1].message == "energy grew by 3 %"
    assert rows[3].message.startswith("ZeroDivisionError: no stiffness left (sweep_toy.py:")
    assert rows[4].message == "its process died several times: killed, out of memory, or a fault in compiled code"
    assert rows[4].parameters["length"] == 4
    assert rows[5].value("strut.force") == 51
    assert "a worker died of case 4, which runs again" in caplog.text


def test_only_the_case_that_kills_its_worker_is_blamed():
    """Two of six take a worker down, each together with innocent ones in flight."""
    cases = [Parameters(length=i / 4, ending="dies" if i % 3 == 1 else "fine") for i in range(6)]
    rows = sweep(sweep_toy, cases, workers=2)
    assert [row.status for row in rows] == ["CRASHED" if i % 3 == 1 else "OK" for i in range(6)]


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
    """In a case of 60 s the sweep is interrupted by its progress; it must not wait for it."""

    class Impatient:
        def __call__(self, items, total=None, label=""):
            for item in items:
                yield item
                raise KeyboardInterrupt

    cases = [Parameters(length=1), Parameters(length=2, pause=60)]
    begin = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        sweep(sweep_toy, cases, workers=2, store=tmp_path / "s.sqlite", progress=Impatient())
    assert time.monotonic() - begin < 30
    assert stored(tmp_path / "s.sqlite") == same(sweep(sweep_toy, cases[:1], workers=0))


# --- killed -------------------------------------------------------------------------------------------------------------


def kill_and_resume(path, times, words, seed):
    """Kill the sweep or one of its processes some times at random moments, then let it end; processes it left behind."""
    rng, left, hits = np.random.default_rng(seed), [], 0
    for _ in range(times):
        process = start("sweep", "toy", *words, "--store", path, "--out", path.parent)
        process.stderr.readline()  # it has begun: "... cases, ... stored already"
        time.sleep(rng.uniform(0.05, 1.5))
        others = descendants(process.pid)
        if others and rng.random() < 0.5:
            os.kill(int(rng.choice(others)), signal.SIGKILL)
            time.sleep(rng.uniform(0.05, 0.5))
        others = descendants(process.pid)
        hits += process.poll() is None  # it outlives any of its processes
        process.kill()
        process.communicate()
        if not gone(others):
            left += others
    code, _, err = run("sweep", "toy", *words, "--store", path, "--out", path.parent)
    assert code == 0, err
    assert hits == times  # or the sweep was at its end before it was killed
    return left


@linux
@pytest.mark.parametrize(("times", "cases", "pause"), [(2, 100, 0.1), pytest.param(30, 500, 0.1, marks=pytest.mark.slow)])
def test_killed_at_random_moments_and_resumed_it_is_as_if_undisturbed(tmp_path, times, cases, pause):
    path = tmp_path / "s.sqlite"
    words = ["--vary", f"length=0:1:{cases}", "--noise", "1", "--pause", f"{pause}", "--workers", "2"]
    left = kill_and_resume(path, times, words, seed=times)
    expected = [Parameters(length=float(f"{i / (cases - 1):.12g}"), noise=1, pause=pause) for i in range(cases)]
    assert [row.split(", 'speed'")[0] for row in stored(path)] == [
        f"({i}, {{'length': {case.length}" for i, case in enumerate(expected)
    ]
    quick = [Parameters(length=case.length, noise=1, pause=0) for case in expected]
    undisturbed = same(sweep(sweep_toy, quick, workers=0))
    assert [row.replace(f"'pause': {pause}", "'pause': 0.0") for row in stored(path)] == undisturbed
    assert left == []
    assert sorted(path.parent.glob("s.sqlite*")) == [path]


@linux
def test_a_fork_server_that_dies_as_it_starts_a_worker_is_replaced(monkeypatch):
    from multiprocessing import forkserver

    def killed(self):
        monkeypatch.undo()
        os.kill(forkserver._forkserver._forkserver_pid, signal.SIGKILL)
        raise EOFError("unexpected EOF")

    monkeypatch.setattr(ProcessPoolExecutor, "_adjust_process_count", killed)
    rows = sweep(sweep_toy, toys(3), workers=1)
    assert [row.status for row in rows] == ["OK"] * 3


@linux
@pytest.mark.parametrize("moment", ["starting", "running"])
def test_interrupted_by_ctrl_c_it_says_how_to_go_on(tmp_path, moment):
    path = tmp_path / "s.sqlite"
    words = ["sweep", "toy", "--vary", "length=0:1:20", "--pause", "0.3", "--workers", "2", "--store", path, "--out", tmp_path]
    process = start(*words)
    process.stderr.readline()
    journal = tmp_path / "s.sqlite-wal"
    size = journal.stat().st_size
    time.sleep(0.1)
    while moment == "running" and journal.stat().st_size == size:
        time.sleep(0.05)
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does: to all its processes
    out, err = process.communicate(timeout=30)
    assert process.returncode == 130
    assert out == ""
    message, resume, command = err.strip().splitlines()
    assert message.endswith(f"of 20 cases are stored in {path}")
    assert resume == "interrupted; the same command resumes:"
    assert command == f"  python -m studies {' '.join(map(str, words))}"
    before = stored(path)
    assert len(before) == int(message.split()[0])
    assert bool(before) == (moment == "running")
    code, _, err = run(*words)
    assert code == 0
    assert f"20 cases, {len(before)} of them stored already" in err
    assert [row for row in stored(path) if row in before] == before
    assert len(stored(path)) == 20


@linux
def test_sigterm_is_taken_for_ctrl_c(tmp_path):
    path = tmp_path / "s.sqlite"
    process = start(
        "sweep", "toy", "--vary", "length=1,2,3", "--pause", "30", "--workers", "1", "--store", path, "--out", tmp_path
    )
    process.stderr.readline()
    time.sleep(0.5)
    others = descendants(process.pid)
    process.terminate()
    _, err = process.communicate(timeout=30)
    assert process.returncode == 130
    assert f"0 of 3 cases are stored in {path}" in err
    assert gone(others)
