"""What the check of the branch is made of, against closed forms."""

import numpy as np
import pytest

from buckler.mbs import Beam, Exudyn, Force, Guide, Link, Mechanism, Revolute, Section, Spectral, Weld, simulate
from buckler.mbs.checks.unbuckled import grown, recent_mean

TIME = np.linspace(1.0, 5.0, 4001)


def test_a_disturbance_grows_only_while_its_rate_is_positive_and_starts_anew_each_time():
    rate = np.where((TIME > 2) & (TIME <= 3) | (TIME > 4), 4.0, 0.0)
    found = np.interp([2.0, 2.5, 3.5, 4.4, 5.0], TIME, grown(TIME, rate))
    assert found == pytest.approx([0, 2, 0, 1.6, 4], abs=0.01)


def test_the_mean_looks_back_by_its_span_and_not_before_the_start():
    found = np.interp([1.0, 1.3, 3.0, 5.0], TIME, recent_mean(TIME, 2 * TIME, 1.0))
    assert found == pytest.approx([2.0, 2.3, 5.0, 9.0], abs=1e-9)


SECTION, LENGTH = Section(0.02, 0.001).damped(0.02, 0.3), 0.3


def cantilever(share, ends="free", lean=0.0):
    """A strip along x, or turned by an angle, clamped at one end and pressed by so many Euler loads."""
    along = np.array([np.cos(lean), np.sin(lean)])
    joints = [Weld("O", "ground", "strip")] if ends != "pinned" else [Revolute("O", "ground", "strip")]
    held = {"free": [], "pinned": [Guide("A", "strip", along=tuple(along))], "guided": [Guide("A", "strip", along=tuple(along))]}
    return Mechanism(
        points={"O": (0, 0), "A": tuple(LENGTH * along)}, links=[Link("strip", "O", "A", Beam(SECTION))], joints=joints,
        guides=held[ends], loads=[Force("A", tuple(-share * SECTION.euler_load(LENGTH) * along))],
    )  # fmt: skip


def growth(share):
    """Growth of a pinned strip's half-sine: m s^2 + c s + EI k^4 - P k^2 = 0."""
    wave = np.pi / LENGTH
    bend, mass = SECTION.bending_stiffness, SECTION.mass_per_length
    square = (share * SECTION.euler_load(LENGTH) * wave**2 - bend * wave**4) / mass
    damping = SECTION.material.bending_damping * bend * wave**4 / mass
    return -damping / 2 + np.sqrt(damping**2 / 4 + square)


@pytest.mark.parametrize("solver", [Exudyn(), Spectral()], ids=["engine", "compiled"])
@pytest.mark.parametrize(
    ("ends", "share", "lean", "buckles"),
    [("free", 0.5, 0.0, True), ("free", 0.9, 0.0, True), ("free", 0.24, 0.0, False), ("free", 0.5, 1.0, True),
     ("pinned", 1.5, 0.0, True), ("pinned", 0.95, 0.0, False), ("guided", 1.9, 0.0, False), ("guided", 2.6, 0.0, True)],
)  # fmt: skip
def test_a_straight_strip_past_its_load_is_unbuckled_by_any_clamp(ends, share, lean, buckles, solver):
    """Critical at 1/4, 1 and 2.0457 Euler loads; one that leans leaves the straight line by rounding, far too late."""
    result = simulate(cantilever(share, ends, lean), 1.0, solver=solver)
    assert ("UNBUCKLED" in result.message) is buckles


def test_the_rate_told_is_that_of_the_pinned_strip():
    result = simulate(cantilever(1.5, "pinned"), 1.0, solver=Spectral())
    told = float(result.message.split("grows at ")[1].split(" 1/s")[0])
    assert told == pytest.approx(growth(1.5), rel=0.02)
