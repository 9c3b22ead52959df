"""Rigid runs against closed forms and independent integrations: a pendulum, forces in joints, a slider-crank."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline
from scipy.special import ellipk
from simulations import BAR, SIMPLE, SPAN, G, exact_swing, fine, pendulum, pendulum_frequency, rates, simply_supported

from buckler import mbs
from buckler.mbs.functions import Expression
from buckler.mbs.library import PAPER

# --- a rigid pendulum -------------------------------------------------------------------------------------------------


def swing(result):
    """Angle from hanging, and its rate."""
    x, y, vx, vy = (result.signals[f"A.{name}"] for name in ("x", "y", "vx", "vy"))
    return np.arctan2(x, -y), (x * vy - y * vx) / SPAN**2


@pytest.mark.parametrize("angle", [0.1, 1.5, 2.8])
def test_pendulum_period_is_the_elliptic_integral(angle):
    """T = 4 K(sin^2(a/2))/omega."""
    period = 4 / pendulum_frequency() * ellipk(math.sin(angle / 2) ** 2)
    solver = mbs.Exudyn(mbs.Controlled(tolerance=1e-7, max_step=period / 400))
    result = fine(mbs.simulate(pendulum(angle), 1.3 * period, solver=solver, ledger=True))
    crossings = CubicHermiteSpline(result.time, *swing(result)).roots(extrapolate=False)
    assert 2 * (crossings[1] - crossings[0]) == pytest.approx(period, rel=1e-4)
    assert result.energy_balance < 2e-4
    assert result.energy["kinetic"].max() == pytest.approx(np.ptp(result.energy["weight"]), rel=1e-3)


@pytest.mark.parametrize("radius", [0.999, 0.7])
def test_uniform_steps_converge_at_second_order(radius):
    errors = []
    for steps in (200, 400, 800):
        result = fine(mbs.simulate(pendulum(1.5), 1.5, solver=mbs.Exudyn(mbs.Equal(steps), spectral_radius=radius)))
        assert len(result.time) == steps + 1
        assert np.diff(result.time) == pytest.approx(1.5 / steps, rel=1e-9)
        errors.append(np.abs(swing(result)[0] - exact_swing(1.5, result.time)[0]).max())
    assert rates(errors) == pytest.approx(2, abs=0.1)
    assert errors[-1] < 1e-3


def test_error_follows_the_tolerance():
    """A third-order local error held at tol makes steps ~ tol^(-1/3) and a global error ~ tol^(2/3)."""
    tolerances, errors, steps = 10.0 ** -np.arange(5, 9), [], []
    for tolerance in tolerances:
        result = fine(mbs.simulate(pendulum(1.5), 1.5, solver=mbs.Exudyn(mbs.Controlled(tolerance=tolerance, max_step=0.1))))
        errors.append(np.abs(swing(result)[0] - exact_swing(1.5, result.time)[0]).max())
        steps.append(result.work["steps"])
    assert np.polyfit(np.log(tolerances), np.log(errors), 1)[0] == pytest.approx(2 / 3, abs=0.12)
    assert np.polyfit(np.log(tolerances), np.log(steps), 1)[0] == pytest.approx(-1 / 3, abs=0.06)
    assert errors[-1] < 1e-4


# --- forces in joints -------------------------------------------------------------------------------------------------


def test_pin_force_of_a_swinging_pendulum():
    """Force m (a_C - g): radial m (g cos + omega^2 L/2), transverse m (g sin + alpha L/2)."""
    result = fine(mbs.simulate(pendulum(1.5), 1.0, solver=mbs.Exudyn(mbs.Equal(1000))))
    angle, rate = swing(result)
    mass, alpha = BAR.section.mass_per_length * SPAN, -(pendulum_frequency() ** 2) * np.sin(angle)
    radial, transverse = mass * (G * np.cos(angle) + rate**2 * SPAN / 2), mass * (G * np.sin(angle) + alpha * SPAN / 2)
    s, c = np.sin(angle), np.cos(angle)
    later = result.time > 0.05
    force = np.array([result.signals[f"O.ground-bar.{axis}"] for axis in ("fx", "fy")])[:, later]
    expected = np.array([-radial * s + transverse * c, radial * c + transverse * s])[:, later]
    assert force == pytest.approx(expected, abs=1e-4 * np.abs(expected).max())


def test_centre_of_mass_moves_by_the_sum_of_forces():
    """A strip between two pins side by side, alike by symmetry: m a = 2 F - m g, to the solver's tolerance."""
    section = mbs.Section(width=0.020, thickness=0.004)
    for body in (mbs.Beam(section, elements=2), mbs.Beam(section, elements=3, nodes=2), mbs.Cable(section, elements=2)):
        mechanism = simply_supported(body, G)
        result = fine(mbs.simulate(mechanism, 0.02, solver=mbs.Exudyn(mbs.Equal(400), spectral_radius=0.9)))
        mass, later = section.mass_per_length * SIMPLE, result.time > 0.002
        expected = 2 * result.signals["A.ground-strip.fy"] / mass - G
        found = result.signals["strip.ay"]
        assert found[later] == pytest.approx(expected[later], abs=1e-4 * np.ptp(found))
        for rate, value in (("strip.vy", "strip.y"), ("strip.ay", "strip.vy")):
            slope = np.gradient(result.signals[value], result.time)
            assert result.signals[rate][later][:-1] == pytest.approx(slope[later][:-1], abs=2e-3 * np.ptp(slope))


# --- a driven rigid slider-crank --------------------------------------------------------------------------------------

OMEGA = 6.0


class RigidSliderCrank:
    """Energy and forces of the rigid slider-crank in closed form; derivatives by the complex step."""

    def __init__(self, gravity):
        plain = mbs.slider_crank(mbs.Rigid(mbs.Section(0.030, 0.003)), law=None, mass=0.3, speed=OMEGA)
        self.mechanism = replace(plain, gravity=gravity)
        crank, coupler = (link.body.section for link in plain.links)
        self.crank = crank.mass_per_length * PAPER.crank
        self.coupler = coupler.mass_per_length * PAPER.coupler
        self.turning = self.coupler * (PAPER.coupler**2 + coupler.thickness**2) / 12
        self.gravity = np.array(gravity)

    def places(self, angle):
        pin = PAPER.crank * np.array([np.cos(angle), np.sin(angle)])
        return pin, np.array([PAPER.slider(angle), 0 * angle])

    def energy(self, angle):
        (pin, slider), moved = self.places(angle), self.places(angle + 1e-30j)
        pin_t, slider_t = (OMEGA * place.imag / 1e-30 for place in moved)
        spin = OMEGA * PAPER.crank * np.cos(angle) / np.sqrt(PAPER.coupler**2 - (PAPER.crank * np.sin(angle)) ** 2)
        kinetic = 0.3 * slider_t**2 + self.coupler * ((pin_t + slider_t) / 2) ** 2
        weight = self.coupler * (pin + slider) / 2 + self.crank * pin / 2 + 0.3 * slider
        return kinetic.sum(axis=0) / 2 + self.turning * spin**2 / 2 - self.gravity @ weight

    def torque(self, angle):
        """Virtual work: torque * omega = dE/dt."""
        return differences(self.energy, angle, [1, -8, 0, 8, -1], 12e-3, 1e-3)

    def pin_force(self, angle):
        """Along the slider's line, of the crank on the coupler: what accelerates coupler and slider."""
        momentum = lambda a: 0.3 * self.places(a)[1][0] + self.coupler * sum(self.places(a))[0] / 2  # noqa: E731
        change = differences(momentum, angle, [-1, 16, -30, 16, -1], 12e-6, 1e-3) * OMEGA**2
        return change - (0.3 + self.coupler) * self.gravity[0]


def differences(function, x, weights, scale, h):
    return sum(w * function(x + (k - 2) * h) for k, w in enumerate(weights)) / scale


@pytest.mark.parametrize("gravity", [(0.0, 0.0), (3.0, -G)], ids=["level", "upright"])
def test_torque_and_pin_force_of_a_rigid_slider_crank_are_exact(gravity):
    """To what is left of the differences they are compared with."""
    exact = RigidSliderCrank(gravity)
    result = fine(mbs.simulate(exact.mechanism, 1.0, ledger=True))
    angle = OMEGA * result.time
    for name, right, off in (
        ("B.x", PAPER.slider(angle), 1e-13),
        ("B.vx", OMEGA * PAPER.slider_rate(angle), 1e-13),
        ("drive.torque", exact.torque(angle), 1e-9),
        ("A.crank-coupler.fx", exact.pin_force(angle), 1e-7),
    ):
        assert np.abs(result.signals[name] - right).max() < off * max(1.0, np.abs(right).max()), name
    assert result.energy_balance < 1e-6


def test_drive_gives_what_the_mechanism_takes():
    """From rest to speed: the drive's work is the kinetic energy of the closed form."""
    exact = RigidSliderCrank((0.0, 0.0))
    ramp = mbs.Ramp(0.0, OMEGA, 0.5)
    result = fine(mbs.simulate(replace(exact.mechanism, drives=[mbs.Drive("crank", ramp)]), 1.0, ledger=True))
    kinetic = exact.energy(np.array(ramp.position(1.0))) + exact.crank * PAPER.crank**2 / 6 * OMEGA**2
    assert result.energy["given_drive"][-1] == pytest.approx(kinetic, rel=2e-3)


def test_the_energy_of_a_shaken_slider_crank_adds_up():
    """A crank that turns back 150 times a second; samples of two grids side by side let the balance err by 1.3 per cent."""
    motion = Expression("48*cos(472*t)")
    result = fine(mbs.simulate(mbs.slider_crank(BAR, law=None, mass=0.3, speed=motion), 1.0, ledger=True))
    assert result.energy_balance < 3e-3
