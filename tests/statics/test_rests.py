"""Equilibria of mechanisms drawn far from rest, and what has none, against closed forms."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk

from buckler.mbs import (
    Beam,
    Clearance,
    Force,
    Guide,
    GuideFriction,
    Link,
    Mechanism,
    Revolute,
    Rigid,
    Rope,
    Section,
    Slider,
    Spring,
    Stop,
    Torque,
    TorsionSpring,
    Weld,
    equilibrium,
    frequencies,
)
from buckler.mbs.laws import Coulomb, KelvinVoigt

BAR, LENGTH, GRAVITY = Section(0.03, 0.005), 0.3, 9.81
TURNS = np.linspace(-np.pi, np.pi, 17) + 0.05


def pendulum(*turns, loads=(), gravity=GRAVITY):
    """Rigid bars in a row, each drawn at an angle, rad."""
    names, points = "OABC", {"O": (0.0, 0.0)}
    for k, turn in enumerate(turns):
        x, y = points[names[k]]
        points[names[k + 1]] = (x + LENGTH * np.cos(turn), y + LENGTH * np.sin(turn))
    links = [Link(f"bar{k}", names[k], names[k + 1], Rigid(BAR)) for k in range(len(turns))]
    joints = [Revolute(names[k], f"bar{k - 1}" if k else "ground", f"bar{k}") for k in range(len(turns))]
    return Mechanism(points, links, joints, loads=loads, gravity=(0.0, -gravity))


@pytest.mark.parametrize("turn", TURNS)
def test_a_pendulum_drawn_anywhere_hangs(turn):
    rest = equilibrium(pendulum(turn))
    assert rest.status == "OK"
    assert rest.stable
    assert rest.point("bar0", "A").position == pytest.approx([0.0, -LENGTH], abs=1e-10)
    assert rest.error < 1e-10


@pytest.mark.parametrize("turn", TURNS)
def test_a_double_pendulum_drawn_anywhere_hangs(turn):
    rest = equilibrium(pendulum(turn, 1.3 - turn))
    assert rest.stable
    assert rest.point("bar1", "B").position == pytest.approx([0.0, -2 * LENGTH], abs=1e-10)


def test_a_pendulum_drawn_upright_stands_unstable():
    rest = equilibrium(pendulum(np.pi / 2))
    grows = np.sqrt(1.5 * GRAVITY / LENGTH / (1 + (BAR.thickness / LENGTH) ** 2 / 4))
    assert rest.status == "OK"
    assert not rest.stable
    assert rest.growth == pytest.approx(grows, rel=1e-9)
    assert "unstable" in rest.message


def test_all_equilibria_of_a_double_pendulum_are_four():
    rest = equilibrium(pendulum(0.3, 0.2), all=True)
    heights = sorted((round(each.point("bar0", "A").position[1], 6), round(each.point("bar1", "B").position[1], 6)) for each in
                     (rest, *rest.others))  # fmt: skip
    assert heights == [(-0.3, -0.6), (-0.3, 0.0), (0.3, 0.0), (0.3, 0.6)]
    assert [each.stable for each in rest.others] == [False] * 3


@pytest.mark.parametrize("stiffness", [1e4, 4.6e5, 1e7])
def test_a_bar_falls_upon_a_stop_however_stiff_and_rests_there(stiffness):
    """Its moment about O: the stop at 0.6 L carries the weight at L/2 and the load at the tip."""
    length, load, section = 0.264, 3.875, Section(0.0228, 0.00755)
    bar = Link("bar", "O", "A", Rigid(section), carries=("M",))
    stop = Stop("M", at=-2.25e-3, law=KelvinVoigt(stiffness, 1.0), along=(0.0, 1.0))
    rest = equilibrium(Mechanism(
        {"O": (0, 0), "A": (length, 0), "M": (0.6 * length, 0)}, [bar], [Revolute("O", "ground", "bar")], stops=[stop],
        loads=[Force("A", (0.0, -load))], gravity=(0.0, -GRAVITY),
    ))  # fmt: skip
    depth = (section.mass_per_length * length * GRAVITY / 2 + load) / 0.6 / stiffness
    assert rest.stable
    assert rest.point("bar", "M").position[1] == pytest.approx(-2.25e-3 - depth, rel=1e-9)


@pytest.mark.parametrize("turn", [1.2, 2.5, -1.0])
def test_a_pendulum_slides_along_its_bush_however_long_and_hangs(turn):
    """A stiff contact that bends takes short steps: it is no endless motion."""
    bush = Clearance("O", "ground", "bar", pin=5e-3, gap=1e-4, law=KelvinVoigt(1e7, 10.0))
    tip = (LENGTH * np.cos(turn), LENGTH * np.sin(turn))
    made = Mechanism({"O": (0, 0), "A": tip}, [Link("bar", "O", "A", Rigid(BAR))], [bush], gravity=(0.0, -GRAVITY))
    rest, sunk = equilibrium(made), 1e-4 + BAR.mass_per_length * LENGTH * GRAVITY / 1e7
    assert rest.status == "OK"
    assert rest.stable
    assert rest.point("bar", "A").position == pytest.approx([0.0, -LENGTH - sunk], abs=1e-9)


def block(height, stop=True):
    return Mechanism(
        points={"P": (0, height), "Q": (0, height + 0.1)},
        links=[Link("block", "P", "Q", Rigid.of(mass=1.0, inertia=1e-3))],
        joints=[Slider("P", "block", "ground", along=(0, 1))],
        stops=[Stop("P", at=0.0, law=KelvinVoigt(1e5, 0.0), along=(0, 1))] if stop else [],
        gravity=(0, -GRAVITY),
    )


def test_a_block_drawn_above_a_floor_rests_on_it():
    assert equilibrium(block(0.05)).point("block", "P").position[1] == pytest.approx(-GRAVITY / 1e5, rel=1e-10)


@pytest.mark.parametrize(
    ("mechanism", "name"),
    [
        (pendulum(0.4, loads=[Torque("bar0", 1.0)], gravity=0.0), "bar0"),
        (block(0.05, stop=False), "block"),
        (Mechanism({"A": (0, 0), "B": (0.3, 0)}, [Link("thrown", "A", "B", Beam(BAR))], gravity=(0, -GRAVITY)), "thrown"),
        (
            Mechanism({"A": (0, 0), "B": (0.3, 0)}, [Link("pushed", "A", "B", Rigid(BAR))], loads=[Force("A", (1.0, 0.0))]),
            "pushed",
        ),
    ],
    ids=["crank under a torque", "falls past no floor", "thrown strip", "pushed free bar"],
)
def test_what_has_no_equilibrium_is_named(mechanism, name):
    rest = equilibrium(mechanism)
    assert rest.status == "FREE_MOTION"
    assert f"'{name}'" in rest.message
    assert np.isnan(rest.point(name, mechanism.link(name).start).position).all()
    assert not rest.stable


def test_a_free_strip_without_loads_rests_where_it_is_and_says_that_nothing_holds_it():
    rest = equilibrium(Mechanism({"A": (0, 0), "B": (0.3, 0)}, [Link("strip", "A", "B", Beam(BAR))]))
    assert rest.status == "OK"
    assert rest.stable
    assert rest.neutral == ("strip",) * 3


def test_a_load_beyond_a_limit_point_leads_past_it():
    """Two springs at a mass, von Mises' truss: 2 k (l0/l - 1) y = F; beyond its snap it rests on the other side."""
    stiffness, height, free = 1e4, 0.3, np.hypot(1.0, 0.3)
    top = np.sqrt(free ** (2 / 3) - 1.0)
    snap = 2 * stiffness * (free - np.hypot(1, top)) * top / np.hypot(1, top)
    truss = Mechanism(
        points={"P": (0, height), "Q": (0, height + 0.1), "A": (-1, 0), "C": (1, 0)},
        links=[Link("block", "P", "Q", Rigid.of(mass=1.0, inertia=1e-3))],
        joints=[Slider("P", "block", "ground", along=(0, 1))],
        loads=[Spring("P", f"ground:{end}", stiffness=stiffness, free_length=free) for end in "AC"]
        + [Force("P", (0, -1.1 * snap))],
    )
    rest = equilibrium(truss)
    y = rest.point("block", "P").position[1]
    assert rest.stable
    assert y < -height
    assert 2 * stiffness * (free / np.hypot(1, y) - 1) * y == pytest.approx(1.1 * snap, rel=1e-9)
    assert "of the load" in rest.message


def small_blocks(heights, *loads):
    """Blocks of 0.06 m on one vertical slide, each between two springs to points 1 m aside, in whose line they snap."""
    points, links, joints, springs = {}, [], [], []
    for k, height in enumerate(heights):
        points |= {f"P{k}": (0, height), f"Q{k}": (0.06, height), f"A{k}": (-1, height - 0.3), f"B{k}": (1, height - 0.3)}
        links.append(Link(f"block{k}", f"P{k}", f"Q{k}", Rigid.of(mass=1.0, inertia=1e-3)))
        joints.append(Slider(f"P{k}", f"block{k}", "ground", along=(0, 1)))
        springs += [Spring(f"P{k}", f"ground:{end}{k}", stiffness=1e4, free_length=np.hypot(1, 0.3)) for end in "AB"]
    return Mechanism(points, links, joints, loads=[*springs, *loads])


def test_a_rest_that_is_two_hundred_links_away_is_no_free_motion():
    """2 k (1 - l0/l) y = F where it has snapped through."""
    load, free = 2.5e5, np.hypot(1.0, 0.3)
    rest = equilibrium(small_blocks([0.3], Force("P0", (0.0, -load))))
    exact = brentq(lambda y: 2e4 * (1 - free / np.hypot(1, y)) * y + load, -50, -2)
    assert exact < -12
    assert (rest.status, rest.stable) == ("OK", True)
    assert rest.point("block0", "P0").position[1] == pytest.approx(exact, rel=1e-9)


def test_all_four_stable_rests_of_two_trusses_that_a_weak_spring_couples_are_found():
    """Each is up or down; a spring of a thousandth of their stiffness moves them by as little."""
    weak = Spring("block0:P0", "block1:P1", stiffness=1.0, free_length=1.0)
    rest = equilibrium(small_blocks([0.3, 1.3], weak), all=True)
    found = [(each.point("block0", "P0").position[1], each.point("block1", "P1").position[1] - 1.0) for each in
             (rest, *rest.others) if each.stable]  # fmt: skip
    assert len(found) == 4
    for lower, upper in ((a, b) for a in (-0.3, 0.3) for b in (-0.3, 0.3)):
        assert sum(abs(one - lower) + abs(two - upper) < 0.01 for one, two in found) == 1


def test_the_error_of_a_bent_strip_bounds_its_difference_to_a_fine_one():
    section = Section(0.03, 0.0005)
    load = 10 * section.bending_stiffness / 0.25
    made = Mechanism(
        {"A": (0, 0), "B": (0.5, 0)}, [Link("strip", "A", "B", Beam(section))], [Weld("A", "ground", "strip")],
        loads=[Force("B", (0.0, -load))],
    )  # fmt: skip
    fine = equilibrium(made, degree=30).point("strip", "B").position
    for degree in (4, 6, 8, None):
        rest = equilibrium(made, degree=degree)
        true = np.abs(rest.point("strip", "B").position - fine).max() / 0.5
        assert true <= rest.error + 1e-10
        assert rest.error < (1e-8 if degree is None else 1.0)


@pytest.mark.parametrize("times", [5.0, 28.0, 30.0])
def test_a_force_across_a_strip_that_turns_with_it_rolls_it_up(times):
    """Against Reissner's strip integrated from its tip, in whose frame the force is known."""
    section, length = Section(0.02, 0.0005), 0.5
    force = times * section.bending_stiffness / length**2
    axial, shear, bend = section.axial_stiffness, section.shear_stiffness, section.bending_stiffness

    def back(s, y):
        along, across = 1 + force * np.sin(y[2]) / axial, force * np.cos(y[2]) / shear
        x = along * np.cos(y[2]) - across * np.sin(y[2])
        return [-x, -(along * np.sin(y[2]) + across * np.cos(y[2])), -y[3] / bend, x * force]

    x, y, turn, _ = solve_ivp(back, (0, length), np.zeros(4), rtol=1e-11, atol=1e-13).y[:, -1]
    c, s = np.cos(turn), np.sin(turn)
    rest = equilibrium(Mechanism(
        {"A": (0, 0), "B": (length, 0)}, [Link("strip", "A", "B", Beam(section))], [Weld("A", "ground", "strip")],
        loads=[Force("B", (0.0, force), follows="strip")],
    ))  # fmt: skip
    assert rest.point("strip", "B").position == pytest.approx([-c * x - s * y, s * x - c * y], abs=1e-8)
    assert rest.status == "OK"
    assert rest.error < 1e-7
    assert rest.stable
    assert rest.neutral == ()


def test_the_other_equilibria_of_a_column_have_errors_as_small_as_the_first():
    """Buckled to both sides: Euler's elastica, P = 4 K^2 EI/L^2, its ends (2 E/K - 1) L apart; or turned over and pulled."""
    section, length = Section(0.02, 0.0002), 0.5
    load = 2 * section.euler_load(length)
    rest = equilibrium(Mechanism(
        {"A": (0, 0), "B": (length, 0)}, [Link("strip", "A", "B", Beam(section))], [Revolute("A", "ground", "strip")],
        [Guide("B", "strip")], loads=[Force("B", (-load, 0.0))],
    ), all=True)  # fmt: skip
    m = brentq(lambda m: 4 * ellipk(m) ** 2 - 2 * np.pi**2, 0.1, 0.9)
    buckled = [each for each in rest.others if each.stable and each.point("strip", "B").position[0] > -0.9 * length]
    assert not rest.stable
    assert len(buckled) == 2
    for each in buckled:
        assert each.point("strip", "B").position[0] == pytest.approx((2 * ellipe(m) / ellipk(m) - 1) * length, abs=1e-6)
        assert each.error < 1e-7


def test_a_column_at_five_euler_loads_bows_to_both_sides_in_one_and_two_waves():
    """4 n^2 K^2 EI/L^2 = P: an elastica of n = 1, 2 half waves, and its image in the line of the ends, each beside the other."""
    section, length = Section(0.02, 0.0002), 0.5
    load = 5 * section.euler_load(length)
    rest = equilibrium(Mechanism(
        {"A": (0, 0), "B": (length, 0)}, [Link("strip", "A", "B", Beam(section))], [Revolute("A", "ground", "strip")],
        [Guide("B", "strip")], loads=[Force("B", (-load, 0.0))],
    ), all=True)  # fmt: skip
    for waves in (1, 2):
        m = brentq(lambda m, n=waves: (2 * n * ellipk(m)) ** 2 - 5 * np.pi**2, 1e-6, 0.999)
        end = (2 * ellipe(m) / ellipk(m) - 1) * length
        found = [each.point("strip", "B") for each in rest.others if abs(each.point("strip", "B").position[0] - end) < 1e-5]
        assert len(found) == 2
        assert sum(each.angle for each in found) == pytest.approx(0.0, abs=1e-6)
        assert np.abs(found[0].angle) == pytest.approx(2 * np.arcsin(np.sqrt(m)), abs=1e-5)


def test_a_torque_where_its_strip_is_clamped_is_told_to_move_nothing():
    def torque(at):
        strip = Link("strip", "A", "B", Beam(BAR))
        return Mechanism({"A": (0, 0), "B": (LENGTH, 0)}, [strip], [Weld("A", "ground", "strip")], loads=[Torque(at, 0.1)])

    assert "'torque.strip' moves nothing" in equilibrium(torque("strip")).message
    bent = equilibrium(torque("strip:B"))
    assert bent.message == ""
    assert bent.point("strip", "B").angle == pytest.approx(0.1 * LENGTH / BAR.bending_stiffness, rel=1e-9)


def hung(*loads):
    """Two blocks on vertical slides, 2 kg and 1.2 kg, on a rope over two pulleys."""
    return Mechanism(
        {"B": (0.3, -0.5), "C": (0.6, -0.2), "D": (0.6, 0), "E": (0.3, 0), "B2": (0, 0), "C2": (1, 0), "S": (0.3, -0.9)},
        [Link("one", "B", "B2", Rigid.of(mass=2.0, inertia=1e-3)), Link("two", "C", "C2", Rigid.of(mass=1.2, inertia=1e-3))],
        [Slider("B", "one", "ground", along=(0, 1)), Slider("C", "two", "ground", along=(0, 1))],
        couplings=[Rope("one:B", "two:C", over=("ground:E", "ground:D"))], loads=loads, gravity=(0.0, -GRAVITY),
    )  # fmt: skip


def test_a_rope_pulls_and_ends_at_its_pulleys():
    below = Spring("B", "ground:S", stiffness=1000.0, free_length=0.4)
    drawn = equilibrium(hung())
    assert (drawn.status, drawn.stable) == ("FREE_MOTION", False)
    assert "'rope.one-two' draws one of its ends into a pulley" in drawn.message
    pushed = equilibrium(hung(below, Force("C", (0.0, 40.0))))
    assert (pushed.status, pushed.stable) == ("SLACK", False)
    assert f"push with {40.0 - 1.2 * GRAVITY:.4g} N" in pushed.message
    pulled = equilibrium(hung(below))
    assert pulled.status == "OK"
    assert pulled.point("one", "B").position[1] == pytest.approx(-0.5 - 0.8 * GRAVITY / 1000.0, rel=1e-9)


def on_an_incline(turn, coefficient, *loads):
    """A block of 1 kg; S lies 1 m below it."""
    along, body = np.array([np.cos(turn), np.sin(turn)]), Rigid.of(mass=1.0, inertia=1e-3, centre=(0, 0))
    return along, Mechanism(
        {"P": (0, 0), "Q": (0, 0.1), "S": tuple(-along)}, [Link("block", "P", "Q", body)],
        guides=[Guide("P", "block", along=tuple(along), friction=Coulomb(coefficient))],
        loads=[TorsionSpring("ground", "block", stiffness=1.0), *loads], gravity=(0.0, -GRAVITY),
    )  # fmt: skip


def test_friction_holds_a_block_on_an_incline_up_to_its_angle():
    """tan(0.2) = 0.2027."""
    kept, slides = (equilibrium(on_an_incline(0.2, coefficient)[1]) for coefficient in (0.203, 0.202))
    assert (kept.status, kept.stable) == ("OK", True)
    assert kept.message == "held by friction where it is drawn; it has no rest without"
    assert kept.point("block", "P").position == pytest.approx([0.0, 0.0], abs=1e-15)
    assert slides.status == "FREE_MOTION"


def test_friction_on_an_incline_leaves_an_interval_of_rest():
    """K s = -m g (sin a -+ mu cos a)."""
    along, made = on_an_incline(0.3, 0.2, Spring("P", "ground:S", stiffness=300.0, free_length=1.0))
    rest = equilibrium(made)
    found = sorted(each.point("block", "P").position @ along for each in rest.between)
    assert found == pytest.approx([-GRAVITY * (np.sin(0.3) + way * 0.2 * np.cos(0.3)) / 300.0 for way in (1, -1)], rel=1e-12)
    assert ("P rests" in str(rest)) == (len(rest.between) == 2)


def test_friction_of_a_slider_holds_its_crank_in_an_interval():
    """C a + m g r/2 cos(a + a0) = T + -F ds/da: virtual work of a crank of length r and a rod without mass, to be turned by T."""
    crank, rod, drawn, force = 0.1, 0.3, 1.0, 2.0
    end = crank * np.cos(drawn) + np.sqrt(rod**2 - (crank * np.sin(drawn)) ** 2)
    made = Mechanism(
        {"O": (0, 0), "A": (crank * np.cos(drawn), crank * np.sin(drawn)), "B": (end, 0)},
        [Link("crank", "O", "A", Rigid(BAR)), Link("rod", "A", "B", Rigid.of(mass=1e-12, inertia=1e-12))],
        [Revolute("O", "ground", "crank"), Revolute("A", "crank", "rod")],
        guides=[Guide("B", "rod", friction=GuideFriction(force))],
        loads=[TorsionSpring("ground", "crank", stiffness=1.5), Torque("crank", 0.2)], gravity=(0.0, -GRAVITY),
    )  # fmt: skip

    def left(turn, way):
        angle, weight = drawn + turn, BAR.mass_per_length * crank * GRAVITY
        travel = -crank * np.sin(angle) * (1 + crank * np.cos(angle) / np.sqrt(rod**2 - (crank * np.sin(angle)) ** 2))
        return 0.2 - 1.5 * turn - weight * crank / 2 * np.cos(angle) + way * force * travel

    rest = equilibrium(made)
    found = sorted(each.point("crank", "O").angle - drawn for each in rest.between)
    assert found == pytest.approx(sorted(brentq(left, -0.8, 0.8, args=(way,), xtol=1e-14) for way in (1, -1)), abs=1e-9)
    assert found[0] < rest.point("crank", "O").angle - drawn < found[1]


@pytest.mark.parametrize("guess", ["x", [1.0], [np.nan] * 3])
def test_coordinates_that_are_none_of_the_mechanism_are_refused(guess):
    with pytest.raises(ValueError, match="guess: must be 3 finite coordinates"):
        equilibrium(pendulum(0.1), guess=guess)
    with pytest.raises(ValueError, match="about: must be 3 finite coordinates"):
        frequencies(pendulum(0.1), about=guess)


@pytest.mark.parametrize(
    ("asked", "said"), [({"load": np.nan}, "load"), ({"degree": 2.5}, "degree"), ({"degree": 0}, "degree"), ({"all": "x"}, "all")]
)
def test_what_makes_no_sense_is_refused_in_a_line(asked, said):
    with pytest.raises(ValueError, match=f"^{said} = "):
        equilibrium(pendulum(0.1), **asked)


def test_no_mechanism_is_refused():
    with pytest.raises(ValueError, match="mechanism: must be a Mechanism, not NoneType"):
        equilibrium(None)
