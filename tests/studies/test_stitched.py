"""The published model of the slider-crank against closed forms, and its ledger against energy."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from buckler.elastica import law
from buckler.mbs import Ramp, Section
from buckler.mbs.library import PAPER, PAPER_STOP
from buckler.studies.striking.stitched import Rebound, Stitched, follow

EI = Section(0.03, 3e-4).bending_stiffness
WEIGHT = 0.3 * 9.81
MODEL = Stitched(mass=0.3, restitution=0.8, friction=0.1 * WEIGHT, impact_duration=3.775e-3, stiffness=EI)
SLOW = Ramp(0.02, 0.02, 1.0)  # the crank hardly turns while the slider rebounds: the push is constant


def turn(speed):
    return Ramp(speed, speed, 1.0), 2 * np.pi / speed


def pulses(trace):
    """Force and start of every impact."""
    modes = np.flatnonzero(np.diff((trace.force > 0).astype(int)) == 1) + 1
    return trace.force[modes], trace.time[modes]


def test_rebound_agrees_with_an_integration_of_its_motion():
    rebound = Rebound.of(speed=0.15, push=1.35, friction=0.3, mass=0.3)

    def motion(_, state):
        return state[1], -(1.35 + 0.3 * np.sign(state[1])) / 0.3

    def still(_, state):
        return state[1]

    still.terminal, still.direction = True, -1
    out = solve_ivp(motion, (0, 1), (0, 0.15), events=still, rtol=1e-11, atol=1e-13)
    assert rebound.outward_time == pytest.approx(out.t[-1], rel=1e-9)
    assert rebound.height == pytest.approx(out.y[0, -1], rel=1e-9)

    def home(_, state):
        return state[0]

    home.terminal, home.direction = True, -1
    back = solve_ivp(motion, (0, 1), (rebound.height, -1e-12), events=home, rtol=1e-11, atol=1e-13)
    assert rebound.duration == pytest.approx(out.t[-1] + back.t[-1], rel=1e-6)
    assert rebound.return_speed == pytest.approx(-back.y[1, -1], rel=1e-6)
    assert rebound.return_speed == pytest.approx(0.15 * np.sqrt(1.05 / 1.65), rel=1e-12)


def test_rebounds_without_friction_are_a_geometric_series():
    model = replace(MODEL, friction=0.0)
    trace = follow(model, SLOW, 2.2 / 0.02)
    forces, starts = pulses(trace)
    count = int(np.ceil(np.log(1e-2) / np.log(0.8)))
    speed = 0.02 * abs(PAPER.slider_rate(model.contact_angle))
    assert len(forces) == count + 1  # the impacts, and then the contact
    assert forces[:count] == pytest.approx(model.impact_force(speed) * 0.8 ** np.arange(count), rel=1e-6)
    flights = 2 * 0.3 * speed / model.contact_force(model.contact_angle) * (0.8 ** np.arange(1, count + 1)).sum()
    assert starts[-1] - starts[0] == pytest.approx(count * model.impact_duration + flights, rel=1e-4)


def test_impulse_of_the_first_impact():
    trace = follow(MODEL, *turn(1.25))
    hit = (trace.time <= pulses(trace)[1][0] + 1.5 * MODEL.impact_duration) & (trace.time > 1.6)
    speed = 1.25 * abs(PAPER.slider_rate(MODEL.contact_angle))
    assert speed == pytest.approx(0.18874, abs=5e-6)
    assert np.trapezoid(trace.force[hit], trace.time[hit]) == pytest.approx(0.3 * 1.8 * speed, rel=1e-12)
    assert trace.force.max() == pytest.approx(27, abs=0.01)


def test_contact_force_is_the_published_quartic():
    u = 1 - (0.140 * np.cos(0) + (-PAPER_STOP) - 2 * 0.140) / 0.310
    assert MODEL.contact_force(np.pi) == pytest.approx(law.quartic(u) * EI / 0.310**2, rel=1e-12)
    trace = follow(MODEL, *turn(1.25))
    assert np.interp(np.pi, trace.angle, trace.force) == pytest.approx(MODEL.contact_force(np.pi), rel=1e-5)
    assert np.degrees(trace.angle[np.flatnonzero(trace.force)[-1]]) == pytest.approx(240, abs=1e-9)


def test_strip_energy_is_the_work_of_its_force():
    u, h = np.linspace(0.05, 0.6, 7), 1e-5
    slope = (MODEL.strip_energy(u + h) - MODEL.strip_energy(u - h)) / (2 * h)
    assert slope == pytest.approx(MODEL.strip_force(u) * 0.310, rel=1e-8)


def test_compression_is_newtons_law_of_the_slider():
    ramp, h = Ramp(1.0, 4.0, 2.0), 1e-4
    times = np.array([0.3, 0.8, 1.1])

    def place(t):
        return PAPER.slider(np.array([ramp.position(x) for x in t]))

    angle = np.array([ramp.position(t) for t in times])
    speed = np.array([ramp.speed(t) for t in times])
    acceleration = (place(times + h) - 2 * place(times) + place(times - h)) / h**2
    direction = np.sign(place(times + h) - place(times - h))
    lean = PAPER.lean_cosine(angle, place(times))
    expected = -(0.3 * acceleration + MODEL.friction * direction) / lean
    assert MODEL.compression(angle, speed, 1.5) == pytest.approx(expected, rel=1e-5)


def test_strip_buckles_on_the_way_above_a_crank_speed():
    assert follow(MODEL, *turn(5.80)).buckling_ratio.max() < 1 < follow(MODEL, *turn(5.90)).buckling_ratio.max()
    assert follow(replace(MODEL, friction=1.46), *turn(0.1)).buckling_ratio.max() > 1  # the Euler load is 1.456 N


def test_ledger_closes_until_the_slider_is_let_go():
    trace = follow(MODEL, *turn(1.25))
    energy = trace.energy
    assert np.abs(energy["error"][trace.angle < MODEL.contact_angle]).max() < 1e-15
    in_contact = trace.angle < np.radians(239.9)
    assert np.abs(energy["error"][in_contact]).max() < 1e-4  # the push was held constant in each flight
    jump = energy["error"][-1] - energy["error"][in_contact][-1]
    speed = 1.25 * abs(PAPER.slider_rate(2 * np.pi - MODEL.contact_angle))
    assert jump == pytest.approx(0.3 * speed**2 / 2, rel=1e-2)
    assert trace.energy_balance == pytest.approx(0.0253, abs=1e-3)


def test_friction_takes_its_force_over_the_path():
    trace = follow(replace(MODEL, restitution=1e-6), *turn(1.25))  # no rebounds: in and out, once
    path = 2 * (PAPER.slider(0.0) - PAPER_STOP)
    assert trace.energy["taken_friction"][-1] == pytest.approx(MODEL.friction * path, rel=1e-4)
