"""What a mechanism is made of: section formulas, prescribed motions, and wrong input named in one sentence."""

import math
import pickle
from dataclasses import FrozenInstanceError, replace

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

from buckler.elastica import law, pinned
from buckler.mbs import (
    STEEL,
    Beam,
    Cable,
    Clearance,
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
    Stop,
    Strut,
    slider_crank,
)
from buckler.mbs.kinematics.slidercrank import SliderCrank
from buckler.mbs.laws import ExactRestitution, NoFriction
from buckler.mbs.validate import non_negative, number, positive, whole

INF, NAN = math.inf, math.nan
BAR = Section(width=0.020, thickness=0.005)
STRIP = Section(width=0.030, thickness=0.0003)  # of the compliant slider-crank, doi 10.1115/IMECE2008-68796
LENGTH = 0.310
LAW = ExactRestitution(1e5, 0.8)


def steel(**changed):
    return replace(STEEL, **changed)


def play(**changed):
    return Clearance(**{"point": "A", "first": "crank", "second": "rod", "pin": 5e-3, "gap": 1e-4, "law": LAW, **changed})


# --- validate: one voice ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("value", [0.0, 1, 2.5, np.float64(1.5), np.float32(0.5), np.int64(2)])
def test_number_returns_a_plain_float(value):
    checked = number("x", value, 0.0, 2.5, "m")
    assert type(checked) is float and checked == value


@pytest.mark.parametrize("value", [-1e-300, 2.5000001, NAN, INF, -INF, None, "1", True, 1j, [1.0]])
def test_number_names_parameter_value_range_and_unit(value):
    with pytest.raises(ValueError) as caught:
        number("depth", value, 0.0, 2.5, "m/s")
    assert str(caught.value) == f"depth = {value!r} m/s: must lie in [0, 2.5] m/s"


def test_open_ends_are_shown_and_kept():
    with pytest.raises(ValueError, match=r"mass = 0.0 kg: must lie in \(0, inf\) kg"):
        positive("mass", 0.0, "kg")
    assert positive("mass", 1e-29, "kg") > 0
    with pytest.raises(ValueError, match="as good as zero"):
        positive("mass", 5e-324, "kg")
    assert non_negative("mass", 0.0, "kg") == 0
    with pytest.raises(ValueError, match=r"mass = -1 kg: must lie in \[0, inf\) kg"):
        non_negative("mass", -1, "kg")


def test_a_plain_number_has_no_unit():
    with pytest.raises(ValueError) as caught:
        number("ratio", 2, 0.0, 1.0, "1")
    assert str(caught.value) == "ratio = 2: must lie in [0, 1]"


def test_whole_takes_whole_numbers_only():
    assert whole("n", 3, 1, 3) == 3 and type(whole("n", np.int64(2), 1, 3)) is int
    for value in (0, 4, 2.5, True):
        with pytest.raises(ValueError) as caught:
            whole("n", value, 1, 3)
        assert str(caught.value) == f"n = {value!r}: must be a whole number in [1, 3]"


@pytest.mark.parametrize("value", [NAN, INF, None, "two", 1j])
def test_whole_names_what_is_no_number(value):
    with pytest.raises(ValueError) as caught:
        whole("n", value, 1, 3)
    assert str(caught.value) == f"n = {value!r}: must be a whole number in [1, 3]"


def test_a_whole_float_is_refused_or_becomes_an_integer():
    try:
        body = Beam(STRIP, elements=8.0)
    except ValueError as error:
        assert "elements = 8.0" in str(error)
    else:
        assert isinstance(body.elements, int)


# --- wrong input ------------------------------------------------------------------------------------------------------

WRONG = {  # what is made -> what the message must say: parameter = value, range, unit
    "modulus": (lambda: steel(modulus=0.0), "modulus = 0.0 Pa", "(0, inf) Pa"),
    "density": (lambda: steel(density=-1.0), "density = -1.0 kg/m^3", "(0, inf) kg/m^3"),
    "poisson high": (lambda: steel(poisson=0.51), "poisson = 0.51", "(-1, 0.5]"),
    "poisson low": (lambda: steel(poisson=-1.0), "poisson = -1.0", "(-1, 0.5]"),
    "bending damping": (lambda: steel(bending_damping=-1e-9), "bending_damping = -1e-09 s", "[0, inf) s"),
    "axial damping": (lambda: steel(axial_damping=NAN), "axial_damping = nan s", "[0, inf) s"),
    "width": (lambda: Section(width=0.0, thickness=1e-3), "width = 0.0 m", "[1e-09, 1e+06] m"),
    "thickness": (lambda: Section(width=0.1, thickness=NAN), "thickness = nan m", "[1e-09, 1e+06] m"),
    "ratio": (lambda: STRIP.damped(-0.1, LENGTH), "ratio = -0.1", "[0, inf)"),
    "elements low": (lambda: Beam(STRIP, elements=0), "elements = 0", "[1, 1000]"),
    "elements high": (lambda: Beam(STRIP, elements=1001), "elements = 1001", "[1, 1000]"),
    "elements broken": (lambda: Cable(STRIP, elements=2.5), "elements = 2.5", "[1, 1000]"),
    "nodes": (lambda: Beam(STRIP, nodes=4), "nodes = 4", "[2, 3]"),
    "imperfection": (lambda: Beam(STRIP, imperfection=1.1), "imperfection = 1.1 m", "[-1, 1] m"),
    "imperfection of a cable": (lambda: Cable(STRIP, imperfection=NAN), "imperfection = nan m", "[-1, 1] m"),
    "dynamic": (lambda: GuideFriction(-1.0), "dynamic = -1.0 N", "[0, inf) N"),
    "static below dynamic": (lambda: GuideFriction(2.0, static=1.0), "static = 1.0 N", "[2, inf) N"),
    "viscous": (lambda: GuideFriction(1.0, viscous=-1.0), "viscous = -1.0 N s/m", "[0, inf) N s/m"),
    "regularisation": (lambda: GuideFriction(1.0, regularisation=0.0), "regularisation = 0.0 m/s", "(0, inf) m/s"),
    "stribeck": (lambda: GuideFriction(1.0, stribeck=0.0), "stribeck = 0.0 m/s", "(0, inf) m/s"),
    "coefficient": (lambda: GuideFriction.of_weight(-0.1, 1.0), "coefficient = -0.1", "[0, inf)"),
    "along": (lambda: Guide("B", "bar", along=(0.0, 0.0)), "along (length) = 0.0", "(0, inf)"),
    "mass": (lambda: Guide("B", "bar", mass=-0.3), "mass = -0.3 kg", "[0, inf) kg"),
    "at": (lambda: Stop("B", at=INF, law=LAW), "at = inf m", "[-1e+06, 1e+06] m"),
    "pin": (lambda: play(pin=0.0), "pin = 0.0 m", "(0, inf) m"),
    "gap": (lambda: play(gap=-1e-5), "gap = -1e-05 m", "(0, inf) m"),
    "duration": (lambda: Ramp(0.0, 1.0, 0.0), "duration = 0.0 s", "(0, inf) s"),
    "position(0)": (lambda: Motion(math.cos, lambda t: -math.sin(t)), "position(0) = 1.0 rad or m", "[-1e-12, 1e-12]"),
}


@pytest.mark.parametrize("case", WRONG)
def test_wrong_value_is_named_with_its_range_and_unit(case):
    make, name_and_value, allowed = WRONG[case]
    with pytest.raises(ValueError) as caught:
        make()
    assert name_and_value in str(caught.value)
    assert f" in {allowed}" in str(caught.value)


POINTS = {"O": (0, 0), "A": (1, 0), "B": (2, 0)}
LINKS = (Link("crank", "O", "A", Rigid(BAR)), Link("rod", "A", "B", Strut(STRIP)))
JOINTS = (Revolute("O", "ground", "crank"), Revolute("A", "crank", "rod"))
GUIDES = (Guide("B", "rod", mass=1.0),)


def mechanism(**changed):
    parts = dict(points=POINTS, links=LINKS, joints=JOINTS, guides=GUIDES)
    return Mechanism(**{**parts, **changed})


INCONSISTENT = {  # what is changed in a consistent mechanism -> words of the message
    "no link": (dict(links=()), ["links", "at least one"]),
    "link twice": (dict(links=[*LINKS, LINKS[0]]), ["unique", "crank"]),
    "link named ground": (dict(links=[*LINKS, Link("ground", "O", "B", Rigid(BAR))]), ["'ground'"]),
    "link named like a point": (dict(links=[*LINKS, Link("B", "O", "B", Rigid(BAR))]), ["point's name", "B"]),
    "link to nowhere": (
        dict(links=[*LINKS, Link("x", "O", "Z", Rigid(BAR))]),
        ["link 'x'", "unknown point 'Z'", "A, B, O"],
    ),
    "carried point nowhere": (dict(links=[*LINKS, Link("x", "O", "A", Rigid(BAR), ["Z"])]), ["link 'x'", "'Z'"]),
    "no length": (dict(links=[*LINKS, Link("x", "O", "O", Rigid(BAR))]), ["length of link 'x' = 0.0 m", "(0, inf) m"]),
    "joint nowhere": (dict(joints=[Revolute("Z", "ground", "crank")]), ["joint at 'Z'", "unknown point"]),
    "joint with itself": (dict(joints=[Revolute("A", "crank", "crank")]), ["joint at 'A'", "itself"]),
    "joint of a stranger": (dict(joints=[Revolute("A", "crank", "arm")]), ["unknown link 'arm'", "crank, rod"]),
    "joint out of reach": (dict(joints=[Revolute("B", "ground", "crank")]), ["'crank' does not reach", "O, A"]),
    "guide nowhere": (dict(guides=[Guide("Z", "rod")]), ["guide of 'Z'", "unknown point"]),
    "guide of a stranger": (dict(guides=[Guide("B", "arm")]), ["guide of 'B'", "unknown link 'arm'"]),
    "guide out of reach": (dict(guides=[Guide("O", "rod")]), ["'rod' does not reach"]),
    "two guides": (dict(guides=[*GUIDES, Guide("B", "rod")]), ["at most one guide"]),
    "stop of a free point": (
        dict(stops=[Stop("A", at=0.5, law=LAW)]),
        ["stop at 'A'", "along: must be given", "as (1, 0)"],
    ),
    "drive of nothing": (dict(drives=[Drive("arm", 1.0)]), ["drive", "'arm'", "B, crank"]),
    "drive of a strut": (dict(drives=[Drive("rod", 1.0)]), ["drive", "rigid link", "'rod'"]),
    "drive of a free point": (dict(drives=[Drive("A", 1.0)]), ["drive", "guided point", "'A'"]),
}


@pytest.mark.parametrize("case", INCONSISTENT)
def test_inconsistent_mechanism_is_refused_in_words(case):
    mechanism()  # the unchanged one is fine
    changed, words = INCONSISTENT[case]
    with pytest.raises(ValueError) as caught:
        mechanism(**changed)
    assert not [word for word in words if word not in str(caught.value)], str(caught.value)


UNSEEN = {
    "speed": lambda: Drive("crank", NAN),
    "speed in words": lambda: Drive("crank", "fast"),
    "start": lambda: Ramp(NAN, 1.0, 1.0),
    "end": lambda: Ramp(0.0, INF, 1.0),
    "gravity": lambda: mechanism(gravity=(0.0, NAN)),
    "points": lambda: mechanism(points={**POINTS, "C": (INF, 0.0)}),
    "joint twice": lambda: mechanism(joints=[*JOINTS, Revolute("A", "rod", "crank")]),
}


@pytest.mark.parametrize("case", UNSEEN)
def test_this_too_is_checked_when_made(case):
    with pytest.raises(ValueError, match=case.split()[0]):
        UNSEEN[case]()


def test_a_motion_is_never_asked_for_times_before_the_start():
    motion = Motion(lambda t: math.sqrt(t) ** 5, lambda t: 2.5 * math.sqrt(t) ** 3)
    assert motion.acceleration(0.0) == pytest.approx(0.0, abs=0.1)


def test_only_a_rigid_link_carries_points():
    assert Link("bar", "A", "B", Rigid(BAR), carries=["C"]).points == ("A", "B", "C")
    for body in (Strut(STRIP), Beam(STRIP), Cable(STRIP)):
        with pytest.raises(ValueError, match=f"link 'bar'.*Rigid.*{type(body).__name__}"):
            Link("bar", "A", "B", body, carries=["C"])


def test_a_stop_needs_a_law():
    for nonsense in (None, 1e5, lambda depth: depth):
        with pytest.raises(ValueError, match=r"stop at 'B'.*law"):
            Stop("B", at=0.0, law=nonsense)


def test_a_joint_with_play_needs_play_a_law_and_friction():
    assert isinstance(play().friction, NoFriction)
    with pytest.raises(ValueError, match=r"'A': gap = 0.0 m: .* Revolute"):
        play(gap=0.0)
    with pytest.raises(ValueError, match=r"clearance at 'A': law = 3"):
        play(law=3)
    with pytest.raises(ValueError, match=r"clearance at 'A': friction = 0\.1: must be Coulomb"):
        play(friction=0.1)


def test_law_parameters_are_checked_where_the_law_is_made():
    with pytest.raises(ValueError, match=r"restitution = 1\.2: "):
        ExactRestitution(1e5, 1.2)


def test_wrong_lengths_of_the_slider_crank_are_named():
    with pytest.raises(ValueError, match="of link 'coupler'"):
        slider_crank(Rigid(BAR), law=None, mass=0.3, speed=1.0, lengths=SliderCrank(crank=0.1, coupler=0.0))


# --- frozen, normalised, portable -------------------------------------------------------------------------------------


def test_specs_are_frozen_and_compare_by_value():
    one, two = mechanism(), mechanism()
    assert one == two and one != mechanism(gravity=(0.0, -9.81))
    with pytest.raises(FrozenInstanceError):
        one.gravity = (0.0, 0.0)
    with pytest.raises(FrozenInstanceError):
        one.links[0].name = "x"


def test_a_mechanism_pickles():
    one = mechanism(stops=[Stop("B", at=2.1, law=LAW)], drives=[Drive("crank", Ramp(0.0, 1.0, 2.0))])
    assert pickle.loads(pickle.dumps(one)) == one


def test_the_callers_containers_are_copied():
    points, links = dict(POINTS), list(LINKS)
    one = mechanism(points=points, links=links)
    points["A"], links[:] = (9.0, 9.0), []
    assert one.points["A"] == (1.0, 0.0) and len(one.links) == 2


def test_guide_direction_becomes_a_unit_vector():
    guide = Guide("B", "rod", along=(3, -4))
    assert guide.along == pytest.approx((0.6, -0.8), abs=1e-15)
    assert mechanism().guide("B").along == (1.0, 0.0)


def test_lengths_and_names():
    one = mechanism(points={"O": (0, 0), "A": (3, 4), "B": (3, 16)})
    assert one.length("crank") == 5 and one.length("rod") == 12
    assert one.link("rod").end == "B"
    with pytest.raises(KeyError):
        one.link("arm")


def test_friction_of_a_weight():
    friction = GuideFriction.of_weight(0.2, 3.0, gravity=10.0, static=7.5, viscous=2.0)
    assert friction.dynamic == pytest.approx(6.0) and friction.static_offset == pytest.approx(1.5)
    assert friction.viscous == 2.0 and GuideFriction(1.0).static_offset == 0.0


# --- motions ----------------------------------------------------------------------------------------------------------

RAMPS = [Ramp(0.75, 6.58, 15.0), Ramp(2.0, -3.0, 0.5), Ramp(1.25, 1.25, 1.0), Ramp(0.0, 1.0, 1e-3)]


@pytest.mark.parametrize("ramp", RAMPS)
def test_ramp_position_is_the_integral_of_its_speed(ramp):
    for t in (0.0, 0.3 * ramp.duration, ramp.duration, 1.7 * ramp.duration):
        integral = quad(ramp.speed, 0.0, t, points=[ramp.duration] if t > ramp.duration else None, epsabs=1e-13)[0]
        assert ramp.position(t) == pytest.approx(integral, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("ramp", RAMPS)
def test_ramp_is_linear_and_then_stays(ramp):
    T = ramp.duration
    assert [ramp.speed(0.0), ramp.speed(T), ramp.speed(3 * T)] == pytest.approx([ramp.start, ramp.end, ramp.end])
    assert ramp.speed(T / 2) == pytest.approx((ramp.start + ramp.end) / 2)
    h = 1e-3 * T
    for t in (0.2 * T, 0.7 * T, 1.5 * T):
        assert ramp.acceleration(t) == pytest.approx((ramp.speed(t + h) - ramp.speed(t - h)) / (2 * h), abs=1e-9)


def test_constant_speed_drives_like_a_flat_ramp():
    motion = Drive("crank", -1.25).motion
    for t in (0.0, 0.4, 1.0, 7.0):
        assert motion.position(t) == pytest.approx(-1.25 * t, rel=1e-14) and motion.speed(t) == -1.25
        assert motion.acceleration(t) == 0.0


def test_own_motion_is_taken_with_its_derivative():
    motion = Motion(lambda t: 0.2 * math.sin(3 * t), lambda t: 0.6 * math.cos(3 * t))
    assert Drive("crank", motion).motion is motion
    for t in (0.1, 0.5, 2.0):
        assert motion.acceleration(t) == pytest.approx(-1.8 * math.sin(3 * t), rel=1e-6)


@pytest.mark.parametrize("factor", [-1.0, 0.99, 0.0, 2.0])
def test_wrong_derivative_of_a_motion_is_refused(factor):
    with pytest.raises(ValueError, match=r"drive: speed\(0.05\) = .* is not the derivative of position"):
        Motion(lambda t: math.sin(t), lambda t: factor * math.cos(t)).check_run(1.0, "drive")


@pytest.mark.parametrize("frequency", [50.0, 300.0, 2000.0])
def test_a_fast_oscillation_is_the_derivative_of_itself(frequency):
    """Its difference over 2e-4 s is 0.6 % off at 300 Hz."""
    w = 2 * math.pi * frequency
    Motion(lambda t: math.sin(w * t) / w, lambda t: math.cos(w * t)).check_run(1.0, "drive")
    with pytest.raises(ValueError, match="is not the derivative"):
        Motion(lambda t: math.sin(w * t) / w, lambda t: 1.01 * math.cos(w * t)).check_run(1.0, "drive")


# --- sections ---------------------------------------------------------------------------------------------------------


def test_strip_of_the_published_slider_crank():
    """E I, Euler load and mass computed by hand from 30 x 0.3 mm steel, 310 mm long."""
    assert STRIP.second_moment == pytest.approx(0.0675e-12, rel=1e-12, abs=0)
    assert STRIP.bending_stiffness == pytest.approx(0.014175, rel=1e-12)
    assert STRIP.euler_load(LENGTH) == pytest.approx(1.4558, abs=5e-5)
    assert STRIP.axial_stiffness / LENGTH == pytest.approx(6.097e6, rel=1e-4)
    assert STRIP.mass_per_length * LENGTH == pytest.approx(0.0219, abs=5e-5)
    assert STRIP.inertia_per_length == pytest.approx(7850 * 0.0675e-12, rel=1e-12, abs=0)
    assert STRIP.first_frequency(LENGTH) / (2 * math.pi) == pytest.approx(7.32, abs=5e-3)


def test_euler_load_is_where_the_elastica_begins():
    unit = STRIP.bending_stiffness / LENGTH**2
    assert STRIP.euler_load(LENGTH) == pytest.approx(unit * pinned.load(1e-12), rel=1e-11)
    assert Strut(STRIP).load is law.fast


def test_first_frequency_against_finite_differences():
    """E I w'''' = rho A omega^2 w, pinned: on n intervals, second order in 1/n."""

    def frequency(n):
        step = LENGTH / n
        bend = (np.diag(np.full(n - 2, 1.0), 1) + np.diag(np.full(n - 2, 1.0), -1) - 2 * np.eye(n - 1)) / step**2
        return math.sqrt(STRIP.bending_stiffness / STRIP.mass_per_length * np.linalg.eigvalsh(bend @ bend)[0])

    errors = [abs(frequency(n) / STRIP.first_frequency(LENGTH) - 1) for n in (10, 20, 40)]
    assert np.log2(np.divide(errors[:-1], errors[1:])) == pytest.approx(2, abs=0.02)
    assert errors[-1] < 1e-3


@pytest.mark.parametrize("ratio", [0.0, 0.02, 0.3])
def test_damped_section_has_that_damping_ratio_in_its_first_mode(ratio):
    """Modal equation q'' + tau omega^2 q' + omega^2 q = 0, integrated over one damped period."""
    section = STRIP.damped(ratio, LENGTH)
    omega, tau = section.first_frequency(LENGTH), section.material.bending_damping
    period = 2 * math.pi / (omega * math.sqrt(1 - ratio**2))
    run = solve_ivp(
        lambda _, y: (y[1], -tau * omega**2 * y[1] - omega**2 * y[0]), (0, period), (0.0, 1.0), rtol=1e-10, atol=1e-14
    )
    decrement = -math.log(run.y[1, -1])
    assert decrement / math.hypot(2 * math.pi, decrement) == pytest.approx(ratio, abs=1e-7)


def test_damping_changes_nothing_else():
    section = STRIP.damped(0.02, LENGTH)
    assert replace(section, material=STEEL) == STRIP
    assert section.material.axial_damping == 0.0


def test_shear_stiffness_by_cowper():
    """Factor 5/6 without lateral contraction, 0.8497 at nu = 0.3 (Cowper 1966, doi 10.1115/1.3625046)."""
    plain = replace(BAR, material=steel(poisson=0.0))
    assert plain.shear_stiffness == pytest.approx(5 / 6 * STEEL.modulus / 2 * BAR.area, rel=1e-14)
    shear_modulus = STEEL.modulus / 2.6
    assert BAR.shear_stiffness / (shear_modulus * BAR.area) == pytest.approx(0.8497, abs=5e-5)
