"""Statics and vibration of mechanisms against exact solutions made without finite elements: `buckler.elastica`."""

import numpy as np
import pytest

from buckler.elastica.member import Member
from buckler.elastica.vibration import beam_frequencies, portal_frequencies
from buckler.mbs import STEEL, Beam, Guide, Link, Mechanism, Revolute, Section, Weld
from buckler.mbs.statics import frequencies

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
    assert found == pytest.approx(portal_frequencies(member(section, height), member(section, width), 5), rel=1e-6)


def test_a_strip_held_at_its_ends_has_no_guide_to_give_way():
    """A guide lets the far end slide: the same bar is softer, and not by rounding."""
    points = {"A": (0.0, 0.0), "B": (LENGTH, 0.0)}
    held = Mechanism(points, [Link("bar", "A", "B", Beam(BAR, imperfection=0.02))], JOINTS["pinned-pinned"])
    sliding = Mechanism(points, held.links, [Revolute("A", "ground", "bar")], [Guide("B", "bar")])
    stiff, soft = (frequencies(m, degree=14, count=1).angular[0] for m in (held, sliding))
    assert stiff > 1.05 * soft
