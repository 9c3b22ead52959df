"""A result compared with a run of another solver: Exudyn and the compiled solver share the elements and none of the equations."""

from dataclasses import replace
from math import inf
from time import perf_counter

import numpy as np

from ..elements.signal import Kind
from ..record.errors import Errors, Norm
from ..record.result import Result
from ..record.run import Run
from ..scene.scene import Scene
from ..solvers import Closure, Exudyn, Spectral
from .demand import USUAL_ERROR, Asked, Usual, Worst, find_worst
from .difference import Difference
from .estimate import LEAST_ERROR, Separation
from .levels import LEVELS_BY_SOLVER, Runner
from .refine import refine
from .trajectory import Trajectory

NAMES: dict[type, str] = {Exudyn: "Exudyn", Spectral: "the compiled solver", Closure: "loop closure"}


def verify_by_other_solver(result: Result, first: Run, duration: float, run: Runner) -> Result:
    """Run another solver by `run` and put the largest relative difference of places into the result's `verified`.

    `first` is the run of the result, by its own solver. A failed result is returned unchanged. If the other solver fails, the
    result gets a note.
    """
    if not result.status.finished:
        return result
    other: Exudyn | Spectral = Exudyn() if isinstance(first.solver, Spectral) else Spectral()
    name, other_name = NAMES[type(first.solver)], NAMES[type(other)]
    start = perf_counter()
    has_accuracy = result.asked > 0
    least = 0.1 * result.asked if has_accuracy else LEAST_ERROR  # difference that is always allowed: by convention a tenth
    demand = Asked(result.asked) if has_accuracy else Usual()  # allowed errors: by that accuracy, or by convention
    try:
        levels = LEVELS_BY_SOLVER[type(other)](first.record.mechanism, duration, other, place_error=demand.place_error)
        answer = refine(run, levels, demand)  # runs of ever finer levels, until the demand is met
    except (ValueError, NotImplementedError, ImportError) as reason:
        return add_notes(result, f"not verified: {other_name} does not take this mechanism: {reason}")
    result = replace(result, work=result.work | {"verify_s": perf_counter() - start})
    other_run = answer.run
    if (failure := other_run.failure) is not None:
        return add_notes(result, f"not verified: {other_name} ended as {failure.status}: {failure.message}")
    if not all(np.isfinite(values).all() for values in (*result.signals.values(), *other_run.values.values())):
        return add_notes(result, "not verified: a signal is not finite")
    largest_of_places, worst = compare_solvers(first, other_run, result.error, answer.errors, least)
    result = replace(result, verified=largest_of_places)
    why = "the sum of their errors" if result.error.known and answer.errors.known else "as one error at least is not known"
    found = f"SOLVERS: {name} and {other_name} are {worst.error:.2g} apart in '{worst.name}', allowed {worst.allowed:.2g}, {why}"
    return result.suspect(found) if worst.ratio > 1 else result


def compare_solvers(a: Run, b: Run, errors_a: Errors, errors_b: Errors, least: float = LEAST_ERROR) -> tuple[float, Worst]:
    """Return the largest relative difference of places of two runs, and the signal whose difference is worst.

    Compared are places, contacts, forces of joints and links, and states of loads. A motion that may be chaotic is compared up to
    the time at which a place differs by more than `Usual` allows, or an error estimate ends. The allowed difference is the sum of
    both errors, at least `least`. Without one of the errors it is 5 % (`USUAL_ERROR`) for every signal. Run b gives the sizes.
    """
    trajectory_a, trajectory_b = Trajectory.of(a), Trajectory.of(b)
    limits = Usual().limits(trajectory_b)  # errors allowed of places, states and contacts, by signal and norm
    forces = [name for name, signal in trajectory_b.signals.items() if signal.kind in (Kind.REACTION, Kind.INTERNAL)]
    compared = [*limits, *((name, Norm.IMPULSE) for name in forces)]  # limits have none of these
    known = errors_a.known and errors_b.known
    ends = [errors.until for errors in (errors_a, errors_b) if errors.known]  # [s], to which the errors hold
    rattles = bool(Scene.of(a.record.mechanism).clearances)
    # an error estimate that holds only up to an earlier time shows that its runs separated, as in chaotic motion
    may_be_chaotic = rattles or min(ends, default=inf) < trajectory_a.time[-1]
    until = min([Separation(Difference(trajectory_a, trajectory_b), limits).agree_until(), *ends]) if may_be_chaotic else inf
    apart, _sizes = Difference(trajectory_a, trajectory_b, until).norms()  # relative differences, by signal and norm
    allowed = dict.fromkeys(compared, USUAL_ERROR)
    if known:
        allowed = {key: max(least, errors_a.signals.get(key, 0.0) + errors_b.signals.get(key, 0.0)) for key in compared}
    worst = find_worst(allowed, apart)
    of_places = [apart[n, norm] for n, norm in apart if norm is Norm.RMS and trajectory_b.signals[n].kind is Kind.PLACE]
    return max(of_places, default=0.0), worst


def add_notes(result: Result, *notes: str) -> Result:
    """Return the result with notes."""
    every = [*result.provenance.get("notes", ()), *notes]
    return replace(result, provenance=result.provenance | ({"notes": every} if every else {}))
