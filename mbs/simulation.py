"""From a mechanism to a checked result."""

from __future__ import annotations

import platform
from collections.abc import Callable, Sequence
from dataclasses import fields, is_dataclass, replace
from functools import cache
from importlib import metadata
from importlib.util import find_spec
from typing import Any

import numpy as np

from .accuracy.deliver import Climb, deliver, plain, verified
from .accuracy.goal import Asked, Goal, Usual
from .accuracy.ladder import ladder_of, suited
from .accuracy.words import COARSEST, FINEST, PLACES
from .checks.suspicions import idle, suspicions
from .functions import own_functions
from .functions.breaks import WIDTH
from .geometry import Array
from .kinematics import exact
from .mechanism import Mechanism
from .process import Interrupted, Progress, ctrl_c, one_thread, working_time
from .record.energy import ledger as energy_ledger
from .record.errors import Status
from .record.result import Result
from .record.run import Run
from .record.signals import shapes_at
from .solvers import Closure, Exudyn, Spectral
from .validate import listed, number, one_of, positive, short
from .view.movie import Film
from .view.verdicts import IDLE


def _compiled(*arguments: Any) -> Run:
    """Run with the compiled solver, which takes a second to load."""
    if find_spec("numba") is None:
        raise ImportError("the compiled solver needs Numba: pip install 'buckler[fast]'")
    from .spectral.run import once as run

    return run(*arguments)


def _on_engine(*arguments: Any) -> Run:
    """Run with the engine, which is loaded only where it runs."""
    from .engine.solve import once as run

    return run(*arguments)


SOLVERS: dict[type, Callable[..., Run]] = {Exudyn: _on_engine, Spectral: _compiled, Closure: exact.once}
"""What runs a mechanism once, by the type of the solver: `run(mechanism, duration, solver, timeout, progress)`."""

Solver = Exudyn | Spectral | Closure


@one_thread()
def simulate(
    mechanism: Mechanism,
    duration: float,
    accuracy: float | None = None,
    *,
    of: str | Sequence[str] = PLACES,
    solver: Solver | None = None,
    verify: bool = False,
    ledger: bool = False,
    shapes: Sequence[float] = (),
    timeout: float | None = None,
    progress: Callable[[float], None] | None = None,
) -> Result:
    """Simulate a mechanism from t = 0, its velocities given by the drive through the constraints.

    Parameters
    ----------
    mechanism : Mechanism
    duration : float
        s, positive.
    accuracy : float, optional
        Largest relative error of what `of` names, 1e-6 to 0.1: the solver climbs its ladder, finer in time, and with strips in
        space, until the error of what `of` names is what was asked; the result's `error` tells that of each signal. It takes
        three runs or more. A result that misses it is SUSPECT, ACCURACY in the message.
    of : str or sequence of str
        What the accuracy is asked of: "places"; "forces", as computed, all of them; "means", forces that ring as means over
        their axial period and the others as computed; or signals by their names, as `mbs.accuracy.compare` measures them.
    solver : Exudyn, Spectral or Closure, optional
        Solver and its settings. Without an accuracy it runs once, and its error is not known. By default `Closure()` where
        joints and drives alone decide the motion; with an accuracy the solver that suits the mechanism; else `Exudyn()`, held
        against a finer run, see `mbs.accuracy.deliver`.
    verify : bool
        Also run another solver, `Exudyn` for `Spectral` and `Spectral` for the others, and put the largest relative difference of
        places into the result's `verified`. Signals farther apart than both errors allow make it SUSPECT, SOLVERS in the message.
    ledger : bool
        Also keep the energy ledger, and mark a run whose balance fails as SUSPECT.
    shapes : sequence of float
        Times, s, at which to keep the shapes of flexible links.
    timeout : float, optional
        Wall-clock limit, s; beyond it the run ends as TIMED_OUT with what it has.
    progress : callable, optional
        Called with the fraction done after each step; of each run in turn, where there are several.

    Returns
    -------
    Result
        Failures come as a status with a message, not as exceptions.

    Raises
    ------
    ValueError
        On wrong input, before any engine call.
    Interrupted
        On Ctrl-C: a KeyboardInterrupt whose `result` is what there is by then.
    """
    one_of("mechanism", mechanism, (Mechanism,))
    duration = float(positive("duration", duration, "s"))
    goal = _goal(accuracy, of)
    if timeout is not None:
        positive("timeout", timeout, "s")
    for name, element in mechanism.elements().items():
        element.check_run(duration, name)
    if solver is not None:
        one_of("solver", solver, tuple(SOLVERS))
    times = _times(shapes, duration)
    start, made = working_time(), list[Run]()

    def run(mechanism: Mechanism, span: float, solver: Solver) -> Run:
        left = None if timeout is None else max(1e-3, timeout - (working_time() - start))
        with ctrl_c() as interrupted:  # also while a run is put together, or its record
            made.append(_once(mechanism, span, solver, left, progress))
        if interrupted():
            raise KeyboardInterrupt
        return made[-1]

    try:
        if accuracy is None and solver is not None:
            single, complete = run(mechanism, duration, solver), None
        else:
            ladder = None if accuracy is None else ladder_of(mechanism, duration, accuracy, solver or suited(mechanism))
            found = plain(mechanism, duration, run) if ladder is None else deliver(Climb(ladder, run), goal)
            single, complete = found.run, lambda result: found.complete(result, goal, working_time() - start)
        result = _result(single, complete, ledger, times)
        return verified(result, single, mechanism, duration, run) if verify else result
    except KeyboardInterrupt as stop:
        raise (_interrupted(made) if made else stop) from None


def _goal(accuracy: float | None, of: str | Sequence[str]) -> Goal:
    """What is asked of a run's errors."""
    if accuracy is not None:
        return Asked(number("accuracy", accuracy, FINEST, COARSEST, "1"), of)
    if of != PLACES:
        raise ValueError(f"of = {short(of)}: no accuracy; give accuracy = 1e-3, or another from {FINEST:g} to {COARSEST:g}")
    return Usual()


def _times(shapes: Sequence[float], duration: float) -> Array:
    """Times, s, at which shapes are kept."""
    each = (shapes,) if isinstance(shapes, int | float) else listed("shapes", shapes)
    return np.array([number(f"shapes[{k}]", t, 0.0, duration, "s") for k, t in enumerate(each)])


def _interrupted(made: Sequence[Run]) -> Interrupted:
    """What Ctrl-C leaves of several runs: the one that got farthest. No check looks at it."""
    run = max(reversed(made), key=lambda run: float(run.record.time[-1]))
    said = run.failure[1] if run.failure else f"Ctrl-C after a run to t = {run.record.time[-1]:.6g} s; nothing checked it"
    return Interrupted(_result(replace(run, failure=(Status.INTERRUPTED, said)), None, False, np.empty(0)))


def _once(mechanism: Mechanism, duration: float, solver: Solver, timeout: float | None, progress: Progress | None) -> Run:
    """One pass of the solver that was asked for."""
    return SOLVERS[type(solver)](mechanism, duration, solver, timeout, progress)


def _result(run: Run, complete: Callable[[Result], Result] | None, ledger: bool, times: Array) -> Result:
    """Signals, energies and checks of a run; `complete` adds what is known of its error before it is checked."""
    record = run.record
    status, message = run.failure or (Status.OK, "")
    result = Result(
        status,
        message,
        record.time,
        run.values,
        run.units,
        run.work,
        energy_ledger(record) if ledger else {},
        shapes_at(record, times) if len(times) else {},
        _provenance(run),
        film=Film(record),
        traits=run.traits,
    )
    if complete is not None:
        result = complete(result)
    result = replace(result, provenance=result.provenance | {IDLE: idle(run, result)})
    for reason in suspicions(run, result):
        result = result.suspect(reason)
    return result


@cache
def _versions() -> dict[str, str]:
    """Of what computes."""
    return {name: metadata.version(name) for name in ("buckler", "exudyn", "numpy", "scipy")} | {
        "python": platform.python_version()
    }


def _provenance(run: Run) -> dict[str, Any]:
    """Versions, what was built, the settings it ran with, and what is worth knowing of the mechanism."""
    found = {**_versions(), "scene": dict(run.summary), "settings": _settings(run.solver)}
    elements = run.record.mechanism.elements().items()
    notes = [*run.notes, *(note for name, element in elements for note in element.remarks(name, run.values))]
    if own_functions(run.record.mechanism):
        looked = f"functions in Python are looked at every {WIDTH * run.record.time[-1]:.2g} s for jumps and pulses"
        notes.append(f"{looked}; a Table names shorter ones")
    return found | ({"notes": notes} if notes else {})


def _settings(value: Any) -> dict[str, Any]:
    """A solver's settings as plain values, each value that is a type of its own with its name."""
    found: dict[str, Any] = {"kind": type(value).__name__}
    for spec in fields(value):
        inner = getattr(value, spec.name)
        found[spec.name] = _settings(inner) if is_dataclass(inner) else inner
    return found
