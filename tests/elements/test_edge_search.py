"""Functions of time that nobody described: their jumps, kinks and pulses are found, and stepped onto."""

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.special import erf

from buckler.mbs import Exudyn, Force, Link, Mechanism, Rigid, Slider, Spectral, simulate
from buckler.mbs.functions import Components, Expression, Piecewise
from buckler.mbs.functions.edge_search import find_edges_in_time

JUMPS = {
    "pulse of one look": (lambda t: (1e3 if 5.0 <= t < 5.0001 else 0.0, 0.0), 10.0, (5.0, 5.0001)),
    "box beside a constant": (lambda t: 5.0 + 10.0 * (0.2 <= t < 0.2004), 1.0, (0.2, 0.2004)),
    "ramp that ends": (lambda t: min(t, 0.3), 1.0, (0.3,)),
    "late step": (lambda t: 3.0 + (t > 1.7), 2.0, (1.7,)),
    "kinks of a sine's magnitude": (lambda t: abs(np.sin(20 * t)), 1.0, tuple(np.pi / 20 * np.arange(1, 7))),
    "square wave": (lambda t: 1.0 if (50 * t) % 1 < 0.5 else -1.0, 1.0, tuple(np.arange(1, 100) / 100)),
    "of time, angle and speed": (lambda t, angle, speed: -speed + (t > 0.5), 1.0, (0.5,)),
}


@pytest.mark.parametrize("name", JUMPS)
def test_jumps_and_kinks_are_found_where_they_are(name):
    function, duration, right = JUMPS[name]
    assert find_edges_in_time(function, duration).times == pytest.approx(right, abs=1e-9 * duration)


@pytest.mark.parametrize("function", [lambda t: np.sin(20 * t), lambda t: 1 - np.exp(-t / 0.2), lambda t: t**3, lambda _t: 4.0])
def test_smooth_functions_have_none(function):
    assert find_edges_in_time(function, 1.0).times == ()


def test_a_narrow_hump_is_stepped_onto():
    found = find_edges_in_time(lambda t: np.exp(-(((t - 0.3) / 1e-3) ** 2)), 1.0).times
    assert found and all(abs(t - 0.3) < 6e-3 for t in found)


def test_what_fails_or_swings_too_fast_has_none():
    def fails(t):
        raise RuntimeError("no")

    def fails_between_looks(t):
        return fails(t) if 0.5 < t < 0.500009 and t != 0.5 else float(t >= 0.500005)

    for function in (fails, fails_between_looks, lambda t: np.inf if t > 0.5 else 0.0):
        assert find_edges_in_time(function, 1.0).times == ()
    assert find_edges_in_time(lambda t: np.sin(1e7 * t * t), 1.0).capped


@dataclass
class Blow:
    """A function of a class of one's own, which cannot be hashed."""

    at: float

    def __call__(self, t):
        return (2.0 * (t >= self.at), 1.0)


def test_a_function_that_cannot_be_hashed_is_looked_at_too():
    assert find_edges_in_time(Blow(0.25), 1.0).times == pytest.approx([0.25], abs=1e-9)


def test_work_of_a_force_that_jumps_on_a_line_through_a_point():
    """A free bar, twice 0.02 N s in 0.1 ms on a line 0.3 m from its centre of mass: J^2/2m + (0.3 J)^2/2I."""
    pytest.importorskip("numba")
    bar = Mechanism(
        points={"A": (0, 0), "B": (0.4, 0)},
        links=[Link("bar", "A", "B", Rigid.of(mass=1.0, inertia=0.02))],
        loads=[Force("bar:B", lambda t: (0.0, 200.0 * (0.05 <= t < 0.0501 or 0.06 <= t < 0.0601)), through=(0.5, 0.0))],
    )
    energy = simulate(bar, 0.1, solver=Spectral(), ledger=True).energy
    assert energy["given_load"][-1] == pytest.approx(0.04**2 / 2 + 0.012**2 / 0.04, rel=2e-3)
    assert energy["kinetic"][-1] == pytest.approx(energy["given_load"][-1], rel=1e-3)


def sliding(push):
    """A block of 1 kg on a line, at rest before it is pushed."""
    return Mechanism(
        {"A": (0, 0), "B": (0, -0.1)}, [Link("block", "A", "B", Rigid.of(mass=1.0, inertia=1e-3, centre=(0, 0)))],
        [Slider("A", "block", "ground", along=(1, 0))], loads=[Force("A", push)],
    )  # fmt: skip


@pytest.mark.parametrize("how", [{}, {"accuracy": 1e-3}, {"solver": Spectral()}])
def test_a_blow_between_all_steps_moves_the_block(how):
    """1 kN for 0.1 ms on 1 kg at rest, 5 s before the end: 0.5 m."""
    if "solver" in how:
        pytest.importorskip("numba")
    block = sliding(lambda t: (1e3 if 5.0 <= t < 5.0001 else 0.0, 0.0))
    result = simulate(block, 10.0, **how)
    assert result.ok, result.message
    off = abs(result["A.x"][-1] - 0.1 * (5 - 5e-5))
    assert off < 0.5 * (2e-3 if not result.error.known else 2 * result.error["A.x", "peak"]) < 3e-3
    assert any("looked at every 0.0001 s" in note for note in result.provenance["notes"])


@pytest.mark.parametrize("period", [None, 0.53])
def test_named_breaks_are_stepped_onto_though_finer_than_a_function_is_looked_at(period):
    """A blow of 1 N s within 1e-7 of the run, once or with a period, against its closed form."""
    at, lasts, duration = 0.1237, 5e-7, 5.0

    def push(t):
        return (1 / lasts if at <= (t if period is None else t % period) < at + lasts else 0.0), 0.0

    blows = np.arange(1 if period is None else 10) * (period or 0.0) + at
    result = simulate(sliding(Piecewise(push, (at, at + lasts), period)), duration)
    assert result.ok and result["A.x"][-1] == pytest.approx(float((duration - blows - lasts / 2).sum()), rel=1e-6)


HUMP, AT, DURATION = 5e-5, 0.3127, 0.8
"""Width of a Gaussian, of the run; its place, of the run; the run, s."""


def hump(t):
    return np.exp(-(((np.asarray(t) - AT * DURATION) / (HUMP * DURATION)) ** 2))


def reached(t):
    """Integral of the hump from 0."""
    return HUMP * DURATION * np.sqrt(np.pi) / 2 * (1 + erf((t - AT * DURATION) / (HUMP * DURATION)))


FORMULA = Expression(f"exp(-((t - {AT * DURATION!r})/{HUMP * DURATION!r})**2)")


def test_the_integral_of_a_short_hump_is_right():
    integral = FORMULA.integral()
    for t in (AT * DURATION, 0.5, DURATION):
        assert integral(t) == pytest.approx(reached(t), rel=1e-9)


@pytest.mark.parametrize("duration", [1e-6, 1e4])
def test_an_integral_is_as_right_in_a_microsecond_as_in_hours(duration):
    """Pieces went by seconds: in a short run a hump of a thousandth of it was not seen, a long one took minutes."""
    width, speed = 1e-3 * duration, 200 / duration
    formula = Expression(f"1 + 500*exp(-((t - {0.37 * duration!r})/{width!r})**2) + cos({speed!r}*t)")
    right = duration + 500 * width * np.sqrt(np.pi) + np.sin(200) / speed
    assert formula.integral()(duration) == pytest.approx(right, rel=1e-9)


PUSHES = {"formula": Components((FORMULA, 0.0)), "function": lambda t: (float(hump(t)), 0.0)}


@pytest.mark.parametrize("solver", [Spectral(), Exudyn()], ids=["compiled", "exudyn"])
@pytest.mark.parametrize("push", PUSHES)
def test_a_short_hump_is_told_and_right(push, solver):
    """The way after a blow, against its integral: the two runs of a difference took the same steps within it."""
    result = simulate(sliding(PUSHES[push]), DURATION, 1e-2, solver=solver)
    right = reached(DURATION) * (1 - AT) * DURATION
    off = abs(result["A.x"][-1] / right - 1)
    assert result.ok, result.message
    assert off <= max(2 * result.error["A.x", "peak"], 1e-4) < 0.1
