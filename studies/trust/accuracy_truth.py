"""What is right in a mechanism of the study `accuracy`: a closed form, an equation of motion, or a run far finer than asked."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import inf
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

from buckler.mbs import Strut
from buckler.mbs.accuracy.compare import Functions, compare, relative
from buckler.mbs.accuracy.ladder import ExudynLadder, Ladder, Runner, SpectralLadder
from buckler.mbs.accuracy.words import ALL_FORCES, MEANS, PLACES
from buckler.mbs.elements.signal import Kind, Signal
from buckler.mbs.geometry import Array
from buckler.mbs.kinematics.slidercrank import SliderCrank
from buckler.mbs.mechanism import Mechanism
from buckler.mbs.simulation import SOLVERS
from buckler.mbs.solvers import Exudyn, Spectral

from ..kit.drawn import EVERYTHING, Draw

SAMPLES = 2001
"""Times at which motions known otherwise are compared."""
FINE, FINER = 1e-3, 2
"""Level of a reference, of the accuracy asked for; rungs of the run that tells its error."""
PATIENCE = 60.0
"""Longest time, s, of a reference run."""


class Truth(NamedTuple):
    """What is right, and its own relative errors; none of what is no run."""

    functions: Functions
    errors: Mapping[str, float]


def closed_loop(made: Draw, _asked: float, _solver: str) -> Truth:
    """The place of a rigid slider-crank's slider."""
    mechanism, speed = made.mechanism, _constant(made)
    time = np.linspace(0.0, made.duration, SAMPLES)
    return _slider(time, SliderCrank(mechanism.length("crank"), mechanism.length("coupler")).slider(speed * time), made)


def moving_slider(made: Draw, _asked: float, _solver: str) -> Truth:
    """The equation of motion of a slider on a strut, from one touch of its stop to the next."""
    (stop,), (guide,), body = made.mechanism.stops, made.mechanism.guides, made.mechanism.link("coupler").body
    crank, length, speed = made.mechanism.length("crank"), made.mechanism.length("coupler"), _constant(made)
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
    return _slider(time, x, made)


def _constant(made: Draw) -> float:
    """Speed of its crank, rad/s."""
    speed = made.mechanism.drives[0].speed
    assert isinstance(speed, float)
    return speed


def _slider(time: Any, x: Any, made: Draw) -> Truth:
    size = max(made.mechanism.length(link.name) for link in made.mechanism.links)
    return Truth(Functions(time, {"B.x": Signal("B.x", x, "m", Kind.PLACE)}, size), {})


def two_runs(made: Draw, asked: float, solver: str) -> Truth | None:
    """A run far finer than what was asked for, its error by one finer still; None where either fails."""
    level, run = FINE * asked, runner(PATIENCE)
    ladder: Ladder = SpectralLadder(made.mechanism, made.duration, level, Spectral())
    if solver == "exudyn":
        ladder = ExudynLadder(made.mechanism, made.duration, level, Exudyn())
    wide = 2 if ladder.in_space else 0
    own, other = ladder.made(FINER, wide + (wide > 0), run), ladder.made(0, wide, run)
    if own.failure is not None or other.failure is not None:
        return None
    truth = Functions.of(own)
    return Truth(truth, relative(compare(Functions.of(other), truth)) | dict.fromkeys(truth.unresolved, inf))


def runner(timeout: float) -> Runner:
    """What makes runs within a time, s, for all of them."""
    ends = perf_counter() + timeout

    def run(mechanism: Mechanism, duration: float, solver: object) -> Any:
        return SOLVERS[type(solver)](mechanism, duration, solver, max(1e-3, ends - perf_counter()), None)

    return run


class Scene(NamedTuple):
    """Families of mechanisms, what an accuracy is asked of, and what is right."""

    families: tuple[str, ...]
    of: str = PLACES
    right: Callable[[Draw, float, str], Truth | None] = two_runs


SCENES = {
    **{name: Scene((name,)) for name in ("smooth", "ramp")},
    "rigid": Scene(("rigid",), right=closed_loop),
    "buckling": Scene(("strip on a stop",)),
    "strut": Scene(("any struck",), right=moving_slider),
    **{name: Scene((name,)) for name in ("rigid clearance", "modal clearance", "beam clearance")},
    "grammar": Scene(EVERYTHING),
    "forces": Scene(EVERYTHING, ALL_FORCES),
    "means": Scene(EVERYTHING, MEANS),
}
