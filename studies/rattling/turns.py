"""Means over turns of the crank-rocker with clearance, of many members on the compiled solver.

Motion with rattling joints is chaotic: an offset of 1e-12 m grows to 1e-4 m within some 40 ms. Beyond that only means over turns
of members whose journals start anywhere in their bushes are results, with their standard errors.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from math import pi
from typing import Any, NamedTuple

import numpy as np

from buckler.mbs import Controlled, Mechanism, Result, Spectral
from buckler.mbs import ensemble as run_ensemble
from buckler.mbs.elements.clearance import clearances
from buckler.mbs.geometry import Array

from ..kit.parameters import StudyParameters, integer, quantity
from ..kit.statistics import Mean
from .assumptions import BODIES, JOINTS

LOOSE = 1e-6
"""Tolerance from which on stability, not accuracy, limits explicit steps where contacts are stiffly damped."""
START_OFFSET = 1e-9
"""Scale [rad] of the random offset of the crank at the start of a run on the engine: far below all errors."""
STEPS_A_TURN = 720
"""Least number of the engine's steps for a turn of the crank."""
FORCE = "max(sqrt({0}.normal_force**2 + {0}.friction_force**2))"
"""Reading of a joint's largest force [N]."""
DEPTHS = tuple(map("max({}.penetration)".format, JOINTS))
"""Readings of the deepest penetration [m]."""


@dataclass(frozen=True)
class Runs(StudyParameters):
    """Number and accuracy of the runs of a crank-rocker with clearance."""

    members: int = integer(4, 2, 10_000, "runs of each case; their scatter gives its standard error", "statistics")
    cycles: int = integer(2, 1, 10**5, "turns measured of each run", "statistics")
    settle: int = integer(1, 0, 10**5, "turns before that", "statistics")
    seed: int = integer(0, 0, 2**30, "of the runs' starts", "statistics")
    tolerance: float = quantity(LOOSE, "1", 1e-12, 1e-3, "of a step, of the longest bar and a radian", "numerics")
    workers: int = integer(2, 1, 256, "threads", "numerics")


@dataclass(frozen=True)
class Judged(Runs):
    """Runs whose means are judged."""

    level: float = quantity(0.05, "1", 1e-9, 0.5, "chance that any verdict of the table is wrong", "statistics")
    margin: float = quantity(0.05, "1", 0, 0.5, "least difference that counts", "statistics")


class Turns(NamedTuple):
    """Means over members and turns by reading, the deepest pin over its clearance, and objections, each beginning with a name."""

    means: dict[str, Mean]
    depth: float
    notes: tuple[str, ...]


def run_turns(
    p: Runs, mechanisms: Sequence[Mechanism], of: Sequence[str], batch: int = 0, curves: Mapping[str, Any] | None = None
) -> list[Turns]:
    """Run members of crank-rockers with clearance whose cranks have the same speed; other batches start at other states."""
    turn, asked = period(mechanisms[0]), tuple(dict.fromkeys((*of, *DEPTHS)))
    with ThreadPoolExecutor(p.workers) as pool:
        found = run_ensemble(
            mechanisms, (p.settle + p.cycles) * turn, p.members, of=asked, curves=curves, skip=p.settle, each=turn, executor=pool,
            solver=solver(mechanisms[0], p.tolerance), seed=10_000 * p.seed + batch, progress=False,
        )  # fmt: skip
    cells = {reading: found.cells(reading) for reading in of}
    made = []
    for k, mechanism in enumerate(mechanisms):
        means = {reading: Mean(*cells[reading][k][2:]) for reading in of}
        failed = [reason for cell, reason in zip(found.members.cells, found.said, strict=True) if cell == k and reason]
        deepest = max((found.of(depth, k).max(initial=0.0) for depth in DEPTHS), default=0.0)
        depth = np.nan if failed else deepest / max(joint.gap for joint in clearances(mechanism))
        notes = [f"FAILED: {len(failed)} of {p.members} runs, one by {failed[0]}"] if failed else []
        notes += [f"PENETRATION: a pin {depth:.2g} clearances deep in its bush: no law holds there"] if depth > 1 else []
        made.append(Turns(means, float(depth), tuple(notes)))
    return made


def period(mechanism: Mechanism) -> float:
    """Return the time of a turn of the crank [s]; a ValueError if its speed is zero."""
    speed = mechanism.drives[0].speed
    if not isinstance(speed, int | float) or not speed:
        raise ValueError(f"speed = {speed} rad/s: turns need a crank that turns at one speed")
    return 2 * pi / abs(speed)


def solver(mechanism: Mechanism, tolerance: float) -> Spectral:
    """Make a solver with steps of this tolerance, at most a hundredth of a turn, explicit unless stability would limit them."""
    steps = Controlled(tolerance, max_step=period(mechanism) / 100, max_steps=20_000_000)
    return Spectral(steps, method="chosen" if tolerance >= LOOSE else "explicit")


def chance(seed: int) -> float:
    """Draw the offset of the crank at the start [rad]."""
    return START_OFFSET * float(np.random.default_rng(seed).standard_normal())


def force_on_second(result: Result, joint: str, axis: str) -> Array:
    """Return the force on the second of a joint's `BODIES` [N], whichever of the two carries the pin."""
    first, second = BODIES[joint]
    s, turned = result.signals, f"{joint}.{second}-{first}.f{axis}"
    return -s[turned] if turned in s else s[f"{joint}.{first}-{second}.f{axis}"]
