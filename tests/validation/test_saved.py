"""Random mechanisms whose runs were once silently wrong or falsely suspected: each has a verdict.

`drawn/cases.json` says what accuracy is asked for, what each was, what it still is (`known`), and which are slow.
"""

import json
from pathlib import Path

import pytest

pytest.importorskip("numba")

from buckler.mbs import Mechanism
from buckler.studies.extremes.case import judge
from buckler.studies.extremes.verdict import Verdict
from buckler.studies.kit.drawn import Draw

FOLDER = Path(__file__).parent / "drawn"
CASES = {case["name"]: case for case in json.loads((FOLDER / "cases.json").read_text(encoding="utf-8"))}


def mark(case):
    """Mark a case as slow, or as one that is known to be wrong still."""
    reason = f"still {case['known']}" if case["known"] else ""
    return [pytest.mark.slow] * case["slow"] + [pytest.mark.xfail(reason=reason, strict=True)] * bool(reason)


@pytest.mark.parametrize("name", [pytest.param(name, marks=mark(case)) for name, case in CASES.items()])
def test_a_saved_mechanism_is_neither_silently_wrong_nor_falsely_suspected(name):
    case, mechanism = CASES[name], Mechanism.load(FOLDER / f"{name}.toml")
    found = judge("saved", Draw(name, mechanism, case["duration"]), case["accuracy"], timeout=200.0)
    assert found.verdict in (Verdict.RIGHT, Verdict.NAMED), found
