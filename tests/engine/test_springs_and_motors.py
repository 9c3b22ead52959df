"""Motors, springs and what fails of a load: closed forms, and failures by name."""

import math

import numpy as np
import pytest
from loaded import ABOUT_PIN, CRANK, crank, free, period, tight, turn
from scipy.integrate import solve_ivp
from scipy.special import ellipk
from simulations import BAR, G, fine

from buckler import mbs

# --- motors -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "extra", [{}, {"inertia": 2e-4}, {"inertia": 1e-4, "friction": 0.05, "dead_band": 2.0}, {"gear": -4.0, "friction": 0.05}]
)
def test_motor_runs_up_as_it_should(extra):
    """Omega = (u_eff k - friction R)/(k^2 g) (1 - exp(-t/tau)), tau = (I + J g^2) R/(k g)^2: to 1e-8."""
    motor = mbs.Motor("crank", 12.0, 0.8, 0.05, **{"gear": 10.0, **extra})
    total = ABOUT_PIN + motor.inertia * motor.gear**2
    tau = total * motor.resistance / (motor.constant * motor.gear) ** 2
    speed = ((12.0 - motor.dead_band) / motor.constant - motor.friction * motor.resistance / motor.constant**2) / motor.gear
    if motor.gear < 0:
        speed = (12.0 / motor.constant - motor.friction * motor.resistance / motor.constant**2) / motor.gear
    result = fine(mbs.simulate(crank(motor), 1.2 * tau, solver=tight(16000), ledger=True))
    exact = speed * (1 - np.exp(-result.time / tau))
    late = result.time > 0.01 * tau  # friction sets in within 1e-3 rad/s of the rotor
    allowed = 1e-8 if not motor.friction else 5e-5  # the first step, in which friction sets in, is a kink
    assert np.abs(turn(result)[1] - exact)[late].max() < allowed * abs(speed)
    assert result.energy_balance < 1e-6
    i = result.signals["motor.crank.current"]
    np.testing.assert_allclose(i, (12.0 - motor.dead_band - 0.05 * motor.gear * turn(result)[1]) / 0.8, atol=1e-6 * i.max())


def test_motor_stands_still_in_its_dead_band_and_against_its_friction():
    for motor in (
        mbs.Motor("crank", 1.9, 0.8, 0.05, dead_band=2.0),
        mbs.Motor("crank", lambda t: -1.9 * math.sin(30 * t), 0.8, 0.05, dead_band=2.0),
    ):
        result = fine(mbs.simulate(crank(motor), 0.5))
        assert np.abs(turn(result)[0]).max() < 1e-12
    stalled = mbs.Motor("crank", 1.9, 0.8, 0.05, friction=0.2)  # 0.119 N m drive it
    assert np.abs(turn(fine(mbs.simulate(crank(stalled), 0.5)))[1]).max() < 1e-3


# --- springs ----------------------------------------------------------------------------------------------------------


def hung(**spring):
    """A bar that hangs by a spring from the ground, upright."""
    return mbs.Mechanism(
        points={"P": (0.2, 0.5), "A": (0.2, 0.0), "B": (0.2, -0.3)},
        links=[mbs.Link("bar", "A", "B", BAR)],
        loads=[mbs.Spring("ground:P", "A", **spring)],
        gravity=(0, -G),
    )


def test_a_mass_on_a_spring_keeps_its_time():
    """It falls by m g/k (1 - cos w t), and with a damper the decayed wave."""
    mass, stiff = BAR.section.mass_per_length * 0.3, 68.0
    for damping in (0.0, 0.4):
        result = fine(mbs.simulate(hung(stiffness=stiff, damping=damping), 2.0, solver=tight(20000), ledger=True))
        decay = damping / mass / 2
        omega = math.sqrt(stiff / mass - decay**2)
        t = result.time
        wave = np.exp(-decay * t) * (np.cos(omega * t) + decay / omega * np.sin(omega * t))
        np.testing.assert_allclose(result.signals["A.y"], mass * G / stiff * (wave - 1), atol=5e-6)
        np.testing.assert_allclose(result.signals["spring.P-A.elongation"], -result.signals["A.y"], atol=1e-12)
        assert result.energy_balance < 1e-6


def test_a_law_takes_the_place_of_stiffness_and_damping():
    """A law k e + c e' runs and balances as the spring does; a cubic one has the period of Duffing's oscillator."""
    linear = fine(mbs.simulate(hung(stiffness=68.0, damping=0.4), 1.0, solver=tight(20000), ledger=True))
    by_law = fine(
        mbs.simulate(hung(stiffness=0.0, law=lambda e, rate: 68 * e + 0.4 * rate), 1.0, solver=tight(20000), ledger=True)
    )
    np.testing.assert_allclose(by_law.signals["A.y"], linear.signals["A.y"], atol=1e-10)
    for name in ("spring", "taken_damping"):
        np.testing.assert_allclose(by_law.energy[name], linear.energy[name], atol=1e-10)
    mass, a, start = 1.0, 2000.0, 0.1
    mechanism = mbs.Mechanism(
        points={"O": (0, 0), "A": (1.0 + start, 0), "B": (1.5, 0)},
        links=[mbs.Link("bar", "A", "B", mbs.Rigid.of(mass=mass, inertia=0.01))],
        loads=[mbs.Spring("A", "ground:O", 0.0, free_length=1.0, law=lambda e, _rate: a * e**3)],
    )
    result = fine(mbs.simulate(mechanism, 3.0, solver=tight(20000), ledger=True))
    exact = 4 * ellipk(0.5) / (start * math.sqrt(a / mass))  # x'' = -a x^3
    assert period(result.time, result.signals["A.x"]) == pytest.approx(exact, rel=1e-5)
    assert result.energy_balance < 1e-6


def test_a_spring_pendulum_follows_its_equations():
    """A mass on a spring that swings, against an integration in polar coordinates."""
    stiff, free_length, mass = 40.0, 0.4, 0.5
    mechanism = mbs.Mechanism(
        points={"P": (0, 0), "A": (0.5, 0.1), "B": (0.6, 0.1)},
        links=[mbs.Link("bob", "A", "B", mbs.Rigid.of(mass=mass, inertia=1e-3, centre=(0, 0)))],
        loads=[mbs.Spring("A", "ground:P", stiff, free_length=free_length)],
        gravity=(0, -G),
    )
    result = fine(mbs.simulate(mechanism, 2.0, solver=tight(20000), ledger=True))

    def rates(_t, s):
        r = math.hypot(s[0], s[1])
        pull = -stiff * (r - free_length) / r / mass
        return s[2], s[3], pull * s[0], pull * s[1] - G

    exact = solve_ivp(rates, (0, 2), (0.5, 0.1, 0, 0), "DOP853", [2.0], rtol=1e-12, atol=1e-13).y[:, 0]
    np.testing.assert_allclose([result.signals[f"A.{n}"][-1] for n in ("x", "y", "vx", "vy")], exact, atol=3e-5)
    assert result.energy_balance < 1e-6


def test_springs_between_links_keep_momentum():
    """Two free links, a spring and a torsion spring between them: linear and angular momentum stay as they were."""
    points = {"A": (0, 0), "B": (0.4, 0.1), "C": (0.5, -0.2), "D": (0.8, 0.3)}
    mechanism = mbs.Mechanism(
        points=points,
        links=[mbs.Link("one", "A", "B", CRANK), mbs.Link("two", "C", "D", BAR)],
        loads=[
            mbs.Spring("B", "two:C", 300.0, 0.5, free_length=0.2),
            mbs.TorsionSpring("one", "two", 5.0, 0.05, free_angle=0.6),
            mbs.Spring("A", "D", 0.0, law=lambda e, rate: 80 * e**3 + 0.1 * rate),
        ],
    )
    from buckler.mbs.engine.solve import run_once

    record = run_once(mechanism, 1.0, tight(12000), None, None).record
    linear, angular, size = 0.0, 0.0, 0.0
    for motion in record.links.values():
        place, velocity, _ = motion.centre()
        linear = linear + motion.mass * velocity
        angular = angular + motion.mass * (place[:, 0] * velocity[:, 1] - place[:, 1] * velocity[:, 0])
        angular = angular + motion.inertia * motion.turn()[1]
        size = max(size, float(np.abs(motion.mass * velocity).max()), float(np.abs(motion.inertia * motion.turn()[1]).max()))
    assert np.abs(linear).max() < 1e-9 * size
    assert np.abs(angular).max() < 1e-6 * size  # the integrator's own: of second order in the step


def test_torsion_springs_swing_in_their_time():
    """Between a link and the ground omega^2 = k/I; between two free links k (1/I_1 + 1/I_2), by a law too."""
    stiff = 3.0
    for law in (None, lambda angle, _rate: stiff * angle):
        spring = mbs.TorsionSpring("ground", "crank", stiff, free_angle=0.4, law=law)
        result = fine(mbs.simulate(crank(spring), 2.0, solver=tight(12000), ledger=True))
        angle = 0.4 * (1 - np.cos(math.sqrt(stiff / ABOUT_PIN) * result.time))
        np.testing.assert_allclose(turn(result)[0], angle, atol=1e-5)
        np.testing.assert_allclose(result.signals["torsion.ground-crank.torque"], stiff * (angle - 0.4), atol=3e-5)
        assert result.energy_balance < 1e-6
    points = {"A": (0, 0), "B": (0.4, 0), "C": (1, 0), "D": (1.2, 0)}
    bodies = [mbs.Rigid.of(mass=1.0, inertia=i) for i in (0.02, 0.05)]
    mechanism = mbs.Mechanism(
        points=points,
        links=[mbs.Link("one", "A", "B", bodies[0]), mbs.Link("two", "C", "D", bodies[1])],
        loads=[mbs.TorsionSpring("one", "two", stiff, free_angle=-0.5)],
    )
    result = fine(mbs.simulate(mechanism, 1.0, solver=tight(12000)))
    omega = math.sqrt(stiff * (1 / 0.02 + 1 / 0.05))
    np.testing.assert_allclose(result.signals["torsion.one-two.angle"], 0.5 * np.cos(omega * result.time), atol=1e-4)


# --- failures and refusals --------------------------------------------------------------------------------------------


def later(value):
    """A function of any arguments, time first, that fails after 0.1 s."""

    def function(t, *_):
        if t > 0.1:
            if value is None:
                raise RuntimeError("no more")
            return value
        return (0.0, 0.0) if isinstance(value, tuple) or pairs else 0.0

    pairs = value is None
    return function


@pytest.mark.parametrize(
    ("load", "name", "what"),
    [
        (mbs.Force("A", later(None)), "force.A", "raised RuntimeError: no more"),
        (mbs.Force("A", later((math.nan, 0.0))), "force.A", "returned (nan, 0.0)"),
        (mbs.Force("A", later((1.0, 2.0, 3.0))), "force.A", "returned (1.0, 2.0, 3.0)"),
        (mbs.Torque("crank", later(math.inf)), "torque.crank", "returned inf"),
        (mbs.Motor("crank", later("much"), 1.0, 0.1), "motor.crank", "returned 'much'"),
        (mbs.Spring("A", "ground:O", 0.0, law=lambda e, _r: 500.0 if e > -0.05 else math.nan), "spring.A-O", "returned nan"),
        (
            mbs.TorsionSpring("ground", "crank", 0.0, law=lambda a, _r: -50.0 if a < 0.1 else math.nan),
            "torsion.ground-crank",
            "nan",
        ),
    ],
)
def test_a_function_that_fails_ends_the_run_by_name(load, name, what):
    result = mbs.simulate(free(load), 1.0)
    assert result.status is mbs.Status.FUNCTION_FAILED, result.message
    assert f"the function of '{name}'" in result.message and what in result.message
    assert 0 < result.time[-1] < 1.0 and np.isfinite(result.signals["A.x"]).all()


def test_a_spring_from_a_point_to_itself_is_refused():
    with pytest.raises(ValueError, match="spring from 'A' to 'crank:A': both its ends are the same point of the same link"):
        crank(mbs.Spring("A", "crank:A", 10.0))
