"""Runs of the crank-rocker on the compiled solver against what physics says they must do."""

from math import sqrt

import numpy as np
import pytest
from scipy.optimize import brentq

pytest.importorskip("numba")

from clearance_pair import beam_modes
from fourbar import FourBar, ideal_state, run

from buckler.mbs import Status
from buckler.mbs.ensembles.readings import read_windows
from buckler.mbs.laws import Coulomb, ExactRestitution, Hertz, Impact, KelvinVoigt, NoFriction, delivered
from buckler.mbs.library import CLOSED, JOINT_STIFFNESS, RATTLING
from buckler.mbs.spectral.run import once
from buckler.studies.rattling.turns import DEPTHS, FORCE, solver

FAR = np.inf
"""No joint."""
FREE = (FAR, FAR, FAR, FAR)


def crank_hangs(law, **kw):
    """Only the crank on its pin O, at rest, gravity along -y."""
    return FourBar(gap=(0.25e-3, FAR, FAR, FAR), law=law, speed=0.0, gravity=(0.0, -9.81), friction=NoFriction(), **kw)


# --- one contact at a time --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("n", [1.0, 1.5, 2.2])
def test_a_journal_at_rest_sinks_to_the_power_law(n):
    law = Impact(5e3 * 1e6 ** (n - 1), 50.0, 1e-6, exponent=n)
    bar = crank_hangs(law)
    sunk = (bar.masses[0] * 9.81 / law.stiffness) ** (1 / n)
    state = ideal_state(bar)
    state[1] -= 0.25e-3 + 0.9 * sunk
    found = run(bar, 0.15, tolerance=1e-13, state=state, samples=11)
    assert found.ok and not found.onsets  # it never leaves
    assert found.depth[-1, 0] == pytest.approx(sunk, rel=1e-9)
    np.testing.assert_allclose(found.force[-1, 0], [0.0, -bar.masses[0] * 9.81], rtol=1e-9, atol=1e-12)


def test_a_free_fall_onto_the_pin_arrives_when_and_as_fast_as_it_must():
    bar = crank_hangs(RATTLING)
    found = run(bar, 0.01, tolerance=1e-11)
    joint, start, speed = found.onsets[0]
    assert joint == 0
    assert start == pytest.approx(sqrt(2 * 0.25e-3 / 9.81), rel=1e-9)
    assert speed == pytest.approx(sqrt(2 * 0.25e-3 * 9.81), rel=1e-9)


LAWS = [RATTLING, CLOSED, Hertz(JOINT_STIFFNESS), ExactRestitution(JOINT_STIFFNESS, 0.3), KelvinVoigt(1e7, 400.0)]


@pytest.mark.parametrize("law", LAWS, ids=lambda law: f"{type(law).__name__}-{getattr(law, 'damping', 0):g}")
@pytest.mark.parametrize("speed", [0.02, 0.3])
def test_an_impact_restores_what_the_law_delivers(law, speed):
    """The rocker flies along its own axis against pin C: effective mass = mass."""
    bar = FourBar(gap=(FAR, FAR, FAR, 0.25e-3), law=law, friction=NoFriction(), speed=0.0)
    state = ideal_state(bar)
    along = np.array([np.cos(state[7]), np.sin(state[7])])
    state[8 + 5 : 8 + 7] = speed * along
    expected = delivered(law, bar.masses[2], speed)
    crossing = 2 * 0.25e-3 / (expected * speed)  # until it meets the other side
    found = run(bar, 0.25e-3 / speed + min(0.05, 0.8 * crossing), tolerance=1e-10, state=state)
    _, start, onset = found.onsets[0]
    assert start == pytest.approx(0.25e-3 / speed, rel=1e-6) and onset == pytest.approx(speed, rel=1e-6)
    left = -(found.q_t[-1, 5:7] @ along)
    assert left / speed == pytest.approx(expected, abs=2e-6)
    lost = 0.5 * bar.masses[2] * speed**2 * (1 - expected**2)
    assert found.taken_contact[-1, 3] == pytest.approx(lost, rel=2e-5, abs=1e-9)


def test_an_oblique_impact_turns_the_rocker_by_its_lever():
    """Across the axis: effective mass 1/(1/m + (L/2)^2/J), and the kick at C turns the rocker."""
    bar = FourBar(gap=(FAR, FAR, FAR, 0.25e-3), law=RATTLING, friction=NoFriction(), speed=0.0)
    state, speed = ideal_state(bar), 0.1
    across = np.array([-np.sin(state[7]), np.cos(state[7])])
    state[13:15] = speed * across
    found = run(bar, 5e-3, tolerance=1e-10, state=state)
    mass, inertia, arm = bar.masses[2], bar.inertias[2], bar.rocker / 2
    effective = 1 / (1 / mass + arm**2 / inertia)
    kick = effective * (1 + delivered(RATTLING, effective, speed)) * speed
    assert found.q_t[-1, 5:7] @ across == pytest.approx(speed - kick / mass, rel=2e-4)
    assert found.q_t[-1, 7] == pytest.approx(arm * kick / inertia, rel=2e-4)


@pytest.mark.parametrize("mu", [0.1, 0.4])
def test_friction_spins_the_rocker_down(mu):
    """Flung outward on pin C, N = m r w^2: the torque mu N R_p about the pin makes 1/w grow linearly.

    w' = -k w^2 with k (J + m r^2) = mu m r R_p sqrt((1 + k^2)/(1 + mu^2)), r from the pin to the rocker's centre. The contact
    lies beside that line by the angle of friction.
    """
    bar = FourBar(gap=(FAR, FAR, FAR, 0.25e-3), law=CLOSED, friction=Coulomb(mu, 1e-5), speed=0.0)
    mass, inertia, half, spin = bar.masses[2], bar.inertias[2], bar.rocker / 2, 60.0
    r = half + 0.25e-3
    k = brentq(lambda k: k * (inertia + mass * r**2) - mu * mass * r * bar.pin * sqrt((1 + k**2) / (1 + mu**2)), 0.0, 1.0)
    force = mass * r * spin**2 * sqrt((1 + k**2) / (1 + mu**2))
    e, beside = 0.25e-3 + (force / CLOSED.stiffness) ** (1 / 1.5), np.arctan(mu) + np.arctan(k)
    bush = -e * np.exp(1j * beside)  # seen from the pin, with the centre of mass on the negative real axis
    r = e * np.cos(beside) + sqrt(half**2 - (e * np.sin(beside)) ** 2)
    state = ideal_state(bar)
    state[5:7], state[7] = (bar.frame - r, 0.0), np.angle(-bush - r)
    state[13:15], state[15] = (k * r * 0.0, -r * spin), spin
    found = run(bar, 0.2, tolerance=1e-10, state=state, samples=41)
    slope = np.polyfit(found.time, 1 / found.q_t[:, 7], 1)[0]
    assert slope == pytest.approx(k, rel=2e-4)
    left = 0.5 * (inertia + mass * r**2) * found.q_t[:, 7] ** 2
    np.testing.assert_allclose(found.taken_friction[1:, 3], (left[0] - left)[1:], rtol=1e-3)
    assert found.energy_balance < 1e-8


# --- no contact -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("gravity", [(0.0, 0.0), (3.0, -9.0)])
def test_a_free_vibrating_rocker_keeps_momentum_spin_and_energy(gravity):
    """Spinning at 600 rad/s and bent by millimetres, undamped: every velocity term of the floating frame is at work."""
    modes = beam_modes(thickness=0.005, width=0.020, bending=2, axial=1, damping=0.0)
    bar = FourBar(gap=FREE, modes=modes, gravity=gravity)
    state = ideal_state(bar)
    n = state.size // 2
    model = modes.planar(bar.rocker)
    ends = np.array([model.shapes[1, 1, 0], model.shapes[1, 1, 1], model.shapes[1, 0, 2]])  # of what moves by 1 m there
    state[8:11] = np.array([4e-3, -1e-3, 2e-5]) / ends
    state[n + 7], state[n + 8 : n + 11] = 600.0, np.array([3.0, 5.0, 0.5]) / ends
    found = run(bar, 0.01, tolerance=1e-11, state=state, samples=101)
    e, e_t, w = found.q[:, 8:], found.q_t[:, 8:], found.q_t[:, 7]
    moved = found.q[0, 5:7] + np.outer(found.time, found.q_t[0, 5:7]) + 0.5 * np.outer(found.time**2, gravity)
    np.testing.assert_allclose(found.q[:, 5:7], moved, atol=1e-11)
    inertia = model.inertia + 2 * e @ model.radial + (e**2).sum(axis=1)
    spin = inertia * w + ((e @ model.gyration) * e_t).sum(axis=1)
    np.testing.assert_allclose(spin, spin[0], rtol=1e-9)
    assert np.ptp(model.inertia * w) > 1e-3 * abs(spin[0])  # or the bending would not have mattered
    np.testing.assert_allclose(found.held, found.held[0], rtol=1e-9)
    assert np.ptp(found.strain) > 0.05 * np.ptp(found.kinetic) > 0


def test_modes_ring_at_their_frequencies_and_decay_at_their_damping():
    modes = beam_modes(bending=1, axial=1, damping=0.02)
    bar = FourBar(gap=FREE, modes=modes, speed=0.0)
    for i, w in enumerate(modes.planar(bar.rocker).frequency):
        state = ideal_state(bar)
        state[8 + i] = 1e-3
        found = run(bar, 2e-3, tolerance=1e-12, state=state, samples=201)
        wd, t = w * sqrt(1 - 0.02**2), found.time
        exact = 1e-3 * np.exp(-0.02 * w * t) * (np.cos(wd * t) + 0.02 * w / wd * np.sin(wd * t))
        np.testing.assert_allclose(found.q[:, 8 + i], exact, atol=1e-11)
        assert found.taken_modes[-1] == pytest.approx(found.held[0] - found.held[-1], rel=1e-7)


# --- the integrator ---------------------------------------------------------------------------------------------------


def test_steps_converge_with_fifth_order_and_samples_with_fourth():
    """Tolerance out of the way, steps of a fixed length: a free, spinning, ringing rocker."""
    bar = FourBar(gap=FREE, modes=beam_modes(thickness=0.005, width=0.020, bending=1, axial=0, damping=0.0))
    state = ideal_state(bar)
    state[8], state[9 + 7] = 1e-3, 300.0
    exact = run(bar, 4e-3, tolerance=1e-13, state=state, samples=18).q
    ends, between = [], []
    for steps in (80, 160, 320):
        found = run(bar, 4e-3, tolerance=1e3, longest=4e-3 / steps, state=state, samples=18)
        ends.append(abs(found.q[-1] - exact[-1]).max())
        between.append(abs(found.q - exact).max())
    assert np.log2(ends[0] / ends[1]) > 4.6 and np.log2(ends[1] / ends[2]) > 4.8
    assert np.log2(between[1] / between[2]) > 3.8
    assert ends[-1] < 1e-10


# --- the whole mechanism ----------------------------------------------------------------------------------------------

CASES = {
    "rattling": FourBar(),
    "closed": FourBar(law=CLOSED),
    "flexible": FourBar(modes=beam_modes()),
    "restitution": FourBar(law=ExactRestitution(JOINT_STIFFNESS, 0.8), gravity=(0.0, -9.81)),
    "coupler-rocker only": FourBar(gap=(0.0, 0.0, 0.25e-3, 0.0)),
    "flexible, ideal": FourBar(gap=0.0, modes=beam_modes()),
}


@pytest.mark.parametrize("bar", CASES.values(), ids=CASES.keys())
def test_energy_balance(bar):
    found = run(bar, 0.03, tolerance=5e-9)
    assert found.ok, found.message
    assert found.energy_balance < 5e-6  # of the quadrature: where one joint alone has clearance the contact is shortest
    assert np.diff(found.taken_contact, axis=0).min() > -1e-6 and np.diff(found.taken_friction, axis=0).min() > -1e-6
    if max(bar.gaps) > 0:
        assert found.taken[-1] > 1e-4 and found.given[-1] != 0


def test_the_ledger_is_the_integral_of_what_the_samples_show():
    """Friction and squared accelerations again, by quadrature over dense samples; largest forces are those of the steps."""
    bar = FourBar(law=CLOSED)
    found = run(bar, bar.period, samples=200_001)
    drag = (found.force**2).sum(axis=2) - found.normal**2
    rubbed = np.trapezoid(np.sqrt(np.maximum(drag, 0)) * abs(found.sliding), found.time, axis=0)
    np.testing.assert_allclose(found.taken_friction[-1], rubbed, rtol=2e-3)
    higher = found.peak_force.max(axis=0) / np.hypot(*found.force.T).max(axis=1)
    assert higher.min() >= 1 - 1e-9 and higher.max() < 1.05  # impacts of a microsecond: samples miss their peaks, steps do not
    mechanism, readings = bar.mechanism(), [FORCE.format(place=joint) for joint in "OABC"]
    readings += [*DEPTHS, "rms(coupler.ax)", "rms(rocker.ax)", "max(abs(coupler.ax))", "max(abs(rocker.ax))"]
    made = once(mechanism, bar.period, solver(mechanism, 1e-8))
    (turn,) = read_windows(readings, made.record.time, made.values, np.array([0.0, bar.period]))
    square = np.trapezoid(found.q_tt[:, [2, 5]] ** 2, found.time, axis=0) / bar.period
    np.testing.assert_allclose(turn[8:10], np.sqrt(square), rtol=2e-3)
    np.testing.assert_allclose(turn[10:], np.abs(found.q_tt[:, [2, 5]]).max(axis=0), rtol=0.05)
    np.testing.assert_allclose(turn[:4], found.peak_force.max(axis=0), rtol=2e-3)
    np.testing.assert_allclose(turn[4:8], found.peak_depth.max(axis=0), rtol=2e-3)


def test_smaller_clearance_comes_nearer_the_ideal_mechanism():
    """Distance from the ideal motion in proportion to the clearance; forces of the ideal joints between the reversals."""
    far, ideal = [], run(FourBar(gap=0.0), 0.02, tolerance=1e-9, samples=201)
    for gap in (1e-4, 1e-5, 1e-6):
        bar = FourBar(gap=gap, law=Impact(1e13, 2e4, 1e-7), friction=NoFriction())
        found = run(bar, 0.02, samples=201)
        assert found.ok and found.energy_balance < 3e-6  # 3e-7 to 1.1e-6, as processors round
        far.append(abs(found.q[:, :2] - ideal.q[:, :2]).max())
    assert far[0] < 2e-4 and far[2] < 3e-6
    np.testing.assert_allclose(np.log10(np.divide(far[:-1], far[1:])), 1, atol=0.15)
    late = found.time > 0.01
    assert abs(found.force[late] - ideal.force[late]).mean() < 0.1 * abs(ideal.force[late]).mean()


# --- when it goes wrong -----------------------------------------------------------------------------------------------


HARD = {
    "wide": {"gap": 2e-3}, "narrow": {"gap": 2e-5}, "slow": {"speed": np.pi}, "fast": {"speed": 100 * np.pi},
    "soft": {"law": Impact(0.1 * JOINT_STIFFNESS, 253.0, 1e-5)}, "hard": {"law": Impact(100 * JOINT_STIFFNESS, 253.0, 1e-5)},
    "elastic and frictionless": {"law": Hertz(JOINT_STIFFNESS), "friction": NoFriction()},
    "sticky": {"friction": Coulomb(0.9, 1e-4)}, "backwards": {"speed": -31.4}, "still": {"speed": 0.0, "gravity": (0.0, -9.81)},
}  # fmt: skip


@pytest.mark.parametrize("parameters", HARD.values(), ids=HARD.keys())
def test_hard_cases_end_and_balance(parameters):
    found = run(FourBar(**parameters), 0.01)
    assert found.time[-1] == 0.01 and found.status in (Status.OK, Status.SUSPECT)
    assert found.energy_balance < 1e-5 and np.isfinite(found.q_tt).all()
