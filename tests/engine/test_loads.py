"""Loads, masses and motors against closed forms: each gives what it should, to both its bodies, and its energy balances."""

import math
from dataclasses import replace

import numpy as np
import pytest
from loaded import ABOUT_PIN, CENTRE, INERTIA, MASS, TIP, crank, free, period, tight, turn
from scipy.special import ellipk
from simulations import G, fine

from buckler import mbs
from buckler.mbs.elements.load import Load

DAMPED = mbs.Section(0.02, 0.005, mbs.Material(210e9, 7850.0, 0.3, bending_damping=5e-3, axial_damping=1e-4))
SPAN = 0.5


# --- rigid links of given mass, masses on links -----------------------------------------------------------------------


@pytest.mark.parametrize(
    "extra", [(), (mbs.Mass("A", 0.7, 0.02),), (mbs.Mass("A", 0.4, 0.01), mbs.Mass("O", 3.0, 0.01, "crank"))]
)
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
    result = fine(mbs.simulate(mechanism, 2.2 * exact, solver=tight(20000), ledger=True))
    assert period(result.time, turn(result)[0]) == pytest.approx(exact, rel=3e-6)
    assert result.energy_balance < 1e-6


@pytest.mark.parametrize("kind", ["beam", "cable", "modal", "block"])
def test_a_mass_on_any_body_falls_and_weighs_as_it_should(kind):
    """Two equal masses on the ends of a free bar, or one on a block: it falls with g; held, it pulls with its weight."""
    if kind == "modal":
        pytest.importorskip("skfem")
    if kind == "block":
        mechanism = mbs.Mechanism(
            points={"A": (0, 0), "B": (0, -SPAN)},
            links=[mbs.Link("strip", "A", "B", mbs.Strut(mbs.Section(0.02, 0.005)))],
            joints=[mbs.Revolute("A", "ground", "strip")],
            guides=[mbs.Guide("B", "strip", (0, 1), mass=0.5)],
            masses=[mbs.Mass("B", 0.25, link="strip")],
            gravity=(0, -G),
        )
        result = fine(mbs.simulate(mechanism, 0.005, solver=mbs.Exudyn(mbs.Equal(2000), spectral_radius=0.9), ledger=True))
        stiffness = DAMPED.axial_stiffness / SPAN
        assert result.signals["strip.compression"].min() == pytest.approx(-2 * 0.75 * G, rel=1e-2)  # loaded at once: twice
        assert period(result.time, result.signals["B.y"]) == pytest.approx(2 * math.pi * math.sqrt(0.75 / stiffness), rel=2e-3)
        return
    body = {"beam": mbs.Beam(DAMPED, 4), "cable": mbs.Cable(DAMPED, 4)}.get(kind) or mbs.Modal(DAMPED)
    inertia = 0.0 if kind == "cable" else 1e-3
    mechanism = mbs.Mechanism(
        points={"A": (0, 0), "B": (SPAN, 0)},
        links=[mbs.Link("strip", "A", "B", body)],
        masses=[mbs.Mass("A", 0.3, inertia), mbs.Mass("B", 0.3, inertia)],
        gravity=(0, -G),
    )
    result = fine(mbs.simulate(mechanism, 0.2, solver=mbs.Exudyn(mbs.Equal(200), spectral_radius=0.9), ledger=True))
    for point in "AB":
        np.testing.assert_allclose(result.signals[f"{point}.y"], -G * result.time**2 / 2, atol=1e-7)
    weight = (0.6 + DAMPED.mass_per_length * SPAN) * G
    assert result.energy["kinetic"][-1] == pytest.approx(weight * G * 0.2**2 / 2, rel=1e-5)
    turned = replace(
        mechanism, gravity=(0.0, 0.0), loads=[mbs.Torque("strip:A", 0.5), mbs.Torque("strip:B", 0.5)][: 2 if inertia else 0]
    )
    if inertia:
        result = fine(mbs.simulate(turned, 0.1, solver=mbs.Exudyn(mbs.Equal(400), spectral_radius=0.9), ledger=True))
        about = DAMPED.mass_per_length * SPAN**3 / 12 + 0.3 * SPAN**2 / 2 + 2 * inertia
        mean = (result.signals["B.y"][-1] - result.signals["A.y"][-1]) / SPAN
        assert mean == pytest.approx(0.1**2 / 2 / about, rel=2e-2)
        assert result.energy_balance < 1e-3


# --- forces and torques -----------------------------------------------------------------------------------------------


def test_a_force_in_time_moves_a_free_link():
    """F = (2 + 6 t, -3 t^2) at the centre of mass of a bar: x'' = F/m."""
    bar = mbs.Rigid.of(mass=2.0, inertia=0.05, centre=(0.0, 0.0))
    result = fine(
        mbs.simulate(free(mbs.Force("O", lambda t: (2 + 6 * t, -3 * t * t)), body=bar), 1.0, solver=tight(12000), ledger=True)
    )
    t = result.time
    np.testing.assert_allclose(result.signals["O.x"], t**2 / 2 + t**3 / 2, atol=1e-7)
    np.testing.assert_allclose(result.signals["O.y"], -(t**4) / 8, atol=1e-7)
    np.testing.assert_allclose(result.signals["force.O.fy"], -3 * t * t, atol=1e-12)
    assert result.energy_balance < 1e-6


def test_newton_and_euler_hold_of_every_load():
    """Momentum: at each step m a = sum of forces and I alpha = sum of moments, as the elements tell them from the record."""
    from buckler.mbs.engine.solve import run_once

    loads = [
        mbs.Force("A", (1.0, -2.0)),
        mbs.Force("A", lambda t: (3 * math.sin(9 * t), t), follows="crank"),
        mbs.Force("A", (2.0, 1.0), through=(0.3, -0.4)),
        mbs.Torque("crank", 0.7),
        mbs.Torque("crank", lambda t, angle, speed: math.cos(7 * t) - 0.3 * speed + 0.2 * angle),
        mbs.Motor("crank", lambda t: 12 * math.cos(3 * t), 0.8, 0.05, gear=-3.0, friction=0.02, dead_band=1.0),
        mbs.Spring("A", "ground:O", 90.0, 2.0, free_length=0.1),
        mbs.Spring("ground:A", "O", 0.0, law=lambda e, rate: 30 * e + 400 * e**3 + 0.5 * rate, free_length=0.2),
        mbs.TorsionSpring("ground", "crank", 2.0, 0.1, free_angle=0.3),
        mbs.TorsionSpring("crank", "ground", 0.0, law=lambda angle, rate: 2 * math.sin(angle) + 0.05 * rate),
    ]
    record = run_once(free(*loads), 1.0, tight(2000), None, None).record
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


def test_a_force_that_follows_its_link_turns_it_evenly():
    """Square to the crank at its tip it is a constant torque: angle = F r t^2/2 I, beyond a turn."""
    reach = math.hypot(*TIP)
    push = mbs.Force("A", (-20 * TIP[1] / reach, 20 * TIP[0] / reach), follows="crank")
    result = fine(mbs.simulate(crank(push), 0.6, solver=tight(16000), ledger=True))
    np.testing.assert_allclose(turn(result)[0], 20 * reach / ABOUT_PIN * result.time**2 / 2, atol=1e-5, rtol=2e-6)
    assert turn(result)[0][-1] > 2 * math.pi
    assert result.energy_balance < 1e-6


@pytest.mark.parametrize("body", [mbs.Beam(DAMPED, 4), mbs.Cable(DAMPED, 4), mbs.Modal(DAMPED)], ids=["beam", "cable", "modal"])
def test_a_force_that_follows_a_flexible_link(body):
    """On a stiff strip it does what it does on a rigid one of the same mass."""
    if isinstance(body, mbs.Modal):
        pytest.importorskip("skfem")
    found = []
    for kind in (body, mbs.Rigid(DAMPED)):
        push = mbs.Force("crank:A", (-0.5 * TIP[1], 0.5 * TIP[0]), follows="crank")
        result = fine(mbs.simulate(crank(push, body=kind), 0.4, solver=mbs.Exudyn(mbs.Equal(2000)), ledger=True))
        assert result.energy_balance < 1e-4
        found.append(turn(result)[0][-1])
    assert found[0] == pytest.approx(found[1], rel=1e-2) and found[1] > 0.4


def test_a_torque_of_angle_and_speed_is_a_damped_oscillator():
    stiff, damped = 3.0, 0.2
    law = mbs.Torque("crank", lambda _t, angle, speed: stiff * (0.5 - angle) - damped * speed)
    result = fine(mbs.simulate(crank(law), 2.0, solver=tight(20000), ledger=True))
    decay = damped / ABOUT_PIN / 2
    omega = math.sqrt(stiff / ABOUT_PIN - decay**2)
    wave = np.cos(omega * result.time) + decay / omega * np.sin(omega * result.time)
    np.testing.assert_allclose(turn(result)[0], 0.5 * (1 - np.exp(-decay * result.time) * wave), atol=3e-6)
    assert result.energy_balance < 1e-6


# --- where loads may act ----------------------------------------------------------------------------------------------


def test_a_load_on_a_struts_end_acts_on_what_it_is_pinned_to():
    """A spring, a force and a mass named on the strut: the block moves as if they were named on it."""
    found = []
    for end in ("B", "strip:B"):
        mechanism = mbs.Mechanism(
            points={"A": (0, 0), "B": (SPAN, 0), "P": (SPAN + 0.2, 0)},
            links=[mbs.Link("strip", "A", "B", mbs.Strut(mbs.Section(0.02, 0.005)))],
            joints=[mbs.Revolute("A", "ground", "strip")],
            guides=[mbs.Guide("B", "strip", mass=0.5)],
            loads=[mbs.Spring(end, "ground:P", 3000.0, 2.0, free_length=0.1), mbs.Force(end, lambda t: (-5e4 * t, 0.0))],
            masses=[mbs.Mass("B", 0.5, link="strip" if ":" in end else None)],
        )
        result = fine(mbs.simulate(mechanism, 0.02, solver=mbs.Exudyn(mbs.Equal(4000)), ledger=True))
        assert result.energy_balance < 1e-3
        found.append(result.signals["B.x"])
    np.testing.assert_array_equal(*found)
    assert found[0][-1] < SPAN - 1e-6
