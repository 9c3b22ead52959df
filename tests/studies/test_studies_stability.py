"""Each case of the study of stability by name, and the study as a whole."""

import numpy as np
import pytest

from buckler.mbs import path
from buckler.studies.trust import frames
from buckler.studies.trust.stability import CASES, FRAMES, Parameters, allowed, figure, run

LONG = [
    name for name in CASES if name.startswith((*FRAMES, "euler")) and not name.startswith("euler") * name.endswith(("_1", "_2"))
]


@pytest.mark.parametrize("name", [pytest.param(each, marks=[pytest.mark.slow] * (each in LONG)) for each in CASES])
def test_a_case_is_as_exact_as_is_asked_and_within_its_told_error(name):
    found = CASES[name]()
    off = abs(found.value - found.exact)
    assert off <= allowed(name) * abs(found.exact)
    published = name.startswith(("beck", "reut", "leipholz", "pfluger", "portal"))  # exact: rounded, or of a simpler theory
    assert published or off <= found.estimated + 1e-9 * abs(found.exact)


def test_the_study_gives_three_numbers_a_case():
    result = run(Parameters(cases=("ziegler", "truss")))
    assert result.status == "OK"
    assert result.metrics["ziegler.value"].value == pytest.approx(result.metrics["ziegler.exact"].value, rel=1e-9)
    assert set(result.metrics) == {f"{name}.{key}" for name in ("ziegler", "truss") for key in ("value", "exact", "estimated")}
    assert figure(result).axes


@pytest.mark.slow
def test_frames_turn_where_is_published():
    found = {name: CASES[name]().value for name in ("lee_limit_1", "lee_limit_2", "deep_arch_limit_1")}
    found["deep_arch_limit_1"] /= (np.radians(215) / 2) ** 2
    assert list(found.values()) == pytest.approx([18.55, -9.39, 8.97], rel=5e-4)


def test_the_koiter_roorda_frame_has_no_limit_on_the_other_side():
    frame = frames.roorda(0.01)
    assert list(frame.chain.critical()) == path(frame.mechanism, to=frame.chain.to).points == []
