"""What the paper leaves open, as parameters: pins on either body, gravity, thresholds, damping and kind of modes."""

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("numba")

from clearance_pair import beam_modes
from fourbar import FourBar, ideal_state, run

from buckler.mbs import simulate
from buckler.mbs.laws import Coulomb, NoFriction
from buckler.mbs.library import CLOSED
from buckler.studies.rattling import (
    buffering,
    clearance_speed,
    crank_rocker,
    modes,
)
from buckler.studies.rattling.bars import DAMPINGS, LENGTH, PINS, RockerParameters, make_modal_rocker, set_damping
from buckler.studies.rattling.crank_rocker import simulate as on_engine
from buckler.studies.rattling.turns import solver

FIRST = PINS[::2]  # the default
OTHER = ("O.crank", "A.coupler", "B.rocker", "C.rocker")
FAR = np.inf


@pytest.mark.slow
def test_pin_on_the_rocker_grips_at_the_other_side_of_the_radius():
    """Joint C: without friction the side of the pin is not felt. The rocker's surface slides otherwise by w (e + 2 R).

    With the pin, radius R, on the ground the rocker touches it at e + R from its bush's centre; with the pin on the rocker
    at R from its centre, on the other side.
    """
    bar = FourBar(gap=(FAR, FAR, FAR, 0.25e-3), law=CLOSED, friction=NoFriction(), speed=0.0)
    state = ideal_state(bar)
    state[13:16] = 0.3 * np.array([np.cos(state[7]), np.sin(state[7]), 40.0])
    plain, turned = (run(replace(bar, turned=t), 0.02, state=state, tolerance=1e-10) for t in ("", "C"))
    np.testing.assert_allclose(plain.q, turned.q, atol=1e-9)
    np.testing.assert_allclose(plain.force[:, 3], turned.force[:, 3], atol=1e-3)
    touched = plain.normal[:, 3] > 1
    assert touched.any()
    apart = np.abs(plain.sliding[touched, 3] - turned.sliding[touched, 3])
    gap, spin = 0.25e-3 + plain.depth[touched, 3], np.abs(plain.q_t[touched, 7])
    np.testing.assert_allclose(apart, (gap + 2 * bar.pin) * spin, rtol=1e-4)
    rough = replace(bar, friction=Coulomb(0.2, 1e-3))
    one, two = (run(replace(rough, turned=t), 0.02, state=state, tolerance=1e-10, samples=1_000_001) for t in ("", "C"))
    for found in (one, two):
        assert found.energy_balance < 2e-7 and found.taken_friction[-1, 3] > 1e-4
        dp = np.trapezoid(-found.force[:, 3], found.time, axis=0)
        np.testing.assert_allclose(dp, bar.masses[2] * (found.q_t[-1, 5:7] - found.q_t[0, 5:7]), rtol=0.02, atol=1e-4)
    assert abs(one.q_t[-1, 7] - two.q_t[-1, 7]) > 1e-3


@pytest.mark.parametrize("pins", [FIRST, OTHER])
def test_engine_and_reference_agree_on_either_body(pins):
    """First 8 ms of the flexible rocker under gravity, before chaos: centres within a thousandth of the clearance."""
    given = {"pin_on": pins, "gravity": 9.81, "friction_thresholds": 0.1, "clearance": 2.5e-4}
    p = crank_rocker.Parameters(**given, rocker=("rigid",), start_angle=0.0, duration=8e-3, settle=0.0, tolerance=1e-6)
    made = on_engine(p, "rigid", "OABC")
    q = RockerParameters(**given)
    assert q.reversed_joints == ("OABC" if pins == OTHER else "") and q.gravity_vector[1] == pytest.approx(-9.81)

    def compiled(case):
        bars = case.bars(angle=p.first_angle)
        return simulate(bars, 8e-3, solver=solver(bars, 1e-10))

    one, two = compiled(q), compiled(replace(q, pin_on=FIRST if q.reversed_joints else OTHER))
    for name in ("coupler.x", "coupler.y", "rocker.x", "rocker.y"):
        assert np.abs(made.signals[name] - one.at(name, made.time)).max() < 1e-3 * 2.5e-4
    assert np.abs(two.at("rocker.x", one.time) - one["rocker.x"]).max() > 1e-6  # or the pins' side went untested


def test_pins_and_thresholds_of_the_friction_are_those_asked_for():
    assert RockerParameters(pin_on="B.rocker").reversed_joints == "B" and len(PINS) == 8
    assert RockerParameters().thresholds == (0.1, 1.0) and RockerParameters().gravity_vector == (0.0, 0.0)
    p = RockerParameters(friction_thresholds=0.2)
    assert p.thresholds == pytest.approx((0.02, 0.2))
    friction = p.bars().joints[0].friction
    assert (friction.v_s, friction.v_d) == p.thresholds


def test_damping_ratios_by_frequency():
    f = np.array([50.0, 500.0, 3300.0])
    np.testing.assert_array_equal(DAMPINGS["constant"](f, 0.02), [0.02] * 3)
    np.testing.assert_array_equal(DAMPINGS["ADAMS"](f, 0.02), [0.01, 0.1, 1.0])
    ratios = DAMPINGS["Rayleigh"](f, 0.02)
    alpha, beta = 2 * np.linalg.solve([[1 / (2 * np.pi * x), 2 * np.pi * x] for x in f[:2]], [0.02, 0.02])
    np.testing.assert_allclose(ratios, alpha / (4 * np.pi * f) + beta * np.pi * f)
    assert ratios[2] > 0.1
    assert set_damping(beam_modes(), "ADAMS", 0.01).damping == (1.0,) * 3


def test_craig_bampton_answers_a_static_load_where_free_modes_do_not():
    """Its static shapes hold what ends under load do: compliance of the bar along its axis, L/(3 E A), free of mean axes."""
    studies = [RockerParameters(rocker="modal", modes_of=kind) for kind in ("free", "Craig-Bampton")]
    free, made = (make_modal_rocker(p).planar(LENGTH) for p in studies)
    exact = LENGTH / (3 * 207e9 * 1e-4)
    for each, (low, high) in ((free, (0.2, 0.6)), (made, (0.0, 0.05))):
        found = (each.shapes[1, 0] ** 2 / each.stiffness).sum()
        assert low * exact <= abs(found - exact) <= high * exact
    assert len(made) > len(free)


def test_modal_rockers_on_the_engine_take_damping_and_kind():
    p = crank_rocker.Parameters(rocker="rigid,modal", modes_of="Craig-Bampton", modal_damping="ADAMS")
    assert p.body("modal").modes.fixed == 12 and set(p.body("modal").damping) == {1.0}


@pytest.mark.parametrize(("study", "wrong", "message"), [
    (crank_rocker, {"settle": 1.0}, "settle = 1 s: must be less than duration = 0.2 s"),
    (crank_rocker, {"dynamic_friction": 0.4}, "static = 0.3"),
    (crank_rocker, {"rocker": "beam,modal"}, "rocker = beam,modal: name one flexible rocker at most"),
    (crank_rocker, {"modal_damping": "ADAMS"}, "only a rocker of modes"),
    (crank_rocker, {"pin_on": "B.coupler,B.rocker"}, "one body a joint"),
    (modes, {"modes_of": "Craig-Bampton"}, "add craig_bampton to sets"),
    (clearance_speed, {"frequency_factor": 1.1}, r"frequency_factor = 1\.1: only a rocker of modes"),
    (clearance_speed, {"rocker": "modal", "bending": 0, "axial": 0}, "the flexible rocker needs one mode at least"),
    (buffering, {"clearance": "1mm,0.5mm,0.1mm"}, r"clearance = 0.001,0.0005,0.0001: must be one number or two ends"),
])  # fmt: skip
def test_wrong_input_is_refused_in_one_line(study, wrong, message):
    with pytest.raises(ValueError, match=message) as refused:
        study.Parameters(**wrong)
    assert "\n" not in str(refused.value)
