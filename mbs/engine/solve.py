"""One run of the engine: the scene, the integrator that suits it, the record."""

from __future__ import annotations

from dataclasses import replace
from time import perf_counter
from typing import Any

import exudyn as exu

from buckler.mbs.engine.build import build
from buckler.mbs.engine.integrate import explicit_settings, implicit_settings, run_engine
from buckler.mbs.engine.recording import Recorder
from buckler.mbs.engine.scene import Scene
from buckler.mbs.engine.stepping import implicit_control
from buckler.mbs.interrupts import Progress
from buckler.mbs.kinematics.diagnosis import remarks, stuck
from buckler.mbs.kinematics.exact import sample_times
from buckler.mbs.kinematics.linkage import determined
from buckler.mbs.mechanism import Mechanism
from buckler.mbs.record.run import Run
from buckler.mbs.record.status import Status
from buckler.mbs.solvers.exudyn import Exudyn
from buckler.mbs.solvers.steps import Equal

UNFINISHED = 1e-9
"""Of the duration: what may be missing of it at the end."""


def once(mechanism: Mechanism, duration: float, solver: Exudyn, timeout: float | None, progress: Progress | None) -> Run:
    """Build the scene and let the engine run."""
    scene = build(mechanism)
    steps = solver.steps
    if steps.adaptive and steps.tolerance is None and determined(mechanism):
        count = len(sample_times(mechanism, duration, steps)) - 1
        solver = replace(solver, steps=Equal(count)) if count <= steps.max_steps else solver
    start = perf_counter()
    control, engine, failure = (_run_explicit if scene.loose else _run_implicit)(scene, solver, duration, timeout, progress)
    wall = perf_counter() - start
    history = control.record.history(scene)
    work = {
        "wall_s": wall,
        "steps": float(solver.steps.record_every * (len(history.time) - 1)),
        "newton_iterations": float(engine.it.newtonStepsCount),
        "jacobians": float(engine.it.newtonJacobiCount),
        "rejected": float(control.rejected),
    }
    record = scene.record(history)
    if failure is not None and failure[0] is Status.NEWTON_DIVERGED:
        failure = stuck(record) or failure
    if failure is None and solver.steps.record_every == 1 and record.time[-1] < duration * (1 - UNFINISHED):
        failure = Status.ENGINE_ERROR, f"the run ended at t = {record.time[-1]:.6g} s of {duration:.6g} s without a reason"
    return Run(solver, record, failure, work, scene.summary(), [*remarks(mechanism, scene.redundant), *scene.told])


def _run_implicit(scene: Scene, solver: Exudyn, duration: float, timeout: float | None, progress: Progress | None) -> Any:
    """Generalized-alpha."""
    engine = exu.MainSolverImplicitSecondOrder()
    control = implicit_control(scene, solver, duration, engine, timeout, progress)
    settings = implicit_settings(scene, solver, duration)
    if solver.steps.record_every > 1:
        settings.solution.sensors.writePeriod = solver.steps.longest(duration) * solver.steps.record_every
    return control, engine, run_engine(scene, control, engine, settings)


def _run_explicit(scene: Scene, solver: Exudyn, duration: float, timeout: float | None, progress: Progress | None) -> Any:
    """Dormand-Prince 5(4) with the engine's own error control: rigid links in free flight and short contacts."""
    engine = exu.MainSolverExplicit()
    control = Recorder(scene, solver, duration, timeout, progress)
    return control, engine, run_engine(scene, control, engine, explicit_settings(scene, solver, duration))
