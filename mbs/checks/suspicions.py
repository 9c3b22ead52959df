"""Self-checks of a finished run: each gives the reasons for which it must not be trusted.

None of them believes the integrator: energy is balanced by formulas that the engine does not use, a stretch of the run is run
again at half its steps, and what a mechanism cannot do (pull at a contact, jump to its other branch) is looked for.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from buckler.mbs.checks.branch import branches
from buckler.mbs.checks.closure import closures
from buckler.mbs.checks.mesh import meshes
from buckler.mbs.checks.steps import steps
from buckler.mbs.engine.settings import Solver
from buckler.mbs.record.energy import ledger
from buckler.mbs.record.result import Result, Status
from buckler.mbs.record.signals import History

Array = np.ndarray[Any, Any]
BALANCE = 1e-2
"""Energy balance, relative to the energy put through, beyond which a run is suspect."""
OF_ACCURACY = 3.0
"""The same in units of an accuracy that was asked for, where that is more."""
PIERCED = 0.05
"""Depth in a stop, relative to the mechanism's size, beyond which its contact law means nothing."""
ROUNDING = 1e-9
"""Of the largest force: a pull smaller than that is none."""


def suspicions(history: History, solver: Solver, result: Result) -> Iterator[str]:
    """Yield the checks that failed, in words; none for a run that failed already.

    Parameters
    ----------
    history : History
        What the run recorded.
    solver : Solver
        The settings it was made with.
    result : Result
        What is to be trusted.
    """
    if result.status is not Status.OK:
        return
    if not all(np.isfinite(values).all() for values in result.signals.values()):
        yield "NOT_FINITE: a signal is not finite"
        return
    if len(result.time) > 1 and not (np.diff(result.time) > 0).all():
        yield "TIME: time does not increase"
        return
    if result.energy or solver.record_every == 1:  # work cannot be summed over steps that were not recorded
        yield from _energy(result.energy or ledger(history), max(BALANCE, OF_ACCURACY * result.asked))
    yield from _pulls(result)
    yield from _pierced_stops(history.scene, result)
    yield from _pierced_bushes(history.scene, result)
    yield from branches(history.scene, result)
    yield from closures(history)
    yield from meshes(history)
    halved = result.error >= 0 and not history.scene.clearances  # whole runs were, to estimate the error; with play 10 ms only
    if not halved:
        yield from steps(history, solver, result)


def _energy(energy: Mapping[str, Array], allowed: float) -> Iterator[str]:
    """What is held, taken and given must add up, and what takes energy must not give it."""
    through = max(float(energy["throughput"][-1]), np.finfo(float).tiny)
    balance = float(np.abs(energy["error"]).max()) / through
    if not balance <= allowed:
        yield f"ENERGY: balance {balance:.2e} of the energy put through, allowed {allowed:g}"
    for name, taken in energy.items():
        if name.startswith("taken_"):
            given = float((np.maximum.accumulate(taken) - taken).max()) / through
            if given > allowed:
                yield f"ENERGY: '{name}' gives back {given:.2e} of the energy put through: a law makes energy"


def _pulls(result: Result) -> Iterator[str]:
    """A contact pushes while it is closed, outwards on the bush, and does nothing while it is open."""
    signals = result.signals
    for name, force in signals.items():
        point, _, kind = name.rpartition(".")
        if kind not in ("contact_force", "normal_force"):
            continue
        allowed = ROUNDING * float(np.abs(force).max(initial=0.0))
        pulling = force < -allowed
        apart = (np.abs(force) > allowed) & (signals[f"{point}.penetration"] <= 0)
        for wrong, what in ((pulling, "pulls"), (apart, "acts without touching")):
            if wrong.any():
                k = int(np.argmax(wrong))
                yield f"CONTACT: '{point}' {what} with {force[k]:.3g} N at t = {result.time[k]:.4g} s"


def _pierced_stops(scene: Any, result: Result) -> Iterator[str]:
    """A contact law means nothing once the point has gone through the stop by the size of the mechanism."""
    size = max(scene.mechanism.length(link.name) for link in scene.mechanism.links)
    for point in scene.stops:
        deepest = float(result.signals[f"{point}.penetration"].max(initial=0.0))
        if deepest > PIERCED * size:
            yield f"PENETRATION: '{point}' is {deepest:.3g} m inside its stop; the stop is too soft for this motion"


def _pierced_bushes(scene: Any, result: Result) -> Iterator[str]:
    """A contact law of pin and bush means nothing once the pin is deeper in the bush than it has play."""
    for group in scene.clearances:
        for joint in group.joints:
            deepest = float(result.signals[f"{joint.point}.penetration"].max(initial=0.0))
            if deepest > joint.gap:
                yield f"PENETRATION: pin '{joint.point}' is {deepest:.3g} m in its bush, more than its play {joint.gap:.3g} m"
