"""The strip in motion: against beam theory, rigid kinematics, the static closed form and the engine."""

from math import inf, pi

import numpy as np
import pytest

from buckler.elastica import pinned
from buckler.elastica.moving import MotionError, MovingStrip, turning_crank
from buckler.mbs import Beam, Controlled, Drive, Exudyn, Guide, Link, Mechanism, Revolute, Rigid, Section, simulate
from buckler.mbs.kinematics.slidercrank import SliderCrank

L, R, MASS, WALL = 0.31, 0.14, 0.3, -0.355307
STRIP = Section(width=0.03, thickness=2e-3)


def strip(section=STRIP, pin=None, **more):
    given = {"end_mass": MASS, "terms": 6} | more
    return MovingStrip(pin or turning_crank(R, 62.8), L, section.bending_stiffness, section.mass_per_length, **given)


@pytest.mark.parametrize("side", [-1, 1])
@pytest.mark.parametrize("stretch", [{}, {"axial_stiffness": 1e4, "strain_terms": 2}])
def test_shaken_pin_bends_it_as_beam_theory_says(side, stretch):
    amplitude, rate = 1e-6, 200.0
    moving = strip(pin=lambda t: ((0, amplitude * np.sin(rate * t)), (0, amplitude * rate * np.cos(rate * t)),
                                  (0, -amplitude * rate**2 * np.sin(rate * t))), side=side, **stretch)  # fmt: skip
    t = np.linspace(0, 0.05, 51)
    k = np.arange(1, 7)[:, None]
    own = (k * pi / L) ** 2 * np.sqrt(STRIP.bending_stiffness / STRIP.mass_per_length)
    bent = 2 / (k * pi) * rate**2 * (np.sin(rate * t) - rate / own * np.sin(own * t)) / (own**2 - rate**2)
    expected = side * amplitude * np.sin(k[:, 0] * pi / 2) @ bent
    found = moving.move(t, rtol=1e-9, atol=1e-14).deflection
    np.testing.assert_allclose(found, expected, atol=2e-3 * abs(expected).max())


def test_stiff_strip_is_the_rigid_slider_crank():
    stiff = Section(width=0.03, thickness=0.02)
    t = np.linspace(0, 0.05, 26)
    found = strip(stiff, terms=2).move(t)
    exact = SliderCrank(crank=R, coupler=L).slider(62.8 * t)
    assert abs(found.x - exact).max() < 1e-5 and abs(found.deflection).max() > 1e-6


def test_slow_pressing_gives_the_force_of_the_elastica():
    thin = Section(width=0.03, thickness=0.3e-3)
    own = (pi / L) ** 2 * np.sqrt(thin.bending_stiffness / thin.mass_per_length)
    start, speed = np.radians(119), 0.6
    moving = strip(thin, turning_crank(R, speed, start), bending_damping=2 * 0.05 / own, bow=L / 1000, terms=3)
    t = np.array([(pi - start) / speed, (np.radians(181) - start) / speed])
    found = moving.move(t, wall=WALL, push=lambda depth, rate, _: max(0.0, 1e5 * depth + 350 * rate), rtol=1e-6, atol=1e-8)
    exact = pinned.load(1 - (-R - WALL) / L) * thin.bending_stiffness / L**2
    assert found.force[0] == pytest.approx(exact, rel=3e-3)
    assert len(found.contacts) >= 1 and np.degrees(start + speed * found.contacts[0, 0]) == pytest.approx(120, abs=0.05)
    assert found.contacts[-1, 2] == inf


def test_terms_converge_at_a_high_rate():
    t = np.linspace(0, 0.03, 31)
    finest = strip(terms=8, side=1).move(t).deflection
    errors = [abs(strip(terms=n, side=1).move(t).deflection - finest).max() / abs(finest).max() for n in (2, 4, 6)]
    assert errors[1] < 0.1 * errors[0] and errors[2] < 0.33 * errors[1] < 1e-4  # n^-3 at least


def test_the_engine_bends_its_coupler_alike():
    t = np.linspace(0, 0.05, 51)
    found = strip(axial_stiffness=STRIP.axial_stiffness, strain_terms=1, side=1, terms=5).move(t, rtol=1e-7, atol=1e-8)
    mechanism = Mechanism(
        points={"O": (0, 0), "A": (R, 0), "B": (R + L, 0)},
        links=[Link("crank", "O", "A", Rigid(STRIP)), Link("coupler", "A", "B", Beam(STRIP, elements=6))],
        joints=[Revolute("O", "ground", "crank"), Revolute("A", "crank", "coupler")],
        guides=[Guide("B", "coupler", along=(1, 0), mass=MASS)],
        drives=[Drive("crank", speed=62.8)],
    )
    result = simulate(mechanism, 0.05, solver=Exudyn(Controlled(tolerance=1e-8), spectral_radius=0.9), shapes=t[1:])
    points = result.shapes["coupler"].points
    middle, chord = points[:, points.shape[1] // 2] - points[:, 0], points[:, -1] - points[:, 0]
    deflection = (chord[:, 0] * middle[:, 1] - chord[:, 1] * middle[:, 0]) / np.hypot(*chord.T)
    np.testing.assert_allclose(deflection, found.deflection[1:], atol=2e-3 * abs(found.deflection).max())


def test_elastic_stop_gives_the_speed_back_and_chatter_ends_by_name(monkeypatch):
    monkeypatch.setattr("buckler.elastica.moving.MOST_RESTARTS", 1)
    moving = strip(Section(width=0.03, thickness=0.3e-3), turning_crank(R, 1.25, np.radians(119)), bow=1e-4)
    with pytest.raises(MotionError, match="contact chatters"):
        moving.move(np.array([1.0]), wall=WALL, push=lambda depth, rate, onset: 1e5 * depth, rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"end_mass": -1.0}, "end_mass = -1.0: must be finite and not negative"),
        ({"creep": 0.0}, "creep = 0.0: must be positive"),
        ({"bow": 0.1}, "bow = 0.1 m: must be below a tenth"),
        ({"side": 2}, "side = 2, terms = 6"),
        ({"strain_terms": 1}, "must be 1 to 64 with a finite one"),
        ({"axial_stiffness": 1e6}, "must be 1 to 64 with a finite one"),
    ],
)
def test_wrong_input_is_named(wrong, message):
    with pytest.raises(ValueError, match=message):
        strip(**wrong)
