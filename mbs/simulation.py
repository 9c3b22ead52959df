"""Simulation of a mechanism: `simulate` runs a solver until the error estimate meets the demand, checks, and makes the result."""

import platform
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import fields, is_dataclass, replace
from functools import cache
from importlib import metadata
from importlib.util import find_spec
from math import inf
from typing import Any

import numpy as np

from .accuracy.demand import Asked, CheckedRun, Demand, Usual
from .accuracy.levels import LEVELS_BY_SOLVER
from .accuracy.refine import refine
from .accuracy.second_opinion import add_notes, verify_by_other_solver
from .accuracy.words import COARSEST, FINEST, PLACES
from .checks.suspicions import explain_not_applicable, find_suspicions
from .elements import Drive, Motion
from .functions import EdgeMemory, has_user_code, use_memory
from .functions.edge_memory import SETTLED
from .functions.edge_search import MOST, WIDTH
from .geometry import Array
from .imports import import_late
from .kinematics import exact
from .mechanism import Mechanism
from .process import Interrupted, Progress, catch_ctrl_c, has_compiler, one_thread, working_time
from .progress import Forecast, Ticker, forecast
from .record.errors import Failure, Status
from .record.result import Result
from .record.run import Run, shapes_at
from .scene.scene import Scene
from .solvers import Closure, Exudyn, Spectral
from .validate import as_tuple, number, one_of, positive, short
from .view.movie import Film
from .view.verdicts import NOT_APPLICABLE


def _run_compiled(*arguments: object, **scene: object) -> Run:
    """Load the compiled solver, which takes a second, and run it; raise an ImportError without Numba."""
    if find_spec("numba") is None:
        raise ImportError("the compiled solver needs Numba: pip install 'buckler[fast]'")
    return import_late("spectral.run:once")(*arguments, **scene)


def _run_engine(*arguments: object) -> Run:
    """Load the engine and run it; raise an ImportError with advice if it does not load."""
    try:
        run = import_late("engine.solve:run_once")
    except ImportError as error:
        advice = (
            "its wheel needs libGL and libX11 of the system: Debian 'apt-get install libgl1 libx11-6', Fedora "
            "'dnf install mesa-libGL libX11', conda packages libgl and xorg-libx11; the other solvers run without it"
        )
        raise ImportError(f"Exudyn does not load ({error}); {advice}") from error
    return run(*arguments)


SOLVERS: dict[type, Callable[..., Run]] = {Exudyn: _run_engine, Spectral: _run_compiled, Closure: exact.once}
"""Function that runs a mechanism once, by the type of the solver: `run(mechanism, duration, solver, timeout, progress)`. That of
`Spectral` also takes its compiled `scene`, if it is known."""
Solver = Exudyn | Spectral | Closure
STALLED = 3
"""Number of last runs in which the smallest shift of edges must be at most half the smallest shift before; else repetition ends.
`Passed.shift` is the largest change of an edge's time between two runs, over its distance from the nearest other edge."""


@one_thread()
def simulate(
    mechanism: Mechanism, duration: float, accuracy: float | None = None, *, of: str | Sequence[str] = PLACES,
    solver: Solver | None = None, verify: bool = False, ledger: bool = False, shapes: Sequence[float] = (),
    timeout: float | None = None, progress: bool | Callable[[float], None] | None = None,
) -> Result:  # fmt: skip
    """Simulate a mechanism from t = 0; drives give the first velocities through the constraints.

    Failures come as a status of the result with a message. Exceptions are a ValueError on wrong input, before any engine call,
    and on Ctrl-C `Interrupted`, a KeyboardInterrupt whose `result` is the run that got farthest.

    Parameters
    ----------
    mechanism : Mechanism
    duration : float, time to simulate [s], positive
    accuracy : float, optional
        Largest relative error of the signals in `of`, 1e-6 to 0.1. Each run of the solver is finer than the run before, until the
        error estimated from the last two is small enough. A result with a larger error is SUSPECT, with ACCURACY in the message.
        A motion that is accurate up to `error.until` only is CHAOTIC, or SENSITIVE if finer runs would be accurate longer.
        Without an accuracy the allowed errors are conventions, see `mbs.accuracy.demand`. A chaotic motion is then OK, and the
        message says up to when it is one trajectory.
    of : str or sequence of str
        Signals that shall have the accuracy: "places", "forces", names of signals, or norms such as "impulse(B.contact_force)".
    solver : Exudyn, Spectral or Closure, optional
        Solver and its settings; without an accuracy it runs once, and the error is not known. By default `Closure()` if joints
        and drives alone determine the motion, else the compiled `Spectral()`, or `Exudyn()` if that lacks Numba or an element.
    verify : bool
        True to run another solver as well, `Exudyn` for `Spectral` and `Spectral` for the others. A difference above the sum of
        both errors makes the result SUSPECT, with SOLVERS in the message.
    ledger : bool, True to keep the energies over time in the result's `energy`
    shapes : sequence of float, times [s] at which to keep the shapes of flexible links
    timeout : float, optional
        Wall-clock limit [s]; beyond it the result is TIMED_OUT: the finest run that ended, or else the beginning of the first.
    progress : bool or callable, optional
        True shows a bar and the expected time, by default in terminals and notebooks. A function is called after each step with
        the fraction of the run that is done; each run begins at 0.
    """
    one_of("mechanism", mechanism, (Mechanism,))
    duration = float(positive("duration", duration, "s"))
    demand = _demand(accuracy, of)
    if timeout is not None:
        positive("timeout", timeout, "s")
    if solver is not None:
        one_of("solver", solver, tuple(SOLVERS))
    listed = (shapes,) if isinstance(shapes, int | float) else as_tuple("shapes", shapes)
    times = np.array([number(f"shapes[{k}]", t, 0.0, duration, "s") for k, t in enumerate(listed)])
    single = solver if accuracy is None else None  # solver of a single run, whose error is not estimated
    numbers_of_runs = (2, 5) if single is None else (1, 1)  # chosen: least and largest that most results need
    runs = _Runs(mechanism, timeout, forecast(progress, numbers_of_runs))
    with use_memory(runs.memory):
        for name, element in Scene.of(mechanism).elements.items():
            if isinstance(element, Drive) and isinstance(element.motion, Motion):
                element.motion.check_run(duration, name)  # it searches the edges of the drive's function, which the memory keeps
        ticker = Ticker(runs.progress) if isinstance(runs.progress, Forecast) else None
        try:
            if single is not None:
                best = runs(mechanism, duration, single)
                result = _result(best, None, ledger, times)
            else:
                solver, why = (solver, "it was named") if solver else runs.choose_solver()
                levels = LEVELS_BY_SOLVER[type(solver)](mechanism, duration, solver, place_error=demand.place_error)
                answer = refine(runs, levels, demand)
                best = answer.run
                result = _result(best, lambda result: runs.complete(result, answer, demand, why), ledger, times)
            return verify_by_other_solver(result, best, duration, runs) if verify else result
        except KeyboardInterrupt as stop:
            raise (_interruption(runs.ended) if runs.ended else stop) from None
        finally:
            if ticker:
                ticker.stop()


class _Runs:
    """Runs of one call of `simulate`, listed in `ended`; they share time limit, compiled scene and edges of users' functions."""

    def __init__(self, mechanism: Mechanism, timeout: float | None, progress: Progress | None) -> None:
        self.mechanism, self.timeout, self.progress, self.memory = mechanism, timeout, progress, EdgeMemory()
        self.start, self.ended = working_time(), list[Run]()
        self.scenes: dict[int | None, Any] = {}

    def __call__(self, mechanism: Mechanism, duration: float, solver: Solver) -> Run:
        """Run a solver; repeat the run while edges of a user's function lie between its steps.

        The memory keeps the edges that it finds in a run, and steps of the next run end on them, which moves later edges. The
        mechanism is that of the call, for Exudyn perhaps with more elements.
        """
        shifts: list[float] = []
        for _ in range(16):  # a limit of time; if edges then still lie between steps, the run is UNSEEN
            run = self._run_once(mechanism, duration, solver)
            if run.failure is not None or len(run.record.time) < 2:
                return run
            passed = self.memory.find_passed(run.record.time, run.record.user_functions())
            shifts.append(passed.shift)
            has_settled = passed.shift <= SETTLED
            has_stalled = min(shifts[-STALLED:]) > min(shifts[:-STALLED], default=inf) / 2  # False in the first three runs
            # steps of the next run end on `passed.edges`: while there are any, a further run is needed
            if passed.too_many or ((has_settled or has_stalled) and not len(passed.edges)):
                break
        if passed.too_many or len(passed.edges):
            count = f"more than {MOST}" if passed.too_many else f"{len(passed.edges)}, the first at t = {passed.edges[0]:.6g} s,"
            text = f"UNSEEN: a function was looked at every {WIDTH * duration:.2g} s; of its edges {count} lie between steps"
            advice = "name them by a Piecewise, give a Table, or a shorter run"
            if passed.too_many:
                advice += "; a force that jumps with the sign of a speed is a friction law of buckler.mbs.laws"
            self.ended[-1] = run = replace(run, unseen=f"{text}; {advice}")
        return run

    def _run_once(self, mechanism: Mechanism, duration: float, solver: Solver) -> Run:
        left = None if self.timeout is None else max(1e-3, self.timeout - (working_time() - self.start))
        options = {}
        if isinstance(solver, Spectral) and find_spec("numba"):
            scene = self.scene(solver.degree)
            options = {} if isinstance(scene, str) else {"scene": scene}  # else the solver makes its own, or raises the reason
        with catch_ctrl_c() as interrupted:  # a solver reacts to Ctrl-C only in its steps, not before the first or after the last
            self.ended.append(SOLVERS[type(solver)](mechanism, duration, solver, left, self.progress, **options))
        if interrupted():
            raise KeyboardInterrupt
        return self.ended[-1]

    def scene(self, degree: int | None) -> Any:
        """Return the compiled scene for strips of a degree, or a text: why the compiled solver cannot run the mechanism."""
        if degree not in self.scenes:  # a scene serves all mechanisms of this call, as they differ only in elements for Exudyn
            self.scenes[degree] = import_late("spectral.run:scene_or_reason")(self.mechanism, degree)
        return self.scenes[degree]

    def choose_solver(self) -> tuple[Solver, str]:
        """Choose the solver, if the user names none; return it with the reason."""
        if Scene.of(self.mechanism).is_kinematic:
            return Closure(), "joints and drives alone decide the motion"
        if not has_compiler():
            return Exudyn(), "there is no compiler: pip install 'buckler[fast]'"
        any_duration = 1.0  # the degree is the same for all
        levels = LEVELS_BY_SOLVER[Spectral](self.mechanism, any_duration, Spectral())
        _, coarsest_solver = levels.settings(levels.first())
        scene = self.scene(coarsest_solver.degree)
        if isinstance(scene, str):
            return Exudyn(), f"the compiled solver does not take this mechanism: {scene}"
        return Spectral(), "it knows all elements of this mechanism"

    def complete(self, result: Result, answer: CheckedRun, demand: Demand, why: str) -> Result:
        """Add the errors, the work of all runs and the status to the result of the best run."""
        counts = {f"{name}_runs": float(n) for name, n in Counter(type(r.solver).__name__.lower() for r in self.ended).items()}
        work = result.work | {"wall_s": working_time() - self.start, "runs": float(len(self.ended))} | counts
        result = add_notes(replace(result, work=work, asked=demand.accuracy, error=answer.errors), *answer.errors.notes)
        result = replace(result, provenance=result.provenance | {"solver": f"{type(answer.run.solver).__name__}: {why}"})
        if answer.run.failure:
            return result
        shortfall, last = answer.shortfall(demand), self.ended[-1].failure
        if last and last.status is Status.TIMED_OUT:
            best = f"timeout = {self.timeout:g} s is over; the best so far is a run to the end, the one before the last"
            return replace(result, status=Status.TIMED_OUT, message="; ".join(filter(None, (best, shortfall))))
        if answer.chaos:
            status = answer.chaos if isinstance(demand, Asked) else Status.OK  # without an accuracy chaos is no fault
            note_on_chaos, *_ = answer.errors.notes  # `refine` puts it first; it becomes the message
            return replace(result, status=status, message=note_on_chaos)
        return result.suspect(shortfall) if shortfall else result


def _demand(accuracy: float | None, of: str | Sequence[str]) -> Demand:
    if accuracy is not None:
        return Asked(number("accuracy", accuracy, FINEST, COARSEST, "1"), of)
    if of != PLACES:
        raise ValueError(f"of = {short(of)}: no accuracy; give accuracy = 1e-3, or another from {FINEST:g} to {COARSEST:g}")
    return Usual()


def _interruption(runs: Sequence[Run]) -> Interrupted:
    """Make the exception of Ctrl-C, with the unchecked result of the run that got farthest."""
    run = max(reversed(runs), key=lambda run: float(run.record.time[-1]))  # reversed: of equally far ones the last, the finest
    message = run.failure.message if run.failure else f"Ctrl-C after a run to t = {run.record.time[-1]:.6g} s; nothing checked it"
    return Interrupted(_result(replace(run, failure=Failure(Status.INTERRUPTED, message)), None, False, np.empty(0)))


def _result(run: Run, complete: Callable[[Result], Result] | None, ledger: bool, times: Array) -> Result:
    """Make the result of a run: signals, energies, checks; `complete` adds the error estimate before the checks."""
    record = run.record
    status, message = run.failure or (Status.OK, "")
    traits = {name: signal.trait for name, signal in run.signals.items()}
    result = Result(
        status, message, record.time, signals=run.values, units=run.units, work=run.work, energy=run.ledger if ledger else {},
        shapes=shapes_at(record, times) if len(times) else {}, provenance=_provenance(run), film=Film(record), traits=traits,
    )  # fmt: skip
    if complete is not None:
        result = complete(result)
    result = replace(result, provenance=result.provenance | {NOT_APPLICABLE: explain_not_applicable(run, result)})
    for reason in find_suspicions(run, result):
        result = result.suspect(reason)
    if run.unseen and result.status.finished:
        result = replace(result, status=Status.UNSEEN, message="; ".join(filter(None, (run.unseen, result.message))))
    return result


@cache
def _versions() -> dict[str, str]:
    packages = {name: metadata.version(name) for name in ("buckler", "exudyn", "numpy", "scipy")}
    return packages | {"python": platform.python_version()}


def _provenance(run: Run) -> dict[str, Any]:
    """Return versions, counts of elements, settings of the solver, and remarks on the mechanism."""
    found = {**_versions(), "scene": dict(run.summary), "settings": _settings(run.solver)}
    scene = Scene.of(run.record.mechanism)
    notes = [*run.notes, *(note for name, element in scene.elements.items() for note in element.remarks(name, run.values))]
    if has_user_code(scene.mechanism):
        interval = f"every {WIDTH * run.record.time[-1]:.2g} s"
        notes.append(f"functions in Python are looked at {interval} for jumps and pulses; a Piecewise names shorter ones")
    return found | ({"notes": notes} if notes else {})


def _settings(value: Any) -> dict[str, Any]:
    """Return a solver's settings as plain values; the steps are a dictionary as well."""
    settings = {field.name: getattr(value, field.name) for field in fields(value)}
    plain = {name: _settings(inner) if is_dataclass(inner) else inner for name, inner in settings.items()}
    return {"kind": type(value).__name__} | plain
