"""A run without settings looks at itself: another run stands beside it, and where the two differ it is made finer until it holds.

The run is Exudyn's with its default settings. Beside it runs the compiled solver, which shares none of the equations; or Exudyn
with a tenth of the tolerance, shorter steps and less damping, where that solver does not take the mechanism, would have to
compile a function in Python, or would answer for other elements than those that are named in a mechanism with clearance, whose
blows excite the highest vibrations of any elements. With clearance the time that can be predicted is compared. If the two agree
in all that `mbs.accuracy.usual` allows, the run stands, with their difference as its error. If not, the mechanism is delivered as
with an accuracy, until all is within what is allowed or the time is over; where elements are named, they are kept, and what they
leave out is told by the compiled solver. What is far beyond even then is SUSPECT; with clearance only if a clearance a thousandth
larger does not change as much: where it does, the motion is one of many, which a note says.

Linkages that are determined are not integrated: only where a drive is a function of time are the samples doubled.
"""

from __future__ import annotations

from dataclasses import replace
from math import nan
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np

from buckler.mbs.accuracy.by_signal import by_energy, by_signal
from buckler.mbs.accuracy.delivery import Delivering, Delivery, Runner, Task, comparable
from buckler.mbs.accuracy.difference import difference
from buckler.mbs.accuracy.predictable import predictable
from buckler.mbs.accuracy.usual import ASKED, BOUND, Usual
from buckler.mbs.accuracy.ways import against, compilable, compiled, deliver, named, own_functions
from buckler.mbs.elements.clearance import Clearance, clearances
from buckler.mbs.elements.drive import Ramp
from buckler.mbs.kinematics.determined import answered
from buckler.mbs.mechanism import Mechanism
from buckler.mbs.record.errors import Errors
from buckler.mbs.record.result import Result
from buckler.mbs.record.run import Run
from buckler.mbs.solvers.choice import usual_tolerance
from buckler.mbs.solvers.closure import Closure
from buckler.mbs.solvers.exudyn import Exudyn
from buckler.mbs.solvers.spectral import Spectral
from buckler.mbs.solvers.steps import Controlled

TIMES, LEAST = 20.0, 5.0
"""Limit of the time for a finer run: so many times that of the first one, but at least this, s."""
RESTS = 1e-5
"""Way of a point or a deflection, in lengths of the largest link, below which it rests."""
KNOWN = 1e-3
"""How well a clearance is taken to be known, relative."""
STRICTER, SHORTER, RADIUS = 10.0, 2.15, 0.9
"""Exudyn's run beside: tolerance and longest step divided by this, and its spectral radius."""


class Refined(NamedTuple):
    """What came of a run without settings.

    Attributes
    ----------
    delivery : Delivery
        The run that is handed back; its errors are not known where nothing could stand beside it.
    usual : Usual or None
        What it was held to.
    one_of_many : bool
        Whether its motion is one of many: nothing predicts it.
    """

    delivery: Delivery
    usual: Usual | None = None
    one_of_many: bool = False


def refine(mechanism: Mechanism, duration: float, run: Runner) -> Refined:
    """Run with default settings, look at it, and make it finer where it misses what is allowed."""
    own = Delivering(Task(mechanism, duration, ASKED), run)
    begin = perf_counter()
    first = own.run(mechanism, duration, Closure() if answered(mechanism) else Exudyn())
    spent = perf_counter() - begin
    alone = Delivery(first, nan, Errors(), {}, own.runs)
    if first.failure is not None or len(first.record.time) < 3:
        return Refined(alone)
    mine = comparable(first)
    if _rests(mechanism, mine):
        return Refined(alone)
    usual = Usual.of(mechanism, mine)
    other = _beside(own, first)
    if other is None:
        return Refined(alone)
    told, reached = _compared(mine, first, comparable(other), other, usual)
    held = Delivery(first, reached, told, {}, own.runs)
    if reached <= ASKED:
        return Refined(held, usual)
    task = Task(
        mechanism,
        duration,
        ASKED,
        usual,
        patience=max(LEAST, TIMES * spent),
        begun=other if isinstance(other.solver, Spectral) else None,
    )
    found = deliver(task, run)
    best = found.after(held)
    if named(mechanism) and told.elements and best.run.failure is None:
        best = _with_elements(best, compiled(task, run), task)
    missed = best.run.failure is None and not best.reached <= BOUND * ASKED
    return Refined(best, usual, missed and _one_of_many(own, best.run, usual))


def _with_elements(best: Delivery, other: Delivery, task: Task) -> Delivery:
    """What was delivered with elements that are named, its errors with what these leave out, by the compiled solver.

    Where that one does not know itself well enough, all of the difference counts: nobody can tell whose it is.
    """
    counted = best.counting(best, other)
    if other.run.failure is not None or not (other.errors.known and best.errors.known):
        return counted
    if not other.kept(ASKED):
        other = replace(other, errors=replace(other.errors, motion=0.0, signals={}))
    return against(counted, other, task)


def _one_of_many(own: Delivering, run: Run, usual: Usual) -> bool:
    """Whether another clearance, by less than anybody knows it, gives another motion."""
    mechanism, play = run.record.mechanism, clearances(run.record.mechanism)
    if not play:
        return False
    joints = [
        replace(joint, gap=(1 + KNOWN) * joint.gap) if isinstance(joint, Clearance) else joint for joint in mechanism.joints
    ]
    span = predictable(mechanism, own.task.duration)
    other = own.run(replace(mechanism, joints=joints), span, run.solver)
    return other.failure is None and usual.apart(comparable(other), comparable(run)) > BOUND * ASKED


def _rests(mechanism: Mechanism, result: Result) -> bool:
    """Whether nothing moves: what does is round-off, or a bristle that bends."""
    size = max(mechanism.length(link.name) for link in mechanism.links)
    ways = [name for name, unit in result.units.items() if unit == "m" and name.endswith((".x", ".y", ".deflection"))]
    return all(float(np.ptp(result.signals[name])) < RESTS * size for name in ways)


def _compared(mine: Result, first: Run, theirs: Result, other: Run, usual: Usual) -> tuple[Errors, float]:
    """Errors of the first run by the other one, and how much of what is allowed they are, times `ASKED`."""
    signals, energies = by_signal(mine, theirs), {}
    if first.solver.steps.record_every == 1 and not clearances(first.record.mechanism):
        energies = by_energy(first, other)
    kind = f"a run of {type(other.solver).__name__} beside it"
    found = signals | energies
    elements = isinstance(other.solver, Spectral)
    return Errors(difference(mine, theirs), found, kind, elements), usual.largest(found, theirs.units)


def _beside(own: Delivering, first: Run) -> Run | None:
    """Another run of the same mechanism; None if there is none to be had, or none is needed."""
    mechanism, duration = own.task.mechanism, own.task.duration
    if answered(mechanism):
        if all(isinstance(drive.motion, Ramp) for drive in mechanism.drives):
            return None
        steps = Controlled(max_step=duration / (2 * (len(first.record.time) - 1)))
        return _ended(own.run(mechanism, duration, Closure(steps)))
    span = predictable(mechanism, duration)
    if not (own_functions(mechanism) or (named(mechanism) and clearances(mechanism))) and compilable(mechanism):
        found = _ended(own.run(mechanism, span, _compiled(mechanism, span)))
        if found is not None:
            return found
    steps = Controlled(
        usual_tolerance(mechanism) / STRICTER, span / (200 * SHORTER), contact_resolution=2 * Controlled().contact_resolution
    )
    return _ended(own.run(mechanism, span, Exudyn(steps, spectral_radius=RADIUS)))


def _ended(run: Run) -> Run | None:
    return run if run.failure is None else None


def _compiled(mechanism: Mechanism, span: float) -> Any:
    """Settings of the compiled solver's run beside."""
    from buckler.mbs.spectral.accuracy import beside

    return beside(mechanism, span)


def refined(result: Result, found: Refined, wall: float) -> Result:
    """The result of a run without settings; SUSPECT, ACCURACY in the message, where it misses what is allowed."""
    delivery, usual = found.delivery, found.usual
    result = delivery.complete(result, wall)
    if usual is None or delivery.reached <= BOUND * ASKED or not delivery.errors.known:
        return result
    name, error, allowed = usual.worst(delivery.errors)
    said = f"'{name}' is off by about {error:.2g} after {sum(delivery.runs.values())} runs, allowed {allowed:.2g}"
    mechanism = delivery.run.record.mechanism
    if named(mechanism) and delivery.errors.elements:
        said += " (a strip names its elements: more of them, or none, may cure it)"
    if found.one_of_many:
        note = f"the motion cannot be predicted: {said}; read what is the same in many runs"
        return replace(result, provenance=result.provenance | {"notes": [*result.provenance.get("notes", ()), note]})
    return result.suspect(f"ACCURACY: {said}")
