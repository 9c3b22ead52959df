"""From a mechanism to a checked result."""

from __future__ import annotations

import platform
from collections.abc import Callable, Sequence
from dataclasses import fields, is_dataclass
from functools import cache
from importlib import metadata
from time import perf_counter
from typing import Any

import numpy as np

from buckler.mbs.accuracy.delivery import Delivery, deliver
from buckler.mbs.accuracy.difference import COARSEST, FINEST
from buckler.mbs.accuracy.verify import verify as compare
from buckler.mbs.checks.suspicions import suspicions
from buckler.mbs.engine.settings import Exudyn
from buckler.mbs.engine.solve import once
from buckler.mbs.files.movie import Film
from buckler.mbs.mechanism import Mechanism
from buckler.mbs.record.energy import ledger as energy_ledger
from buckler.mbs.record.result import Result, Status
from buckler.mbs.record.run import Run
from buckler.mbs.record.signals import shapes_at
from buckler.mbs.spectral.solver import Spectral
from buckler.mbs.validate import number, one_of, positive


def _compiled(*arguments: Any) -> Run:
    """Run with the compiled solver, which takes a second to load."""
    from buckler.mbs.spectral.run import once as run

    return run(*arguments)


SOLVERS: dict[type, Callable[..., Run]] = {Exudyn: once, Spectral: _compiled}
"""What runs a mechanism once, by the type of the solver: `run(mechanism, duration, solver, timeout, progress)`."""


def simulate(
    mechanism: Mechanism,
    duration: float,
    accuracy: float | None = None,
    *,
    solver: Exudyn | Spectral | None = None,
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
        Largest relative error of the motion, as `mbs.accuracy.difference` measures it, 1e-6 to 0.1: the integrator, its steps and
        tolerances and the elements of flexible links that name no number are chosen to keep it, and the result's `error` tells
        what was delivered. It takes several runs. A result that misses it is SUSPECT, ACCURACY in the message.
    solver : Exudyn or Spectral, optional
        Solver and its settings, instead of an accuracy; `Exudyn()` by default, whose settings suit any scene.
    verify : bool
        Also run the other solver, `Spectral` for `Exudyn` and the other way, and put the difference into the result's
        `verified`. One beyond the sum of both estimates, or without an accuracy beyond 5 %, is SUSPECT, SOLVERS in the message.
        With clearance the first 10 ms are compared.
    ledger : bool
        Also keep the energy ledger, and mark a run whose balance fails as SUSPECT.
    shapes : sequence of float
        Times, s, at which to keep the shapes of flexible links.
    timeout : float, optional
        Wall-clock limit, s; beyond it the run ends as TIMED_OUT with what it has.
    progress : callable, optional
        Called with the fraction of a run done after each step.

    Returns
    -------
    Result
        Failures come as a status with a message, not as exceptions.

    Raises
    ------
    ValueError
        On wrong input, before any engine call.
    """
    one_of("mechanism", mechanism, (Mechanism,))
    positive("duration", duration, "s")
    if timeout is not None:
        positive("timeout", timeout, "s")
    for name, element in mechanism.elements().items():
        element.check_run(duration, name)
    times = np.atleast_1d(np.asarray(shapes, dtype=float))
    for t in times:
        number("shapes", float(t), 0.0, duration, "s")
    if solver is not None:
        one_of("solver", solver, tuple(SOLVERS))
    start = perf_counter()

    def run(mechanism: Mechanism, span: float, solver: Exudyn | Spectral) -> Run:
        left = None if timeout is None else max(1e-3, timeout - (perf_counter() - start))
        return _once(mechanism, span, solver, left, progress)

    def checked(result: Result) -> Result:
        return compare(result, mechanism, duration, solver or Exudyn(), run) if verify else result

    if accuracy is None:
        return checked(_result(run(mechanism, duration, solver or Exudyn()), None, ledger, times))
    number("accuracy", accuracy, FINEST, COARSEST, "1")
    if solver is not None:
        raise ValueError(f"accuracy = {accuracy:g} and solver: give one of them; an accuracy chooses the settings itself")
    delivery = deliver(mechanism, duration, accuracy, run)
    return checked(_result(delivery.run, delivery, ledger, times, perf_counter() - start))


def _once(mechanism: Mechanism, duration: float, solver: Exudyn | Spectral, timeout: float | None, progress: Any) -> Run:
    """One pass of the solver that was asked for."""
    return SOLVERS[type(solver)](mechanism, duration, solver, timeout, progress)


def _result(run: Run, delivery: Delivery | None, ledger: bool, times: Any, wall: float = 0.0) -> Result:
    """Signals, energies and checks of a run; with what the accuracy asked for made of it, and the time that took."""
    record = run.record
    signals, units = run.signals
    status, message = run.failure or (Status.OK, "")
    result = Result(
        status,
        message,
        record.time,
        signals,
        units,
        run.work,
        energy_ledger(record) if ledger else {},
        shapes_at(record, times) if len(times) else {},
        _provenance(run),
        film=Film(record),
    )
    if delivery is not None:
        result = delivery.complete(result, wall)
    for reason in suspicions(run, result):
        result = result.suspect(reason)
    return result


@cache
def _versions() -> dict[str, str]:
    """Of what computes."""
    return {name: metadata.version(name) for name in ("exudyn", "numpy", "scipy")} | {"python": platform.python_version()}


def _provenance(run: Run) -> dict[str, Any]:
    """Versions, what was built, the settings it ran with, and what is worth knowing of the mechanism."""
    found = {**_versions(), "scene": dict(run.summary), "settings": _settings(run.solver)}
    return found | ({"notes": list(run.notes)} if run.notes else {})


def _settings(value: Any) -> dict[str, Any]:
    """A solver's settings as plain values, each value that is a type of its own with its name."""
    found: dict[str, Any] = {"kind": type(value).__name__}
    for spec in fields(value):
        inner = getattr(value, spec.name)
        found[spec.name] = _settings(inner) if is_dataclass(inner) else inner
    return found
