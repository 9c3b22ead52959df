"""Gravity's flip: the grid reaches the modes, indices add up, and a small run gives its numbers."""

import numpy as np
import pytest

pytest.importorskip("numba")

from buckler.studies.rattling import gravity_flip
from buckler.studies.rattling.bars import flexible
from buckler.studies.rattling.mode_sets import LENGTH
from buckler.studies.rattling.worlds import ASSUMPTIONS, drawn


def test_a_case_has_the_modes_it_names():
    p = gravity_flip.Parameters()
    plain, raised, few, euler = (
        flexible(p.case(*case, 9.81)).frequencies(LENGTH)
        for case in (
            ("Timoshenko", "3 + 1", 1.0),
            ("Timoshenko", "3 + 1", 1.1),
            ("Timoshenko", "2 + 1", 1.0),
            ("Euler-Bernoulli", "3 + 1", 1.0),
        )
    )
    assert raised == pytest.approx(1.1 * plain, rel=1e-9)
    assert len(few) == 3 and len(plain) == 4
    assert euler[0] / plain[0] > 1.02 and euler[-1] == pytest.approx(plain[-1], rel=1e-9)  # bending by shear; axial alike


def test_indices_are_shares_of_the_variance():
    p = gravity_flip.Parameters()
    theory, count, factor = np.meshgrid([0, 1], [0, 1, 2], [-1, 0, 1], indexing="ij")
    added = (3.0 * theory + 0.5 * count + 0.1 * factor).ravel()
    indices = gravity_flip.sobol(p, added)
    assert sum(indices) == pytest.approx(1, abs=1e-12)  # no interaction
    parts = np.array([9 / 4, 0.25 * 2 / 3, 0.01 * 2 / 3])
    assert indices == pytest.approx(parts / parts.sum(), abs=1e-12)
    assert sum(gravity_flip.sobol(p, (theory * factor).ravel().astype(float))) < 0.8


def test_worlds_vary_theory_number_and_frequency_of_the_modes():
    names = {assumption.name for assumption in ASSUMPTIONS}
    assert {"modes", "number of modes", "rocker's frequency"} <= names
    cases = drawn(16, 0).cases
    assert {case.modes_of for case in cases} == {"free", "Euler-Bernoulli", "Craig-Bampton"}
    assert {(case.bending, case.axial) for case in cases} == {(2, 1), (3, 1), (6, 3)}
    assert all(0.9 <= case.frequency_factor <= 1.1 for case in cases)


@pytest.mark.slow
def test_a_small_grid_tells_sampling_and_model_apart():
    given = {"theories": "Timoshenko", "counts": "3 + 1", "factors": "0.9,1.1", "members": 2}
    result = gravity_flip.run(gravity_flip.Parameters(**given))
    assert result.status == "OK", result.message
    value = {name: metric.value for name, metric in result.metrics.items()}
    assert value["lowest.without"] > 0.4 and value["highest.without"] < 0.8
    assert value["decided_by.frequency"] == pytest.approx(1)
    assert value["sampling"] > 0 and len(gravity_flip.figure(result).axes) == 2
