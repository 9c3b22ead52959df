"""Runs against closed forms and independent integrations: motion, forces, contact, friction, beams, failures."""

import math
from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicHermiteSpline
from scipy.special import ellipk

from elastica import pinned
from mbs import (
    STEEL,
    Beam,
    Cable,
    Drive,
    Guide,
    GuideFriction,
    Link,
    Mechanism,
    Motion,
    Ramp,
    Revolute,
    Rigid,
    Section,
    Solver,
    Status,
    Stop,
    Strut,
    simulate,
    slider_crank,
)
from mbs.laws import CarvalhoMartins, ExactRestitution, Hertz, KelvinVoigt, restitution
from mbs.library import PAPER
from mbs.statics import pinned_strip

G = 9.81
BAR = Rigid(Section(width=0.020, thickness=0.010))
STRIP = Section(width=0.030, thickness=0.0003)  # of the compliant slider-crank, doi 10.1115/IMECE2008-68796
LENGTH = 0.310
UNIT = STRIP.bending_stiffness / LENGTH**2


def fine(result):
    """The result, if it is trustworthy."""
    assert result.status is Status.OK, result.message
    return result


def rates(errors, factor=2.0):
    """Observed orders of convergence, steps shrinking by a factor each time."""
    return np.log(np.divide(errors[:-1], errors[1:])) / np.log(factor)


# --- a rigid pendulum -------------------------------------------------------------------------------------------------

SPAN = 0.5


def pendulum(angle, swapped=False):
    names = ("bar", "ground") if swapped else ("ground", "bar")
    return Mechanism(
        points={"O": (0, 0), "A": (SPAN * math.sin(angle), -SPAN * math.cos(angle))},
        links=[Link("bar", "O", "A", BAR)],
        joints=[Revolute("O", *names)],
        gravity=(0.0, -G),
    )


def pendulum_frequency():
    """Small swings, rad/s: omega^2 = m g (L/2)/I_O with I_O = m (L^2 + h^2)/12 + m L^2/4."""
    inertia = (SPAN**2 + BAR.section.thickness**2) / 12 + SPAN**2 / 4
    return math.sqrt(G * SPAN / 2 / inertia)


def swing(result):
    """Angle from hanging, and its rate."""
    x, y, vx, vy = (result.signals[f"A.{name}"] for name in ("x", "y", "vx", "vy"))
    return np.arctan2(x, -y), (x * vy - y * vx) / SPAN**2


def exact_swing(angle, times):
    square = pendulum_frequency() ** 2
    run = solve_ivp(
        lambda _, s: (s[1], -square * math.sin(s[0])), (0, times[-1]), (angle, 0.0),
        method="DOP853", t_eval=times, rtol=1e-12, atol=1e-13,
    )  # fmt: skip
    return run.y[0]


@pytest.mark.parametrize("angle", [0.1, 1.5, 2.8])
def test_pendulum_period_is_the_elliptic_integral(angle):
    """T = 4 K(sin^2(a/2))/omega."""
    period = 4 / pendulum_frequency() * ellipk(math.sin(angle / 2) ** 2)
    solver = Solver(tolerance=1e-7, max_step=period / 400)
    result = fine(simulate(pendulum(angle), 1.3 * period, solver=solver, ledger=True))
    crossings = CubicHermiteSpline(result.time, *swing(result)).roots(extrapolate=False)
    assert 2 * (crossings[1] - crossings[0]) == pytest.approx(period, rel=1e-4)
    assert result.energy_balance < 2e-4
    assert result.energy["kinetic"].max() == pytest.approx(np.ptp(result.energy["weight"]), rel=1e-3)


@pytest.mark.parametrize("radius", [1.0, 0.7])
def test_uniform_steps_converge_at_second_order(radius):
    errors = []
    for steps in (100, 200, 400):
        result = fine(simulate(pendulum(1.5), 1.5, solver=Solver(uniform_steps=steps, spectral_radius=radius)))
        assert len(result.time) == steps + 1
        assert np.diff(result.time) == pytest.approx(1.5 / steps, rel=1e-9)
        errors.append(np.abs(swing(result)[0] - exact_swing(1.5, result.time)).max())
    assert rates(errors) == pytest.approx(2, abs=0.1)
    assert errors[-1] < 1e-3


def test_error_follows_the_tolerance():
    """A third-order local error held at tol makes steps ~ tol^(-1/3) and a global error ~ tol^(2/3)."""
    tolerances, errors, steps = 10.0 ** -np.arange(5, 9), [], []
    for tolerance in tolerances:
        result = fine(simulate(pendulum(1.5), 1.5, solver=Solver(tolerance=tolerance, max_step=0.1)))
        errors.append(np.abs(swing(result)[0] - exact_swing(1.5, result.time)).max())
        steps.append(result.work["steps"])
    assert np.polyfit(np.log(tolerances), np.log(errors), 1)[0] == pytest.approx(2 / 3, abs=0.12)
    assert np.polyfit(np.log(tolerances), np.log(steps), 1)[0] == pytest.approx(-1 / 3, abs=0.06)
    assert errors[-1] < 1e-4


# --- forces in joints -------------------------------------------------------------------------------------------------


def test_hanging_bar_pulls_with_its_weight():
    result = fine(simulate(pendulum(0.0), 0.1))
    weight = BAR.section.mass_per_length * SPAN * G
    assert result.signals["O.ground-bar.fy"] == pytest.approx(weight, rel=1e-8)
    assert np.abs(result.signals["O.ground-bar.fx"]).max() < 1e-8 * weight


def test_action_is_reaction():
    """The same joint named from the other side: the force on the other body."""
    one, two = (fine(simulate(pendulum(1.0, swapped), 0.5)) for swapped in (False, True))
    for axis in ("fx", "fy"):
        on_bar, on_ground = one.signals[f"O.ground-bar.{axis}"], two.signals[f"O.bar-ground.{axis}"]
        assert on_ground == pytest.approx(-on_bar, abs=1e-6 * np.abs(on_bar).max())


def test_pin_force_of_a_swinging_pendulum():
    """Force m (a_C - g): radial m (g cos + omega^2 L/2), transverse m (g sin + alpha L/2)."""
    result = fine(simulate(pendulum(1.5), 1.0, solver=Solver(uniform_steps=1000)))
    angle, rate = swing(result)
    mass, alpha = BAR.section.mass_per_length * SPAN, -(pendulum_frequency() ** 2) * np.sin(angle)
    radial, transverse = mass * (G * np.cos(angle) + rate**2 * SPAN / 2), mass * (G * np.sin(angle) + alpha * SPAN / 2)
    s, c = np.sin(angle), np.cos(angle)
    later = result.time > 0.05
    force = np.array([result.signals[f"O.ground-bar.{axis}"] for axis in ("fx", "fy")])[:, later]
    expected = np.array([-radial * s + transverse * c, radial * c + transverse * s])[:, later]
    assert force == pytest.approx(expected, abs=1e-4 * np.abs(expected).max())


def test_each_pin_of_a_chain_carries_what_hangs_below():
    chain = Mechanism(
        points={"O": (0, 0), "A": (0, -0.3), "B": (0, -0.8)},
        links=[Link("upper", "O", "A", BAR), Link("lower", "A", "B", BAR)],
        joints=[Revolute("O", "ground", "upper"), Revolute("A", "upper", "lower")],
        gravity=(0.0, -G),
    )
    result, weight = fine(simulate(chain, 0.1)), BAR.section.mass_per_length * G
    assert result.signals["O.ground-upper.fy"][-1] == pytest.approx(0.8 * weight, rel=1e-8)
    assert result.signals["A.upper-lower.fy"][-1] == pytest.approx(0.5 * weight, rel=1e-8)


def test_centre_of_mass_moves_by_the_sum_of_forces():
    """A strip between two pins side by side, alike by symmetry: m a = 2 F - m g, to the solver's tolerance."""
    section = Section(width=0.020, thickness=0.004)
    for body in (Beam(section, elements=2), Beam(section, elements=3, nodes=2), Cable(section, elements=2)):
        mechanism = simply_supported(body, G)
        result = fine(simulate(mechanism, 0.02, solver=Solver(uniform_steps=400, spectral_radius=0.9)))
        mass, later = section.mass_per_length * SIMPLE, result.time > 0.002
        expected = 2 * result.signals["A.ground-strip.fy"] / mass - G
        found = result.signals["strip.ay"]
        assert found[later] == pytest.approx(expected[later], abs=1e-4 * np.ptp(found))
        for rate, value in (("strip.vy", "strip.y"), ("strip.ay", "strip.vy")):
            slope = np.gradient(result.signals[value], result.time)
            assert result.signals[rate][later][:-1] == pytest.approx(slope[later][:-1], abs=2e-3 * np.ptp(slope))


def test_centre_of_a_rigid_link_is_its_middle():
    result = fine(simulate(slider_crank(BAR, law=None, mass=0.3, speed=2.0), 1.0))
    for name, tolerance in {"x": 1e-9, "y": 1e-9, "vx": 1e-5, "vy": 1e-5}.items():  # speeds: to the order of the steps
        middle = (result.signals[f"A.{name}"] + result.signals[f"B.{name}"]) / 2
        assert result.signals[f"coupler.{name}"] == pytest.approx(middle, abs=tolerance)


# --- a driven rigid slider-crank --------------------------------------------------------------------------------------

OMEGA = 6.0


class RigidSliderCrank:
    """Energy and forces of the rigid slider-crank in closed form; derivatives by the complex step."""

    def __init__(self, gravity):
        plain = slider_crank(Rigid(Section(0.030, 0.003)), law=None, mass=0.3, speed=OMEGA)
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
def test_torque_and_pin_force_of_a_rigid_slider_crank(gravity):
    """Both converge at second order once the start, felt for a few steps, is over."""
    exact, errors = RigidSliderCrank(gravity), []
    for steps in (200, 400, 800):
        solver = Solver(uniform_steps=steps, newton_relative=1e-14, newton_absolute=1e-10)
        result = fine(simulate(exact.mechanism, 1.0, ledger=True, solver=solver))
        angle, later = OMEGA * result.time, result.time > 0.2
        assert result.signals["drive.position"] == pytest.approx(angle, abs=1e-11)
        assert result.signals["B.x"] == pytest.approx(PAPER.slider(angle), abs=1e-9)
        gaps = [
            result.signals["B.vx"] - OMEGA * PAPER.slider_rate(angle),
            result.signals["drive.torque"] - exact.torque(angle),
            result.signals["A.crank-coupler.fx"] - exact.pin_force(angle),
        ]
        errors.append([np.abs(gap[later]).max() for gap in gaps])
        assert result.energy_balance < 40 / steps**2 + 1e-5
    assert rates(errors) == pytest.approx(2, abs=0.25)
    scales = OMEGA * 0.18, np.abs(exact.torque(angle)).max(), np.abs(exact.pin_force(angle)).max()
    assert (np.divide(errors[-1], scales) < 1e-4).all()


def test_drive_gives_what_the_mechanism_takes():
    """From rest to speed: the drive's work is the kinetic energy of the closed form."""
    exact = RigidSliderCrank((0.0, 0.0))
    ramp = Ramp(0.0, OMEGA, 0.5)
    result = fine(simulate(replace(exact.mechanism, drive=Drive("crank", ramp)), 1.0, ledger=True))
    kinetic = exact.energy(np.array(ramp.position(1.0))) + exact.crank * PAPER.crank**2 / 6 * OMEGA**2
    assert result.energy["given_drive"][-1] == pytest.approx(kinetic, rel=2e-3)


# --- a block on its guide ---------------------------------------------------------------------------------------------

FEATHER = Rigid(Section(1e-3, 1e-3))
BLOCK = 0.5
MASS = BLOCK + FEATHER.section.mass_per_length * 0.1


def block(pull=0.0, law=None, stop=0.1, friction=None, speed=None, along=(1.0, 0.0)):
    """A block on a guide, pulled along it; a light bar carries it, both its ends on the line."""
    unit = np.array(along) / np.hypot(*along)
    return Mechanism(
        points={"A": (0, 0), "B": tuple(0.1 * unit)},
        links=[Link("bar", "A", "B", FEATHER)],
        guides=[Guide("A", "bar", along, BLOCK, friction), Guide("B", "bar", along)],
        stops=[] if law is None else [Stop("A", at=stop, law=law)],
        drive=None if speed is None else Drive("A", speed),
        gravity=tuple(pull * unit),
    )


def impact(law, speed, pull):
    """Speed ratio and largest force of one impact, integrated on its own."""

    def motion(_, s):
        return s[1], pull - float(law.force(s[0], s[1], speed)) / MASS

    def out(_, s):
        return s[0]

    out.terminal, out.direction = True, -1
    run = solve_ivp(motion, (0, 10), (1e-12, speed), events=out, method="DOP853", rtol=1e-10, atol=1e-14)
    return -run.y_events[0][0][1] / speed, float(law.force(*run.y, speed).max())


def rebound(law, solver=None):
    """Speed ratio over the face, largest force, and the run of one impact after a fall through 0.5 m at 0.1 m/s^2."""
    pull, way = 0.1, 0.5
    speed = math.sqrt(2 * pull * way)
    result = fine(simulate(block(pull, law, way), 1.5 * speed / pull, solver=solver, ledger=True))
    x, v = result.signals["A.x"], result.signals["A.vx"]
    out = int(np.flatnonzero(x > way)[-1]) + 1
    at_face = math.sqrt(v[out] ** 2 + 2 * pull * (way - x[out]))
    assert v[out] < 0
    return at_face / speed, result.signals["A.contact_force"].max(), result


@pytest.mark.parametrize("e", [0.8, 0.5, 0.3])
def test_stop_gives_back_about_what_its_law_delivers(e):
    law = CarvalhoMartins(1e8, e)
    ratio, force, result = rebound(law)
    expected, peak = impact(law, math.sqrt(0.1), 0.1)
    assert expected == pytest.approx(restitution(law.chi), abs=1e-3)
    assert ratio == pytest.approx(expected, abs=0.02)
    assert force == pytest.approx(peak, rel=0.02)
    lost = 0.5 * MASS * 0.1 * (1 - ratio**2)
    assert result.energy["taken_contact"][-1] == pytest.approx(lost, rel=0.02)
    assert result.energy_balance < 5e-3


@pytest.mark.parametrize(("law", "tolerance"), [
    (CarvalhoMartins(1e8, 0.8), 1e-3), (CarvalhoMartins(1e6, 0.8, 1.0), 1e-3), (ExactRestitution(1e8, 0.9), 1e-3),
    (Hertz(1e8), 1e-3), (KelvinVoigt.from_restitution(1e6, 0.8, MASS), 6e-3),  # its force begins with a jump
], ids=["Hertzian", "linear", "exact", "elastic", "dashpot"])  # fmt: skip
def test_stop_gives_back_what_its_law_delivers(law, tolerance):
    ratio, _, _ = rebound(law)
    assert ratio == pytest.approx(impact(law, math.sqrt(0.1), 0.1)[0], abs=tolerance)


def test_finer_contact_steps_find_the_restitution():
    law = CarvalhoMartins(1e6, 0.8, 1.0)
    expected = impact(law, math.sqrt(0.1), 0.1)[0]
    errors = [abs(rebound(law, Solver(contact_resolution=n))[0] - expected) for n in (20, 80, 320)]
    assert errors[1] < 5e-4 and errors[2] < 1e-4


@pytest.mark.parametrize("along", [(1, 0), (-1, 0), (3, -4)])
def test_stop_works_in_any_direction_and_on_either_side(along):
    """The same fall: a face ahead in the guide's direction, or behind and pulled backwards."""
    law = ExactRestitution(1e8, 0.5)
    ahead = fine(simulate(block(1.0, law, 0.1, along=along), 0.7))
    behind = fine(simulate(block(-1.0, law, -0.1, along=along), 0.7))
    for result, side in ((ahead, 1), (behind, -1)):
        unit = side * np.array(along) / np.hypot(*along)
        travel = result.signals["A.x"] * unit[0] + result.signals["A.y"] * unit[1]
        assert travel.max() - 0.1 == pytest.approx(result.signals["A.penetration"].max(), rel=1e-9)
        assert 0 < travel.max() - 0.1 < 1e-3 and result.signals["A.contact_force"].min() >= 0
    assert ahead.signals["A.contact_force"] == pytest.approx(behind.signals["A.contact_force"], abs=1e-6)


def test_resting_block_presses_with_what_pulls_it():
    """After many bounces: K d^n = m a."""
    law = ExactRestitution(1e7, 0.3)
    result = fine(simulate(block(5.0, law, 0.01), 1.0))
    assert result.signals["A.contact_force"][-1] == pytest.approx(MASS * 5, rel=1e-3)
    assert result.signals["A.penetration"][-1] == pytest.approx((MASS * 5 / 1e7) ** (2 / 3), rel=1e-3)


FRICTION = GuideFriction(0.7, static=1.1, viscous=3.0, regularisation=2e-3, stribeck=2e-2)


@pytest.mark.parametrize("speed", [1e-3, 2e-3, 5e-3, 0.02, 0.5, -0.05])
def test_driven_block_feels_the_friction_curve(speed):
    beyond = abs(speed) - 2e-3
    expected = 0.7 + 0.4 * math.exp(-beyond / 2e-2) + 3.0 * beyond if beyond > 0 else 1.1 * abs(speed) / 2e-3
    result = fine(simulate(block(friction=FRICTION, speed=speed), 0.1, ledger=True))
    assert result.signals["drive.force"] == pytest.approx(math.copysign(expected, speed), rel=1e-6)
    assert result.energy["taken_friction"][-1] == pytest.approx(expected * abs(speed) * 0.1, rel=1e-9)


def test_dry_friction_slows_a_fall():
    pull, force = 2.0, 0.3 * MASS * 2.0
    result = fine(simulate(block(pull, friction=GuideFriction(force, regularisation=1e-5)), 0.5, ledger=True))
    assert result.signals["A.x"] == pytest.approx(0.5 * (pull - force / MASS) * result.time**2, abs=1e-5)
    assert result.energy["taken_friction"][-1] == pytest.approx(force * result.signals["A.x"][-1], rel=1e-3)


def test_stopping_distance_under_dry_friction():
    """Thrown back by an elastic stop, a block comes to rest after v^2/2 over its deceleration."""
    pull, way = 2.0, 0.2
    force = 0.3 * MASS * pull
    speed = math.sqrt(2 * (pull - force / MASS) * way)
    up, turn = speed / (pull - force / MASS), speed / (pull + force / MASS)
    mechanism = block(pull, Hertz(1e8), way, GuideFriction(force, regularisation=1e-4))
    result = fine(simulate(mechanism, up + 1.2 * turn, ledger=True))
    highest = result.signals["A.x"][result.time > 1.05 * up].min()
    assert way - highest == pytest.approx(speed**2 / 2 / (pull + force / MASS), rel=5e-3)


def test_held_block_creeps_at_the_regularised_speed():
    """Static friction above the pull: v = v_r m a/F_s, no true sticking."""
    friction = GuideFriction(2.0 * MASS, static=2.5 * MASS, regularisation=1e-3)
    result = fine(simulate(block(1.0, friction=friction), 0.2))
    assert result.signals["A.vx"][-1] == pytest.approx(1e-3 / 2.5, rel=1e-6)


def test_viscous_friction_approaches_its_terminal_speed():
    """Speed (m a/c) (1 - exp(-c t/m))."""
    damping, pull = 2.0, 2.0
    friction = GuideFriction(0.0, viscous=damping, regularisation=1e-6)
    result = fine(simulate(block(pull, friction=friction), 1.0, ledger=True))
    expected = MASS * pull / damping * -np.expm1(-damping * result.time / MASS)
    assert result.signals["A.vx"] == pytest.approx(expected, abs=2e-5)
    assert result.energy_balance < 1e-4


# --- beams ------------------------------------------------------------------------------------------------------------

STIFF = Section(width=0.020, thickness=0.004)
SIMPLE = 0.5


def simply_supported(body, pull):
    return Mechanism(
        points={"A": (0, 0), "B": (SIMPLE, 0)},
        links=[Link("strip", "A", "B", body)],
        joints=[Revolute("A", "ground", "strip")],
        guides=[Guide("B", "strip")],
        gravity=(0.0, -pull),
    )


def sudden_load(times, pull, terms=6):
    """Mid deflection, sum of 4 g/(n pi omega_n^2) sin(n pi/2) (1 - cos omega_n t) over odd n, omega_n = n^2 omega_1."""
    total = np.zeros_like(times)
    for n in range(1, 2 * terms, 2):
        omega = n**2 * STIFF.first_frequency(SIMPLE)
        total -= 4 * pull / (n * np.pi * omega**2) * (1 - np.cos(omega * times)) * math.sin(n * np.pi / 2)
    return total


@pytest.mark.parametrize("body", [Beam(STIFF), Cable(STIFF)], ids=["beam", "cable"])
def test_beam_under_sudden_gravity_rings_between_zero_and_twice_its_sag(body):
    sag = 5 * STIFF.mass_per_length * G * SIMPLE**4 / (384 * STIFF.bending_stiffness)
    period = 2 * np.pi / STIFF.first_frequency(SIMPLE)
    result = fine(simulate(simply_supported(body, G), 3 * period, ledger=True, solver=Solver(max_step=period / 300)))
    deflection = result.signals["strip.deflection"]
    assert deflection == pytest.approx(sudden_load(result.time, G), abs=0.01 * sag)
    assert deflection.min() == pytest.approx(-2 * sag, rel=0.01) and deflection.max() < 0.01 * sag
    second = np.abs(result.time - period) < period / 4
    assert result.time[second][np.argmax(deflection[second])] == pytest.approx(period, rel=0.02)
    assert result.energy_balance < 1e-4


def test_tighter_tolerance_brings_a_flexible_run_closer():
    """The ringing beam against its own run with 4000 steps a period; error ~ tol^(2/3) as for rigid links."""
    mechanism, period = simply_supported(Beam(STIFF), G), 2 * np.pi / STIFF.first_frequency(SIMPLE)
    best = fine(simulate(mechanism, period, solver=Solver(uniform_steps=4000)))
    tolerances, errors = 10.0 ** -np.arange(5, 9), []
    for tolerance in tolerances:
        result = fine(simulate(mechanism, period, solver=Solver(tolerance=tolerance, max_step=period / 10)))
        gap = best.at("strip.deflection", result.time) - result.signals["strip.deflection"]
        errors.append(np.abs(gap).max() / np.ptp(best.signals["strip.deflection"]))
    assert np.polyfit(np.log(tolerances), np.log(errors), 1)[0] == pytest.approx(2 / 3, abs=0.15)
    assert errors[-1] < 2e-3


def test_damped_beam_settles_on_its_static_sag():
    """Mid deflection 5 q L^4/(384 E I), and half the weight on the pin."""
    section = STIFF.damped(0.7, SIMPLE)
    period = 2 * np.pi / section.first_frequency(SIMPLE)
    result = fine(simulate(simply_supported(Beam(section), G), 5 * period, ledger=True))
    load = section.mass_per_length * G
    sag = 5 * load * SIMPLE**4 / (384 * section.bending_stiffness)
    assert result.signals["strip.deflection"][-1] == pytest.approx(-sag, rel=1e-3)
    assert result.signals["A.ground-strip.fy"][-1] == pytest.approx(load * SIMPLE / 2, rel=1e-3)
    strain = load**2 * SIMPLE**5 / (240 * section.bending_stiffness)  # half the work of the load on its own sag
    assert result.energy["strain"][-1] == pytest.approx(strain, rel=2e-3)
    assert result.energy["taken_damping"][-1] == pytest.approx(strain, rel=1e-2)  # the other half


@pytest.mark.parametrize("ratio", [0.02, 0.1])
def test_bending_damping_is_the_given_ratio(ratio):
    """Logarithmic decrement of the ringing about the sag."""
    section = STIFF.damped(ratio, SIMPLE)
    period = 2 * np.pi / section.first_frequency(SIMPLE) / math.sqrt(1 - ratio**2)
    result = fine(simulate(simply_supported(Beam(section), G), 4.5 * period, solver=Solver(max_step=period / 200)))
    sag = 5 * section.mass_per_length * G * SIMPLE**4 / (384 * section.bending_stiffness)
    swing = result.signals["strip.deflection"] + sag
    peaks = [np.abs(swing[np.abs(result.time - k * period / 2) < period / 8]).max() for k in (2, 8)]
    decrement = math.log(peaks[0] / peaks[1]) / 3
    assert decrement / math.hypot(2 * np.pi, decrement) == pytest.approx(ratio, rel=0.02)


# --- struts and buckled strips ----------------------------------------------------------------------------------------


def pressed(body, travel, duration, mass=0.1):
    """A strip in line with its guide, its far end on a pin; the near end travels as t^3."""
    return Mechanism(
        points={"A": (0, 0), "B": (LENGTH, 0)},
        links=[Link("strip", "A", "B", body)],
        joints=[Revolute("B", "ground", "strip")],
        guides=[Guide("A", "strip", mass=mass)],
        drive=Drive("A", Motion(lambda t: travel * (t / duration) ** 3, lambda t: 3 * travel * t**2 / duration**3)),
    )


def test_pressed_strut_gives_the_exact_elastica():
    travel, duration = 0.95 * LENGTH, 1.0
    result = fine(simulate(pressed(Strut(STRIP), travel, duration), duration, ledger=True))
    u = result.signals["strip.end_shortening"] / LENGTH
    load = UNIT * pinned.load(np.maximum(u, 1e-9))
    later = u > 1e-3
    assert result.signals["strip.compression"][later] == pytest.approx(load[later], rel=1e-5)
    inertia = 0.1 * 6 * travel * result.time / duration**3
    assert result.signals["drive.force"][later] == pytest.approx((load + inertia)[later], rel=1e-3)
    bending = STRIP.bending_stiffness / LENGTH * pinned.energy(u[-1])
    assert result.energy["strain"][-1] == pytest.approx(bending, rel=1e-4)


@pytest.mark.parametrize("travel", [-1e-6, 1e-7])
def test_straight_strut_is_a_stiff_bar(travel):
    """E A/L times the elongation, taut or still below the Euler load."""
    result = fine(simulate(pressed(Strut(STRIP), travel, 1.0), 1.0))
    force = STRIP.axial_stiffness / LENGTH * travel
    assert abs(force) < STRIP.euler_load(LENGTH) or travel < 0
    assert result.signals["strip.compression"][-1] == pytest.approx(force, rel=1e-9)
    assert result.signals["drive.force"][-1] == pytest.approx(force, abs=1e-5)


def test_taut_strut_is_damped_along_its_axis():
    """Pulled by U = U_1 t^3: E A/L (U + tau U'), and the damping takes E A/L tau 9 U_1^2/5 in the first second."""
    tau, pull, rigidity = 0.05, 1e-5, STRIP.axial_stiffness / LENGTH
    section = replace(STRIP, material=replace(STEEL, axial_damping=tau))
    result = fine(simulate(pressed(Strut(section), -pull, 1.0), 1.0, ledger=True))
    t = result.time
    force = rigidity * pull * (t**3 + tau * 3 * t**2) + 0.1 * 6 * pull * t
    assert -result.signals["drive.force"] == pytest.approx(force, abs=1e-4 * force[-1])
    assert result.energy["taken_damping"][-1] == pytest.approx(rigidity * tau * 9 * pull**2 / 5, rel=1e-3)


DAMPED = STRIP.damped(0.1, LENGTH)


@pytest.mark.parametrize(
    "body", [Beam(DAMPED, imperfection=1e-5), Cable(DAMPED, elements=16, imperfection=1e-5)], ids=["beam", "cable"]
)
def test_strip_pressed_slowly_follows_the_exact_elastica(body):
    result = fine(simulate(pressed(body, 0.6 * LENGTH, 80.0), 80.0, ledger=True))
    u = result.signals["strip.end_shortening"] / LENGTH
    later = u > 0.05
    assert u[-1] == pytest.approx(0.6, abs=1e-6)
    load = UNIT * pinned.load(u[later])
    assert result.signals["drive.force"][later] == pytest.approx(load, rel=1e-3)
    height = np.abs(result.signals["strip.deflection"][later])
    assert height == pytest.approx(LENGTH * pinned.mid_deflection(u[later]), rel=1e-3)
    bending = STRIP.bending_stiffness / LENGTH * pinned.energy(u[-1])
    assert result.energy["strain"][-1] == pytest.approx(bending, rel=1e-3)


@pytest.mark.parametrize(("make", "order", "bound"), [
    (lambda n: Beam(STRIP, elements=n, nodes=2), 2, 1e-2),
    (lambda n: Beam(STRIP, elements=n, nodes=3), 4, 1e-4),
    (lambda n: Cable(STRIP, elements=n), 4, 1e-3),
], ids=["linear beam", "quadratic beam", "cable"])  # fmt: skip
def test_static_force_converges_to_the_elastica(make, order, bound):
    """At u = 0.1, 0.5, 0.9; the error is taken where it is largest."""
    u, errors = np.array([0.1, 0.5, 0.9]), []
    for elements in (8, 16) if order == 4 else (16, 32):
        found = pinned_strip(make(elements), LENGTH, u)
        assert found.status is Status.OK, found.message
        errors.append(np.abs(found.load / pinned.load(u) - 1).max())
    assert rates(errors)[0] == pytest.approx(order, abs=0.5)
    assert errors[-1] < bound


def test_static_shapes_are_the_exact_ones():
    found = pinned_strip(Beam(STRIP, elements=16), LENGTH, [0.3, 0.8])
    for u, line in zip(found.shortening, found.shapes, strict=True):
        assert line[:, 1].max() == pytest.approx(LENGTH * pinned.mid_deflection(u), rel=1e-3)
        assert np.hypot(*(line[-1] - line[0])) == pytest.approx((1 - u) * LENGTH, rel=1e-9)
        assert np.hypot(*np.diff(line, axis=0).T).sum() == pytest.approx(LENGTH, rel=1e-3)


def test_too_coarse_a_strip_is_called_off_its_branch():
    found = pinned_strip(Beam(STRIP, elements=2, nodes=2), LENGTH, [0.1])
    assert found.status is Status.SUSPECT and "BRANCH" in found.message and "u = 0.1" in found.message


@pytest.mark.parametrize("u", [0.0, -0.1, 1.6, math.nan])
def test_static_shortening_out_of_range_is_named(u):
    with pytest.raises(ValueError, match=r"shortenings = .*must lie in \[1e-06, 1.5\]"):
        pinned_strip(Beam(STRIP), LENGTH, [0.1, u])


@pytest.mark.parametrize(("body", "length", "word"), [(Beam(STRIP), -0.3, "length"), (Rigid(STRIP), 0.3, "Rigid")])
def test_static_strip_is_checked_before_the_engine(body, length, word):
    with pytest.raises(ValueError, match=word):
        pinned_strip(body, length, [0.1])


# --- what must not be trusted, and what failed ------------------------------------------------------------------------


@dataclass(frozen=True)
class Kicker(Hertz):
    """A stop that gives back twice the force it took: it makes energy."""

    def force(self, depth, rate, onset):
        return self.elastic(depth) * np.where(rate < 0, 2.0, 1.0)


@dataclass(frozen=True)
class Broken(Hertz):
    """A stop whose force is no number."""

    def force(self, depth, rate, onset):
        return math.nan


def test_a_stop_that_makes_energy_is_suspect():
    result = simulate(block(G, Kicker(1e8)), 0.3, ledger=True)
    assert result.energy["taken_contact"][-1] < -0.1  # joules, of 0.5 put in
    assert result.status is Status.SUSPECT and "ENERGY" in result.message


def test_a_force_the_ledger_does_not_know_is_suspect(monkeypatch):
    """The stop pushes half as hard again as the law that is booked."""
    from mbs.joints import StopContact

    plain = StopContact.force
    calls = {"engine": 1.5}
    monkeypatch.setattr(StopContact, "force", lambda self, *state: calls["engine"] * plain(self, *state))
    from mbs.recording import StopState

    accept = StopState.accept

    def booked(self, *state):
        calls["engine"] = 1.0
        force = accept(self, *state)
        calls["engine"] = 1.5
        return force

    monkeypatch.setattr(StopState, "accept", booked)
    result = simulate(block(G, Hertz(1e8)), 0.3, ledger=True)
    assert result.status is Status.SUSPECT and "ENERGY" in result.message


@pytest.mark.parametrize(
    ("mechanism", "steps"), [(pendulum(2.5), 20), (block(G, Hertz(1e10)), 100)], ids=["swing", "hit"]
)
def test_too_large_uniform_steps_are_suspect(mechanism, steps):
    result = simulate(mechanism, 1.5 if steps == 20 else 0.4, ledger=True, solver=Solver(uniform_steps=steps))
    assert result.status is Status.SUSPECT and "ENERGY" in result.message
    assert result.energy_balance > 1e-2


def test_uniform_steps_stay_uniform_or_fail():
    result = simulate(pendulum(1.5), 10.0, solver=Solver(uniform_steps=10))
    assert result.status is not Status.OK or len(result.time) == 11


def test_unbuckled_strip_is_suspect():
    """Perfectly straight and pressed in line: the integrator stays on the straight branch."""
    result = simulate(pressed(Beam(STRIP), 0.5 * LENGTH, 1.0), 1.0)
    assert result.status is Status.SUSPECT and "UNBUCKLED" in result.message and "'strip'" in result.message


def test_soft_stop_is_suspect():
    result = simulate(block(G, Hertz(10.0)), 0.4)
    assert result.status is Status.SUSPECT and "PENETRATION" in result.message


def test_out_of_time():
    result = simulate(slider_crank(Beam(STRIP), law=None, mass=0.3, speed=1.25), 5.0, timeout=1e-9, ledger=True)
    assert result.status is Status.TIMED_OUT and "of 5 s" in result.message
    assert 1 <= result.work["steps"] < 50 and len(result.signals["B.x"]) == len(result.time)


def test_too_many_steps():
    result = simulate(slider_crank(Beam(STRIP), law=None, mass=0.3, speed=1.25), 5.0, solver=Solver(max_steps=7))
    assert result.status is Status.TOO_MANY_STEPS and "max_steps = 7" in result.message
    assert len(result.time) <= 8


def test_drive_out_of_reach_is_newton_diverged():
    """The slider is pulled on beyond the stretched linkage."""
    linkage = Mechanism(
        points={"O": (0, 0), "A": (0.1, 0.1), "B": (0.4, 0)},
        links=[Link("a", "O", "A", BAR), Link("b", "A", "B", BAR)],
        joints=[Revolute("O", "ground", "a"), Revolute("A", "a", "b")],
        guides=[Guide("B", "b")],
        drive=Drive("B", 0.1),
    )
    result = simulate(linkage, 2.0)
    assert result.status is Status.NEWTON_DIVERGED
    reach = math.hypot(0.1, 0.1) + math.hypot(0.3, 0.1)
    assert result.signals["B.x"][-1] == pytest.approx(reach, abs=1e-4) and "0.57" in result.message


def test_redundant_rigid_linkage_is_no_success():
    joints = [Revolute("O", "ground", "bar"), Revolute("O", "bar", "ground")]
    try:
        result = simulate(replace(pendulum(1.0), joints=joints), 0.1)
    except ValueError:
        return
    assert result.status is Status.NEWTON_DIVERGED


def test_force_that_is_no_number_is_a_failure():
    result = simulate(block(G, Broken(1e8)), 0.3)
    assert result.status in (Status.NEWTON_DIVERGED, Status.NOT_FINITE)
    assert result.time[-1] < math.sqrt(0.2 / G) * 1.01


def half_elastica(u):
    if u > 0.2:
        raise ValueError(f"shortening = {u:.3f}: must lie in [0, 0.2]")
    return pinned.load(u)


def test_strut_beyond_its_law_has_a_name():
    result = simulate(pressed(Strut(STRIP, load=half_elastica), 0.5 * LENGTH, 1.0), 1.0)
    assert result.status is Status.STRUT_OUT_OF_RANGE
    assert result.signals["strip.end_shortening"][-1] == pytest.approx(0.2 * LENGTH, rel=0.05)


def test_what_a_law_complained_of_reaches_the_reader():
    result = simulate(pressed(Strut(STRIP, load=half_elastica), 0.5 * LENGTH, 1.0), 1.0)
    assert "must lie in [0, 0.2]" in result.message


def test_failed_run_keeps_the_shapes_it_reached():
    mechanism = slider_crank(Beam(STRIP), law=None, mass=0.3, speed=1.25)
    result = simulate(mechanism, 5.0, solver=Solver(max_steps=20), shapes=[0.0, 4.0])
    assert result.status is Status.TOO_MANY_STEPS and result.shapes["coupler"].times.tolist() == [0.0]


def test_block_between_two_stops():
    between = block(1.0, Hertz(1e8), 0.1)
    both = replace(between, stops=[*between.stops, Stop("A", at=-0.05, law=Hertz(1e8))])
    result = simulate(both, 1.0, ledger=True)
    assert result.status is Status.OK, result.message


def test_names_may_have_blanks_or_are_refused_when_made():
    try:
        mechanism = Mechanism(
            points={"pivot": (0, 0), "far end": (0.5, 0)},
            links=[Link("long bar", "pivot", "far end", BAR)],
            joints=[Revolute("pivot", "ground", "long bar")],
        )
    except ValueError:
        return
    assert simulate(mechanism, 0.01).ok


def test_strip_may_be_pressed_by_a_ramp_from_rest():
    ramped = replace(pressed(Strut(STRIP), 1.0, 1.0), drive=Drive("A", Ramp(0.0, 0.05, 0.1)))
    assert simulate(ramped, 0.1).ok


# --- wrong input, repeatability, manners ------------------------------------------------------------------------------


def test_wrong_input_is_refused_before_the_engine(monkeypatch):
    import mbs.solve

    def no_engine(*_):
        raise AssertionError("the engine was asked")

    monkeypatch.setattr(mbs.solve, "build", no_engine)
    with pytest.raises(AssertionError):
        simulate(pendulum(1.0), 1.0)
    for value in (0, -1.0, math.nan, math.inf, None, "1"):
        with pytest.raises(ValueError, match=r"duration = .* s: must lie in \(0, inf\] s"):
            simulate(pendulum(1.0), value)
    for value in (0.0, -1.0, math.nan):
        with pytest.raises(ValueError, match=r"timeout = .* s: must lie in \(0, inf\] s"):
            simulate(pendulum(1.0), 1.0, timeout=value)


@pytest.mark.parametrize("times", [[2.0], [-0.1], [math.nan]])
def test_wrong_times_of_shapes_are_refused_before_the_run(times, monkeypatch):
    import mbs.solve

    monkeypatch.setattr(mbs.solve, "build", lambda *_: pytest.fail("the engine was asked"))
    with pytest.raises(ValueError, match="shapes"):
        simulate(slider_crank(Beam(STRIP), law=None, mass=0.3, speed=1.25), 1.0, shapes=times)


SETTINGS = {
    "tolerance": (0.0, "(0, inf]"),
    "max_step": (-1.0, "(0, inf] s"),
    "min_step": (math.nan, "(0, inf] s"),
    "contact_resolution": (0, "[1, 10000]"),
    "spectral_radius": (1.1, "[0, 1]"),
    "newton_relative": (0.0, "(0, inf]"),
    "newton_absolute": (-1e-9, "(0, inf] N"),
    "max_steps": (0, "[1, 1000000000]"),
    "uniform_steps": (2.5, "[1, 1000000000]"),
}


@pytest.mark.parametrize("name", SETTINGS)
def test_wrong_settings_are_named(name):
    value, allowed = SETTINGS[name]
    with pytest.raises(ValueError) as caught:
        Solver(**{name: value})
    assert f"{name} = {value!r}" in str(caught.value) and f" in {allowed}" in str(caught.value)


def test_the_same_input_gives_the_same_bits():
    mechanism = slider_crank(
        Beam(STRIP.damped(0.02, LENGTH)),
        law=CarvalhoMartins(1e5, 0.8),
        mass=0.3,
        speed=1.25,
        friction=GuideFriction(0.1),
    )
    one, two = (simulate(mechanism, 2.5, ledger=True) for _ in range(2))
    assert one.ok and one.signals["B.contact_force"].max() > 1  # so that there is something to repeat
    assert np.array_equal(one.time, two.time)
    for name in one.signals:
        assert np.array_equal(one.signals[name], two.signals[name]), name
    for name in one.energy:
        assert np.array_equal(one.energy[name], two.energy[name]), name


def test_the_ledger_changes_nothing_but_itself():
    mechanism = slider_crank(Strut(STRIP), law=ExactRestitution(1e5, 0.8), mass=0.3, speed=1.25)
    one, two = simulate(mechanism, 2.0), simulate(mechanism, 2.0, ledger=True)
    assert not one.energy and two.energy
    assert all(np.array_equal(one.signals[name], two.signals[name]) for name in one.signals)


def test_progress_rises_from_zero_to_one():
    seen = []
    simulate(pendulum(1.0), 0.3, progress=seen.append)
    assert seen[0] == 0 and seen[-1] == pytest.approx(1.0) and (np.diff(seen) > 0).all()


def test_run_ends_where_it_should_and_keeps_to_the_largest_step():
    result = fine(simulate(pendulum(1.0), 0.7, solver=Solver(max_step=0.01)))
    assert result.time[0] == 0 and result.time[-1] == pytest.approx(0.7, rel=1e-12)
    assert np.diff(result.time).max() <= 0.01 * (1 + 1e-9)


def test_published_slider_crank_quasi_static_contact_force():
    """Largest force on the stop from the exact elastica, 1.7246 N at 180 degrees, once the impact has died out."""
    section = replace(STRIP, material=STEEL).damped(0.1, LENGTH)
    mechanism = slider_crank(Beam(section), law=CarvalhoMartins(1e5, 0.3), mass=0.05, speed=0.5)
    result = fine(simulate(mechanism, math.radians(200) / 0.5, ledger=True))
    u = PAPER.shortening(np.pi, mechanism.stops[0].at)
    force = result.at("B.contact_force", math.pi / 0.5)
    assert force == pytest.approx(UNIT * pinned.load(u), rel=5e-3)
    assert force == pytest.approx(1.7246, rel=5e-3)
    assert result.energy_balance < 5e-3
