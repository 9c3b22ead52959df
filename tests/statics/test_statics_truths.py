"""Statics and vibration of mechanisms against exact solutions made without finite elements: `buckler.elastica`."""

from itertools import pairwise

import numpy as np
import pytest
from truths import arches, princeton

from buckler.elastica.member import Member
from buckler.elastica.vibration import beam_frequencies, portal
from buckler.mbs import STEEL, Beam, Force, Guide, Link, Material, Mechanism, Revolute, Section, Weld
from buckler.mbs.statics import equilibrium, frequencies, path
from buckler.mbs.statics.problem import places

LENGTH, BAR = 0.5, Section(0.020, 0.050, STEEL)


def member(section, length):
    """The same bar as a member in closed form."""
    return Member(
        length,
        section.bending_stiffness,
        section.mass_per_length,
        section.shear_stiffness,
        section.inertia_per_length,
        section.axial_stiffness,
    )


JOINTS = {
    "cantilever": [Weld("A", "ground", "bar")],
    "clamped-pinned": [Weld("A", "ground", "bar"), Revolute("B", "ground", "bar")],
    "clamped-clamped": [Weld("A", "ground", "bar"), Weld("B", "ground", "bar")],
    "pinned-pinned": [Revolute("A", "ground", "bar"), Revolute("B", "ground", "bar")],
}


@pytest.mark.parametrize("ends", JOINTS)
def test_frequencies_of_a_bar_are_timoshenkos(ends):
    points = {"A": (0.0, 0.0), "B": (LENGTH, 0.0)}
    mechanism = Mechanism(points, [Link("bar", "A", "B", Beam(BAR))], JOINTS[ends])
    found = frequencies(mechanism, degree=16, count=4).angular
    exact = beam_frequencies(member(BAR, LENGTH), ends, 6)
    for omega in exact[:3]:
        assert found[np.argmin(abs(found - omega))] == pytest.approx(omega, rel=1e-6)


def test_frequencies_of_a_portal_frame():
    """Two columns and a beam, welded corners, clamped feet: exact by the members' dynamic stiffness."""
    section, height, width = Section(0.020, 0.010, STEEL), 0.5, 0.8
    mechanism = Mechanism(
        points={"A": (0, 0), "B": (0, height), "C": (width, height), "D": (width, 0)},
        links=[Link(name, *ends, Beam(section)) for name, ends in {"left": "AB", "top": "BC", "right": "DC"}.items()],
        joints=[
            Weld("A", "ground", "left"), Weld("D", "ground", "right"), Weld("B", "left", "top"), Weld("C", "top", "right"),
        ],
    )  # fmt: skip
    found = frequencies(mechanism, degree=14, count=5).angular
    assert found == pytest.approx(portal(member(section, height), member(section, width)).frequencies(5), rel=1e-6)


@pytest.mark.parametrize("load", [4.448, 8.896, 13.345])
def test_cantilever_bends_as_the_exact_elastica(load):
    """The Princeton beam in its plane, with shear and stretching."""
    section = Section(princeton.WIDTH, princeton.THICKNESS, Material(princeton.MODULUS, 2804.0, princeton.POISSON))
    mechanism = Mechanism(
        points={"A": (0.0, 0.0), "B": (princeton.LENGTH, 0.0)},
        links=[Link("beam", "A", "B", Beam(section))],
        joints=[Weld("A", "ground", "beam")],
        loads=[Force("B", (0.0, -load))],
    )
    x, y = equilibrium(mechanism, degree=14).point("beam", "B").position
    assert (princeton.LENGTH - x, -y) == pytest.approx(princeton.tip(load), rel=1e-6)


def circle(fraction):
    """The arch of the truths as a function of the fraction of its arc."""
    half = 2.0 * np.arctan(2.0 * arches.RISE / arches.SPAN)
    radius = arches.SPAN / 2 / np.sin(half)
    turn = half * (2 * fraction - 1)
    return arches.SPAN / 2 + radius * np.sin(turn), radius * (np.cos(turn) - np.cos(half))


@pytest.mark.parametrize("ends", ["pinned", "clamped"])
def test_shallow_arch_passes_both_limit_points(ends):
    section = Section(arches.WIDTH, arches.THICKNESS, Material(arches.MODULUS, arches.DENSITY, arches.POISSON))
    hold = Revolute if ends == "pinned" else Weld
    mechanism = Mechanism(
        points={"A": (0.0, 0.0), "B": (arches.SPAN, 0.0)},
        links=[Link("arch", "A", "B", Beam(section, shape=circle), carries={"M": 0.5})],
        joints=[hold("A", "ground", "arch"), hold("B", "ground", "arch")],
        loads=[Force("M", (0.0, -1.0))],
    )
    followed = path(mechanism, load="force.M", to=120.0, degree=14, steps=400)
    assert followed.limits[:2] == pytest.approx(arches.snap("circle", ends).loads, rel=1e-6)


@pytest.mark.parametrize("to", [30.0, 120.0, 1000.0])
def test_a_path_stays_on_its_branch_whatever_the_load_is_measured_by(to):
    """Beside a large load the way of the places is short: a step must not reach over to another branch."""
    section = Section(0.020, 0.002, STEEL)
    mechanism = Mechanism(
        points={"A": (0, 0), "B": (0.5, 0)},
        links=[Link("arch", "A", "B", Beam(section, imperfection=0.005), carries={"M": 0.5})],
        joints=[Revolute("A", "ground", "arch"), Revolute("B", "ground", "arch")],
        loads=[Force("M", (0, -1.0))],
    )
    followed = path(mechanism, load="force.M", to=to, degree=10, steps=120)
    heights = [places(followed.scene, q, "arch", "M").position[1] for q in followed.q]
    assert followed.limits[:2] == pytest.approx([23.67, -23.40], rel=1e-3)
    assert np.abs(np.diff(heights)).max() < 2e-3


def test_a_strip_held_at_its_ends_has_no_guide_to_give_way():
    """A guide lets the far end slide: the same bar is softer, and not by rounding."""
    points = {"A": (0.0, 0.0), "B": (LENGTH, 0.0)}
    held = Mechanism(points, [Link("bar", "A", "B", Beam(BAR, imperfection=0.02))], JOINTS["pinned-pinned"])
    sliding = Mechanism(points, held.links, [Revolute("A", "ground", "bar")], [Guide("B", "bar")])
    stiff, soft = (frequencies(m, degree=14, count=1).angular[0] for m in (held, sliding))
    assert stiff > 1.05 * soft


def quarter(fraction):
    """A quarter of a circle that starts along x."""
    turn = fraction * np.pi / 2
    return LENGTH * np.sin(turn), LENGTH * (1 - np.cos(turn))


def test_curved_cantilever_gives_way_as_castigliano_says():
    """F R^3/(E I) (3 pi/4 - 2) + F R pi/4 (1/E A + 1/G A) down, F R^3/(2 E I) + F R/2 (1/G A - 1/E A) along."""
    force, bar = 1.0, Section(0.020, 0.020, STEEL)
    bending, axial, shear = (
        force * LENGTH**3 / bar.bending_stiffness,
        force * LENGTH / bar.axial_stiffness,
        force * LENGTH / bar.shear_stiffness,
    )
    exact = [bending / 2 + (shear - axial) / 2, -bending * (3 * np.pi / 4 - 2) - (axial + shear) * np.pi / 4]
    errors = []
    for degree in (2, 3, 4, 5, 8):
        tips = []
        for down in (force, -force):  # the mean of both is free of what is quadratic in the load
            mechanism = Mechanism(
                points={"A": (0, 0), "B": (LENGTH, LENGTH)},
                links=[Link("bow", "A", "B", Beam(bar, shape=quarter))],
                joints=[Weld("A", "ground", "bow")],
                loads=[Force("B", (0, -down))],
            )
            tips.append(equilibrium(mechanism, degree=degree).point("bow", "B").position)
        errors.append(np.abs((tips[0] - tips[1]) / 2 / exact - 1).max())
    assert errors[-1] < 2e-8  # what is cubic in the load
    assert all(fine < coarse / 20 for coarse, fine in pairwise(errors[:4]))
