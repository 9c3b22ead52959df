"""Waiting for a run: how long it will take, a limit of time, Ctrl-C."""

import os
import re
import signal
import threading

import pytest
from own_file import metrics

from buckler.mbs import Status
from buckler.mbs.progress import Forecast, forecast, spoken
from buckler.studies.kit.cli import main


@pytest.fixture
def clock(monkeypatch):
    """A clock that the test moves."""
    now = [0.0]
    monkeypatch.setattr("buckler.mbs.progress.working_time", lambda: now[0])
    return now


def test_the_time_is_told_within_three_seconds(clock, capsys):
    told = Forecast("arch", bar=False)
    told.runs = (2, 5)
    for step in range(1, 31):
        clock[0] = 0.1 * step
        told(0.01 * step)  # ten seconds for this run
    first = 10.0 - 2.0
    growth = [10 * 8 ** (k / 4) for k in range(1, 5)]
    said = capsys.readouterr().err
    span = f"{spoken(first + growth[0])} to {spoken(first + sum(growth))}"
    assert said == f"arch: about {span} more; this run takes 10 s, and finer ones tell its error\n"


def test_a_run_of_a_named_solver_and_cases(clock, capsys):
    single, nine, soon = Forecast("arch", bar=False), Forecast("arch", cases=9.0, bar=False), Forecast("arch", bar=False)
    clock[0] = 2.0
    single(0.1), nine(0.1), soon(0.5)
    assert capsys.readouterr().err.splitlines() == [
        "arch: about 18 s more", "arch: about 3 min more, 9 cases one after another",
    ]  # fmt: skip


def test_times_in_words():
    assert [spoken(s) for s in (0.2, 12.4, 89, 95, 3000, 9000)] == ["1 s", "12 s", "89 s", "2 min", "50 min", "2.5 h"]


def test_progress_is_shown_where_it_is_wanted_or_someone_looks_on(monkeypatch):
    assert forecast(None) is None and forecast(False) is None and forecast(print) is print
    assert isinstance(forecast(True), Forecast)
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    assert isinstance(forecast(None), Forecast) and forecast(False) is None


def test_a_limit_of_time_leaves_the_best_so_far(pendulum, capsys):
    assert main(argv=["run", "pendulum.json", "--duration", "5000", "--timeout", "0.5", "--measure", "min(A.y)"]) == 1
    _, err = capsys.readouterr()
    assert "pendulum: TIMED_OUT: " in err
    found = metrics(pendulum / "results" / "pendulum")
    assert found["status"] == "TIMED_OUT" and found["metrics"]["min(A.y)"]["value"] < 0
    assert main(argv=["run", "pendulum.json", "--timeout", "-1"]) == 2
    assert main(argv=["frequencies", "pendulum.json", "--timeout", "0s"]) == 2


def test_a_command_without_an_answer_says_so(pendulum, capsys, monkeypatch):
    monkeypatch.setattr("buckler.studies.own.verbs.open_file", lambda *_: os.kill(os.getpid(), signal.SIGALRM))
    assert main(argv=["frequencies", "pendulum.json", "--timeout", "1h"]) == 1
    said = "pendulum.json: TIMED_OUT: --timeout 3600: the time is over, and there is no answer yet\n"
    assert capsys.readouterr().err == said


def test_ctrl_c_keeps_what_there_is_and_exits_130(pendulum, capsys):
    main(argv=["run", "pendulum.json", "-q"])  # compiled before the clock runs
    clock = threading.Timer(1.0, os.kill, (os.getpid(), signal.SIGINT))
    clock.start()
    try:
        assert main(argv=["run", "pendulum.json", "--duration", "50000", "--measure", "min(A.y)"]) == 130
    finally:
        clock.cancel()
    assert re.search(r"pendulum: INTERRUPTED: Ctrl-C", capsys.readouterr().err)
    found = metrics(pendulum / "results" / "pendulum")
    assert found["status"] == Status.INTERRUPTED and "min(A.y)" in found["metrics"]
    assert (pendulum / "results" / "pendulum" / "signals.npz").exists()
