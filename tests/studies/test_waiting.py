"""Waiting for a run: how long it will take, a limit of time, Ctrl-C."""

import signal
import time
from itertools import count

import pytest
from made_up_study import metrics_of
from stopping import stop_at

from buckler.mbs import Status
from buckler.mbs.process import COMPILING, Interrupted
from buckler.mbs.progress import USER_STOPS, Forecast, Ticker, Watch, watch, write_duration
from buckler.studies.kit.cli import main


@pytest.fixture
def clock(monkeypatch):
    now = [0.0]
    monkeypatch.setattr("buckler.mbs.progress.working_time", lambda: now[0])
    return now


def test_the_time_is_told_after_two_seconds(clock, capsys, monkeypatch):
    looks = count()  # each a second after the one before
    monkeypatch.setattr("buckler.mbs.progress.perf_counter", looks.__next__)
    told = Forecast("arch")
    told.runs = (2, 5)
    ticker = Ticker(told)
    for step in range(1, 21):
        clock[0] = 0.1 * step
        told(0.01 * step)  # ten seconds for this run
    while ticker.thread.is_alive() and not ticker.announced:
        time.sleep(0.01)
    ticker.stop()
    assert next(looks) == 3
    first = 10.0 - 2.0
    growth = [10 * 8 ** (k / 4) for k in range(1, 5)]
    said = capsys.readouterr().err
    span = f"{write_duration(first + growth[0])} to {write_duration(first + sum(growth))}"
    assert said == f"arch: about {span} more; this run takes 10 s, and finer ones tell its error\n"
    assert told.line() == "arch run 1: 20 %"


def test_the_time_before_the_first_step_is_not_that_of_further_runs(clock):
    told = Forecast("arch", cases=12.0)
    for now, done in ((10.0, 0.1), (10.5, 0.2)):  # ten seconds to load, then five for a run
        clock[0] = now
        told(done)
    assert told.text() == f"arch: about {write_duration(4.0 + 11 * 5.0)} more, 12 cases one after another"


def test_each_further_case_takes_the_time_of_all_its_runs(clock):
    told = Forecast("arch", cases=3.0)
    told.runs = (2, 2)
    for now, done in ((2.5, 0.5), (5.0, 1.0), (5.0, 0.0), (7.0, 0.2)):
        clock[0] = now
        told(done)
    case = 10 + 10 / 8 ** (1 / 4)  # the second run takes ten seconds, the first one less
    assert told.text() == f"arch: about {write_duration(8.0 + 2 * case)} more, 3 cases one after another"


def test_a_call_tells_the_time_of_its_steps(clock):
    state = Watch("steps", clock=lambda: clock[0])
    for step in range(1, 21):
        clock[0] = 0.1 * step
        state.step()
    assert state.text().startswith("20 steps so far; how many it takes is not known")
    state.most = 100
    assert state.text() == "at most 8 s for 100 steps"  # 0.1 s each
    state.step(0.25)
    assert state.text() == "about 6 s more at this rate, at most 8 s for 100 steps" and "25 % of the way" in state.line()
    state.most = 40
    assert state.text() == "at most 2 s for 40 steps"  # not "about 6 s more", which so few steps cannot take


def test_a_limit_of_time_leaves_the_best_so_far(pendulum, capsys):
    assert main(argv=["run", "pendulum.json", "--duration", "5000", "--timeout", "0.5", "--measure", "min(A.y)"]) == 1
    _, err = capsys.readouterr()
    assert "pendulum: TIMED_OUT: " in err
    found = metrics_of(pendulum / "results" / "pendulum")
    assert found["status"] == "TIMED_OUT" and found["metrics"]["min(A.y)"]["value"] < 0
    assert main(argv=["run", "pendulum.json", "--timeout", "-1"]) == 2
    assert main(argv=["frequencies", "pendulum.json", "--timeout", "0s"]) == 2


def test_a_command_without_an_answer_says_so(pendulum, capsys, monkeypatch):
    words = ["sensitivity", "pendulum.json", "--by", "gravity[1]", "--of", "min(A.y)", "--timeout", "1h"]
    stop_at(monkeypatch, 1)
    assert main(argv=words) == 1
    assert "pendulum.json: TIMED_OUT: --timeout = 1 s is over, and there is no answer yet\n" in capsys.readouterr().err
    stop_at(monkeypatch, 5)
    assert main(argv=words) == 1
    assert "timeout = 1 s is over" in capsys.readouterr().out
    stop_at(monkeypatch, 5, "Ctrl-C")
    assert main(argv=words) == 130
    assert "Ctrl-C" in capsys.readouterr().out


def test_ctrl_c_while_a_function_is_compiled_ends_the_call(monkeypatch):
    """The handler itself raises in the compiler, and the function keeps its best answer."""
    monkeypatch.setattr(COMPILING, "is_active", True)

    @watch("steps")
    def search():
        try:
            signal.raise_signal(signal.SIGINT)
        except USER_STOPS:
            return "best"

    with pytest.raises(Interrupted) as stop:
        search(progress=False)
    assert stop.value.result == "best"


def test_ctrl_c_keeps_what_there_is_and_exits_130(pendulum, capsys, monkeypatch):
    told = Forecast.__call__
    monkeypatch.setattr(Forecast, "__call__", lambda self, share: told(self, share) or signal.raise_signal(signal.SIGINT))
    assert main(argv=["run", "pendulum.json", "--duration", "500", "--measure", "min(A.y)"]) == 130
    assert "pendulum: INTERRUPTED: Ctrl-C" in capsys.readouterr().err
    found = metrics_of(pendulum / "results" / "pendulum")
    assert found["status"] == Status.INTERRUPTED and "min(A.y)" in found["metrics"]
    assert (pendulum / "results" / "pendulum" / "signals.npz").exists()
