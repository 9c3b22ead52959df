"""Smooth contact laws against published trajectories of nonsmooth dynamics, whose contacts are rigid.

The depth of a contact of stiffness K is its force over K where it rests, and its speed times sqrt(m/K) in an impact. So the
distance from the published trajectory must fall as 1/K in the four-bar, whose joints stay closed. In the slider-crank it must
fall between 1/sqrt(K) and 1/K. There the published guide has friction and ours has none, so that times differ: the height of
the slider is compared at equal angles of the crank.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache, partial
from math import pi

import numpy as np
from exact.siconos import ARM, CLEARANCE, COUPLER, CRANK, FOURBAR, ROCKER, ROD, SLIDER_CRANK, fourbar, slider_crank

from buckler.mbs import Controlled, Exudyn, Result, simulate
from buckler.mbs.geometry import Array

from .known import Answer, Known

STIFFNESSES, STIFFEST = (1e5, 2e5, 5e5, 1e6), 1e7
"""Contact stiffnesses from which the rate is fitted, and of the stiffest run, whose distance is the error of the published steps
[N/m]."""
TURNS = 1.45
"""Turns of the crank that are compared; from 1.2 on the two published schemes differ by a clearance."""


@cache
def run(name: str, stiffness: float) -> Result:
    """Run a mechanism with contacts of this stiffness."""
    make, duration = {"four-bar": (fourbar, 1.0), "slider-crank": (slider_crank, 0.1)}[name]
    return simulate(make(stiffness), duration, solver=Exudyn(Controlled(1e-5)))


def find_distances(name: str, result: Result) -> Array:
    """Find the distance from the published trajectory at each of its samples, over the crank's length."""
    if name == "four-bar":
        time, *published = FOURBAR[:4]
        links = (("crank", CRANK), ("coupler", COUPLER), ("rocker", ROCKER))
        turned = [result.at(f"{link}.angle", np.minimum(time, result.time[-1])) for link, _ in links]
        distances = [length * np.abs(a[0] + t - a) for (_, length), a, t in zip(links, published, turned, strict=True)]
        return np.asarray(np.max(distances, axis=0)) / CRANK
    difference = np.abs(find_height(result, 2 * pi * SLIDER_CRANK[1]) - SLIDER_CRANK[2])
    return np.asarray(CLEARANCE / ARM * difference[SLIDER_CRANK[1] <= TURNS])


def find_height(result: Result, crank_angle: Array) -> Array:
    """Interpolate the slider's height over its clearance at angles of the crank [rad]."""
    angle, coupler = result.signals["crank.angle"], result.signals["coupler.angle"]
    return np.interp(crank_angle, angle, ARM * np.sin(angle) + ROD * np.sin(coupler)) / CLEARANCE


def compare_schemes() -> float:
    """Compute the root mean square distance of the two published schemes of the slider-crank, over the crank's length."""
    _, turns, first, second_turns, second = SLIDER_CRANK
    difference = (np.interp(turns, second_turns, second) - first)[turns <= TURNS]
    return float(CLEARANCE / ARM * np.sqrt((difference**2).mean()))


def solve_rate(name: str, power: float, within: float) -> Answer:
    """Fit the power of the stiffness with which the root mean square distance falls."""
    means = [np.sqrt((find_distances(name, run(name, stiffness)) ** 2).mean()) for stiffness in STIFFNESSES]
    return Answer(float(np.polyfit(np.log(STIFFNESSES), np.log(means), 1)[0]), power, within)


def solve_distance(name: str, allowed: float) -> Answer:
    """Find the largest distance of the stiffest run."""
    result = run(name, STIFFEST)
    return Answer(float(find_distances(name, result).max()), 0.0, allowed, "1", float("nan"), str(result.status), result.message)


def solve_mean() -> Answer:
    """Compute the root mean square distance of the stiffest slider-crank; it must be less than that of the published schemes."""
    distance = find_distances("slider-crank", run("slider-crank", STIFFEST))
    return Answer(float(np.sqrt((distance**2).mean())), 0.0, compare_schemes())


def list_known() -> Iterator[Known]:
    """Yield rates and distances."""
    case = partial(Known, "nonsmooth", slow=True)
    for name, power, within in (("four-bar", -1.0, 0.15), ("slider-crank", -0.75, 0.25)):
        yield case(f"{name}: power of the stiffness by which the distance falls", name, partial(solve_rate, name, power, within))
        yield case(f"{name}: largest distance over the crank's length, 1e7 N/m", name, partial(solve_distance, name, 1e-3))
    yield case("slider-crank: mean distance, 1e7 N/m; allowed: that of the published schemes", "slider-crank", solve_mean)
