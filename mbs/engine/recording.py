"""Recording of a run, step by step, and conditions that end a run early."""

from collections.abc import Callable
from math import nan
from time import perf_counter
from typing import Any

import exudyn as exu
import numpy as np

from ..geometry import Array
from ..laws.journal import SINCE
from ..process import Progress
from ..record.errors import Failure, Status
from ..solvers import Exudyn
from . import System
from .forces import StopContact
from .guarded import describe_failure
from .placed import EngineStates, History, WithMemory
from .scene import EngineScene


class Recorder:
    """Callback of the engine after each accepted step: record it, report the progress, end the run if necessary."""

    def __init__(
        self, scene: EngineScene, solver: Exudyn, duration: float, timeout: float | None, progress: Progress | None
    ) -> None:
        self.solver, self.duration, self.data = solver, duration, scene.system.systemData
        is_explicit = scene.source.is_explicit_in_exudyn  # rigid links with clearance in all joints, without constraints
        self.engine: Any = exu.MainSolverExplicit() if is_explicit else exu.MainSolverImplicitSecondOrder()
        self.stops = list(scene.stops.values())
        # a memory has values of the last accepted step, on which contacts and bristles depend; some laws use none of them
        self.updated: list[WithMemory] = [force for force in scene.with_memory if force.updates_memory]
        self.constrained = self.data.AEsize() > 0
        # entries for each step, or none if the system has no such values
        self.time: list[float] = []
        self.q: list[Array] = []  # displacements (coordinates,), then their rates
        self.q_t: list[Array] = []
        self.q_tt: list[Array] = []
        self.multipliers: list[Array] = []  # (constraints,)
        self.contact: list[list[float]] = []  # force [N] of each stop
        self.memory: list[list[Array]] = []  # an array (joints, 4) for each of `updated`, with the columns `laws.journal.MEMORY`
        self.deadline = perf_counter() + timeout if timeout else None
        self.progress: Callable[[float], None] | None = progress
        self.failure: Failure | None = None
        self.callback_error: BaseException | None = None
        self.is_interrupted: Callable[[], bool] = lambda: False  # replaced by `run_engine`, which catches Ctrl-C
        self.rejected = 0  # number of rejected steps, which a subclass counts

    def after_step(self, _system: System, t: float) -> bool:
        """Record a step; return False to end the run. An exception is stored, to be raised after the engine's return."""
        try:
            self._accept(t)
            return self._may_continue(t)
        except BaseException as error:
            self.callback_error = error
            return False

    def _accept(self, t: float) -> None:
        """Record a step; read multipliers, stops and memories only if there are any, as that takes as long as a small step."""
        data = self.data
        q, q_t = data.GetODE2Coordinates(), data.GetODE2Coordinates_t()
        self.time.append(t)
        self.q.append(q)
        self.q_t.append(q_t)
        self.q_tt.append(data.GetODE2Coordinates_tt())
        if self.constrained:
            self.multipliers.append(data.GetAECoordinates())
        if self.stops:
            self.contact.append([self._contact(stop, q, q_t, t) for stop in self.stops])
        if self.updated:
            self.memory.append([force.accept(q, q_t, t) for force in self.updated])
        if self.progress is not None:
            self.progress(t / self.duration)
        self.next_step(q, q_t)

    def _contact(self, stop: StopContact, q: Array, q_t: Array, t: float) -> float:
        """Update a stop and return its force [N]; nan, which ends the run, if its law raises an exception."""
        try:
            return stop.step(q, q_t)
        except Exception as error:
            self.failure = describe_failure(t, f"the law of the stop of '{stop.stop.point}'", error)
            return nan

    def next_step(self, q: Array, q_t: Array) -> None:
        """Do nothing: the engine chooses the size of the next step, unless a subclass does."""

    def _may_continue(self, t: float) -> bool:
        """Return False, and store the failure, if the run must end."""
        count = len(self.time)
        if self.failure is not None:
            return False
        if self.is_interrupted():
            self.failure = Failure(Status.INTERRUPTED, f"Ctrl-C at t = {t:.6g} s of {self.duration:.6g} s")
        elif count > self.solver.steps.max_steps:
            most = self.solver.steps.max_steps
            self.failure = Failure(Status.TOO_MANY_STEPS, f"more than max_steps = {most} steps by t = {t:.6g} s")
        elif self.deadline and count % 16 == 0 and perf_counter() > self.deadline:  # every 16th step
            self.failure = Failure(Status.TIMED_OUT, f"out of time at t = {t:.6g} s of {self.duration:.6g} s after {count} steps")
        elif not np.isfinite(self.q[-1]).all():
            self.failure = Failure(Status.NOT_FINITE, f"coordinates are not finite at t = {t:.6g} s")
        return self.failure is None

    def history(self, scene: EngineScene) -> History:
        """Stack the values as arrays; multipliers of the first step replace those at t = 0 that lack friction."""
        count, time = len(self.time), np.array(self.time)
        lists = (self.q, self.q_t, self.q_tt, self.multipliers, self.contact)
        q, q_t, q_tt, multipliers, contact = (np.array(entries).reshape(count, -1) for entries in lists)
        if scene.initial_multipliers_lack_friction and count > 1:
            multipliers[0] = multipliers[1]
        stacked = iter(np.array(entries) for entries in zip(*self.memory, strict=True))
        # each (times, joints, 4); a constant memory (joints, 4) is repeated
        memory = [next(stacked) if force.updates_memory else np.tile(force.memory, (count, 1, 1)) for force in scene.with_memory]
        for part in memory:
            part[:, :, SINCE] = time[:, None]  # time of the last accepted step: updated memories have it, constant ones do not
        return History(time, EngineStates(q, q_t, q_tt), multipliers, contact, memory)
