"""The verdict of the study of two solvers on mechanisms with a kind of element: for `python tests/mutations signs --solvers`."""

import os
from itertools import islice

import pytest

pytest.importorskip("numba")

from buckler.studies.trust import two_solvers
from buckler.studies.trust.two_solvers_scenes import FAMILIES, drawn, known

EITHER = {"Strip": ("Beam", "Cable"), "Slider": ("Slider", "Slot")}
CASES = 4


def cases(kind):
    """Mechanisms that have it, drawn ones first."""
    names = EITHER.get(kind, (kind,))
    some = (drawn(1, k) for k in range(12 * len(FAMILIES)))
    return islice((pair for pair in (*some, *known()) if any(f"{name}(" in repr(pair.mechanism) for name in names)), CASES)


def test_solvers_agree(monkeypatch):
    found = list(cases(os.environ["KIND"]))
    assert found, "no mechanism of the study has it"
    monkeypatch.setattr(two_solvers, "pairs", lambda _p: iter(found))
    result = two_solvers.run(two_solvers.Parameters(cases=len(found), timeout=4.0))
    assert result.status == "OK", result.message
