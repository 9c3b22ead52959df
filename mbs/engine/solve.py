"""One run of the engine: assembly, choice and settings of the integrator, record."""

from dataclasses import replace
from math import ceil
from time import perf_counter

import exudyn as exu

from ..kinematics.closing import diagnose_last_pose
from ..kinematics.exact import sample_times
from ..mechanism import Mechanism
from ..process import Progress, catch_ctrl_c
from ..record.errors import Failure, Status
from ..record.run import Run
from ..solvers import MIN_STEP, Controlled, Equal, Exudyn, position_error
from .build import build
from .recording import Recorder
from .scene import SPARSE_FROM, EngineScene
from .stepping import StepControl


def run_engine(scene: EngineScene, control: Recorder, settings: exu.SimulationSettings) -> Failure | None:
    """Integrate with `control.engine`, the integrator that the recorder chose; return the failure, if any."""
    scene.system.SetPostStepUserFunction(control.after_step)
    keeps_jacobian = not settings.timeIntegration.newton.modifiedNewtonJacUpdatePerStep
    if isinstance(control, StepControl) and keeps_jacobian:  # a repeated step must ask for a new Jacobian
        scene.system.SetPreStepUserFunction(control.before_step)
    engine_error: Exception | None = None
    finished = False
    with catch_ctrl_c() as control.is_interrupted:
        try:
            finished = control.engine.SolveSystem(scene.system, settings)
        except exu.ExudynError as error:
            engine_error = error
    if control.callback_error is not None:
        raise control.callback_error
    last = control.time[-1] if control.time else 0.0
    diverged = f"no convergence after t = {last:.6g} s"
    if any(force.is_stuck for force in scene.with_memory):  # contacts in which the engine repeated a step too often
        reason = "a step is rejected again and again, however short: look at the contact law"
        return Failure(Status.NEWTON_DIVERGED, f"{diverged}: {reason}")
    failure = control.failure or scene.stopped  # at the end of a step, or of a user's function within one
    if failure is not None or finished:
        return failure
    if engine_error is None or isinstance(engine_error, exu.SolverError):
        return Failure(Status.NEWTON_DIVERGED, f"{diverged}: the smallest step did not help")
    return Failure(Status.ENGINE_ERROR, f"after t = {last:.6g} s: {' '.join(str(engine_error).split())[-200:]}")


def _make_common_settings(duration: float, solver: Exudyn) -> exu.SimulationSettings:
    """Return the settings that both integrators share."""
    settings = exu.SimulationSettings()
    settings.solution.file.write = False
    settings.timeIntegration.endTime = duration
    settings.timeIntegration.verboseMode = 0
    steps = solver.steps
    settings.timeIntegration.numberOfSteps = steps.count if isinstance(steps, Equal) else ceil(duration / steps.longest(duration))
    return settings


def explicit_settings(scene: EngineScene, solver: Exudyn, duration: float) -> exu.SimulationSettings:
    """Return the settings of the Dormand-Prince method, 5(4)."""
    settings = _make_common_settings(duration, solver)
    integration = settings.timeIntegration
    integration.solverType = exu.DynamicSolverType.DOPRI5
    integration.automaticStepSize = integration.adaptiveStep = solver.steps.adaptive
    integration.explicit.computeEndOfStepAccelerations = False  # the last stage is at the end of the step
    integration.absoluteTolerance = 1e100  # so that no equal step is rejected
    if solver.steps.adaptive:
        integration.initialStepSize = 1e-6  # s; the error control enlarges it
        # 10 is chosen: with 100 a rattling four-bar linkage takes 25 % fewer steps and has ten times the error,
        # still far below that of the implicit integrator
        integration.absoluteTolerance = 10.0 * position_error(scene.source, solver.steps.tolerance)
    integration.relativeTolerance = 0.0
    integration.minimumStepSize = 1e-15  # s, out of reach: the engine repeats one of this size for ever; joints end that
    return settings


def implicit_settings(scene: EngineScene, solver: Exudyn, duration: float) -> exu.SimulationSettings:
    """Return the settings of the generalized-alpha method."""
    settings = _make_common_settings(duration, solver)
    integration = settings.timeIntegration
    integration.minimumStepSize = MIN_STEP
    integration.adaptiveStep = solver.steps.adaptive
    integration.adaptiveStepRecoverySteps = 2**31 - 1  # StepControl increases the step
    integration.generalizedAlpha.spectralRadius = solver.spectral_radius
    integration.newton.useModifiedNewton = True
    # with clearance steps are many and short, and the Jacobian is kept until their size changes
    keeps_jacobian = bool(scene.source.clearances) and solver.steps.adaptive
    integration.newton.modifiedNewtonJacUpdatePerStep = not keeps_jacobian
    integration.newton.relativeTolerance = 1e-10  # of the residual, over that at the start of a step: chosen
    strips = [link.body for link in scene.mechanism.links if link.body.force_rounding]  # rounding of the axial force over E A
    reachable = max([1e-8, *(body.force_rounding * body.section.axial_stiffness for body in strips)])  # [N]; 1e-8 is chosen
    integration.newton.absoluteTolerance = solver.newton_absolute or reachable
    integration.discontinuous.useRecommendedStepSize = True  # a rejected step is repeated with that of `StepControl`
    if scene.source.redundant:
        settings.linearSolver.solverType = exu.LinearSolverType.EigenDense
        settings.linearSolver.ignoreSingularJacobian = True  # full pivoting finds one of many solutions
    elif scene.system.systemData.ODE2Size() >= SPARSE_FROM:
        settings.linearSolver.solverType = exu.LinearSolverType.EigenSparse
    return settings


def run_once(mechanism: Mechanism, duration: float, solver: Exudyn, timeout: float | None, progress: Progress | None) -> Run:
    """Assemble a mechanism, integrate it with the engine, and record its motion."""
    scene = build(mechanism)
    steps = solver.steps
    is_default = steps.adaptive and steps.tolerance is None
    if is_default and scene.source.is_determined:
        # constraints alone give the motion, so that steps have no local error: as many equal ones as the solver `Closure` takes
        count = len(sample_times(mechanism, duration, steps)) - 1
        if count <= steps.max_steps:  # else controlled steps, which may be fewer than max_steps
            solver = replace(solver, steps=Equal(count))
    start = perf_counter()
    is_explicit = scene.source.is_explicit_in_exudyn
    is_controlled = isinstance(solver.steps, Controlled) and not is_explicit
    control = (StepControl if is_controlled else Recorder)(scene, solver, duration, timeout, progress)
    settings = (explicit_settings if is_explicit else implicit_settings)(scene, solver, duration)
    failure = run_engine(scene, control, settings)
    wall = perf_counter() - start
    history = control.history(scene)
    work = {
        "wall_s": wall,
        "steps": float(len(history.time) - 1),
        "newton_iterations": float(control.engine.it.newtonStepsCount),
        "jacobians": float(control.engine.it.newtonJacobiCount),
        "rejected": float(control.rejected),
    }
    record = scene.record(history)
    if failure is not None and failure.status is Status.NEWTON_DIVERGED:
        failure = diagnose_last_pose(record) or failure
    if failure is None and record.time[-1] < duration * (1 - 1e-9):  # 1e-9: rounding of the sum of the steps
        end = f"the run ended at t = {record.time[-1]:.6g} s of {duration:.6g} s without a reason"
        failure = Failure(Status.ENGINE_ERROR, end)
    return Run(solver, record, failure, work, scene.summary(), [*scene.source.remarks, *scene.notes])
