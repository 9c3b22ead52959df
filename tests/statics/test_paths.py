"""Paths of equilibria: every critical point of columns and trusses against closed forms, flutter, branches, any number."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from exact.columns import LENGTH, ZIEGLER, column, critical, ziegler
from exact.columns import STRIP as SECTION
from scipy.optimize import brentq

from buckler.mbs import (
    Beam,
    Force,
    Guide,
    Link,
    Mechanism,
    Revolute,
    Rigid,
    Section,
    Spring,
    Stop,
    TorsionSpring,
    path,
)
from buckler.mbs.laws import KelvinVoigt

EULER, engesser = SECTION.euler_load(LENGTH), partial(critical, "pinned")


def columns(*names, load=1.0):
    """Equal pinned columns above each other, each pressed by a load."""
    points, links, joints, guides, loads = {}, [], [], [], []
    for k, name in enumerate(names):
        points |= {f"A{name}": (0, k), f"B{name}": (LENGTH, k)}
        links.append(Link(name, f"A{name}", f"B{name}", Beam(SECTION), carries={f"M{name}": 0.5}))
        points[f"M{name}"] = (LENGTH / 2, k)
        joints.append(Revolute(f"A{name}", "ground", name))
        guides.append(Guide(f"B{name}", name))
        loads.append(Force(f"B{name}", (-load, 0)))
    return Mechanism(points, links, joints, guides, loads=loads)


def test_branches_that_no_point_distinguishes_are_named():
    twins = columns("a", "b")
    bare = replace(twins, links=[replace(link, carries={}) for link in twins.links])
    followed, left_out = (path(each, to=1.05 * EULER, branches=True) for each in (twins, bare))
    assert len(followed.branches) == 4 and not followed.message
    assert not left_out.branches
    assert left_out.message.startswith(f"paths that leave the branching at {left_out.branchings[0]:.6g} were not followed")


@pytest.mark.parametrize("name", ["Ma", "spring.Ma-top"])
def test_stops_and_springs_are_no_loads(name):
    stop, spring = Stop("Ma", at=0.1, law=KelvinVoigt(1e4, 0), along=(0, 1)), Spring("Ma", "ground:top", stiffness=1.0)
    one = columns("a")
    held = replace(one, points={**one.points, "top": (0, 1)}, stops=[stop], loads=[*one.loads, spring])
    with pytest.raises(ValueError, match=f"load = '{name}': unknown; known: force.Ba, gravity"):
        path(held, load=name, to=1.0)


def test_a_drawing_shows_the_coordinate_that_changes_more():
    found = path(columns("a"), to=1.05 * EULER, branches=True)
    assert found.plot("a", "Ma").get_ylabel() == "y of a:Ma [m]"
    axes = found.plot("a", "Ba")  # its guide leads along x
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("factor of the loads", "x of a:Ba [m]")


def propped(load, stiffness):
    """Zero where a column on a spring at its middle buckles into one wave, by half of it, with shear and stretching."""
    bend, axial, shear = SECTION.bending_stiffness, SECTION.axial_stiffness, SECTION.shear_stiffness
    soft = 1.0 - load / axial + load / shear
    wave = np.sqrt(load * soft / bend)
    turn = wave * LENGTH / 2
    return soft * (np.sin(turn) / wave - np.cos(turn) * LENGTH / 2) + load * np.cos(turn) * (LENGTH / 2 / shear + 2 / stiffness)


@pytest.mark.parametrize("to", [4.4, 4.5, 6.0])
@pytest.mark.parametrize("stiffness", [100.0, 500.0])
def test_a_column_on_a_spring_branches_at_both_its_loads_wherever_the_path_ends(stiffness, to):
    """As it shortens its spring tilts by 4e-6, so that paths part where they would cross: a secant that falls there fails."""
    made = columns("a", load=EULER)
    spring = Spring("Ma", "ground:G", stiffness=stiffness, free_length=1.0)
    made = replace(made, points={**made.points, "G": (LENGTH / 2, -1.0)}, loads=[*made.loads, spring])
    found = path(made, to=to, load="force.Ba")
    loads = np.linspace(1.2, 4.45, 100) * EULER
    signs = np.sign([propped(load, stiffness) for load in loads])
    (k,) = np.flatnonzero(np.diff(signs))
    alone = brentq(propped, loads[k], loads[k + 1], args=(stiffness,), xtol=1e-13)
    assert found.branchings == pytest.approx(sorted([alone / EULER, engesser(2) / EULER]), rel=1e-7)
    assert found.unstable[-1] == 2


def truss(height, stiffness=1e4):
    """A mass on two springs and a torsion spring: limit and branchings in closed form."""
    free = np.hypot(1, height)
    return Mechanism(
        points={"P": (0, height), "Q": (0, height + 0.1), "A": (-1, 0), "C": (1, 0)},
        links=[Link("block", "P", "Q", Rigid.of(mass=0.1, inertia=1e-3, centre=(0, 0)))],
        loads=[*(Spring("P", f"ground:{end}", stiffness=stiffness, free_length=free) for end in "AC"), Force("P", (0.0, -1.0)),
               TorsionSpring("ground", "block", stiffness)],
    )  # fmt: skip


def test_branchings_that_cancel_within_a_step_and_one_beside_a_limit_are_found():
    """A node on two springs, height h over half span 1: k_xx = 1 - l h^2/(1 + h^2)^1.5 dips below zero and comes back."""
    height, k = 2.4213, 1e3
    free, made = float(np.hypot(1.0, height)), truss(height, k)

    def force(y):
        return 2 * k * (free - np.hypot(1, y)) * y / np.hypot(1, y)

    limit = force(np.sqrt(free ** (2 / 3) - 1))
    turn = np.sqrt(2.0)
    ends = [(turn, height), (1e-6, turn)]
    loads = [force(brentq(lambda y: 1 - free * y * y / np.hypot(1, y) ** 3, *each)) for each in ends]
    found = path(made, load="force.P", to=1.05 * limit)
    assert sorted(found.branchings) == pytest.approx(sorted([*loads, *(-load for load in loads)]), rel=1e-6)


def test_a_column_between_two_stops_is_followed_to_four_euler_loads():
    """It bows onto a stop, which pushes with 2 P k d cos(kl)/(kl cos(kl) - sin(kl)), l = L/2, and branches at the second load."""
    gap, stiffness = 1.5e-3, 1e6
    stops = [Stop("Ma", at=at, law=KelvinVoigt(stiffness, 0.0), along=(0, 1), link="a") for at in (gap, -gap)]
    made = replace(columns("a", load=EULER), stops=stops)
    found = path(made, load="force.Ba", to=4.1, branch=("a", "Ma", (0, -1)), steps=600)
    assert found.status == "OK"
    assert found.branchings == pytest.approx([engesser(1) / EULER, engesser(2) / EULER], rel=1e-4)
    deep = -found.point("a", "Ma")[:, 1] - gap
    touching = (deep > 0) & (found.parameter < 3.8)
    assert touching.sum() > 10 and (deep[-1] > 0)
    turn = np.pi / 2 * np.sqrt(found.parameter[touching])
    load = found.parameter[touching] * EULER
    force = 2 * load * turn / (LENGTH / 2) * (gap + deep[touching]) * np.cos(turn) / (turn * np.cos(turn) - np.sin(turn))
    assert stiffness * deep[touching] == pytest.approx(force, rel=0.02, abs=0.02 * force.max())


def test_an_arch_that_tilts_tilts_back_to_the_other_side_and_returns():
    """The path that leaves an arch's branching meets that of the upright arch again, goes through it and comes back mirrored."""
    arch = Mechanism(
        {"A": (0, 0), "B": (LENGTH, 0)},
        [Link("arch", "A", "B", Beam(Section(0.02, 0.002), imperfection=0.008), carries={"Q": 0.25, "M": 0.5, "R": 0.75})],
        [Revolute("A", "ground", "arch"), Revolute("B", "ground", "arch")],
        loads=[Force("M", (0, -1.0))],
    )  # fmt: skip
    found = path(arch, to=40.0, degree=5, branches=True)
    assert len(found.branchings) == 1 and len(found.branches) == 2
    for each in found.branches:
        tilt = each.point("arch", "Q")[:, 1] - each.point("arch", "R")[:, 1]
        assert each.ended == "closed" and tilt.max() == pytest.approx(-tilt.min(), rel=0.05) and tilt.max() > 7e-3
        (lowest,) = each.limits
        assert each.parameter[0] == pytest.approx(found.branchings[0]) and lowest == pytest.approx(each.parameter.min(), rel=1e-4)


@pytest.mark.parametrize("height", [1.5, 2.7, 6.0])
def test_a_truss_branches_before_or_after_its_limit(height):
    """Sideways stiffness 2 k (1/l^2 + (1 - l0/l) y^2/l^2) is zero where it branches, dF/dy where it turns."""
    free, force = np.hypot(1, height), lambda y: 2e4 * (free - np.hypot(1, y)) * y / np.hypot(1, y)
    turn = np.sqrt(free ** (2 / 3) - 1)
    y = np.linspace(height, 0.0, 200_001)
    length = np.hypot(1, y)
    side = 1 - free / length * (y / length) ** 2
    at = y[np.flatnonzero(np.diff(np.sign(side)))]
    found = path(truss(height), load="force.P", to=1.05 * force(turn), steps=1000)
    assert found.limits[0] == pytest.approx(force(turn), rel=1e-9)
    half = found.branchings[: len(found.branchings) // 2]
    assert sorted(half) == pytest.approx(sorted(force(at)), rel=1e-4)


def posts(count, weight=0.0):
    """Upright bars of 1 m on torsion springs of 50 N m, each pressed at its top."""
    points, links, joints, loads = {}, [], [], []
    for k in range(count):
        points |= {f"O{k}": (k, 0), f"A{k}": (k, 1.0)}
        links.append(Link(f"bar{k}", f"O{k}", f"A{k}", Rigid(Section(0.02, 0.02))))
        joints.append(Revolute(f"O{k}", "ground", f"bar{k}"))
        loads += [TorsionSpring("ground", f"bar{k}", stiffness=50.0), Force(f"A{k}", (0.0, -1.0 - weight))]
    return Mechanism(points, links, joints, loads=loads)


@pytest.mark.parametrize("count", [1, 2])
def test_posts_branch_where_their_springs_yield_and_lean_to_both_sides(count):
    """50 t = F sin t, each by itself at least; most coordinates of a rigid bar have no stiffness, and its path does not move."""
    found = path(posts(count), to=80.0, branches=True)
    turn = brentq(lambda t: 50 * t - 80 * np.sin(t), 0.5, 3.0)
    assert found.ended == "reached"
    assert found.branchings == pytest.approx([50.0] * count, rel=1e-9)
    assert [each.ended for each in found.branches] == ["reached"] * 2 * count
    sides = []
    for each in found.branches:
        tops = np.array([each.point(f"bar{k}", f"A{k}")[-1] - [k, 0] for k in range(count)])
        sides.append(tuple(int(side) for side in np.sign(np.round(tops[:, 0], 6))))
        leans = [[side * np.sin(turn), np.cos(turn) if side else 1.0] for side in sides[-1]]
        assert tops == pytest.approx(np.array(leans), abs=1e-7)
        assert each.stable[-1] == all(sides[-1])
    assert len(set(sides)) == 2 * count


def test_a_pendulum_drawn_anywhere_is_followed_from_where_it_hangs():
    """Under its weight, which stays, and a force that grows: tan t = 2 F/W. Under all loads at once it hangs all along."""
    bar = Rigid(Section(0.03, 0.005))
    made = Mechanism({"O": (0, 0), "A": (0.3, 0.1)}, [Link("bar", "O", "A", bar)], [Revolute("O", "ground", "bar")],
                     loads=[Force("A", (1.0, 0.0))], gravity=(0.0, -9.81))  # fmt: skip
    length = np.hypot(0.3, 0.1)
    weight = bar.section.mass_per_length * length * 9.81
    found = path(made, load="force.A", to=3.0)
    turn = np.arctan2(2 * 3.0, weight)
    assert found.ended == "reached"
    assert found.stable.all()
    assert found.point("bar", "A")[0] == pytest.approx([0.0, -length], abs=1e-10)
    assert found.point("bar", "A")[-1] == pytest.approx([length * np.sin(turn), -length * np.cos(turn)], abs=1e-10)
    both = path(made, to=1.0)
    turn = np.arctan2(2.0, weight)
    assert both.ended == "reached"
    assert both.point("bar", "A")[[0, -1]] == pytest.approx(np.tile([length * np.sin(turn), -length * np.cos(turn)], (2, 1)))


def test_a_little_damping_of_the_strip_makes_becks_column_flutter_at_half_its_load():
    """Ziegler's paradox: 10.94 EI/L^2 for Kelvin and Voigt's material (Bolotin 1963)."""
    section = Section(0.02, 0.0005).damped(1e-3, LENGTH)
    found = path(column("cantilever", section, section.bending_stiffness / LENGTH**2, follows="strip"), to=15.0, degree=8)
    assert found.flutter == pytest.approx([10.94], rel=1e-3)


@pytest.mark.parametrize(("first", "second"), [(0.01, 0.01), (0.01, 0.2), (0.3, 0.01)])
def test_a_damped_flutter_ends_where_its_motions_cease_to_swing(first, second):
    """Ziegler's double pendulum with unequal dampers: flutter begins on the imaginary axis and ends on the real one."""
    length, stiffness, mass = ZIEGLER
    found = path(ziegler(first, second), load="force.B", to=6.2)

    def swinging(load):
        inertia, damping = mass * length**2 * np.array([[3, 1], [1, 1]]), np.array([[first + second, -second], [-second, second]])
        rows = np.linalg.solve(inertia, np.hstack([stiffness * np.array([[2 - load, load - 1], [-1, 1]]), damping]))
        values = np.linalg.eigvals(np.block([[np.zeros((2, 2)), np.eye(2)], [-rows]]))
        return values.real[np.abs(values.imag) > 1e-9].max(initial=-1.0)

    loads = np.linspace(0.1, 6.1, 601)
    at = np.flatnonzero(np.diff(np.sign([swinging(load) for load in loads])))
    exact = [brentq(swinging, loads[k], loads[k + 1], xtol=1e-12) for k in at]
    assert len(exact) == 2
    assert found.flutter == pytest.approx(exact, rel=1e-6)


@pytest.mark.parametrize("behind", [0.0, 1e-9, 1e-4])
def test_a_plate_is_pressed_through_the_contacts_of_its_two_ends(behind):
    """A plate turns about its first stop until the second, deeper by `behind`, holds it; forces balance all along."""
    spring, torsion, face, arm, load = 1000.0, 50.0, 5e4, 0.1, 20.0
    law = KelvinVoigt(face, 0.0)
    plate = Mechanism(
        {"A": (-arm, 0), "B": (arm, 0), "M": (0, 0), "G": (0, -1)},
        [Link("plate", "A", "B", Rigid.of(mass=1.0, inertia=0.01), carries=("M",))],
        guides=[Guide("M", "plate", along=(0, 1))],
        stops=[Stop("A", at=-0.01, law=law, along=(0, 1)), Stop("B", at=-0.01 - behind, law=law, along=(0, 1))],
        loads=[Spring("M", "ground:G", spring), TorsionSpring("ground", "plate", torsion), Force("M", (0, -load))],
    )
    found = path(plate, load="force.M", to=1.5)
    assert (found.status, found.ended) == ("OK", "reached")
    y, a, b = (found.point("plate", name)[:, 1] for name in "MAB")
    push_a, push_b = face * np.maximum(0.0, -0.01 - a), face * np.maximum(0.0, -0.01 - behind - b)
    assert spring * y + found.parameter * load == pytest.approx(push_a + push_b, abs=1e-6)
    half = (b - a) / 2
    assert torsion * np.arcsin(half / arm) == pytest.approx(np.sqrt(arm**2 - half**2) * (push_b - push_a), abs=1e-6)
    assert push_b[-1] > 0.0


def test_a_thickness_is_followed_to_where_the_column_buckles():
    load = 2.0
    thin = (load * 12 * LENGTH**2 / np.pi**2 / SECTION.material.modulus / SECTION.width) ** (1 / 3)
    found = path(columns("a", load=load), parameter="links.a.body.section.thickness", to=0.7 * thin, degree=10)
    assert found.branchings == pytest.approx([thin], rel=1e-4)


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ({"to": 0}, "to = 0"),
        ({"to": np.nan}, "to = nan"),
        ({"to": 1.0, "steps": 0}, "steps = 0"),
        ({"to": 1.0, "step": -1.0}, "step = -1"),
        ({"to": 1.0, "load": []}, r"load = \[\]"),
        ({"to": 1.0, "branch": ("a", "Ma", (0, 0))}, "branch = "),
        ({"to": 0.001, "parameter": "links.a.body.section.thickness"}, "to = 0.001: the path begins there"),
        ({"to": 0.6, "parameter": "links.a.body.section.thickness"}, "thickness of flexible link 'a' = 0.6 m: must be below"),
        ({"to": 1.0, "branch": ("a", "nowhere", (0, 1))}, "branch = "),
        ({"to": 1.0, "load": "force.X"}, "load = 'force.X': unknown"),
        ({"to": 1.0, "parameter": "links.a.name"}, "parameter = "),
    ],
)
def test_what_makes_no_sense_is_refused_in_a_line(asked, said):
    with pytest.raises(ValueError, match=said):
        path(columns("a"), **asked)
