"""Run the members of an ensemble and accumulate statistics of their signals.

    found = ensemble(
        mechanism, 2.0, members=1000, vary={"joints[0].gap": uniform(1e-4, 4e-4)}, of=["rms(B.normal_force)"], each=0.2
    )
    found.mean("rms(B.normal_force)"), found.error("rms(B.normal_force)")

A member is one run, divided into windows of time; each window gives one value of every reading. Members are independent and the
windows of one member are not: standard errors are those of the members' means.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass, replace
from math import floor
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..geometry import Array
from ..mechanism import Mechanism
from ..progress import STOPS, TimeUpError, watch, watching
from ..scene.linkage import turning_speed
from ..solvers import Spectral
from ..spectral.channels import Channels
from ..spectral.dense import refine_times
from ..spectral.output import Output
from ..spectral.run import RunState, integrate, is_explicit
from ..spectral.scene import CompiledScene
from ..spectral.start import start_rates
from ..spectral.statistics import Accumulator
from ..spectral.tables import ForceKind, Forces
from ..validate import one_of, positive, whole
from .members import Members, split
from .readings import StatisticReading, columns, formulas_of, values_of
from .result import Ensemble

CHUNK = 16
"""Members in a task: enough to hide the cost of a task, few enough to keep all cores busy and to lose little at Ctrl-C."""
LOOK = 0.2
"""Time between two looks for Ctrl-C and for the limit of time [s]."""
STATES_WITHIN = 3
"""Number of states that are interpolated within each implicit step of joints with clearance."""
Curve = Callable[[Array], Array]
"""Signal given by a function: values at times [s], both of shape (times,)."""


class PreparedMember(NamedTuple):
    """Compiled scene of a member, its initial state, the columns of its signals; True if its steps pass over impacts."""

    scene: CompiledScene
    start: RunState
    channels: Channels
    loose: bool


@dataclass(frozen=True)
class Task:
    """Settings that all members have in common; it can be pickled for another process."""

    members: Members
    duration: float  # [s]
    solver: Spectral
    readings: tuple[StatisticReading, ...]
    edges: Array  # of the windows [s], (windows + 1,)
    curves: Mapping[str, Curve]  # given signals

    def run(self, members: Iterable[int]) -> list[tuple[int, Array, str]]:
        """Run members; return for each its number, values (windows, readings), nan where it failed, and the reason."""
        prepared: dict[int, PreparedMember] = {}
        return [(k, *self._run_one(k, prepared)) for k in members]

    def _prepare(self, k: int, prepared: dict[int, PreparedMember]) -> PreparedMember:
        """Compile the scene of a member, or take that of one with the same numbers."""
        source = self.members.source(k)
        if source not in prepared or self.members.paths:
            scene = CompiledScene.of(self.members.mechanism(k), self.solver.degree)
            names = dict.fromkeys(name for each in self.readings for name in each.signals if name not in self.curves)
            channels = Channels.of(scene, list(names))
            loose = steps_over_impacts(scene, self.solver)
            prepared[source] = PreparedMember(scene, RunState(0.0, scene.q0, start_rates(scene), scene.memory()), channels, loose)
        return prepared[source]

    def _run_one(self, k: int, prepared: dict[int, PreparedMember]) -> tuple[Array, str]:
        nothing = np.full((len(self.edges) - 1, len(self.readings)), np.nan)
        formulas = formulas_of(self.readings)
        found, last = Accumulator.over(self.edges, len(formulas)), list[Output]()

        def take(out: Output) -> None:
            """Accumulate the formulas' values at the rows of a run."""
            if loose:
                last[:], out = [out], fill(scene, last, out)
            signals = dict(zip(channels.names, channels.values(scene, out).T, strict=True))
            signals |= {name: curve(out.time) for name, curve in self.curves.items()}
            found.add(out.time, columns(formulas, signals))

        try:
            scene, start, channels, loose = self._prepare(k, prepared)
            state = start._replace(q=start.q + self.members.shift(scene, k))
            _, failure, _ = integrate(scene, self.duration, self.solver, state=state, take=take)
        except (ValueError, KeyError) as error:
            return nothing, f"{type(error).__name__}: {error}"
        if failure is not None:
            return nothing, f"{failure[0]}: {failure[1]}"
        return values_of(self.readings, formulas, found), ""


def steps_over_impacts(scene: CompiledScene, solver: Spectral) -> bool:
    """Return True if implicit steps of joints with clearance may pass over the peaks of impacts.

    States within the steps then supply the peaks; not with strips, whose force an interpolated shape makes too large.
    """
    tables = scene.tables
    journals = bool((tables.forces[:, Forces.KIND] == ForceKind.JOURNAL).any())
    return not is_explicit(scene, solver) and not len(tables.strips) and journals


def fill(scene: CompiledScene, last: Sequence[Output], out: Output) -> Output:
    """Add states within the steps of a block of rows, which continues the last row of the block before."""
    first = [Output(*(column[-1:] for column in each)) for each in last]
    joined = Output(*(np.concatenate(columns) for columns in zip(*first, out, strict=True)))
    return refine_times(scene, joined, STATES_WITHIN) if len(joined.time) > 1 else joined


@watch("members")
def ensemble(
    mechanism: Mechanism | Sequence[Mechanism], duration: float, members: int = 1000, *, vary: Mapping[str, Any] | None = None,
    of: Sequence[str], curves: Mapping[str, Curve] | None = None, skip: int = 1, each: float | None = None,
    solver: Spectral | None = None, seed: int = 1,
    executor: Executor | None = None, store: str | Path | None = None, timeout: float | None = None,
    progress: bool | None = None,
) -> Ensemble:  # fmt: skip
    """Run a mechanism many times, with other numbers and other starts, and gather readings of each window of time.

    Members start with their journals at random places in their bushes; without clearance, with an offset of 1e-9. Statistics are
    accumulated by compiled code while a member runs, and no signal is recorded. The values of a member that fails are nan.

    Parameters
    ----------
    mechanism : Mechanism or sequence of Mechanism
    duration : float [s]
    members : int
        Number for each mechanism and combination of given values.
    vary : dict, optional
        Frozen distribution of `scipy.stats` or list of values, by the path of a number in files (`joints[0].gap`). All
        combinations of the lists are run.
    of : list of str
        Readings, such as `rms(B.normal_force)`, `max(abs(rocker.ax))`, `share(B.normal_force)`, `onsets(B.normal_force)`; see
        `buckler.mbs.ensembles.readings`.
    curves : dict of str to callable, optional
        Signals given as functions of an array of times [s], as in `rms(rocker.vx - ideal.vx)`.
    skip : int
        Windows at the start that statistics leave out.
    each : float, optional [s]
        Length of a window; by default a turn of the first drive, or the duration where none turns steadily.
    solver : Spectral, optional
        By default explicit if all links are connected by joints with clearance.
    seed : int
        Seed of numbers and initial states. A member depends on it and on the member's number, not on the executor.
    executor : concurrent.futures.Executor, optional
        Runs chunks of members; by default one thread for each core.
    store : path, optional
        File (.npz) of members that have run; the same call continues from it.
    timeout, progress
        Limit of time [s], after which the best so far is the answer; how long it takes is shown, by default in terminals.

    Returns
    -------
    Ensemble

    Raises
    ------
    ValueError
        If a reading, a path or a number makes no sense.
    """
    positive("duration", duration, "s"), whole("skip", skip, 0, 10**6)
    solver = one_of("solver", solver or Spectral(), (Spectral,))
    if not of:
        raise ValueError("of: give one reading or more, as ['rms(B.normal_force)']")
    readings, mechanisms = (
        tuple(map(StatisticReading.of, of)),
        (mechanism,) if isinstance(mechanism, Mechanism) else tuple(mechanism),
    )
    length = each or _turn(mechanisms[0], duration)
    windows = floor(duration / positive("each", length, "s") * (1 + 1e-9))
    if windows <= skip:
        raise ValueError(f"skip = {skip}: the run has {windows} windows of {length:g} s; skip fewer, or run longer")
    drawn, edges = Members.draw(mechanisms, members, vary or {}, seed), length * np.arange(windows + 1)
    task = Task(drawn, duration, solver, readings, edges, curves or {})
    _try_first(task)
    found = Ensemble.blank(drawn, tuple(of), edges, skip)
    found = found.resume(store) if store and Path(store).exists() else found
    return _gather(task, found, executor, store)


def _turn(mechanism: Mechanism, duration: float) -> float:
    """Return the time of one turn of the drive [s], or the duration."""
    speed = turning_speed(mechanism, duration)
    return min(duration, 2 * np.pi / speed) if speed > 0 else duration


def _try_first(task: Task) -> None:
    """Run the first member for a ten-thousandth of the duration; a ValueError if readings or paths are wrong."""
    short = replace(task, duration=task.duration * 1e-4, edges=np.array([0.0, task.duration * 1e-4]))
    (_, _, reason), = short.run([0])  # fmt: skip
    if reason.startswith(("ValueError", "KeyError", "UnknownSignalError")):
        raise ValueError(reason.partition(": ")[2])


def _gather(task: Task, found: Ensemble, executor: Executor | None, store: str | Path | None) -> Ensemble:
    """Run the members that have not run; if interrupted, return the finished ones."""
    left = [k for k in range(len(task.members)) if not found.done[k]]
    chunks = [[left[k] for k in part] for part in split(len(left), CHUNK)]
    own = executor is None
    pool = executor or ThreadPoolExecutor(os.cpu_count())
    running: set[Future[list[tuple[int, Array, str]]]] = {pool.submit(task.run, chunk) for chunk in chunks}
    state = watching.get()
    state.most = len(left)
    try:
        while running:
            state.check()
            ended, running = wait(running, LOOK, FIRST_COMPLETED)
            for k, values, reason in (each for future in ended for each in future.result()):
                found.add(k, values, reason)
                state.count += 1
            if store and ended:
                found.save(store)
    except STOPS as stop:
        for future in running:
            future.cancel()
        found = replace(found, interrupted=not isinstance(stop, TimeUpError), timed_out=isinstance(stop, TimeUpError))
    finally:
        if own:
            pool.shutdown(cancel_futures=True)
    return found
