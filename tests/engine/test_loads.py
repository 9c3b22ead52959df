"""Loads, masses and motors against closed forms: each gives what it should, to both its bodies, and its energy balances."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import ellipk
from simulations import BAR, G, fine

from buckler.mbs import (
    Beam,
    Cable,
    Clearance,
    Controlled,
    Drive,
    Equal,
    Exudyn,
    Force,
    Guide,
    Link,
    Mass,
    Material,
    Mechanism,
    Modal,
    Motor,
    Ramp,
    Revolute,
    Rigid,
    Section,
    Spring,
    Status,
    Strut,
    Torque,
    TorsionSpring,
    build,
    simulate,
)
from buckler.mbs.elements.load import Load
from buckler.mbs.laws import Impact

MASS, INERTIA, CENTRE = 2.0, 0.05, (0.10, 0.03)
CRANK = Rigid.of(mass=MASS, inertia=INERTIA, centre=CENTRE)
TIP = (0.3, 0.1)
ABOUT_PIN = INERTIA + MASS * (CENTRE[0] ** 2 + CENTRE[1] ** 2)
DAMPED = Section(0.02, 0.005, Material(210e9, 7850.0, 0.3, bending_damping=5e-3, axial_damping=1e-4))
SPAN = 0.5


def tight(steps):
    return Exudyn(Equal(steps), spectral_radius=0.9, newton_absolute=1e-12, reuse_jacobian=True)


def crank(*loads, masses=(), gravity=(0.0, 0.0), body=CRANK, joints=None):
    """A link with its centre of mass off its line, on a pin."""
    return Mechanism(
        points={"O": (0, 0), "A": TIP, "P": (0.5, 0.5)},
        links=[Link("crank", "O", "A", body)],
        joints=[Revolute("O", "ground", "crank")] if joints is None else joints,
        loads=loads, masses=masses, gravity=gravity,
    )  # fmt: skip


def turn(result):
    """Angle turned since t = 0 and its rate, from the motion of the tip."""
    x, y, vx, vy = (result.signals[f"A.{name}"] for name in ("x", "y", "vx", "vy"))
    return np.unwrap(np.arctan2(y, x)) - math.atan2(*TIP[::-1]), (x * vy - y * vx) / (x * x + y * y)


def period(time, values):
    """Mean period by the crossings of the mean of the extremes, each found on a cubic."""
    from scipy.interpolate import CubicSpline

    crossings = CubicSpline(time, values - (values.max() + values.min()) / 2).roots(extrapolate=False)
    return 2 * (crossings[-1] - crossings[0]) / (len(crossings) - 1)


# --- rigid links of given mass, masses on links -----------------------------------------------------------------------


@pytest.mark.parametrize("extra", [(), (Mass("A", 0.7, 0.02),), (Mass("A", 0.4, 0.01), Mass("O", 3.0, 0.01, "crank"))])
def test_compound_pendulum_with_its_centre_off_the_line(extra):
    """T = 4 K(sin^2(a/2))/omega, omega^2 = m g c/I about the pin, c from the pin to the centre of mass of all; tilted link."""
    reach = math.hypot(*TIP)
    frame = np.array([TIP, (-TIP[1], TIP[0])]) / reach
    parts = [(MASS, np.array(CENTRE) @ frame)]
    inertia = ABOUT_PIN
    for mass in extra:
        place = np.array(TIP if mass.point == "A" else (0.0, 0.0))
        parts.append((mass.mass, place))
        inertia += mass.inertia + mass.mass * place @ place
    moment = sum(m * place for m, place in parts)
    lowest = -math.pi / 2 - math.atan2(moment[1], moment[0])  # turn at which it hangs
    square = G * np.linalg.norm(moment) / inertia
    exact = 4 / math.sqrt(square) * ellipk(math.sin(lowest / 2) ** 2)
    mechanism = crank(masses=extra, gravity=(0, -G))
    result = fine(simulate(mechanism, 2.2 * exact, solver=tight(20000), ledger=True))
    assert period(result.time, turn(result)[0]) == pytest.approx(exact, rel=3e-6)
    assert result.energy_balance < 1e-6


def test_centre_of_mass_is_the_links_own_whatever_it_bears():
    """A mass on the tip: the link's own centre still moves as a point of the link, and Newton's law holds of link and mass."""
    result = fine(simulate(crank(masses=[Mass("A", 0.7, 0.02)], gravity=(0, -G)), 0.5, solver=Exudyn(Equal(4000))))
    angle, spin = turn(result)
    own = np.array(CENTRE) @ np.array([TIP, (-TIP[1], TIP[0])]) / math.hypot(*TIP)
    c, s = np.cos(angle), np.sin(angle)
    signals = result.signals
    np.testing.assert_allclose(signals["crank.x"], c * own[0] - s * own[1], atol=1e-12)
    np.testing.assert_allclose(signals["crank.vy"], spin * signals["crank.x"], atol=1e-6)
    reaction = signals["O.ground-crank.fy"]
    tip = np.gradient(signals["A.vy"], result.time)
    np.testing.assert_allclose((MASS * (signals["crank.ay"] + G) + 0.7 * (tip + G))[5:-5], reaction[5:-5], atol=2e-4 * 30)


@pytest.mark.parametrize("kind", ["beam", "cable", "modal", "block"])
def test_a_mass_on_any_body_falls_and_weighs_as_it_should(kind):
    """Two equal masses on the ends of a free bar, or one on a block: it falls with g; held, it pulls with its weight."""
    if kind == "modal":
        pytest.importorskip("skfem")
    if kind == "block":
        mechanism = Mechanism(
            points={"A": (0, 0), "B": (0, -SPAN)},
            links=[Link("strip", "A", "B", Strut(Section(0.02, 0.005)))],
            joints=[Revolute("A", "ground", "strip")],
            guides=[Guide("B", "strip", (0, 1), mass=0.5)],
            masses=[Mass("B", 0.25, link="strip")],
            gravity=(0, -G),
        )
        result = fine(simulate(mechanism, 0.005, solver=Exudyn(Equal(2000), spectral_radius=0.9), ledger=True))
        stiffness = DAMPED.axial_stiffness / SPAN
        assert result.signals["strip.compression"].min() == pytest.approx(-2 * 0.75 * G, rel=1e-2)  # loaded at once: twice
        assert period(result.time, result.signals["B.y"]) == pytest.approx(2 * math.pi * math.sqrt(0.75 / stiffness), rel=2e-3)
        return
    body = {"beam": Beam(DAMPED, 4), "cable": Cable(DAMPED, 4)}.get(kind) or Modal(DAMPED)
    inertia = 0.0 if kind == "cable" else 1e-3
    mechanism = Mechanism(
        points={"A": (0, 0), "B": (SPAN, 0)},
        links=[Link("strip", "A", "B", body)],
        masses=[Mass("A", 0.3, inertia), Mass("B", 0.3, inertia)],
        gravity=(0, -G),
    )
    result = fine(simulate(mechanism, 0.2, solver=Exudyn(Equal(200), spectral_radius=0.9), ledger=True))
    for point in "AB":
        np.testing.assert_allclose(result.signals[f"{point}.y"], -G * result.time**2 / 2, atol=1e-7)
    weight = (0.6 + DAMPED.mass_per_length * SPAN) * G
    assert result.energy["kinetic"][-1] == pytest.approx(weight * G * 0.2**2 / 2, rel=1e-5)
    turned = replace(mechanism, gravity=(0.0, 0.0), loads=[Torque("strip:A", 0.5), Torque("strip:B", 0.5)][: 2 if inertia else 0])
    if inertia:
        result = fine(simulate(turned, 0.1, solver=Exudyn(Equal(400), spectral_radius=0.9), ledger=True))
        about = DAMPED.mass_per_length * SPAN**3 / 12 + 0.3 * SPAN**2 / 2 + 2 * inertia
        mean = (result.signals["B.y"][-1] - result.signals["A.y"][-1]) / SPAN
        assert mean == pytest.approx(0.1**2 / 2 / about, rel=2e-2)
        assert result.energy_balance < 1e-3


# --- forces and torques -----------------------------------------------------------------------------------------------


def free(*loads, body=CRANK):
    return crank(*loads, body=body, joints=[])


def test_a_force_in_time_moves_a_free_link():
    """F = (2 + 6 t, -3 t^2) at the centre of mass of a bar: x'' = F/m."""
    bar = Rigid.of(mass=2.0, inertia=0.05, centre=(0.0, 0.0))
    result = fine(simulate(free(Force("O", lambda t: (2 + 6 * t, -3 * t * t)), body=bar), 1.0, solver=tight(12000), ledger=True))
    t = result.time
    np.testing.assert_allclose(result.signals["O.x"], t**2 / 2 + t**3 / 2, atol=1e-7)
    np.testing.assert_allclose(result.signals["O.y"], -(t**4) / 8, atol=1e-7)
    np.testing.assert_allclose(result.signals["force.O.fy"], -3 * t * t, atol=1e-12)
    assert result.energy_balance < 1e-6


def test_newton_and_euler_hold_of_every_load():
    """Momentum: at each step m a = sum of forces and I alpha = sum of moments, as the elements tell them from the record."""
    from buckler.mbs.engine.solve import once

    loads = [
        Force("A", (1.0, -2.0)),
        Force("A", lambda t: (3 * math.sin(9 * t), t), follows="crank"),
        Torque("crank", 0.7),
        Torque("crank", lambda t, angle, speed: math.cos(7 * t) - 0.3 * speed + 0.2 * angle),
        Motor("crank", lambda t: 12 * math.cos(3 * t), 0.8, 0.05, gear=-3.0, friction=0.02, dead_band=1.0),
        Spring("A", "ground:O", 90.0, 2.0, free_length=0.1),
        Spring("ground:A", "O", 0.0, law=lambda e, rate: 30 * e + 400 * e**3 + 0.5 * rate, free_length=0.2),
        TorsionSpring("ground", "crank", 2.0, 0.1, free_angle=0.3),
        TorsionSpring("crank", "ground", 0.0, law=lambda angle, rate: 2 * math.sin(angle) + 0.05 * rate),
    ]
    record = once(free(*loads), 1.0, tight(2000), None, None).record
    motion, mechanism = record.links["crank"], record.mechanism
    centre, _, acceleration = motion.centre()
    force, moment = np.zeros_like(centre), np.zeros_like(record.time)
    for name, load in mechanism.elements().items():
        if isinstance(load, Load):
            (push,) = load.pushes(name, record)
            arm = record.point(push.at)[0] - centre
            force = force + push.force
            moment = moment + push.torque + arm[:, 0] * push.force[:, 1] - arm[:, 1] * push.force[:, 0]
    np.testing.assert_allclose(MASS * acceleration, force, atol=1e-8 * np.abs(force).max())
    np.testing.assert_allclose(INERTIA * motion.q_tt[:, 2], moment, atol=1e-8 * np.abs(moment).max())


def test_power_of_a_load_is_what_its_energies_say():
    """Virtual work: the power on the bodies is minus that stored and taken, plus that given, to rounding."""
    from buckler.mbs.engine.solve import once

    motor = Motor("crank", lambda t: 12 * math.cos(3 * t), 0.8, 0.05, gear=-3.0, friction=0.02, dead_band=1.0)
    spring = Spring("A", "ground:O", 90.0, 2.0, free_length=0.1)
    torsion = TorsionSpring("ground", "crank", 2.0, 0.1, free_angle=0.3)
    record = once(crank(motor, spring, torsion), 0.5, tight(500), None, None).record
    stretch, rate, _ = spring.stretch(record)
    twist, spin = torsion.twist(record)
    voltage, speed = 12 * np.cos(3 * record.time), record.turn("crank:O")[1]
    current = motor.current(voltage, speed)
    electric = motor.effective(voltage) * current - motor.resistance * current**2
    for load, power in (
        (spring, -90.0 * stretch * rate - spring.lost(stretch, rate)),
        (torsion, -2.0 * twist * spin - torsion.lost(twist, spin)),
        (motor, electric - motor.rubbing(speed) * motor.gear * speed),
    ):
        found = load.power("", record)
        np.testing.assert_allclose(found, power, atol=1e-12 * np.abs(found).max())


def test_a_force_that_follows_its_link_turns_it_evenly():
    """Square to the crank at its tip it is a constant torque: angle = F r t^2/2 I, beyond a turn."""
    reach = math.hypot(*TIP)
    push = Force("A", (-20 * TIP[1] / reach, 20 * TIP[0] / reach), follows="crank")
    result = fine(simulate(crank(push), 0.6, solver=tight(16000), ledger=True))
    np.testing.assert_allclose(turn(result)[0], 20 * reach / ABOUT_PIN * result.time**2 / 2, atol=1e-5, rtol=2e-6)
    assert turn(result)[0][-1] > 2 * math.pi
    assert result.energy_balance < 1e-6


@pytest.mark.parametrize("body", [Beam(DAMPED, 4), Cable(DAMPED, 4), Modal(DAMPED)], ids=["beam", "cable", "modal"])
def test_a_force_that_follows_a_flexible_link(body):
    """On a stiff strip it does what it does on a rigid one of the same mass."""
    if isinstance(body, Modal):
        pytest.importorskip("skfem")
    found = []
    for kind in (body, Rigid(DAMPED)):
        push = Force("crank:A", (-0.5 * TIP[1], 0.5 * TIP[0]), follows="crank")
        result = fine(simulate(crank(push, body=kind), 0.4, solver=Exudyn(Equal(2000)), ledger=True))
        assert result.energy_balance < 1e-4
        found.append(turn(result)[0][-1])
    assert found[0] == pytest.approx(found[1], rel=1e-2) and found[1] > 0.4


def test_a_torque_of_angle_and_speed_is_a_damped_oscillator():
    stiff, damped = 3.0, 0.2
    law = Torque("crank", lambda _t, angle, speed: stiff * (0.5 - angle) - damped * speed)
    result = fine(simulate(crank(law), 2.0, solver=tight(20000), ledger=True))
    decay = damped / ABOUT_PIN / 2
    omega = math.sqrt(stiff / ABOUT_PIN - decay**2)
    wave = np.cos(omega * result.time) + decay / omega * np.sin(omega * result.time)
    np.testing.assert_allclose(turn(result)[0], 0.5 * (1 - np.exp(-decay * result.time) * wave), atol=3e-6)
    assert result.energy_balance < 1e-6


# --- motors -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "extra", [{}, {"inertia": 2e-4}, {"inertia": 1e-4, "friction": 0.05, "dead_band": 2.0}, {"gear": -4.0, "friction": 0.05}]
)
def test_motor_runs_up_as_it_should(extra):
    """Omega = (u_eff k - friction R)/(k^2 g) (1 - exp(-t/tau)), tau = (I + J g^2) R/(k g)^2: to 1e-8."""
    motor = Motor("crank", 12.0, 0.8, 0.05, **{"gear": 10.0, **extra})
    total = ABOUT_PIN + motor.inertia * motor.gear**2
    tau = total * motor.resistance / (motor.constant * motor.gear) ** 2
    speed = ((12.0 - motor.dead_band) / motor.constant - motor.friction * motor.resistance / motor.constant**2) / motor.gear
    if motor.gear < 0:
        speed = (12.0 / motor.constant - motor.friction * motor.resistance / motor.constant**2) / motor.gear
    result = fine(simulate(crank(motor), 1.2 * tau, solver=tight(16000), ledger=True))
    exact = speed * (1 - np.exp(-result.time / tau))
    late = result.time > 0.01 * tau  # friction sets in within 1e-3 rad/s of the rotor
    allowed = 1e-8 if not motor.friction else 5e-5  # the first step, in which friction sets in, is a kink
    assert np.abs(turn(result)[1] - exact)[late].max() < allowed * abs(speed)
    assert result.energy_balance < 1e-6
    i = result.signals["motor.crank.current"]
    np.testing.assert_allclose(i, (12.0 - motor.dead_band - 0.05 * motor.gear * turn(result)[1]) / 0.8, atol=1e-6 * i.max())


def test_motor_stands_still_in_its_dead_band_and_against_its_friction():
    for motor in (
        Motor("crank", 1.9, 0.8, 0.05, dead_band=2.0),
        Motor("crank", lambda t: -1.9 * math.sin(30 * t), 0.8, 0.05, dead_band=2.0),
    ):
        result = fine(simulate(crank(motor), 0.5))
        assert np.abs(turn(result)[0]).max() < 1e-12
    stalled = Motor("crank", 1.9, 0.8, 0.05, friction=0.2)  # 0.119 N m drive it
    assert np.abs(turn(fine(simulate(crank(stalled), 0.5)))[1]).max() < 1e-3


# --- springs ----------------------------------------------------------------------------------------------------------


def hung(**spring):
    """A bar that hangs by a spring from the ground, upright."""
    return Mechanism(
        points={"P": (0.2, 0.5), "A": (0.2, 0.0), "B": (0.2, -0.3)},
        links=[Link("bar", "A", "B", BAR)],
        loads=[Spring("ground:P", "A", **spring)],
        gravity=(0, -G),
    )


def test_a_mass_on_a_spring_keeps_its_time():
    """It falls by m g/k (1 - cos w t), and with a damper the decayed wave."""
    mass, stiff = BAR.section.mass_per_length * 0.3, 68.0
    for damping in (0.0, 0.4):
        result = fine(simulate(hung(stiffness=stiff, damping=damping), 2.0, solver=tight(20000), ledger=True))
        decay = damping / mass / 2
        omega = math.sqrt(stiff / mass - decay**2)
        t = result.time
        wave = np.exp(-decay * t) * (np.cos(omega * t) + decay / omega * np.sin(omega * t))
        np.testing.assert_allclose(result.signals["A.y"], mass * G / stiff * (wave - 1), atol=5e-6)
        np.testing.assert_allclose(result.signals["spring.P-A.elongation"], -result.signals["A.y"], atol=1e-12)
        assert result.energy_balance < 1e-6


def test_a_law_takes_the_place_of_stiffness_and_damping():
    """A law k e + c e' runs and balances as the spring does; a cubic one has the period of Duffing's oscillator."""
    linear = fine(simulate(hung(stiffness=68.0, damping=0.4), 1.0, solver=tight(20000), ledger=True))
    by_law = fine(simulate(hung(stiffness=0.0, law=lambda e, rate: 68 * e + 0.4 * rate), 1.0, solver=tight(20000), ledger=True))
    np.testing.assert_allclose(by_law.signals["A.y"], linear.signals["A.y"], atol=1e-10)
    for name in ("spring", "taken_damping"):
        np.testing.assert_allclose(by_law.energy[name], linear.energy[name], atol=1e-10)
    mass, a, start = 1.0, 2000.0, 0.1
    mechanism = Mechanism(
        points={"O": (0, 0), "A": (1.0 + start, 0), "B": (1.5, 0)},
        links=[Link("bar", "A", "B", Rigid.of(mass=mass, inertia=0.01))],
        loads=[Spring("A", "ground:O", 0.0, free_length=1.0, law=lambda e, _rate: a * e**3)],
    )
    result = fine(simulate(mechanism, 3.0, solver=tight(20000), ledger=True))
    exact = 4 * ellipk(0.5) / (start * math.sqrt(a / mass))  # x'' = -a x^3
    assert period(result.time, result.signals["A.x"]) == pytest.approx(exact, rel=1e-5)
    assert result.energy_balance < 1e-6


def test_a_spring_pendulum_follows_its_equations():
    """A mass on a spring that swings, against an integration in polar coordinates."""
    stiff, free_length, mass = 40.0, 0.4, 0.5
    mechanism = Mechanism(
        points={"P": (0, 0), "A": (0.5, 0.1), "B": (0.6, 0.1)},
        links=[Link("bob", "A", "B", Rigid.of(mass=mass, inertia=1e-3, centre=(0, 0)))],
        loads=[Spring("A", "ground:P", stiff, free_length=free_length)],
        gravity=(0, -G),
    )
    result = fine(simulate(mechanism, 2.0, solver=tight(20000), ledger=True))

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
    mechanism = Mechanism(
        points=points,
        links=[Link("one", "A", "B", CRANK), Link("two", "C", "D", BAR)],
        loads=[
            Spring("B", "two:C", 300.0, 0.5, free_length=0.2),
            TorsionSpring("one", "two", 5.0, 0.05, free_angle=0.6),
            Spring("A", "D", 0.0, law=lambda e, rate: 80 * e**3 + 0.1 * rate),
        ],
    )
    from buckler.mbs.engine.solve import once

    record = once(mechanism, 1.0, tight(12000), None, None).record
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
        spring = TorsionSpring("ground", "crank", stiff, free_angle=0.4, law=law)
        result = fine(simulate(crank(spring), 2.0, solver=tight(12000), ledger=True))
        angle = 0.4 * (1 - np.cos(math.sqrt(stiff / ABOUT_PIN) * result.time))
        np.testing.assert_allclose(turn(result)[0], angle, atol=1e-5)
        np.testing.assert_allclose(result.signals["torsion.ground-crank.torque"], stiff * (angle - 0.4), atol=3e-5)
        assert result.energy_balance < 1e-6
    points = {"A": (0, 0), "B": (0.4, 0), "C": (1, 0), "D": (1.2, 0)}
    bodies = [Rigid.of(mass=1.0, inertia=i) for i in (0.02, 0.05)]
    mechanism = Mechanism(
        points=points,
        links=[Link("one", "A", "B", bodies[0]), Link("two", "C", "D", bodies[1])],
        loads=[TorsionSpring("one", "two", stiff, free_angle=-0.5)],
    )
    result = fine(simulate(mechanism, 1.0, solver=tight(12000)))
    omega = math.sqrt(stiff * (1 / 0.02 + 1 / 0.05))
    np.testing.assert_allclose(result.signals["torsion.one-two.angle"], 0.5 * np.cos(omega * result.time), atol=1e-4)


# --- where loads may act ----------------------------------------------------------------------------------------------


def test_a_load_on_a_struts_end_acts_on_what_it_is_pinned_to():
    """A spring, a force and a mass named on the strut: the block moves as if they were named on it."""
    found = []
    for end in ("B", "strip:B"):
        mechanism = Mechanism(
            points={"A": (0, 0), "B": (SPAN, 0), "P": (SPAN + 0.2, 0)},
            links=[Link("strip", "A", "B", Strut(Section(0.02, 0.005)))],
            joints=[Revolute("A", "ground", "strip")],
            guides=[Guide("B", "strip", mass=0.5)],
            loads=[Spring(end, "ground:P", 3000.0, 2.0, free_length=0.1), Force(end, lambda t: (-5e4 * t, 0.0))],
            masses=[Mass("B", 0.5, link="strip" if ":" in end else None)],
        )
        result = fine(simulate(mechanism, 0.02, solver=Exudyn(Equal(4000)), ledger=True))
        assert result.energy_balance < 1e-3
        found.append(result.signals["B.x"])
    np.testing.assert_array_equal(*found)
    assert found[0][-1] < SPAN - 1e-6


LAW = Impact(1e8, 1e3, 1e-4)


def loose(*loads, masses=(), drives=()):
    """A rattling four-bar of rigid links: the explicit integrator runs it."""

    def play(point, first, second):
        return Clearance(point, first, second, 5e-3, 1e-4, LAW)

    bar = Rigid(Section(0.02, 0.005))
    return Mechanism(
        points={"O": (0, 0), "A": (0.1, 0), "B": (0.3, 0.1), "C": (0.3, -0.1)},
        links=[Link("crank", "O", "A", bar), Link("coupler", "A", "B", bar), Link("rocker", "C", "B", bar)],
        joints=[play("O", "ground", "crank"), play("A", "crank", "coupler"), play("B", "coupler", "rocker"),
                play("C", "ground", "rocker")],
        loads=loads, masses=masses, drives=drives, gravity=(0, -G),
    )  # fmt: skip


EVERYWHERE = (
    Spring("B", "ground:O", 2000.0, 1.0, free_length=0.3),
    Spring("rocker:B", "A", 0.0, law=lambda e, rate: 500 * e + 0.2 * rate),
    Torque("crank", lambda _t, _angle, speed: 1.0 - 0.1 * speed),
    Torque("rocker", -0.3),
    Force("coupler:A", lambda t: (10 * math.sin(50 * t), 3.0)),
    Force("rocker:B", (0, 3.0), follows="coupler"),
    TorsionSpring("crank", "coupler", 1.0, 0.001, free_angle=0.2),
    Motor("rocker", 3.0, 1.0, 0.05, inertia=1e-5, gear=2.0),
)


@pytest.mark.parametrize("driven", [False, True])
def test_the_explicit_integrator_takes_every_load(driven):
    """Its balance closes, and its motion is the implicit integrator's until rattling tells them apart."""
    mechanism = loose(*EVERYWHERE, masses=[Mass("B", 0.1, 1e-4, "rocker")], drives=[Drive("crank", 20.0)] if driven else [])
    assert build(mechanism).loose
    explicit = fine(simulate(mechanism, 0.01, solver=Exudyn(Controlled(1e-7)), ledger=True))
    assert explicit.work["jacobians"] == 0
    assert explicit.energy_balance < 1e-4
    if not driven:
        held = Guide("P", "extra", mass=1.0)  # a slider of its own makes it a scene for the implicit integrator
        apart = replace(
            mechanism,
            points={**mechanism.points, "P": (1, 0), "Q": (1.1, 0)},
            links=[*mechanism.links, Link("extra", "P", "Q", BAR)],
            guides=[held],
        )
        assert not build(apart).loose
        implicit = fine(simulate(apart, 0.01, solver=Exudyn(Controlled(1e-6))))
        for name in ("A.x", "A.y", "B.x", "B.y"):
            assert explicit.signals[name][-1] == pytest.approx(implicit.signals[name][-1], abs=2e-6)


def test_torque_of_a_drive_bears_the_loads_of_its_link():
    """A flywheel driven in a scene with clearance: a torque on it is one the drive need not give."""
    plain, loaded = (
        fine(simulate(loose(*loads, drives=[Drive("crank", 20.0)]), 0.005)) for loads in ((), (Torque("crank", 2.5),))
    )
    np.testing.assert_allclose(loaded.signals["drive.torque"], plain.signals["drive.torque"] - 2.5, atol=1e-9)


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
        (Force("A", later(None)), "force.A", "raised RuntimeError: no more"),
        (Force("A", later((math.nan, 0.0))), "force.A", "returned (nan, 0.0)"),
        (Force("A", later((1.0, 2.0, 3.0))), "force.A", "returned (1.0, 2.0, 3.0)"),
        (Torque("crank", later(math.inf)), "torque.crank", "returned inf"),
        (Motor("crank", later("much"), 1.0, 0.1), "motor.crank", "returned 'much'"),
        (Spring("A", "ground:O", 0.0, law=lambda e, _r: 500.0 if e > -0.05 else math.nan), "spring.A-O", "returned nan"),
        (TorsionSpring("ground", "crank", 0.0, law=lambda a, _r: -50.0 if a < 0.1 else math.nan), "torsion.ground-crank", "nan"),
    ],
)
def test_a_function_that_fails_ends_the_run_by_name(load, name, what):
    result = simulate(free(load), 1.0)
    assert result.status is Status.FUNCTION_FAILED, result.message
    assert f"the function of '{name}'" in result.message and what in result.message
    assert 0 < result.time[-1] < 1.0 and np.isfinite(result.signals["A.x"]).all()


@pytest.mark.parametrize(
    "load", [Force("A", later(None)), Torque("crank", later(math.nan)), Motor("crank", later(math.inf), 1.0, 0.1)]
)
def test_a_function_that_fails_ends_a_driven_run_by_name(load):
    """Where constraints alone decide the motion nothing is integrated; the run ends all the same."""
    mechanism = replace(crank(load), drives=[Drive("crank", 2.0)])
    result = simulate(mechanism, 0.5)
    assert result.status is Status.FUNCTION_FAILED, result.message
    assert f"the function of '{load.key}'" in result.message
    assert result.time[-1] <= 0.1 and np.isfinite(result.signals["drive.torque"]).all()


def test_a_drive_bears_motor_spring_and_mass():
    """Power of the drive: what the energies change by, less what the motor gave; to the trapezoidal rule."""
    loads = [Force("A", (0, -2.0)), Motor("crank", 12.0, 0.8, 0.05, inertia=1e-4, gear=5.0), Spring("A", "ground:P", 50.0, 1.0)]
    mechanism = crank(*loads, masses=[Mass("A", 0.3, 0.01)], gravity=(0, -G))
    mechanism = replace(mechanism, drives=[Drive("crank", Ramp(2.0, 5.0, 0.6))])
    result = fine(simulate(mechanism, 0.5, solver=Exudyn(Equal(4000)), ledger=True))
    assert result.energy_balance < 1e-6
