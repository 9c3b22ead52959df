"""Run of the solver `Closure`: loop closure and inverse dynamics of a determined linkage at sample times, no integration."""

from math import ceil, pi
from time import perf_counter

import numpy as np

from ..elements import Load
from ..geometry import Array
from ..mechanism import Mechanism
from ..process import Progress, catch_ctrl_c
from ..record.errors import Failure, Status
from ..record.record import Record
from ..record.run import Run
from ..scene.linkage import turning_speed
from ..scene.scene import Scene
from ..solvers import Closure, Controlled, Equal
from .determined import Follower, UnclosedError

BEFORE_KINK = 1e-12
"""Time from the sample before a drive's kink to the kink, over the duration, so that both sides of a jump are sampled."""


def once(mechanism: Mechanism, duration: float, solver: Closure, timeout: float | None, progress: Progress | None) -> Run:
    """Make one run, without an error estimate: close the loops over time, then sample motion and forces.

    Raises ValueError if joints and drives alone do not decide motion and forces, KinematicsError if drives cannot move the start.
    """
    reason = Scene.of(mechanism).why_not_kinematic
    if reason:
        raise ValueError(f"solver = Closure(): joints and drives alone must decide motion and forces; {reason}")
    _ = Scene.of(mechanism).start  # computed here as contradictory velocities raise a KinematicsError
    begin = perf_counter()
    with catch_ctrl_c() as interrupted:  # the constructor follows the whole motion; sampling takes little time
        follower = Follower(mechanism, duration, perf_counter() + timeout if timeout else None, progress, interrupted)
    grid = sample_times(mechanism, duration, solver.steps)
    anchors = follower.anchors.time  # ends of the steps by which the motion was followed
    try:
        return _sample_motion(follower, float(anchors[-1]), follower.failure, grid, solver, begin)
    except UnclosedError as error:
        last = float(anchors[anchors < error.time][-1])
        return _sample_motion(follower, last, Failure(Status.SINGULAR, str(error)), grid, solver, begin)


def _sample_motion(follower: Follower, end: float, failure: Failure | None, grid: Array, solver: Closure, begin: float) -> Run:
    """Sample the motion of a linkage at the times `grid` [s], after a failure up to the end [s], and make the run."""
    if failure is not None:
        grid = np.append(grid[grid < end], end)
    if len(grid) - 1 > solver.steps.max_steps:
        t = float(grid[solver.steps.max_steps])
        failure = Failure(Status.TOO_MANY_STEPS, f"more than max_steps = {solver.steps.max_steps} steps by t = {t:.6g} s")
        grid = grid[: solver.steps.max_steps + 1]
    if isinstance(solver.steps, Controlled):
        # samples in a step; 0.2 is chosen, 8 by default. No run here has contacts, but the resolution grows with the level
        least = ceil(0.2 * solver.steps.contact_resolution)
        longest_gap = 2 * BEFORE_KINK * follower.linkage.last  # of a pair at a kink; the end as given, not an early one
        grid = _add_samples(follower.anchors.time, grid, least, longest_gap)
    course = follower.at(grid)  # coordinates, rates and second rates at the samples
    record = follower.record(course)
    failed_load = _find_failed_load(record)
    if failed_load is not None:
        end, failure = failed_load
        grid = grid[grid < end]
        course = follower.at(grid)
        record = follower.record(course)
    record.channels.update(follower.reactions(course, record))  # type: ignore[attr-defined]
    counts_of_integration = {"newton_iterations": 0.0, "jacobians": 0.0, "rejected": 0.0}
    work = {"wall_s": perf_counter() - begin, "steps": float(len(grid) - 1), **counts_of_integration}
    scene, linkage = Scene.of(record.mechanism), follower.linkage
    counts = {**scene.counts, "coordinates": linkage.reference.size, "constraints": len(linkage.names)}
    return Run(solver, record, failure, work, counts, notes=scene.remarks)


def _find_failed_load(record: Record) -> tuple[float, Failure] | None:
    """Find the first time at which the force of a load is no finite number, as after an error in a function of the user."""
    failed = list[tuple[float, Failure]]()
    for name, load in Scene.of(record.mechanism).elements.items():
        pushes = load.pushes(name, record) if isinstance(load, Load) else None
        for push in pushes or ():
            fails = ~(np.isfinite(push.force).all(axis=1) & np.isfinite(push.torque))
            for t in record.time[1:][fails[1:]][:1]:  # not at t = 0, where the mechanism has tried the function
                reason = f"at t = {t:.6g} s the function of '{name}' raised, or returned what is no number"
                failed.append((float(t), Failure(Status.FUNCTION_FAILED, reason)))
    return min(failed, key=lambda each: each[0], default=None)


def sample_times(mechanism: Mechanism, duration: float, steps: Controlled | Equal) -> Array:
    """Return sample times [s]: equal steps, or ten times the resolution a turn at the largest speed, and both sides of each kink.

    The resolution grows with the level of a refinement, so that two runs have other samples. By default it is 40.
    """
    if isinstance(steps, Equal):
        return np.linspace(0.0, duration, steps.count + 1)
    turns = turning_speed(mechanism, duration) * duration / (2 * pi)
    count = ceil(max(duration / steps.longest(duration), 10 * steps.contact_resolution * turns))  # by default each 0.9 degrees
    equidistant = duration / count * np.arange(min(count, steps.max_steps + 1) + 1)  # one step above the limit is enough
    if count <= steps.max_steps:
        equidistant[-1] = duration
    kinks = np.array(Scene.of(mechanism).kinks(duration))
    kinks = kinks[kinks <= equidistant[-1]]
    times = np.unique(np.concatenate([equidistant, kinks, kinks - BEFORE_KINK * duration]))
    is_distinct = np.append(np.diff(times) > BEFORE_KINK * duration / 2, True)  # half: the difference has rounding errors
    return times[is_distinct]


def _add_samples(anchors: Array, grid: Array, least: int, longest_gap: float) -> Array:
    """Divide each step with fewer than `least` sample times equally; keep pairs of times at most `longest_gap` [s] apart.

    Steps lead from anchor to anchor [s]. In a divided step no other time of the grid stays.
    """
    ends = np.append(anchors[anchors < grid[-1]], grid[-1])
    has_few_samples = np.diff(np.searchsorted(grid, ends)) < least  # for each step
    finer = [np.linspace(ends[k], ends[k + 1], least + 1) for k in np.flatnonzero(has_few_samples)]
    is_pair = np.diff(grid) < longest_gap
    step = np.searchsorted(ends, grid, side="right") - 1  # number of the step in which a sample lies
    # pairs at kinks stay; other old samples would make intervals uneven, which spoils the energy balance
    stays = ~np.append(has_few_samples, False)[step]  # False: the last sample is the end of the last step
    stays |= np.append(is_pair, False) | np.append(False, is_pair)
    stays[[0, -1]] = True
    return np.unique(np.concatenate([grid[stays], *finer]))
