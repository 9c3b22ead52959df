"""Two solvers on mechanisms with a kind of element: for `python tests/mutations signs --solvers`."""

import os
from itertools import chain, islice

import pytest

pytest.importorskip("numba")

from validation.solvers import compare, list_ready

from buckler.studies.kit.drawn import EVERYTHING, draw

EITHER = {"Strip": ("Beam", "Cable"), "Slider": ("Slider", "Slot")}
CASES = 6


def kinds(mechanism):
    """Names of the types of its parts, their bodies, laws and frictions."""
    parts = [*mechanism.joints, *mechanism.guides, *mechanism.stops, *mechanism.loads, *mechanism.drives, *mechanism.masses]
    parts += [link.body for link in mechanism.links]
    return {type(each).__name__ for part in parts for each in (part, getattr(part, "law", None), getattr(part, "friction", None))}


def cases(kind):
    """Mechanisms that have it, drawn ones first."""
    names = set(EITHER.get(kind, (kind,)))
    some = (draw(1, k, EVERYTHING) for k in reversed(range(12 * len(EVERYTHING))))
    return islice((pair for pair in chain(some, list_ready()) if names & kinds(pair.mechanism)), CASES)


def test_solvers_agree():
    found = [(made.name, compare(made, timeout=8.0)) for made in cases(os.environ["KIND"])]
    assert [each for each in found if each[1].ratio > 1 and each[1].right == 0] == []
