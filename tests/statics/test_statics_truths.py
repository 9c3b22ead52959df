"""Statics and vibration of mechanisms against exact solutions made without finite elements: `buckler.elastica`."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from exact import arches, princeton, problems
from exact.columns import LENGTH, member
from exact.vibration import beam_frequencies, portal

from buckler.elastica import law
from buckler.mbs import (
    STEEL,
    Beam,
    Cable,
    Drive,
    Force,
    Guide,
    Link,
    Material,
    Mechanism,
    Revolute,
    Section,
    Weld,
    equilibrium,
    frequencies,
    path,
)  # fmt: skip

THICK = Section(0.03, 0.02)
JOINTS = {
    "cantilever": [Weld("A", "ground", "bar")],
    "clamped-pinned": [Weld("A", "ground", "bar"), Revolute("B", "ground", "bar")],
    "clamped-clamped": [Weld("A", "ground", "bar"), Weld("B", "ground", "bar")],
    "pinned-pinned": [Revolute("A", "ground", "bar"), Revolute("B", "ground", "bar")],
}


@pytest.mark.parametrize("ends", JOINTS)
def test_frequencies_of_a_cable_are_eulers(ends):
    """Those of beams at the default degree are in test_small_motions.py."""
    mechanism = Mechanism({"A": (0.0, 0.0), "B": (LENGTH, 0.0)}, [Link("bar", "A", "B", Cable(THICK))], JOINTS[ends])
    found = frequencies(mechanism, degree=14, count=4).angular
    for omega in beam_frequencies(replace(member(THICK), shear=np.inf, rotary=0.0), ends, 3):
        assert np.abs(found / omega - 1).min() < 1e-7


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


@pytest.mark.parametrize("load", princeton.LOADS)
def test_a_cable_bends_as_the_exact_elastica(load):
    """The Princeton beam in its plane, stretched but not sheared; the beam that shears too is in validation/published.py."""
    made = problems.princeton(load)
    rest = equilibrium(replace(made, links=[Link("beam", "A", "B", Cable(problems.PRINCETON))]), degree=14)
    x, y = rest.point("beam", "B").position
    assert rest.stable
    assert (princeton.LENGTH - x, -y) == pytest.approx(princeton.tip(load, shear=False), rel=1e-6)


@pytest.mark.parametrize(("body", "tolerance"), [(Beam, 6e-6), (Cable, 1e-3)])
def test_path_buckles_and_follows_the_elastica(body, tolerance):
    """Shorten a straight pinned strip: it leaves the straight path at Euler's load and then carries the elastica's."""
    section = Section(0.03, 0.0003)
    made = Mechanism(
        {"O": (0.0, 0.0), "A": (LENGTH, 0.0), "M": (LENGTH / 2, 0.0)}, [Link("strip", "O", "A", body(section), {"M": 0.5})],
        [Revolute("O", "ground", "strip")], [Guide("A", "strip")], drives=[Drive("A", 1.0)],
    )  # fmt: skip
    branch = ("strip", "M", (0.0, 1.0))
    followed = path(made, drive="drive", to=-0.9 * LENGTH, degree=14, branch=branch, step=1e-4, longest=0.05)
    unit = section.bending_stiffness / LENGTH**2
    assert followed.branchings[0] == pytest.approx(-(np.pi**2) * unit / section.axial_stiffness * LENGTH, rel=2e-3)
    u, force = -followed.parameter / LENGTH, -followed.reaction("drive")[:, 0] / unit
    bent = u > 1e-3
    assert bent.sum() > 10
    assert np.abs(force[bent] / [law.fast(x) for x in u[bent]] - 1).max() < tolerance
    assert followed.stable[bent].all()


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
    assert followed.limits[:2] == pytest.approx(arches.snap(ends), rel=1e-6)


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
