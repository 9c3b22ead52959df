"""Self-check of the steps: the hardest stretches of a run once more at half of them.

A stretch is a fortieth of the run. One lies about the largest contact force: it and its impulse must come out again. One lies
about the largest local error of the positions: places must come out again, and where nothing strikes speeds too. (A rebound that
comes a step later has another speed by then, and is none the worse for it.)
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from mbs.checks_closure import determined
from mbs.result import Result
from mbs.settings import Solver
from mbs.signals import History, collect
from mbs.window import half_steps

Array = np.ndarray[Any, Any]
SHARE, FEWEST, MOST = 40, 10, 100
"""A stretch is this part of all steps, but at least and at most so many."""
FORCE = 0.1
"""Change of the largest force of a contact beyond which steps are too long. A peak falls between steps where a contact is damped:
force then jumps at the onset and decays. Default steps miss up to 9 % of it and 1 % of the impulse (crank-rocker with play)."""
IMPULSE = 0.05
"""The same for the impulse: it changes speeds, as a coefficient of restitution 5 % wrong would."""
SPEED = 0.05
"""The same for the speed of a point, relative to the fastest point of the run."""
PLACE = 1e-3
"""The same for the place of a point, relative to the mechanism's size."""
CONTACT = ("contact_force", "normal_force")


def steps(history: History, solver: Solver, result: Result) -> Iterator[str]:
    """Yield what changes when the steps are halved, in words."""
    if len(history.time) < 3 or determined(history.scene.mechanism):
        return  # where constraints alone decide the motion, steps cannot make it wrong
    striking = any(name.rpartition(".")[2] in CONTACT for name in result.signals)
    for (first, last), names in _stretches(history, result).items():
        span = f"from t = {history.time[first]:.4g} s to {history.time[last]:.4g} s"
        finer = half_steps(history, solver, first, last)
        if finer is None:
            yield f"STEPS: with half the steps the engine does not get {span}"
            continue
        after = collect(finer)[0]
        changes = dict(_forces(result, names, slice(first, last + 1), finer.time, after))
        changes |= dict(_motion(history, result, last, after, speeds=bool(names) or not striking))
        if changes:
            name = max(changes, key=lambda name: changes[name])
            yield f"STEPS: half the steps {span} change {name} by {changes[name]:.2g}"


def _stretches(history: History, result: Result) -> dict[tuple[int, int], list[str]]:
    """First and last samples of the stretches looked at, and the contact forces compared there."""
    count = len(history.time) - 1
    length = min(count, max(FEWEST, min(MOST, count // SHARE)))
    forces = {name: values for name, values in result.signals.items() if name.rpartition(".")[2] in CONTACT}
    hardest = max(forces, key=lambda name: forces[name].max(), default=None)
    found: dict[tuple[int, int], list[str]] = {}
    if hardest is not None and forces[hardest].max() > 0:
        found[_about(int(np.argmax(forces[hardest])), length, count)] = [hardest]
    errors = np.abs(np.diff(history.q_tt, axis=0)).max(axis=1) * np.diff(history.time) ** 2
    second = _about(int(np.argmax(errors)), length, count)
    if all(abs(second[0] - first) >= length for first, _ in found):
        found[second] = []
    return found


def _about(middle: int, length: int, count: int) -> tuple[int, int]:
    first = min(max(0, middle - length // 2), count - length)
    return first, first + length


def _forces(result: Result, names: list[str], window: slice, time: Array, after: dict[str, Array]) -> Iterator[tuple[str, float]]:
    """Contact forces and impulses that changed by more than they may."""
    for name in names:
        before = result.signals[name][window]
        for what, was, now, allowed in (
            ("the largest", before.max(), after[name].max(), FORCE),
            ("the impulse of", np.trapezoid(before, result.time[window]), np.trapezoid(after[name], time), IMPULSE),
        ):
            change = abs(now - was) / max(was, now)
            if change > allowed:
                yield f"{what} {name}", float(change)


def _motion(history: History, result: Result, last: int, after: dict[str, Array], *, speeds: bool) -> Iterator[tuple[str, float]]:
    """Points whose place, or speed if asked for, at the end changed by more than it may."""
    mechanism, before = history.scene.mechanism, result.signals
    size = max(mechanism.length(link.name) for link in mechanism.links)
    fastest = max(float(np.hypot(before[f"{p}.vx"], before[f"{p}.vy"]).max()) for p in mechanism.points)
    for point in mechanism.points:
        looks = [("place", ("x", "y"), size, PLACE), ("speed", ("vx", "vy"), fastest, SPEED)]
        for what, axes, scale, allowed in looks if speeds else looks[:1]:
            off = np.hypot(*(after[f"{point}.{axis}"][-1] - before[f"{point}.{axis}"][last] for axis in axes))
            if off > allowed * scale:
                yield f"the {what} of {point}", float(off / scale)
