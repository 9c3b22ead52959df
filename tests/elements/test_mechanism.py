"""What a mechanism is made of: section formulas, prescribed motions, and wrong input named in one sentence."""

import math

import numpy as np
import pytest
from made import BAR, GUIDES, JOINTS, LAW, LINKS, POINTS, STRIP, mechanism

from buckler import mbs
from buckler.mbs.library import SliderCrank
from buckler.mbs.validate import number, positive, whole

INF, NAN = math.inf, math.nan


@pytest.mark.parametrize("value", [-1e-300, 2.5000001, NAN, INF, -INF])
def test_number_names_parameter_value_range_and_unit(value):
    with pytest.raises(ValueError) as caught:
        number("depth", value, 0.0, 2.5, "m/s")
    assert str(caught.value) == f"depth = {value!r} m/s: must lie in [0, 2.5] m/s"


@pytest.mark.parametrize("value", [None, "1", True, 1j, [1.0]])
def test_what_is_no_number_has_no_unit(value):
    with pytest.raises(ValueError) as caught:
        number("depth", value, 0.0, 2.5, "m/s")
    assert str(caught.value) == f"depth = {value!r}: must be a number in [0, 2.5] m/s"


def test_open_ends_are_shown_and_kept():
    with pytest.raises(ValueError, match=r"mass = 0.0 kg: must lie in \(0, inf\) kg"):
        positive("mass", 0.0, "kg")
    assert positive("mass", 1e-29, "kg") > 0
    with pytest.raises(ValueError, match="counts as zero"):
        positive("mass", 5e-324, "kg")
    assert number("mass", 0.0, 0.0, math.inf, "kg") == 0
    with pytest.raises(ValueError, match=r"mass = -1 kg: must lie in \[0, inf\) kg"):
        number("mass", -1, 0.0, math.inf, "kg")


def test_whole_takes_whole_numbers_only():
    assert whole("n", 3, 1, 3) == 3 and type(whole("n", np.int64(2), 1, 3)) is int
    for value in (0, 4, 2.5, True, NAN, INF, None, "two", 1j):
        with pytest.raises(ValueError) as caught:
            whole("n", value, 1, 3)
        assert str(caught.value) == f"n = {value!r}: must be a whole number in [1, 3]"


INCONSISTENT = {  # what is changed in a consistent mechanism -> words of the message
    "link twice": (dict(links=[*LINKS, LINKS[0]]), ["unique", "crank"]),
    "link named ground": (dict(links=[*LINKS, mbs.Link("ground", "O", "B", mbs.Rigid(BAR))]), ["'ground'"]),
    "link named like a point": (dict(links=[*LINKS, mbs.Link("B", "O", "B", mbs.Rigid(BAR))]), ["point's name", "B"]),
    "carried point nowhere": (dict(links=[*LINKS, mbs.Link("x", "O", "A", mbs.Rigid(BAR), ["Z"])]), ["link 'x'", "'Z'"]),
    "no length": (dict(links=[*LINKS, mbs.Link("x", "O", "O", mbs.Rigid(BAR))]), ["length of link 'x' = 0.0 m", "(0, inf) m"]),
    "joint with itself": (dict(joints=[mbs.Revolute("A", "crank", "crank")]), ["joint at 'A'", "itself"]),
    "joint out of reach": (dict(joints=[mbs.Revolute("B", "ground", "crank")]), ["'crank' does not reach", "O, A"]),
    "guide nowhere": (dict(guides=[mbs.Guide("Z", "rod")]), ["guide of 'Z'", "unknown point"]),
    "guide of a stranger": (dict(guides=[mbs.Guide("B", "arm")]), ["guide of 'B'", "unknown link 'arm'"]),
    "guide out of reach": (dict(guides=[mbs.Guide("O", "rod")]), ["'rod' does not reach"]),
    "two guides": (dict(guides=[*GUIDES, mbs.Guide("B", "rod")]), ["at most one guide"]),
    "stop of a free point": (dict(stops=[mbs.Stop("A", at=0.5, law=LAW)]), ["stop at 'A'", "along: must be given", "as (1, 0)"]),
    "drive of nothing": (dict(drives=[mbs.Drive("arm", 1.0)]), ["drive", "'arm'", "B, crank"]),
    "drive of a strut": (dict(drives=[mbs.Drive("rod", 1.0)]), ["drive", "rigid link", "'rod'"]),
    "joint twice": (dict(joints=[*JOINTS, mbs.Revolute("A", "rod", "crank")]), ["joint"]),
    "gravity not finite": (dict(gravity=(0.0, NAN)), ["gravity"]),
    "point not finite": (dict(points={**POINTS, "C": (INF, 0.0)}), ["points"]),
    "drive of a free point": (dict(drives=[mbs.Drive("A", 1.0)]), ["drive", "guided point", "'A'"]),
}


@pytest.mark.parametrize("case", INCONSISTENT)
def test_inconsistent_mechanism_is_refused_in_words(case):
    mechanism()  # the unchanged one is fine
    changed, words = INCONSISTENT[case]
    with pytest.raises(ValueError) as caught:
        mechanism(**changed)
    assert not [word for word in words if word not in str(caught.value)], str(caught.value)


def test_only_a_rigid_link_carries_points():
    assert mbs.Link("bar", "A", "B", mbs.Rigid(BAR), carries=["C"]).points == ("A", "B", "C")
    for body in (mbs.Strut(STRIP), mbs.Beam(STRIP), mbs.Cable(STRIP)):
        with pytest.raises(ValueError, match=f"link 'bar'.*Rigid.*{type(body).__name__}"):
            mbs.Link("bar", "A", "B", body, carries=["C"])


def test_a_stop_needs_a_law():
    for nonsense in (None, 1e5, lambda depth: depth):
        with pytest.raises(ValueError, match=r"stop at 'B'.*law"):
            mbs.Stop("B", at=0.0, law=nonsense)


def test_wrong_lengths_of_the_slider_crank_are_named():
    with pytest.raises(ValueError, match="of link 'coupler'"):
        mbs.slider_crank(mbs.Rigid(BAR), law=None, mass=0.3, speed=1.0, lengths=SliderCrank(crank=0.1, coupler=0.0))
