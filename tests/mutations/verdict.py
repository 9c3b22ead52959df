"""The verdict of the study of two solvers on mechanisms with a kind of element: for `python tests/mutations signs --solvers`."""

import os
from itertools import chain, islice

import pytest

pytest.importorskip("numba")

from buckler.studies.kit.drawn import EVERYTHING, draw
from buckler.studies.trust import two_solvers
from buckler.studies.trust.two_solvers import known

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
    return islice((pair for pair in chain(some, known()) if names & kinds(pair.mechanism)), CASES)


def test_solvers_agree(monkeypatch):
    found = list(cases(os.environ["KIND"]))
    monkeypatch.setattr(two_solvers, "pairs", lambda _p: iter(found))
    result = two_solvers.run(two_solvers.Parameters(cases=max(1, len(found)), timeout=4.0))
    assert not found or result.status == "OK", result.message
