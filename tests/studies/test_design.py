"""The slider-crank designed backwards: against integrated impacts, static equilibrium, round trips and simulations."""

import re
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
from drawing import inked, value
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from buckler.elastica import pinned
from buckler.mbs import Section
from buckler.mbs.laws import CarvalhoMartins
from buckler.mbs.laws.peak import peak_factors
from buckler.mbs.library import PAPER
from buckler.studies.striking import design as study
from buckler.studies.striking.impact import read
from buckler.studies.striking.inverse import Given, Wish, binding, design, feasible, limits
from buckler.studies.striking.stitched import Stitched

WISH = Wish(2.0, 30.0, np.radians(120.0))


def test_contact_force_is_static_equilibrium_of_strip_and_stop():
    """From the other end: given the strip and the stop, find how far the stop gives way, with the elliptic integrals."""
    d = design(WISH)
    unit = Section(d.given.width, d.thickness).bending_stiffness / PAPER.coupler**2

    def unbalanced(depth):
        return unit * pinned.load(float(PAPER.shortening(np.pi, d.stop - depth))) - d.given.stiffness * depth

    depth = brentq(unbalanced, 0.0, 1e-3, xtol=1e-18)
    assert d.given.stiffness * depth == pytest.approx(2.0, rel=1e-9)
    assert d.shortening == pytest.approx(float(PAPER.shortening(np.pi, d.stop - depth)), rel=1e-9)


def test_the_published_mechanism_comes_back():
    """1.72465 N on a rigid stop is what the published 30 x 0.3 mm strip and 120 degrees give."""
    d = design(Wish(1.72465, 27.0, np.radians(120.0)), Given(stiffness=7.2e9, mass=3e-6, width=0.030))
    assert d.thickness == pytest.approx(3e-4, rel=2e-6)
    assert PAPER.contact_angle(d.stop) == pytest.approx(np.radians(120.0), rel=1e-12)
    assert d.impact_speed / d.speed == pytest.approx(0.18873831 / 1.25, rel=1e-7)
    speed = design(Wish(1.72465, 27.0, np.radians(120.0)), Given(friction=0.1 * 0.3 * 9.81)).speed
    assert speed == pytest.approx(1.25, rel=2e-3)  # 7.2e4 N/m was fitted to 27 N at 1.25 rad/s by simulations
    wide = design(WISH, Given(width=0.24))
    assert wide.thickness == pytest.approx(design(WISH).thickness / 2, rel=1e-12) and binding(wide).use <= 1


def late_push(d):
    """Largest force of the first impact by integration: a slider behind the axial spring of a strip that holds its Euler load."""
    given, lean = d.given, PAPER.lean_cosine(d.angle, d.stop)
    h = 1e-4
    speeding = -(PAPER.slider(d.angle + h) - 2 * PAPER.slider(d.angle) + PAPER.slider(d.angle - h)) / h**2 * d.speed**2
    rigidity, chi = (
        Section(d.given.width, d.thickness).axial_stiffness / PAPER.coupler,
        CarvalhoMartins.hysteresis(given.restitution),
    )
    before = (given.friction + d.given.mass * speeding) / lean  # what the strip carries as the slider arrives

    def motion(t, state):
        x, v = state
        behind = (d.impact_speed * t + speeding * t**2 / 2 - x) * lean
        push = min(max(rigidity * behind + before, 0.0), d.euler_load) * lean
        return v, (push - given.friction - max(d.given.stiffness * x * (1 + chi * v / d.impact_speed), 0.0)) / d.given.mass

    end = 2 * np.pi * np.sqrt(d.given.mass / d.given.stiffness)
    time = np.linspace(0, end, 4001)
    run = solve_ivp(motion, (0, end), (0, d.impact_speed), method="LSODA", rtol=1e-9, atol=1e-13, t_eval=time)
    x, v = run.y
    force = d.given.stiffness * x * (1 + chi * v / d.impact_speed)
    return force[np.argmax(np.diff(force) < 0)]


LATE = {
    "of the paper": (WISH, Given()),
    "pushed late": (Wish(2.88, 9.42, np.radians(113.6)), Given(width=5.4e-3, mass=0.268, stiffness=1.95e5, restitution=0.948)),
    "speeding up": (Wish(17.5, 121.3, np.radians(38.2)), Given(6.43e-3, 0.807, 5.38e5, 0.606, 0.0134)),
    "slowing down": (Wish(0.889, 5.64, np.radians(15.6)), Given(9.76e-3, 0.052, 1.011e5, 0.516, 1.25e-3)),
}


@pytest.mark.parametrize("name", LATE)
def test_impact_force_is_what_the_stop_gives_a_slider_pushed_late(name):
    wish, given = LATE[name]
    d = design(wish, given)
    peak = late_push(d)
    assert peak == pytest.approx(wish.impact_force, rel=1e-3 if name == "of the paper" else 7e-3)
    without_push = wish.impact_force - peak_factors(given.chi)[1] * d.push
    assert without_push < 0.98 * peak  # or the test could not tell


def random_cases(count, seed=0):
    """Random wishes and givens that keep all limits, as arrays of shape (count,)."""
    g = np.random.default_rng(seed)
    size = 80 * count

    def spread(low, high):
        return np.exp(g.uniform(np.log(low), np.log(high), size))

    wish = Wish(spread(0.1, 30), spread(3, 300), np.radians(spread(10, 340)))
    given = Given(
        width=spread(0.005, 0.05), mass=spread(0.01, 2), stiffness=spread(3e3, 1e6),
        restitution=g.uniform(0.2, 0.99, size), friction=spread(1e-3, 1),
    )  # fmt: skip
    kept = np.flatnonzero(feasible(design(wish, given)))[:count]
    assert len(kept) == count
    return picked(wish, kept), picked(given, kept)


def picked(spec, index):
    """A Wish or Given whose arrays are taken at an index; floats stay."""
    changes = {f.name: getattr(spec, f.name)[index] for f in fields(spec) if np.ndim(getattr(spec, f.name))}
    return replace(spec, **changes)


def test_compression_on_the_way_is_that_of_the_rigid_mechanism_and_stress_that_of_the_strip():
    d = design(WISH)
    found = {limit.name: limit for limit in limits(d)}
    rigid = Stitched(d.given.mass, 0.8, d.given.friction, 1.0, 1.0, stop=d.stop)
    largest = rigid.compression(np.linspace(1e-6, d.angle, 20001), d.speed).max()
    assert found["buckling"].value * d.euler_load == pytest.approx(largest, rel=1e-3)
    exact = pinned.surface_stress(d.shortening, d.thickness, PAPER.coupler, 210e9)
    assert found["yield"].value == pytest.approx(exact / 1e6, rel=1e-12)


BROKEN = {
    "yield": (WISH, Given(yield_strength=3e8)),
    "buckling": (replace(WISH, contact_force=0.3), Given()),
    "pull": (Wish(2.0, 30.0, np.radians(20)), Given(friction=0.01, fastest=30.0)),
    "push": (replace(WISH, contact_force=15.0), Given()),
    "speed": (WISH, Given(fastest=1.2)),
}


@pytest.mark.parametrize("name", BROKEN)
def test_each_limit_can_be_broken_and_says_so_in_one_line(name):
    d = design(*BROKEN[name])
    assert not feasible(d)
    assert binding(d).name == name and binding(d).use > 1
    text = str(binding(d))
    assert text.startswith(f"{name}: ") and text.endswith(" allowed") and "\n" not in text


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: Wish(0.0, 30.0, 2.0), "contact_force = 0.0: must be positive"),
        (lambda: Wish(2.0, float("nan"), 2.0), "impact_force = nan"),
        (lambda: Wish(np.array([1.0, -2.0]), 30.0, 2.0), "contact_force = "),
        (lambda: Given(mass=-1.0), "mass = -1.0"),
        (lambda: Given(friction=-0.1), "friction = -0.1"),
        (lambda: study.Parameters(contact_angle="400deg"), "contact_angle = 400deg"),
    ],
)
def test_wrong_input_is_named(make, text):
    with pytest.raises(ValueError, match=text):
        make()


@pytest.mark.parametrize("count", [5, pytest.param(100, marks=pytest.mark.slow)])
def test_random_wishes_come_true(count):
    """Of any strip, slider, stop and friction, by the strut: nine of ten that come to rest do as wished, but for friction."""
    wish, given = random_cases(count, 11)
    right = []
    for i in range(count):
        d = design(picked(wish, i), picked(given, i))
        found = read(study.simulate_design("strut", d, study.Parameters()))
        if np.isfinite(found.rest_angle):
            right.append(
                found.force_180 == pytest.approx(d.wish.contact_force, abs=5e-3 * d.wish.contact_force + d.given.friction)
                and found.impact_peak == pytest.approx(d.wish.impact_force, abs=2e-2 * d.wish.impact_force + d.given.friction)
                and found.release_angle - found.contact_angle == pytest.approx(d.wish.contact_angle, abs=np.radians(1))
            )
    assert len(right) >= 0.6 * count and np.mean(right) >= 0.9


@pytest.fixture(scope="module")
def result():
    return study.run(study.Parameters())


def test_strut_does_what_was_asked(result):
    assert result.status == "OK", result.message
    for name, wished, bar in (("contact_force", 2.0, 5e-3), ("impact_force", 30.0, 2e-2), ("contact_angle", 120.0, 5e-3)):
        assert result.metrics[name].exact == pytest.approx(wished) and result.metrics[name].error < bar
    d = study.Parameters().design()
    assert (value(result, "thickness"), value(result, "speed")) == (d.thickness, d.speed)
    (ax,) = inked(study, result).axes
    assert "[mm]" in ax.get_xlabel() and "[deg]" in ax.get_ylabel()


def test_a_straight_beam_strikes_harder_and_is_suspect():
    result = study.run(study.Parameters(model="beam"))
    assert result.status == "SUSPECT" and "beam: impact_force off by" in result.message
    assert value(result, "contact_force") == pytest.approx(2.0, rel=5e-3) and value(result, "impact_force") > 4 * 30.0


def test_what_cannot_be_had_names_its_limit_and_a_run_that_fails_its_status():
    result = study.run(study.Parameters(contact_force="0.1N"))
    assert result.status == "INFEASIBLE" and result.message.startswith("buckling: compression on the way over the Euler load")
    assert result.metrics["limit.buckling"].value > 1 and inked(study, result).axes
    result = study.run(study.Parameters(timeout=0.01, tolerance=1e-9))
    assert result.status == "TIMED_OUT" and result.message.startswith("strut: ")


def test_table_of_the_how_to_names_every_limit():
    page = (Path(__file__).parents[2] / "docs" / "how-to-fit-and-design.md").read_text(encoding="utf-8")
    table = page[page.index("| limit |") :].partition("```")[0]
    assert [row.split("|")[1].strip() for row in table.splitlines()[2:] if row] == [each.name for each in limits(design(WISH))]
    promised = re.search(r"`INFEASIBLE: (.*?)`", page)[1]
    assert study.run(study.Parameters(contact_force=0.1)).message == promised
