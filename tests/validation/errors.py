"""True and reported errors of the positions in runs of random mechanisms.

The reference is loop closure, an equation of motion integrated by SciPy, or a run of the compiled solver that is far finer than
the accuracy asked for. A second fine run gives the reference's own error. A signal is compared if that is small against the error
of the run.
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
from buckler.mbs.library import SliderCrank
from buckler.studies.extremes.case import Verdict, run_reference
from buckler.studies.kit.drawn import EVERYTHING, Draw, draw

from .known import Answer, Known

SAMPLES = 2001
"""Number of times at which positions are compared."""
SILENT = 3.0
"""True error over the accuracy asked for, above which a run with status OK is wrong."""
LOW, HIGH = 0.5, 20.0
"""Range of the reported error over the true one that counts as a good estimate."""
SEED = 5
"""Seed of the random mechanisms, an arbitrary number."""
FAMILIES = (*EVERYTHING, "smooth", "ramp", "strip on a stop", "rigid clearance", "modal clearance")
"""Families of random mechanisms, one mechanism of each."""
REFERENCE_SHARE = 0.25
"""Error of a reference over that of the run, up to which a signal is compared."""
ROUNDING = 1e-7
"""Error over the range of a signal, up to which it is rounding and not compared."""


class Reference(NamedTuple):
    """Positions that count as right."""

    time: Array  # (SAMPLES,) [s]
    places: Mapping[str, Array]  # positions [m] and angles [rad], by signal
    errors: Mapping[str, float]  # their own root mean square errors; 0 for signals that are missing


def close_loop(drawn: Draw) -> Reference:
    """Compute the slider's position of a rigid slider-crank from the closure of its loop."""
    time = np.linspace(0.0, drawn.duration, SAMPLES)
    closed = SliderCrank(drawn.mechanism.length("crank"), drawn.mechanism.length("coupler"))
    return Reference(time, {"B.x": closed.slider(drawn.mechanism.drives[0].speed * time)}, {})


def integrate_slider(drawn: Draw) -> Reference:
    """Integrate the equation of motion of a slider between a strut and a stop, from one impact to the next."""
    (stop,), (guide,), body = drawn.mechanism.stops, drawn.mechanism.guides, drawn.mechanism.link("coupler").body
    crank, length, speed = drawn.mechanism.length("crank"), drawn.mechanism.length("coupler"), drawn.mechanism.drives[0].speed
    assert isinstance(body, Strut)
    section, time = body.section, np.linspace(0.0, drawn.duration, SAMPLES)
    unit_load, rigidity = section.bending_stiffness / length**2, section.axial_stiffness / length
    euler = section.euler_load(length)

    def rates(t: float, y: Array, onset: float) -> Any:
        pin, (x, v), depth = crank * np.exp(1j * speed * t), y, stop.at - y[0]
        span = abs(pin - x)
        push = rigidity * (length - span)
        if push > euler:
            push = unit_load * float(body.load(1 - span / length - euler / section.axial_stiffness))
        return v, (push * (x - pin.real) / span + (stop.law.force(depth, -v, onset) if depth > 0 else 0.0)) / guide.mass

    def touches(t: float, y: Array, onset: float) -> float:
        return float(stop.at - y[0]) if t > begin + 1e-9 * drawn.duration else 1.0

    touches.direction, touches.terminal = 1.0, True  # type: ignore[attr-defined]
    begin, state, onset, x = 0.0, np.array([drawn.mechanism.points["B"][0], 0.0]), 1.0, np.empty(SAMPLES)
    while begin < drawn.duration:
        part = solve_ivp(
            rates, (begin, drawn.duration), state, "DOP853", None, True, touches, args=(onset,),
            rtol=1e-11, atol=1e-14, max_step=drawn.duration / 2000,
        )  # fmt: skip
        x[time >= begin] = part.sol(time[time >= begin])[0]
        begin, state = float(part.t[-1]), part.y[:, -1]
        onset = -state[1]
    return Reference(time, {"B.x": x}, {})


def read_places(result: Result, time: Array) -> dict[str, Array]:
    """Interpolate the positions of a run at given times."""
    return {name: result.at(name, time) for name, trait in result.traits.items() if trait.kind is Kind.PLACE}


def run_twice(drawn: Draw) -> Reference | None:
    """Run the compiled solver twice, far finer than the accuracy asked for; return None if it fails."""
    coarse, fine = (run_reference(drawn, finer) for finer in (False, True))
    if coarse is None or fine is None:
        return None
    time = np.linspace(0.0, min(coarse.time[-1], fine.time[-1]), SAMPLES)
    first, places = read_places(coarse, time), read_places(fine, time)
    return Reference(time, places, {name: root_mean_square(first[name] - places[name]) for name in places})


def root_mean_square(difference: Array) -> float:
    """Compute the root mean square over time."""
    return float(np.sqrt((difference**2).mean()))


def find_sizes(drawn: Draw, result: Result) -> dict[str, float]:
    """Find the sizes to which errors of positions are relative: clearance, or the largest range of a vector's components."""
    length, ranges = max(drawn.mechanism.length(link.name) for link in drawn.mechanism.links), dict[str, float]()
    places = {name: trait for name, trait in result.traits.items() if trait.kind is Kind.PLACE}
    for name, trait in places.items():
        least, group = 1e-3 * (length if result.units[name] == "m" else 1.0), trait.group or name
        ranges[group] = max(ranges.get(group, least), float(np.ptp(result.signals[name])))
    return {name: trait.scale or ranges[trait.group or name] for name, trait in places.items()}


REFERENCES: dict[str, Callable[[Draw], Reference | None]] = {"rigid": close_loop, "any struck": integrate_slider}
"""References of families that need no run of this package; the others have `run_twice`."""


class Compared(NamedTuple):
    """Run with an accuracy asked for, compared with its reference."""

    errors: Array  # true and reported relative error of each position, (positions, 2)
    has_reference: bool
    result: Result


@cache
def compare_places(family: str, number: int, asked: float) -> Compared:
    """Run a random mechanism, and compute the true errors of its positions beside the reported ones."""
    drawn = draw(SEED, number, (family,))
    reference = REFERENCES.get(family, run_twice)(drawn)
    result = simulate(drawn.mechanism, drawn.duration, asked)
    if reference is None or result.status not in (Status.OK, Status.SUSPECT):
        return Compared(np.empty((0, 2)), reference is not None, result)
    covered = reference.time <= min(result.time[-1], np.nan_to_num(result.error.until, nan=np.inf))  # by the reported error
    sizes, found = find_sizes(drawn, result), []
    for name, right in reference.places.items():
        error = root_mean_square(result.at(name, reference.time[covered]) - right[covered]) / sizes[name]
        if error > max(ROUNDING, reference.errors.get(name, 0.0) / sizes[name] / REFERENCE_SHARE) and name in result.error:
            found.append((error, result.error[name]))
    return Compared(np.array(found).reshape(-1, 2), True, result)


def solve_accuracy(family: str, number: int, asked: float) -> Answer:
    """Return the largest true error of a position in a run with an accuracy asked for."""
    errors, has_reference, result = compare_places(family, number, asked)
    allowed = (SILENT if result.status == Status.OK else 1.0) * asked
    right = 0.0 if has_reference else float("nan")
    return Answer(float(errors[:, 0].max(initial=0.0)), right, allowed, status=str(result.status), message=result.message)


def solve_share(asked: float) -> Answer:
    """Return the share of positions whose reported error is between 0.5 and 20 times the true one.

    Others are errors of smooth motions, reported up to 50 times too large, and of one with friction, 4 times too small.
    """
    errors = np.vstack([compare_places(family, k, asked).errors for k, family in enumerate(FAMILIES)])
    ratios = errors[:, 1] / errors[:, 0]
    return Answer(float(np.mean((ratios >= LOW) & (ratios <= HIGH))), 1.0, 0.05)


def list_known() -> Iterator[Known]:
    """Yield runs of random mechanisms with two accuracies."""
    for asked in (1e-2, 1e-3):
        for family in REFERENCES:
            for k in range(2):
                group = f"rigid slider-crank and struck strut, places, {asked:g} asked"
                yield Known("errors", group, f"{family} {k}", partial(solve_accuracy, family, k, asked))
        for k, family in enumerate(FAMILIES):
            group = f"random mechanisms of every kind, places, {asked:g} asked"
            yield Known("errors", group, family, partial(solve_accuracy, family, k, asked), slow=True)
        group = f"share of their places with an error reported within 0.5 to 20 of the true one, {asked:g} asked"
        still = Verdict.SILENT if asked > 1e-3 else ""
        yield Known("errors", group, "share", partial(solve_share, asked), slow=True, still=still)
