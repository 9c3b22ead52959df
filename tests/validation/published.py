"""Published benchmark problems of multibody dynamics; `tests/exact` has their data and solves them by other methods."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache, partial
from math import atan2, pi

from exact import four_bars, princeton, problems
from exact.published import ANDREWS_ANGLES, DOUBLE_PENDULUM, PUBLISHED, SIMEON_END

from buckler.mbs import Equal, Exudyn, Mechanism, Result, equilibrium, simulate

from .known import Answer, Known, relate

STEPS = 8000
"""Equal steps of the coarser run of rigid problems."""


def extrapolate(mechanism: Mechanism, duration: float, signal: str) -> tuple[float, str]:
    """Extrapolate the last value of a signal, and its run's status, from n and 2 n equal steps to none.

    The generalized-alpha method is of second order: the finer run's error is a third of the difference.
    """
    runs = [simulate(mechanism, duration, solver=Exudyn(Equal(n), spectral_radius=0.95)) for n in (STEPS, 2 * STEPS)]
    coarse, fine = (float(run[signal][-1]) for run in runs)
    return fine + (fine - coarse) / 3, next((str(run.status) for run in runs if not run.ok), "OK")


def solve_andrews() -> Answer:
    """Compare the crank angle of Andrews' mechanism at 0.03 s."""
    turned, status = extrapolate(problems.andrews(), 0.03, "K1.angle")
    return relate(problems.ANDREWS_START[0] + turned, ANDREWS_ANGLES[0], 1e-6, "rad", status=status)


def solve_pendulum() -> Answer:
    """Compare the first angle of the double pendulum after 5 s with that of a Taylor series in 40 digits."""
    turned, status = extrapolate(problems.double_pendulum(), 5.0, "first.angle")
    return Answer(pi / 2 + turned, DOUBLE_PENDULUM["rods"][0], 1e-6, "rad", status=status)


@cache
def run_four_bars() -> Result:
    """Run the N four-bar through ten singular poses, where its joint forces are unbounded."""
    return simulate(problems.four_bars(2), 10.0, 1e-6)


def solve_four_bars(axis: int) -> Answer:
    """Compare a coordinate of the first bar's top after 10 s with the closed form."""
    result = run_four_bars()
    found = float(result.signals[f"B0.{'xy'[axis]}"][-1])
    return Answer(found, four_bars.top(10.0)[axis], 1e-4, "m", status=str(result.status), message=result.message)


def solve_princeton(load: float) -> Answer:
    """Compare the deflection of the Princeton beam's tip under a load [N] with the exact elastica."""
    rest = equilibrium(problems.princeton(load), degree=14)
    return relate(-rest.point("beam", "B").position[1], princeton.tip(load)[1], 1e-6, "m", status=str(rest.status))


def solve_published_tip() -> Answer:
    """Compare the same with the published beam model, whose value is printed to 5e-5 m."""
    answer = solve_princeton(8.896)
    return answer._replace(right=PUBLISHED["princeton.tip"].value, allowed=PUBLISHED["princeton.tip"].within)


@cache
def run_simeon() -> Result:
    """Run Simeon's flexible slider-crank to 0.1 s."""
    return simulate(problems.simeon(), 0.1, 1e-3)


def solve_simeon(name: str) -> Answer:
    """Compare the slider's position, or the angle of the rod's chord; the published rod bends in two linear modes."""
    result = run_simeon()
    x, y, slider = (float(result.signals[signal][-1]) for signal in ("A.x", "A.y", "B.x"))
    found, right, unit = (slider, SIMEON_END[2], "m") if name == "slider" else (atan2(-y, slider - x), SIMEON_END[1], "rad")
    return relate(found, right, 1e-3, unit, status=str(result.status), message=result.message)


def list_known() -> Iterator[Known]:
    """Yield the published problems."""
    case = partial(Known, "published")
    yield case("Andrews' mechanism, crank angle at 0.03 s", "andrews", solve_andrews)
    yield case("double pendulum, first angle at 5 s", "double pendulum", solve_pendulum)
    for k, axis in enumerate("xy"):
        yield case("N four-bar, N = 2, B0 at 10 s", f"four-bar {axis}", partial(solve_four_bars, k))
    for load in princeton.LOADS:
        yield case("Princeton beam, tip against the elastica", f"{load:g} N", partial(solve_princeton, load))
    yield case("Princeton beam, tip as published", "princeton", solve_published_tip)
    for name in ("slider", "rod"):
        yield case("Simeon's slider-crank at 0.1 s", f"simeon {name}", partial(solve_simeon, name), True)
