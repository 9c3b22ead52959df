"""Each case of the study of stability by name, and the study as a whole."""

import pytest

from buckler.studies.trust.stability import CASES, Parameters, allowed, figure, run

LONG = [name for name in CASES if name.startswith(("lee", "euler")) and not name.endswith(("_1", "_2"))]


@pytest.mark.parametrize("name", [pytest.param(each, marks=[pytest.mark.slow] * (each in LONG)) for each in CASES])
def test_a_case_is_as_exact_as_is_asked_and_within_its_told_error(name):
    found = CASES[name]()
    off = abs(found.value - found.exact)
    assert off <= allowed(name) * abs(found.exact)
    published = name.startswith(("lee", "beck", "near"))  # whose exact value is rounded, or of a simpler theory
    assert published or off <= found.estimated + 1e-9 * abs(found.exact)


def test_the_study_gives_three_numbers_a_case():
    result = run(Parameters(cases=("ziegler", "truss")))
    assert result.status == "OK"
    assert result.metrics["ziegler.value"].value == pytest.approx(result.metrics["ziegler.exact"].value, rel=1e-9)
    assert set(result.metrics) == {f"{name}.{key}" for name in ("ziegler", "truss") for key in ("value", "exact", "estimated")}
    assert figure(result).axes
