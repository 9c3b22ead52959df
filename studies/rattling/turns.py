"""Ensembles of the crank-rocker with clearance on the compiled solver: means of readings over turns of the crank.

Motion with rattling joints is chaotic: an offset of 1e-12 m grows to 1e-4 m within some 40 ms. So results are means over turns
and members of an ensemble, with standard errors. The journals of each member start at random places in their bushes.
"""

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from math import pi
from typing import Any, NamedTuple

import numpy as np

from buckler.mbs import Controlled, Mechanism, Spectral
from buckler.mbs import ensemble as run_ensemble
from buckler.mbs.scene.scene import Scene

from ..kit.parameters import StudyParameters, integer, quantity
from ..kit.statistics import Mean

JOINTS = "OABC"
"""Points of the joints, in the order of the mechanism."""
LOOSE = 1e-6
"""Tolerance at and above which the solver may choose implicit steps; below it steps are explicit. At these tolerances stability,
not accuracy, limits explicit steps if damping is stiff."""
FORCE = "max(sqrt({place}.normal_force**2 + {place}.friction_force**2))"
"""Reading of the largest force [N] in the joint at the point `place`."""
DEPTHS = tuple(map("max({}.penetration)".format, JOINTS))
"""Reading of the largest penetration of each joint [m]."""


@dataclass(frozen=True)
class Runs(StudyParameters):
    """Number and accuracy of the runs of a crank-rocker with clearance."""

    members: int = integer(4, 2, 10_000, "runs of each case; their scatter gives its standard error", "statistics")
    cycles: int = integer(2, 1, 10**5, "turns of each run over which means are taken", "statistics")
    settle: int = integer(1, 0, 10**5, "turns before these, which are discarded", "statistics")
    seed: int = integer(0, 0, 2**30, "seed of the random starts of the runs", "statistics")
    tolerance: float = quantity(LOOSE, "1", 1e-12, 1e-3, "error of a step, over the longest bar or a radian", "numerics")
    workers: int = integer(2, 1, 256, "number of threads", "numerics")


@dataclass(frozen=True)
class TestedRuns(Runs):
    """Runs whose means decide on claims."""

    level: float = quantity(0.05, "1", 1e-9, 0.5, "chance that any verdict of the table is wrong", "statistics")
    margin: float = quantity(0.05, "1", 0, 0.5, "least relative difference of two means that counts", "statistics")


class Turns(NamedTuple):
    """Means over members and turns by reading, largest penetration over the clearance, and faults that make the means invalid."""

    means: dict[str, Mean]
    depth: float
    notes: tuple[str, ...]


def run_turns(
    p: Runs, mechanisms: Sequence[Mechanism], readings: Sequence[str], batch: int = 0, curves: Mapping[str, Any] | None = None
) -> list[Turns]:
    """Run an ensemble of each crank-rocker, all with the same crank speed; return the means of the readings over turns.

    `batch` is the number of the call in its study, below 10 000: calls with other numbers draw other starts, with the seed
    10 000 p.seed + batch. `curves` are functions of time for readings.
    """
    turn, all_readings = period(mechanisms[0]), tuple(dict.fromkeys((*readings, *DEPTHS)))
    with ThreadPoolExecutor(p.workers) as pool:
        found = run_ensemble(
            mechanisms, (p.settle + p.cycles) * turn, p.members, of=all_readings, curves=curves, skip=p.settle, each=turn,
            solver=solver(mechanisms[0], p.tolerance), seed=10_000 * p.seed + batch, executor=pool, progress=False,
        )  # fmt: skip
    # of each reading a list over the mechanisms, which are the cells of the ensemble
    statistics = {reading: found.cells(reading) for reading in readings}
    turns = []
    for k, mechanism in enumerate(mechanisms):
        means = {reading: Mean(each[k].mean, each[k].error, each[k].members) for reading, each in statistics.items()}
        of_members = zip(found.members.cells, found.reasons, strict=True)  # of each run: index of its cell; why it failed, or ""
        failed = [reason for index, reason in of_members if index == k and reason]
        deepest = max(found.of(depth, k).max(initial=0.0) for depth in DEPTHS)
        depth = np.nan if failed else deepest / Scene.of(mechanism).clearances[0].gap  # all joints have the same gap
        notes = [f"FAILED: {len(failed)} of {p.members} runs, one by {failed[0]}"] if failed else []
        notes += [f"PENETRATION: a pin {depth:.2g} clearances deep in its bush: no law holds there"] if depth > 1 else []
        turns.append(Turns(means, float(depth), tuple(notes)))
    return turns


def period(mechanism: Mechanism) -> float:
    """Return the time of a turn of the crank [s]; a ValueError if its speed is zero or not constant."""
    speed = mechanism.drives[0].speed
    if not isinstance(speed, int | float) or not speed:
        raise ValueError(f"speed = {speed} rad/s: turns need a crank that turns at one speed")
    return 2 * pi / abs(speed)


def solver(mechanism: Mechanism, tolerance: float) -> Spectral:
    """Make the compiled solver, with steps of at most a hundredth of a turn, explicit ones below the tolerance `LOOSE`."""
    steps = Controlled(tolerance, max_step=period(mechanism) / 100, max_steps=20_000_000)
    return Spectral(steps, method="chosen" if tolerance >= LOOSE else "explicit")
