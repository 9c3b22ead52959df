"""One run: solver settings chosen from the scene, the engine's work, the checks, the `Result`."""

from __future__ import annotations

import platform
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil, pi
from time import perf_counter
from typing import Any

import exudyn as exu
import exudyn.itemInterface as eii
import numpy as np

from buckler.mbs.accuracy.delivery import Delivery, deliver
from buckler.mbs.accuracy.difference import COARSEST, FINEST
from buckler.mbs.checks.suspicions import suspicions
from buckler.mbs.engine.recording import Recorder
from buckler.mbs.engine.scene import SPARSE_FROM, Scene, build
from buckler.mbs.engine.settings import Solver
from buckler.mbs.engine.stepping import StepControl, longest_step, position_error
from buckler.mbs.kinematics.closure import determined, turning_speed
from buckler.mbs.mechanism import Beam, Cable, Mechanism, Strut
from buckler.mbs.record.energy import ledger as energy_ledger
from buckler.mbs.record.result import Result, Status
from buckler.mbs.record.signals import History, collect, shapes_at
from buckler.mbs.validate import number, positive

Array = np.ndarray[Any, Any]
EXPLICIT_SHARE = 10.0
"""Absolute tolerance of the explicit integrator, fifth order, in units of the position error allowed the implicit one."""
UNLIMITED = 1e100
"""Tolerance of the explicit integrator's equal steps: it rejects by its error even steps whose size it may not change."""
NEVER_REACHED = 1e-15
"""Smallest step of the explicit integrator, s. One that is reached twice it rejects for ever, and no callback ends the run."""

TURN = 400
"""Equal steps of a turn of the drive where constraints alone decide the motion: steps that change
their size make the accelerations ring there, and gain nothing."""


@dataclass(frozen=True)
class Run:
    """One pass of the engine.

    Attributes
    ----------
    solver : Solver
        The settings it was made with.
    history : History
    failure : (Status, str) or None
    work : dict
        wall_s (the engine's), steps, newton_iterations, jacobians, rejected.
    """

    solver: Solver
    history: History
    failure: tuple[Status, str] | None
    work: dict[str, float]

    @cached_property
    def signals(self) -> tuple[dict[str, Array], dict[str, str]]:
        """Signals and their units."""
        return collect(self.history)


def simulate(
    mechanism: Mechanism,
    duration: float,
    accuracy: float | None = None,
    *,
    solver: Solver | None = None,
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
    solver : Solver, optional
        Settings of the integration instead of an accuracy; the defaults suit any scene.
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
    positive("duration", duration, "s")
    if timeout is not None:
        positive("timeout", timeout, "s")
    times = np.atleast_1d(np.asarray(shapes, dtype=float))
    for t in times:
        number("shapes", float(t), 0.0, duration, "s")
    if accuracy is None:
        return _result(_once(mechanism, duration, solver or Solver(), timeout, progress), None, ledger, times)
    number("accuracy", accuracy, FINEST, COARSEST, "1")
    if solver is not None:
        raise ValueError(f"accuracy = {accuracy:g} and solver: give one of them; an accuracy chooses the settings itself")
    start = perf_counter()

    def run(mechanism: Mechanism, span: float, solver: Solver) -> Run:
        left = None if timeout is None else max(1e-3, timeout - (perf_counter() - start))
        return _once(mechanism, span, solver, left, progress)

    delivery = deliver(mechanism, duration, accuracy, run)
    return _result(delivery.run, delivery, ledger, times, perf_counter() - start)


def _once(mechanism: Mechanism, duration: float, solver: Solver, timeout: float | None, progress: Any) -> Run:
    """Build the scene and let the engine run."""
    scene = build(mechanism)
    if solver.tolerance is None and solver.uniform_steps is None and determined(mechanism):
        share = duration / longest_step(solver, duration)
        turns = turning_speed(mechanism, duration) * duration / (2 * pi)
        solver = replace(solver, uniform_steps=ceil(max(share, TURN * turns)))
    start = perf_counter()
    control, engine, failure = (_run_explicit if scene.loose else _run_implicit)(scene, solver, duration, timeout, progress)
    wall = perf_counter() - start
    history = History.of(scene, control.record)
    work = {
        "wall_s": wall,
        "steps": float(solver.record_every * (len(history.time) - 1)),
        "newton_iterations": float(engine.it.newtonStepsCount),
        "jacobians": float(engine.it.newtonJacobiCount),
        "rejected": float(control.rejected),
    }
    return Run(solver, history, failure, work)


def _result(run: Run, delivery: Delivery | None, ledger: bool, times: Any, wall: float = 0.0) -> Result:
    """Signals, energies and checks of a run; with what the accuracy asked for made of it, and the time that took."""
    history = run.history
    signals, units = run.signals
    status, message = run.failure or (Status.OK, "")
    result = Result(
        status,
        message,
        history.time,
        signals,
        units,
        run.work,
        energy_ledger(history) if ledger else {},
        shapes_at(history, times) if len(times) else {},
        {"exudyn": exu.__version__, "python": platform.python_version(), "scene": history.scene.summary()},
    )
    if delivery is not None:
        result = delivery.complete(result, wall)
    for reason in suspicions(history, run.solver, result):
        result = result.suspect(reason)
    return result


def _run_implicit(scene: Scene, solver: Solver, duration: float, timeout: float | None, progress: Any) -> Any:
    """Generalized-alpha under step control."""
    engine = exu.MainSolverImplicitSecondOrder()
    control = StepControl(scene, solver, duration, engine, timeout, progress)
    if solver.uniform_steps is None:
        scene.system.SetPostNewtonUserFunction(control.after_newton)
    settings = _implicit(scene, solver, duration)
    if solver.record_every > 1:
        settings.solution.sensors.writePeriod = duration / (solver.uniform_steps or 1) * solver.record_every
    return control, engine, _run(scene, control, engine, settings)


def _run_explicit(scene: Scene, solver: Solver, duration: float, timeout: float | None, progress: Any) -> Any:
    """Dormand-Prince 5(4) with the engine's own error control: rigid links in free flight and short contacts."""
    engine = exu.MainSolverExplicit()
    control = Recorder(scene, solver, duration, timeout, progress)
    return control, engine, _run(scene, control, engine, _explicit(scene, solver, duration))


def _run(scene: Scene, control: Recorder, engine: Any, settings: Any) -> tuple[Status, str] | None:
    """Let the engine run; what went wrong, if anything."""
    if control.solver.record_every > 1:
        _record_seldom(scene, control)
    else:
        scene.system.SetPostStepUserFunction(control.after_step)
    if isinstance(control, StepControl) and not settings.timeIntegration.newton.modifiedNewtonJacUpdatePerStep:
        scene.system.SetPreStepUserFunction(control.before_step)
    try:
        finished = engine.SolveSystem(scene.system, settings)
    except exu.ExudynError as error:
        return control.failure or _named(control, error)
    if control.failure is not None:
        return control.failure
    return None if finished else _diverged(control, "the smallest step did not help")


def _record_seldom(scene: Scene, control: Recorder) -> None:
    """Record where the engine writes its sensors, by a sensor: no callback after the steps between."""

    def record(system: Any, t: float, *_: Any) -> list[float]:
        if not (control.record.time and t == control.record.time[-1]) and not control.after_step(system, t):
            raise RuntimeError("the run must end here")  # a sensor cannot end it otherwise
        return [0.0]

    item = eii.SensorUserFunction(sensorNumbers=[], factors=[], sensorUserFunction=record, storeInternal=False, writeToFile=False)
    scene.system.AddSensor(item)
    scene.system.Assemble()


def _named(control: Recorder, error: Exception) -> tuple[Status, str]:
    """Name the engine's exception: a law out of its range, no convergence, or something else."""
    text = " ".join(str(error).split())
    if "outside the range" in text or "must lie in" in text:
        reason = next((line.strip() for line in str(error).splitlines() if "must lie in" in line or "range" in line), text)
        return Status.STRUT_OUT_OF_RANGE, f"after t = {_reached(control):.6g} s: {reason}"
    if "NoStepError" in text:
        return _diverged(control, "a step is rejected again and again, however short: look at the contact law")
    if isinstance(error, exu.SolverError):
        return _diverged(control, text[-200:])
    return Status.ENGINE_ERROR, f"after t = {_reached(control):.6g} s: {text[-200:]}"


def _diverged(control: Recorder, reason: str) -> tuple[Status, str]:
    return Status.NEWTON_DIVERGED, f"no convergence after t = {_reached(control):.6g} s: {reason}"


def _reached(control: Recorder) -> float:
    return control.record.time[-1] if control.record.time else 0.0


def _common(duration: float, solver: Solver) -> Any:
    settings = exu.SimulationSettings()
    settings.solution.file.write = False
    settings.timeIntegration.endTime = duration
    settings.timeIntegration.verboseMode = 0
    settings.timeIntegration.numberOfSteps = solver.uniform_steps or max(1, ceil(duration / longest_step(solver, duration)))
    return settings


def _explicit(scene: Scene, solver: Solver, duration: float) -> Any:
    settings = _common(duration, solver)
    integration = settings.timeIntegration
    integration.solverType = exu.DynamicSolverType.DOPRI5
    controlled = solver.uniform_steps is None
    integration.automaticStepSize = integration.adaptiveStep = controlled
    integration.initialStepSize = 1e-6
    integration.explicit.computeEndOfStepAccelerations = False  # the last of Dormand and Prince's stages is the step's end
    integration.absoluteTolerance = EXPLICIT_SHARE * position_error(scene, solver) if controlled else UNLIMITED
    integration.relativeTolerance = 0.0
    integration.minimumStepSize = min(solver.min_step, NEVER_REACHED)
    return settings


def _implicit(scene: Scene, solver: Solver, duration: float) -> Any:
    settings = _common(duration, solver)
    integration = settings.timeIntegration
    integration.minimumStepSize = solver.min_step
    integration.adaptiveStep = solver.uniform_steps is None
    integration.adaptiveStepRecoverySteps = 2**31 - 1  # growing the step again is StepControl's business
    integration.generalizedAlpha.spectralRadius = solver.spectral_radius
    integration.newton.useModifiedNewton = True
    keep = solver.reuse_jacobian or (bool(scene.clearances) and solver.uniform_steps is None)
    integration.newton.modifiedNewtonJacUpdatePerStep = not keep  # a new step size needs a new Jacobian
    integration.newton.relativeTolerance = solver.newton_relative
    integration.newton.absoluteTolerance = solver.newton_absolute or _reachable_residual(scene)
    # the only connectors with a say in it are StepControl's callback; no native contact element is built
    integration.discontinuous.useRecommendedStepSize = True
    if scene.system.systemData.ODE2Size() >= SPARSE_FROM:
        settings.linearSolver.solverType = exu.LinearSolverType.EigenSparse
    return settings


def _reachable_residual(scene: Scene) -> float:
    """Residual, N, ten times above what round-off leaves of the stiffest link's axial force."""
    stiff = [link.body.section.axial_stiffness for link in scene.mechanism.links if isinstance(link.body, Beam | Cable)]
    soft = [link.body.section.axial_stiffness for link in scene.mechanism.links if isinstance(link.body, Strut)]
    return max(1e-8, 5e-12 * max(stiff, default=0.0), 5e-15 * max(soft, default=0.0))
