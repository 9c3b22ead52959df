"""A short stretch of a run once more, at half its steps: what a step too long did to it shows at once."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import exudyn as exu
import numpy as np

from buckler.mbs.engine.history import History
from buckler.mbs.engine.integrate import explicit_settings, implicit_settings, run_engine
from buckler.mbs.engine.placed import States
from buckler.mbs.engine.recording import Recorder
from buckler.mbs.engine.scene import Scene, build
from buckler.mbs.engine.stepping import implicit_control
from buckler.mbs.mechanism import Mechanism
from buckler.mbs.record.record import Record
from buckler.mbs.solvers.choice import usual_tolerance
from buckler.mbs.solvers.exudyn import Exudyn

PATIENCE = 60.0
"""Longest time a stretch may take, s."""
THIRD, FIFTH = 8.0, 32.0
"""What the local error allowed a step is divided by to halve the steps of the implicit and the explicit integrator."""


def half_steps(mechanism: Mechanism, history: History, solver: Exudyn, first: int, last: int) -> Record | None:
    """Run from sample `first` to sample `last` again with steps half as long; equal steps are recorded at the same times.

    The scene is built anew, so that nothing of the run is left in it; it starts from the recorded positions, velocities and
    accelerations, its contacts with what they remember.

    Returns
    -------
    record : Record or None
        None if the engine does not get to the end.
    """
    scene = build(mechanism)
    _place(scene, history, first)
    start, end = float(history.time[first]), float(history.time[last])
    finer = _finer(scene, solver, history, first, last)
    engine: Any
    control: Recorder
    if scene.loose:
        engine, control = exu.MainSolverExplicit(), Recorder(scene, finer, end, PATIENCE, None)
        settings = explicit_settings(scene, finer, end)
        settings.timeIntegration.initialStepSize = float(np.diff(history.time[first : first + 2])[0]) / 2
    else:
        engine = exu.MainSolverImplicitSecondOrder()
        control = implicit_control(scene, finer, end, engine, PATIENCE, None)
        settings = implicit_settings(scene, finer, end)
        settings.timeIntegration.generalizedAlpha.computeInitialAccelerations = first == 0  # seldom records lack them there
    settings.timeIntegration.startTime = start
    settings.timeIntegration.numberOfSteps = finer.steps.number(end - start)
    failure = run_engine(scene, control, engine, settings)
    if failure or len(control.record.time) < 2:
        return None
    found = control.record.history(scene)
    return scene.record(found if solver.steps.record_every == 1 else _rows(found, 2 * solver.steps.record_every))


def _place(scene: Scene, history: History, first: int) -> None:
    """Put a new scene where the run was at a sample."""
    data, initial = scene.system.systemData, exu.ConfigurationType.Initial
    data.SetODE2Coordinates(history.states.q[first], configuration=initial)
    data.SetODE2Coordinates_t(history.states.q_t[first], configuration=initial)
    data.SetODE2Coordinates_tt(history.states.q_tt[first], configuration=initial)
    for group, memory in zip(scene.remembering, history.memory, strict=True):
        group.memory[:] = memory[first]
    for contact in scene.stops.values():
        for q, q_t in zip(history.states.q[: first + 1], history.states.q_t[: first + 1], strict=True):
            contact.accept(*contact.state(q, q_t))


def _rows(history: History, every: int) -> History:
    """One recorded sample in so many."""
    states = States(*(part[::every] for part in history.states))
    kept = {name: getattr(history, name)[::every] for name in ("time", "multipliers", "contact")}
    return replace(history, **kept, states=states, memory=[memory[::every] for memory in history.memory])


def _finer(scene: Scene, solver: Exudyn, history: History, first: int, last: int) -> Exudyn:
    """Settings for steps half as long as those recorded, and no longer than the defaults'."""
    taken = np.diff(history.time[first : last + 1])
    finer = solver.steps.halved(taken, usual_tolerance(scene.mechanism), FIFTH if scene.loose else THIRD)
    newton = solver if not finer.adaptive else Exudyn()
    return replace(solver, steps=finer, newton_relative=newton.newton_relative, newton_absolute=newton.newton_absolute)
