"""What the check of the branch is made of, against closed forms."""

import numpy as np
import pytest
from scipy.optimize import brentq

from buckler import mbs
from buckler.mbs.checks.unbuckled import growth_exponent, recent_mean
from buckler.mbs.modal import BarModes

TIME = np.linspace(1.0, 5.0, 4001)


def test_a_disturbance_grows_only_while_its_rate_is_positive_and_starts_anew_each_time():
    rate = np.where((TIME > 2) & (TIME <= 3) | (TIME > 4), 4.0, 0.0)
    found = np.interp([2.0, 2.5, 3.5, 4.4, 5.0], TIME, growth_exponent(TIME, rate))
    assert found == pytest.approx([0, 2, 0, 1.6, 4], abs=0.01)


def test_the_mean_looks_back_by_its_span_and_not_before_the_start():
    found = np.interp([1.0, 1.3, 3.0, 5.0], TIME, recent_mean(TIME, 2 * TIME, 1.0))
    assert found == pytest.approx([2.0, 2.3, 5.0, 9.0], abs=1e-9)


SECTION, LENGTH = mbs.Section(0.02, 0.001).damped(0.02, 0.3), 0.3


def cantilever(share, ends="free", lean=0.0):
    """A strip along x, or turned by an angle, clamped at one end and pressed by so many Euler loads."""
    along = np.array([np.cos(lean), np.sin(lean)])
    joints = [mbs.Weld("O", "ground", "strip")] if ends != "pinned" else [mbs.Revolute("O", "ground", "strip")]
    held = {
        "free": [],
        "pinned": [mbs.Guide("A", "strip", along=tuple(along))],
        "guided": [mbs.Guide("A", "strip", along=tuple(along))],
    }
    return mbs.Mechanism(
        points={"O": (0, 0), "A": tuple(LENGTH * along)}, links=[mbs.Link("strip", "O", "A", mbs.Beam(SECTION))], joints=joints,
        guides=held[ends], loads=[mbs.Force("A", tuple(-share * SECTION.euler_load(LENGTH) * along))],
    )  # fmt: skip


def column(k):
    """The k-th drawn strip, straight, pressed by 0.6 to 3 times its load; whether it buckles, and how long it runs.

    Critical at EI (u/L)^2: u = pi, pi/2, 4.4934, 2 pi; with a torsion spring c at one pin tan u = u/(1 + u^2 EI/(c L)).
    """
    d = np.random.default_rng(k)
    length, turn = d.uniform(0.2, 0.5), d.choice([0.0, d.uniform(-np.pi, np.pi)])
    section = mbs.Section(d.uniform(0.005, 0.03), length * np.exp(d.uniform(np.log(1e-3), np.log(1e-2)))).damped(0.02, length)
    along, ends = np.array([np.cos(turn), np.sin(turn)]), ("pins", "free", "propped", "guided", "spring")[k % 5]
    stiffness, guides = section.bending_stiffness / length * d.uniform(1, 10), []
    waves = {"pins": np.pi, "free": np.pi / 2, "propped": brentq(lambda u: np.tan(u) - u, 4.4, 4.6), "guided": 2 * np.pi}
    ratio = section.bending_stiffness / (stiffness * length)
    waves["spring"] = brentq(lambda u: np.sin(u) * (1 + u**2 * ratio) - u * np.cos(u), np.pi, 4.5)
    joints = [(mbs.Weld if ends in ("free", "propped", "guided") else mbs.Revolute)("O", "ground", "strip")]
    if ends == "guided":
        joints.append(mbs.Slider("A", "strip", "ground", along=tuple(along)))
    elif ends != "free":
        guides.append(mbs.Guide("A", "strip", along=tuple(along)))
    share = d.uniform(1.4, 3.0) if k % 2 else d.uniform(0.6, 0.95)
    critical = section.bending_stiffness * (waves[ends] / length) ** 2
    loads = [mbs.Force("A", tuple(-share * critical * along))]
    if ends == "spring":
        loads.append(mbs.TorsionSpring("ground", "strip", stiffness=stiffness))
    made = mbs.Mechanism(
        {"O": (0, 0), "A": tuple(length * along)}, [mbs.Link("strip", "O", "A", mbs.Beam(section))], joints, guides, loads=loads
    )
    slowest = section.first_frequency(length) * (waves[ends] / np.pi) ** 2 * np.sqrt(abs(share - 1.0))
    return made, share > 1.0, 50.0 / slowest


@pytest.mark.slow
@pytest.mark.parametrize("k", range(30))
def test_drawn_strips_past_their_load_are_unbuckled_and_no_others(k):
    made, buckles, duration = column(k)
    result = mbs.simulate(made, duration, solver=(mbs.Spectral(), mbs.Exudyn())[k % 2 ^ k // 2 % 2])
    bent = bool(np.abs(result.signals["strip.deflection"]).max() > 1e-3 * made.length("strip"))  # from rounding, where it leans
    assert (bent or "UNBUCKLED" in result.message) is buckles


def growth(share):
    """Growth of a pinned strip's half-sine: m s^2 + c s + EI k^4 - P k^2 = 0."""
    wave = np.pi / LENGTH
    bend, mass = SECTION.bending_stiffness, SECTION.mass_per_length
    square = (share * SECTION.euler_load(LENGTH) * wave**2 - bend * wave**4) / mass
    damping = SECTION.material.bending_damping * bend * wave**4 / mass
    return -damping / 2 + np.sqrt(damping**2 / 4 + square)


@pytest.mark.parametrize("solver", [mbs.Exudyn(), mbs.Spectral()], ids=["engine", "compiled"])
@pytest.mark.parametrize(
    ("ends", "share", "lean", "buckles"),
    [("free", 0.5, 0.0, True), ("free", 0.9, 0.0, True), ("free", 0.24, 0.0, False), ("free", 0.5, 1.0, True),
     ("pinned", 1.5, 0.0, True), ("pinned", 0.95, 0.0, False), ("guided", 1.9, 0.0, False), ("guided", 2.6, 0.0, True)],
)  # fmt: skip
def test_a_straight_strip_past_its_load_is_unbuckled_by_any_clamp(ends, share, lean, buckles, solver):
    """Critical at 1/4, 1 and 2.0457 Euler loads; one that leans leaves the straight line by rounding, far too late."""
    result = mbs.simulate(cantilever(share, ends, lean), 1.0, solver=solver)
    assert ("UNBUCKLED" in result.message) is buckles


def test_the_rate_told_is_that_of_the_pinned_strip():
    result = mbs.simulate(cantilever(1.5, "pinned"), 1.0, solver=mbs.Spectral())
    told = float(result.message.split("grows at ")[1].split(" 1/s")[0])
    assert told == pytest.approx(growth(1.5), rel=0.02)


def test_a_modal_link_that_presses_a_strip_is_in_the_pose():
    """A stiff one led along the line: the strip is clamped at both ends, critical at four Euler loads."""
    stiff = mbs.Modal(mbs.Section(0.02, 0.01), BarModes(2, 0))
    for share, buckles in ((3.0, False), (6.0, True)):
        pressed = mbs.Mechanism(
            {"O": (0, 0), "A": (LENGTH, 0), "B": (2 * LENGTH, 0)},
            [mbs.Link("strip", "O", "A", mbs.Beam(SECTION)), mbs.Link("block", "A", "B", stiff)],
            [mbs.Weld("O", "ground", "strip"), mbs.Weld("A", "strip", "block")],
            [mbs.Guide("A", "block"), mbs.Guide("B", "block")],
            loads=[mbs.Force("B", (-share * SECTION.euler_load(LENGTH), 0.0))],
        )
        assert ("UNBUCKLED" in mbs.simulate(pressed, 1.0, solver=mbs.Spectral()).message) is buckles
