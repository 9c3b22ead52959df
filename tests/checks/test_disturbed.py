"""Runs that are disturbed: by Ctrl-C, which ends them, and by each other in threads, which changes nothing."""

import signal
import threading

import numpy as np
import pytest
from simulations import pendulum
from stopping import press_ctrl_c

from buckler.mbs import Exudyn, Rigid, Section, Spectral, Status, crank_rocker, simulate
from buckler.studies.kit import cli
from buckler.studies.kit.drawn import draw
from buckler.studies.rattling import modes

BAR = Rigid(Section(0.005, 0.020))
HOURS = 1e5
"""Duration, s, of a run that would take hours."""
LONG = {
    "Exudyn": lambda press: simulate(pendulum(2.0), HOURS, solver=Exudyn(), progress=press),
    "compiled": lambda press: simulate(pendulum(2.0), HOURS, solver=Spectral(), progress=press),
    "closure": lambda press: simulate(crank_rocker(BAR, speed=30.0), HOURS, progress=press),
    "itself": lambda press: simulate(pendulum(2.0), HOURS, progress=press),
    "accuracy": lambda press: simulate(pendulum(2.0), HOURS, 1e-4, progress=press),
}


@pytest.mark.parametrize("kind", LONG)
def test_ctrl_c_ends_any_run(kind):
    """Of the engine, of the compiled solver, of closure, and of several runs for an accuracy: all of them, not one."""
    with pytest.raises(KeyboardInterrupt) as stop:
        LONG[kind](press_ctrl_c(20))
    left = stop.value.result
    assert left.status is Status.INTERRUPTED and "Ctrl-C" in left.message, left
    assert len(left.time) > 10 and all(len(values) == len(left.time) for values in left.signals.values())
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


@pytest.mark.parametrize("solver", [Exudyn(), Spectral()], ids=["Exudyn", "compiled"])
def test_runs_in_threads_do_not_disturb_each_other(solver):
    """Bit for bit what they are one after the other."""
    names = ("clearance", "strip on a stop", "strut", "kinks")
    made = [draw(1, k, names) for k in range(len(names))]
    alone = [simulate(d.mechanism, d.duration / 4, solver=solver) for d in made]
    together = [None] * len(made)

    def work(k):
        together[k] = simulate(made[k].mechanism, made[k].duration / 4, solver=solver)

    threads = [threading.Thread(target=work, args=(k,)) for k in range(len(made))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for one, other in zip(alone, together, strict=True):
        assert (one.status, one.message) == (other.status, other.message)
        assert all(np.array_equal(values, other.signals[name]) for name, values in one.signals.items())


@pytest.mark.parametrize("given", [["--seed", "x"], ["--seed", "-1"], ["--seed", "1.5"]])
def test_a_wrong_parameter_is_refused_before_the_study_runs(given, monkeypatch, capsys):
    monkeypatch.setattr(modes, "run", lambda *_: pytest.fail("the study ran"))
    assert cli.main(None, ["run", "modes", *given]) == 2
    assert "seed" in capsys.readouterr().err
