"""What a design must keep to: each limit against its own closed form, and the nearest wish against a search at random."""

from dataclasses import fields, replace

import numpy as np
import pytest

from buckler.elastica import pinned
from buckler.mbs.library import PAPER
from buckler.studies.striking.inverse import Given, Wish, design
from buckler.studies.striking.inverse_limits import NothingNearError, binding, broken, feasible, limits, nearest
from buckler.studies.striking.stitched import Stitched

WISH = Wish(2.0, 30.0, np.radians(120.0))


def named(d, name):
    return next(limit for limit in limits(d) if limit.name == name)


def test_compression_on_the_way_is_that_of_the_rigid_mechanism_and_stress_that_of_the_strip():
    d = design(WISH)
    rigid = Stitched(d.mass, 0.8, d.given.friction, 1.0, 1.0, stop=d.stop)
    angle = np.linspace(1e-6, d.angle, 20001)
    largest = rigid.compression(angle, d.speed).max()
    assert named(d, "buckling").value * d.euler_load == pytest.approx(largest, rel=1e-3)
    exact = pinned.surface_stress(d.shortening, d.thickness, PAPER.coupler, 210e9)
    assert named(d, "yield").value == pytest.approx(exact / 1e6, rel=1e-12)
    assert named(d, "yield").use == pytest.approx(exact / 1e9, rel=1e-12)


def test_friction_loss_by_finite_differences():
    """(w tau)^2 |F''|/F with F'' of the exact force at the dead centre."""
    d = design(replace(WISH, contact_angle=np.radians(250)))
    stop = d.stop - 2.0 / d.stiffness

    def force(angle):
        return pinned.load(float(PAPER.shortening(angle, stop))) * PAPER.lean_cosine(angle, stop)

    h = 1e-3
    bend = (force(np.pi + h) - 2 * force(np.pi) + force(np.pi - h)) / h**2 / force(np.pi)
    delay = d.given.friction / (1e-3 * d.stiffness)
    assert bend < 0
    assert named(d, "creep").value == pytest.approx((d.speed * delay) ** 2 * -bend, rel=1e-3)


def test_friction_holds_the_slider_on_the_stop_though_it_takes_from_the_push():
    smooth, rough = (design(WISH, Given(friction=f)) for f in (0.01, 0.5))
    assert rough.push < smooth.push and named(rough, "rebound").value > 1.3 * named(smooth, "rebound").value


BROKEN = {
    "dead centre": (replace(WISH, contact_angle=np.radians(8)), Given()),
    "shortening": (replace(WISH, contact_angle=np.radians(280)), Given(crank=0.2, coupler=0.25)),
    "stop": (replace(WISH, impact_force=500.0), Given(fastest=1000)),
    "slenderness": (replace(WISH, contact_force=0.5), Given(modulus=1e5, width=0.001, yield_strength=1e10)),
    "yield": (WISH, Given(yield_strength=3e8)),
    "buckling": (replace(WISH, contact_force=0.3), Given()),
    "rebound": (replace(WISH, contact_force=15.0), Given()),
    "rest": (WISH, Given(restitution=0.95, friction=0.02)),
    "creep": (replace(WISH, contact_angle=np.radians(290)), Given()),
    "speed": (WISH, Given(fastest=1.2)),
    "mass": (WISH, Given(mass=None, speed=1.2, heaviest=0.3)),
}


@pytest.mark.parametrize("name", BROKEN)
def test_each_limit_can_be_broken_and_says_so_in_one_line(name):
    d = design(*BROKEN[name])
    assert not feasible(d)
    assert binding(d).name == name == broken(d)[0].name
    assert binding(d).use > 1
    text = str(binding(d))
    assert text.startswith(f"{name}: ") and text.endswith(" allowed") and "\n" not in text


def test_mass_and_speed_may_be_exchanged_but_a_livelier_stop_is_no_help():
    """An impact force on a given stop fixes m v^2, and without friction all else goes by it."""
    heavy, light = (design(WISH, Given(mass=mass, friction=0.0)) for mass in (3.0, 0.03))
    assert light.mass * light.speed**2 == pytest.approx(heavy.mass * heavy.speed**2, rel=5e-3)
    for name in ("buckling", "rest", "rebound"):
        assert named(light, name).use == pytest.approx(named(heavy, name).use, rel=0.03)
    lively = design(WISH, Given(restitution=0.9, mass=3.0, friction=0.0))
    assert named(lively, "rest").value > 1.5 * named(heavy, "rest").value


# --- the nearest wish -------------------------------------------------------------------------------------------------


SEARCHED = ("dead centre", "rebound", "creep", "mass")
"""Limits of which the nearest wish is searched for in slow tests only."""


def distance(a, b):
    return float(np.linalg.norm(np.log([getattr(a, f.name) / getattr(b, f.name) for f in fields(Wish)])))


@pytest.mark.parametrize(
    "name", ["yield", "buckling", "rest", "speed", *(pytest.param(name, marks=pytest.mark.slow) for name in SEARCHED)]
)
def test_nearest_wish_can_be_had_and_nothing_nearer(name):
    """Against 50 000 random wishes that are nearer."""
    wish, given = BROKEN[name]
    found = nearest(wish, given)
    assert feasible(design(found, given))
    assert feasible(design(Wish(*(float(f"{getattr(found, f.name):.5g}") for f in fields(Wish))), given))
    assert binding(design(found, given)).use > 0.99
    reach = distance(found, wish)
    g = np.random.default_rng(4)
    ball = g.normal(size=(50_000, 3))
    ball *= (0.995 * reach - 2e-3) * (g.uniform(size=(len(ball), 1)) ** 0.2) / np.linalg.norm(ball, axis=1, keepdims=True)
    force, impact, angle = np.exp(ball.T + np.log([[wish.contact_force], [wish.impact_force], [wish.contact_angle]]))
    angle = np.minimum(angle, 6.283)
    assert not feasible(design(Wish(force, impact, angle), given)).any()


def test_nearest_when_only_the_speed_binds_is_known():
    """Speed depends on force and angle smoothly: at the nearest wish its gradient in logarithms points back at what was asked."""
    wish, given = BROKEN["speed"]
    found = nearest(wish, given)

    def speed(x):
        return np.log(design(Wish(*np.exp(x)), given).speed)

    x = np.log([found.contact_force, found.impact_force, found.contact_angle])
    back = np.log([wish.contact_force, wish.impact_force, wish.contact_angle]) - x
    h = 1e-5 * np.eye(3)
    gradient = np.array([(speed(x + step) - speed(x - step)) / 2e-5 for step in h])
    cosine = gradient @ back / np.linalg.norm(gradient) / np.linalg.norm(back)
    assert cosine == pytest.approx(1.0, abs=1e-5)
    assert np.exp(speed(x)) == pytest.approx(1.2, rel=2e-3)


def test_a_wish_that_can_be_had_is_its_own_nearest_and_nothing_at_all_can_be_had():
    assert nearest(WISH) is WISH
    with pytest.raises(NothingNearError, match=r"no wish within .*: .* allowed"):
        nearest(WISH, Given(slowest=500.0, fastest=1000.0))
