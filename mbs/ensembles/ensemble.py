"""Run the members of an ensemble and accumulate statistics of their signals.

    found = ensemble(
        mechanism, 2.0, members=1000, vary={"joints[0].gap": uniform(1e-4, 4e-4)}, of=["rms(B.normal_force)"], each=0.2
    )
    found.mean("rms(B.normal_force)"), found.error("rms(B.normal_force)")

A member is one run, divided into windows of time of the length `each`; a window gives one value of every reading. Members are
independent and the windows of one member are not: standard errors are computed from the means of the members.
"""

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass, replace
from math import floor
from pathlib import Path
from typing import Any

import numpy as np

from ..geometry import Array
from ..mechanism import Mechanism
from ..progress import USER_STOPS, TimeUpError, watch, watching
from ..record.errors import Failure
from ..record.run import collect
from ..scene.linkage import turning_speed
from ..solvers import Spectral
from ..spectral.channels import Channels
from ..spectral.dense import refine_times
from ..spectral.output import Output
from ..spectral.recording import record_of
from ..spectral.run import RunState, integrate, is_explicit
from ..spectral.scene import CompiledScene
from ..spectral.start import start_rates
from ..spectral.statistics import Accumulator, add_rows
from ..spectral.tables import ForceKind, Forces
from ..validate import one_of, positive, whole
from .members import Members
from .readings import StatisticReading, columns, formulas_of, values_of
from .result import Ensemble

CHUNK = 16
"""Members in a task of the executor: enough to hide its cost, few enough to keep all cores busy and lose little at Ctrl-C."""
BETWEEN = 3
"""States that are interpolated in a step over impacts; chosen."""
Curve = Callable[[Array], Array]
"""Signal given by a function: values at times [s], both of shape (times,)."""
Prepared = tuple[CompiledScene, RunState, Channels]
"""Compiled scene of a member, its initial state, its signals."""


@dataclass(frozen=True)
class Task:
    """Runs of members, with the settings that all have in common; it can be pickled for another process if its `curves` can."""

    members: Members
    duration: float  # [s]
    solver: Spectral
    readings: tuple[StatisticReading, ...]
    edges: Array  # times between windows [s], (windows + 1,)
    curves: Mapping[str, Curve]  # signals given by the user

    def run(self, members: Iterable[int]) -> list[tuple[int, Array, str]]:
        """Run members; return for each its number, values (windows, readings), nan if it failed, and the reason or ''."""
        prepared: dict[int, Prepared] = {}  # by the index of the mechanism, if no number varies
        found = []
        for k in members:
            try:
                values, failure = self.integrate(k, self.prepare(k, prepared))
                reason = f"{failure.status}: {failure.message}" if failure is not None else ""
            except (ValueError, KeyError) as error:  # numbers with which no mechanism can be made, or no run can begin
                reason = f"{type(error).__name__}: {error}"
            if reason:
                values = np.full((len(self.edges) - 1, len(self.readings)), np.nan)
            found.append((k, values, reason))
        return found

    def prepare(self, k: int, prepared: dict[int, Prepared]) -> Prepared:
        """Compile the scene of a member, or return that of an earlier member if only the initial state differs."""
        index = self.members.mechanism_index(k)
        if index in prepared:
            return prepared[index]
        scene = CompiledScene.of(self.members.mechanism(k), self.solver.degree)
        names = dict.fromkeys(name for reading in self.readings for name in reading.signals if name not in self.curves)
        start = RunState(0.0, scene.q0, start_rates(scene), scene.memory())
        member = scene, start, Channels.of(scene, list(names))
        if not self.members.paths:  # no number varies: members of a mechanism differ in their initial states alone
            prepared[index] = member
        return member

    def integrate(self, k: int, member: Prepared) -> tuple[Array, Failure | None]:
        """Integrate member k from its random start and accumulate statistics; return values (windows, readings) and failure."""
        scene, start, channels = member
        formulas = formulas_of(self.readings)  # by text: `abs(rocker.ax)` of the reading `max(abs(rocker.ax))`
        sums = Accumulator.over(self.edges, len(formulas))
        # Implicit steps of joints with clearance pass over the peaks of impacts, so states within steps are interpolated.
        # Explicit steps need no interpolation: they are stable only if several lie in each impact. Strips are not interpolated:
        # they are so stiff along their line that errors of an interpolated shape make large forces.
        has_journals = bool((scene.tables.forces[:, Forces.KIND] == ForceKind.JOURNAL).any())
        interpolates = has_journals and not len(scene.tables.strips) and not is_explicit(scene, self.solver)
        before: Output | None = None

        def accumulate(part: Output) -> None:
            """Add the values of the formulas at the next rows of the run, a part of its output."""
            nonlocal before
            rows = add_states(scene, before, part) if interpolates else part
            before = part
            signals = dict(zip(channels.names, channels.values(scene, rows).T, strict=True))
            signals |= {name: curve(rows.time) for name, curve in self.curves.items()}
            add_rows(rows.time, columns(formulas, signals), sums)

        state = start._replace(q=start.q + self.members.draw_offset(scene, k))
        _last_row, failure, _counts = integrate(scene, self.duration, self.solver, state=state, take=accumulate)
        return values_of(self.readings, formulas, sums), failure


def add_states(scene: CompiledScene, before: Output | None, part: Output) -> Output:
    """Add interpolated states in each step of a part of the output, and in the step that leads to it from the part before."""
    if before is None:
        return refine_times(scene, part, BETWEEN) if len(part.time) > 1 else part
    joined = Output(*(np.concatenate([old[-1:], new]) for old, new in zip(before, part, strict=True)))
    return Output(*(column[1:] for column in refine_times(scene, joined, BETWEEN)))  # the old row has been counted


@watch("members")
def ensemble(
    mechanism: Mechanism | Sequence[Mechanism], duration: float, members: int = 1000, *, vary: Mapping[str, Any] | None = None,
    of: Sequence[str], curves: Mapping[str, Curve] | None = None, skip: int = 1, each: float | None = None,
    solver: Spectral | None = None, seed: int = 1,
    executor: Executor | None = None, store: str | Path | None = None, timeout: float | None = None,
    progress: bool | None = None,
) -> Ensemble:  # fmt: skip
    """Run a mechanism many times, with varied numbers and initial states, and gather readings of each window of time.

    Members start with their journals at random places in their bushes. Without clearance their coordinates have random offsets
    of 1e-9 of the longest link or rad, from which only chaotic motions differ. No signal is recorded. The values of a member that
    fails are nan. Raise a ValueError for an invalid reading, path or number.

    Parameters
    ----------
    duration : float [s]
    members : int
        Number of members for each mechanism and each combination of listed values.
    vary : dict, optional
        Numbers that vary: a frozen distribution of `scipy.stats` or a list of values, by the path of the number in a file, as
        `joints[0].gap`. All combinations of the lists are run.
    of : list of str
        Readings, such as `rms(B.normal_force)`, `max(abs(rocker.ax))`, `share(B.normal_force)`, `onsets(B.normal_force)`; see
        `buckler.mbs.ensembles.readings`.
    curves : dict of str to callable, optional
        Additional signals, functions of an array of times [s], by name: `ideal.vx` in `rms(rocker.vx - ideal.vx)`.
    skip : int
        Number of windows at the start that statistics leave out.
    each : float, optional [s]
        Length of a window; by default a turn of the drive at its largest speed, or the duration if no drive turns.
    solver : Spectral, optional
        Solver and its settings; by default explicit where nothing is stiff but contacts of joints with clearance.
    seed : int
        Seed of numbers and initial states. A member depends on the seed and on its own number, not on the executor.
    executor : concurrent.futures.Executor, optional
        Executor of chunks of members; by default one thread for each core.
    store : path, optional
        File (.npz) that keeps the members that have run; the same call continues from it.
    timeout, progress
        Limit of time [s], after which members that have run are returned; `progress` shows the state, by default in terminals.
    """
    positive("duration", duration, "s"), whole("skip", skip, 0, 10**6)
    solver = one_of("solver", solver or Spectral(), (Spectral,))
    if not of:
        raise ValueError("of: give one reading or more, as ['rms(B.normal_force)']")
    readings = tuple(map(StatisticReading.of, of))
    mechanisms = (mechanism,) if isinstance(mechanism, Mechanism) else tuple(mechanism)
    speed = turning_speed(mechanisms[0], duration)
    turn = 2 * np.pi / speed if speed > 0 else duration
    length = min(duration, turn) if each is None else positive("each", each, "s")
    windows = floor(duration / length * (1 + 1e-9))  # 1e-9: a duration of whole windows may round down
    if windows <= skip:
        raise ValueError(f"skip = {skip}: the run has {windows} windows of {length:g} s; skip fewer, or run longer")
    drawn = Members.draw(mechanisms, members, vary or {}, seed)
    edges = length * np.arange(windows + 1)
    task = Task(drawn, duration, solver, readings, edges, curves or {})
    units = _try_first(task)
    values = np.full((len(drawn), windows, len(of)), np.nan)
    found = Ensemble(drawn, tuple(of), edges, skip, values, np.zeros(len(drawn), dtype=bool), [""] * len(drawn), units)
    found = found.resume(store) if store and Path(store).exists() else found
    return _gather(task, found, executor, store)


def _try_first(task: Task) -> dict[str, str]:
    """Run the first member for a short time and return the units of readings; raise a ValueError if one or a path is wrong."""
    duration = 1e-4 * task.duration  # chosen: the first rows of a run of any duration show wrong names
    trial = replace(task, duration=duration, edges=np.array([0.0, duration]))
    units: dict[str, str] = {}
    try:
        scene, start, channels = trial.prepare(0, {})
        trial.integrate(0, (scene, start, channels))  # evaluates the readings, keeps no rows of the run
        parts: list[Output] = []
        integrate(scene, duration, task.solver, state=start, take=parts.append)  # keeps rows, of which signals give units
        if parts:
            units = {name: signal.unit for name, signal in collect(record_of(scene, parts[0])).items()}
    except np.linalg.LinAlgError:  # a ValueError, but no mistake in the call: the run of this member will report it
        pass
    except KeyError as error:
        raise ValueError(str(error)) from None
    return {reading.text: reading.unit(units) for reading in task.readings}


def _gather(task: Task, found: Ensemble, executor: Executor | None, store: str | Path | None) -> Ensemble:
    """Run the members that have not run yet and add their values; after Ctrl-C or the time limit return what has been added."""
    left = [k for k in range(len(task.members)) if not found.done[k]]
    pool = executor or ThreadPoolExecutor(os.cpu_count())
    chunks = [left[first : first + CHUNK] for first in range(0, len(left), CHUNK)]
    running: set[Future[list[tuple[int, Array, str]]]] = {pool.submit(task.run, chunk) for chunk in chunks}
    progress = watching.get()
    progress.most = len(left)
    try:
        while running:
            progress.check()
            ended, running = wait(running, 0.2, FIRST_COMPLETED)  # 0.2 s at most, until the next check
            for k, values, reason in (member for future in ended for member in future.result()):
                found.values[k], found.done[k], found.reasons[k] = values, True, reason
                progress.count += 1
            if store and ended:
                found.save(store)
    except USER_STOPS as stop:
        for future in running:
            future.cancel()
        found = replace(found, interrupted=not isinstance(stop, TimeUpError), timed_out=isinstance(stop, TimeUpError))
    finally:
        if executor is None:
            pool.shutdown(cancel_futures=True)
    return found
