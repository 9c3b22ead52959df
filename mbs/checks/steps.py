"""Self-check of the steps: the hardest stretches of a run once more at half of them.

A stretch is a fortieth of the run, more where steps may be longer than the defaults make them. One lies about the largest
contact force: it and its impulse must come out again. One lies about the largest local error of the positions: places must come
out again, and where nothing strikes speeds too. (A rebound that comes a step later has another speed by then, and is none the
worse for it.)
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from buckler.mbs.accuracy.predictable import wholly_compared
from buckler.mbs.checks.check import Check
from buckler.mbs.elements.clearance import clearances
from buckler.mbs.kinematics.linkage import determined
from buckler.mbs.mechanism import Mechanism
from buckler.mbs.record.record import Record
from buckler.mbs.record.result import Result
from buckler.mbs.record.run import Run
from buckler.mbs.record.signals import collect
from buckler.mbs.solvers.choice import usual_tolerance

Array = np.ndarray[Any, Any]
SHARE, FEWEST, MOST = 40, 10, 100
"""A stretch is this part of all steps, but at least and at most so many; the most where steps are longer than by default."""
FORCE = 0.05
"""Change of the largest force of a contact beyond which steps are too long, equal ones at half of it, for halving them shows but
half of an error of first order. Where a contact is damped, force jumps at its onset and decays: its peak falls between steps.
Default steps miss up to 4 % of it (crank-rocker with clearance, rigid or a beam); its contact law is known no better."""
IMPULSE = 0.05
"""The same for the impulse: it changes speeds, as a coefficient of restitution 5 % wrong would."""
SPEED = 0.05
"""The same for the speed of a point, relative to the fastest point of the run."""
PLACE = 1e-3
"""The same for the place of a point, relative to the mechanism's size."""
MOVED = 1e-4
"""Way of a point in the whole run, relative to the mechanism's size, below which nobody asks how fast it was."""
LOOSEST = 0.1
"""Tolerance, with clearance, beyond which a step is allowed the error of a whole run, a tenth of it; it is PLACE without."""
CONTACT = ("contact_force", "normal_force")


def _too_long(run: Run, result: Result) -> Iterator[str]:
    """What changes when the steps are halved."""
    record, taken, mechanism = run.record, run.solver.steps, run.record.mechanism
    loosest = LOOSEST if clearances(mechanism) else PLACE
    if (taken.tolerance or 0.0) > loosest:
        yield f"tolerance = {taken.tolerance:g} allows each step the error of a whole run; it must be {loosest:g} at most"
        return
    striking = any(_of_contact(name, result) for name in result.signals)
    fewest = MOST if taken.coarser_than(usual_tolerance(mechanism)) else FEWEST
    for (first, last), names in _stretches(record, result, fewest).items():
        span = f"from t = {record.time[first]:.4g} s to {record.time[last]:.4g} s"
        finer = run.again(first, last)
        if finer is None:
            yield f"with half the steps the engine does not get {span}"
            continue
        after = {name: signal.values for name, signal in collect(finer).items()}
        window = slice(first, last + 1)
        changes = dict(_forces(result, names, window, finer.time, after, FORCE if taken.adaptive else FORCE / 2))
        changes |= dict(_motion(mechanism, result, last, after, speeds=bool(names) or not striking))
        if changes:
            name = max(changes, key=lambda name: changes[name])
            yield f"half the steps {span} change {name} by {changes[name]:.2g}"


def _idle(run: Run, result: Result) -> str:
    """Where a whole finer run was compared, or constraints alone decide the motion, halved steps tell nothing more."""
    mechanism = run.record.mechanism
    if determined(mechanism):
        return "the drives alone decide the motion"
    if wholly_compared(mechanism, result):
        return "a whole finer run was compared"
    return "fewer than two steps" if len(run.record.time) < 3 else ""


def _stretches(record: Record, result: Result, fewest: int) -> dict[tuple[int, int], list[str]]:
    """First and last samples of the stretches looked at, and the contact forces compared there."""
    count = len(record.time) - 1
    length = min(count, max(fewest, min(MOST, count // SHARE)))
    forces = {name: values for name, values in result.signals.items() if _of_contact(name, result)}
    hardest = max(forces, key=lambda name: forces[name].max(), default=None)
    found: dict[tuple[int, int], list[str]] = {}
    if hardest is not None and forces[hardest].max() > 0:
        found[_about(int(np.argmax(forces[hardest])), length, count)] = [hardest]
    second = _about(int(np.argmax(record.roughness)), length, count)
    if all(abs(second[0] - first) >= length for first, _ in found):
        found[second] = []
    return found


def _of_contact(name: str, result: Result) -> bool:
    """Whether a signal is the force of a contact."""
    owner, _, kind = name.rpartition(".")
    return kind in CONTACT and f"{owner}.penetration" in result.signals


def _about(middle: int, length: int, count: int) -> tuple[int, int]:
    first = min(max(0, middle - length // 2), count - length)
    return first, first + length


def _forces(
    result: Result, names: list[str], window: slice, time: Array, after: dict[str, Array], allowed: float
) -> Iterator[tuple[str, float]]:
    """Contact forces that changed by more than is allowed, and impulses that changed by more than they may."""
    for name in names:
        before = result.signals[name][window]
        for what, was, now, most in (
            ("the largest", before.max(), after[name].max(), allowed),
            ("the impulse of", np.trapezoid(before, result.time[window]), np.trapezoid(after[name], time), IMPULSE),
        ):
            change = abs(now - was) / max(was, now)
            if change > most:
                yield f"{what} {name}", float(change)


def _motion(
    mechanism: Mechanism, result: Result, last: int, after: dict[str, Array], *, speeds: bool
) -> Iterator[tuple[str, float]]:
    """Points whose place, or speed if asked for, at the end changed by more than it may."""
    before = result.signals
    size = max(mechanism.length(link.name) for link in mechanism.links)
    at_rest = PLACE * size / result.time[-1]  # a speed that moves nothing by more than it may
    fastest = max(at_rest, *(float(np.hypot(before[f"{p}.vx"], before[f"{p}.vy"]).max()) for p in mechanism.points))
    for point in mechanism.points:
        moved = max(float(np.ptp(before[f"{point}.{axis}"])) for axis in "xy") > MOVED * size
        looks = [("place", ("x", "y"), size, PLACE), ("speed", ("vx", "vy"), fastest, SPEED)]
        for what, axes, scale, allowed in looks if speeds and moved else looks[:1]:
            off = np.hypot(*(after[f"{point}.{axis}"][-1] - before[f"{point}.{axis}"][last] for axis in axes))
            if off > allowed * scale:
                yield f"the {what} of {point}", float(off / scale)


CHECK = Check(
    "STEPS",
    "failed when half the steps, over the hardest stretches, give other forces, impulses, places or speeds",
    _too_long,
    {"largest force": FORCE, "impulse": IMPULSE, "speed": SPEED, "place": PLACE, "way of rest": MOVED, "tolerance": LOOSEST},
    _idle,
)
