"""Waiting for a run: how long it will take, a limit of time, Ctrl-C."""

import os
import re
import signal
import threading

import pytest
from own_file import metrics

from buckler.mbs import Status
from buckler.mbs.progress import Forecast, write_duration
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
    span = f"{write_duration(first + growth[0])} to {write_duration(first + sum(growth))}"
    assert said == f"arch: about {span} more; this run takes 10 s, and finer ones tell its error\n"


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
