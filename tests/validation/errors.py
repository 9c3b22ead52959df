"""Errors that a run reports of its places against the true ones, on random mechanisms.

The truth of a mechanism is loop closure, an equation of motion integrated by SciPy, or the finer of two runs of the compiled
solver far finer than what is asked for; a signal is judged where the truth's own error is small against the run's.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import cache, partial
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

from buckler.mbs import Result, Status, Strut, simulate
from buckler.mbs.elements.signal import Kind
from buckler.mbs.geometry import Array
from buckler.mbs.kinematics.slidercrank import SliderCrank
from buckler.studies.extremes.case import run_reference
from buckler.studies.kit.drawn import EVERYTHING, Draw, draw

from .known import Answer, Known

SAMPLES = 2001
"""Times at which places are compared."""
SILENT = 3.0
"""True error over the one asked for, above which a run that is reported fine is wrong."""
LOW, HIGH = 0.5, 20.0
"""Reported over true error, below and above which it is reported too small and too large."""
SEED = 5
FAMILIES = (*EVERYTHING, "smooth", "ramp", "strip on a stop", "rigid clearance", "modal clearance")
"""Random mechanisms: seed of the grammar, and families."""
JUDGED = 0.25
"""Largest error of a truth over that of the run, of a signal that is judged."""
NOTHING = 1e-7
"""Errors over the range of a place that are rounding."""


class Truth(NamedTuple):
    """Times [s], places by signal, and the root mean square error of each."""

    time: Array
    places: Mapping[str, Array]
    errors: Mapping[str, float]


def close_loop(made: Draw) -> Truth:
    """Close the loop of a rigid slider-crank: the place of its slider."""
    time = np.linspace(0.0, made.duration, SAMPLES)
    closed = SliderCrank(made.mechanism.length("crank"), made.mechanism.length("coupler"))
    return Truth(time, {"B.x": closed.slider(made.mechanism.drives[0].speed * time)}, {})


def move_slider(made: Draw) -> Truth:
    """Integrate the equation of motion of a slider on a strut, from one touch of its stop to the next."""
    (stop,), (guide,), body = made.mechanism.stops, made.mechanism.guides, made.mechanism.link("coupler").body
    crank, length, speed = made.mechanism.length("crank"), made.mechanism.length("coupler"), made.mechanism.drives[0].speed
    assert isinstance(body, Strut)
    section, time = body.section, np.linspace(0.0, made.duration, SAMPLES)
    unit, rigidity, euler = section.bending_stiffness / length**2, section.axial_stiffness / length, section.euler_load(length)

    def rates(t: float, y: Array, onset: float) -> Any:
        pin, (x, v), depth = crank * np.exp(1j * speed * t), y, stop.at - y[0]
        span = abs(pin - x)
        push = rigidity * (length - span)
        if push > euler:
            push = unit * float(body.load(1 - span / length - euler / section.axial_stiffness))
        return v, (push * (x - pin.real) / span + (stop.law.force(depth, -v, onset) if depth > 0 else 0.0)) / guide.mass

    def touches(t: float, y: Array, onset: float) -> float:
        return float(stop.at - y[0]) if t > begin + 1e-9 * made.duration else 1.0

    touches.direction, touches.terminal = 1.0, True  # type: ignore[attr-defined]
    begin, state, onset, x = 0.0, np.array([made.mechanism.points["B"][0], 0.0]), 1.0, np.empty(SAMPLES)
    while begin < made.duration:
        part = solve_ivp(
            rates, (begin, made.duration), state, "DOP853", None, True, touches, args=(onset,),
            rtol=1e-11, atol=1e-14, max_step=made.duration / 2000,
        )  # fmt: skip
        x[time >= begin] = part.sol(time[time >= begin])[0]
        begin, state = float(part.t[-1]), part.y[:, -1]
        onset = -state[1]
    return Truth(time, {"B.x": x}, {})


def read_places(result: Result, time: Array) -> dict[str, Array]:
    """Read the places of a run at given times."""
    return {name: result.at(name, time) for name, trait in result.traits.items() if trait.kind is Kind.PLACE}


def run_twice(made: Draw) -> Truth | None:
    """Run the compiled solver twice, far finer than what is asked for; None if it fails."""
    coarse, fine = (run_reference(made, finer) for finer in (0, 1))
    if coarse is None or fine is None:
        return None
    time = np.linspace(0.0, min(coarse.time[-1], fine.time[-1]), SAMPLES)
    first, places = read_places(coarse, time), read_places(fine, time)
    return Truth(time, places, {name: find_error(first[name] - places[name]) for name in places})


def find_error(off: Array) -> float:
    """Find the root mean square over time."""
    return float(np.sqrt((off**2).mean()))


def find_sizes(made: Draw, result: Result) -> dict[str, float]:
    """Find what the errors of places are relative to: clearance, or the largest range of a vector's components."""
    length, ranges = max(made.mechanism.length(link.name) for link in made.mechanism.links), dict[str, float]()
    places = {name: trait for name, trait in result.traits.items() if trait.kind is Kind.PLACE}
    for name, trait in places.items():
        least, group = 1e-3 * (length if result.units[name] == "m" else 1.0), trait.group or name
        ranges[group] = max(ranges.get(group, least), float(np.ptp(result.signals[name])))
    return {name: trait.scale or ranges[trait.group or name] for name, trait in places.items()}


TRUTHS: dict[str, Callable[[Draw], Truth | None]] = {"rigid": close_loop, "any struck": move_slider}
"""Truths of families that need no run; the others have `run_twice`."""


class Compared(NamedTuple):
    """Run with an accuracy asked for: true and reported errors of its places, (places, 2), and whether there is a truth."""

    errors: Array
    is_known: bool
    result: Result


@cache
def compare_places(family: str, number: int, asked: float) -> Compared:
    """Run a random mechanism, and compare the errors of its places with those it reports."""
    made = draw(SEED, number, (family,))
    truth = TRUTHS.get(family, run_twice)(made)
    result = simulate(made.mechanism, made.duration, asked, timeout=60.0)
    if truth is None or result.status not in (Status.OK, Status.SUSPECT):
        return Compared(np.empty((0, 2)), truth is not None, result)
    seen = truth.time <= min(result.time[-1], np.nan_to_num(result.error.until, nan=np.inf))
    sizes, found = find_sizes(made, result), []
    for name, right in truth.places.items():
        error = find_error(result.at(name, truth.time[seen]) - right[seen]) / sizes[name]
        if error > max(NOTHING, truth.errors.get(name, 0.0) / sizes[name] / JUDGED) and name in result.error:
            found.append((error, result.error[name]))
    return Compared(np.array(found).reshape(-1, 2), True, result)


def solve_accuracy(family: str, number: int, asked: float) -> Answer:
    """Largest error of a place, of a run with an accuracy asked for."""
    errors, is_known, result = compare_places(family, number, asked)
    allowed = (SILENT if result.status == Status.OK else 1.0) * asked
    right = 0.0 if is_known else float("nan")
    return Answer(float(errors[:, 0].max(initial=0.0)), right, allowed, status=str(result.status), message=result.message)


def solve_share(asked: float) -> Answer:
    """Share of places whose error is reported within half and twenty times the true one."""
    errors = np.vstack([compare_places(family, k, asked).errors for k, family in enumerate(FAMILIES)])
    ratios = errors[:, 1] / errors[:, 0]
    return Answer(float(np.mean((ratios >= LOW) & (ratios <= HIGH))), 1.0, 0.05)


def list_known() -> Iterator[Known]:
    """List accuracies asked of random mechanisms."""
    for asked in (1e-2, 1e-3):
        for family in TRUTHS:
            for k in range(2):
                group = f"rigid slider-crank and struck strut, places, {asked:g} asked"
                yield Known("errors", group, f"{family} {k}", partial(solve_accuracy, family, k, asked))
        for k, family in enumerate(FAMILIES):
            group = f"random mechanisms of every kind, places, {asked:g} asked"
            yield Known("errors", group, family, partial(solve_accuracy, family, k, asked), slow=True)
        group = f"share of their places with an error reported within 0.5 to 20 of the true one, {asked:g} asked"
        yield Known("errors", group, "share", partial(solve_share, asked), slow=True)
