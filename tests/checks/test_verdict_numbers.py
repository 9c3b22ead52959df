"""Numbers that decide verdicts outside the self-checks, each held from both sides: moved tenfold either way, a test fails."""

import numpy as np
import pytest

from buckler.mbs import Rigid, Section, crank_rocker, simulate
from buckler.studies.extremes.verdict import KINDS, compare
from buckler.studies.striking import thickness_speed
from buckler.studies.striking.inverse import Given, Wish, design, limits

ALLOWED = {
    "force": (0.04, 0.06), "impulse": (0.04, 0.06), "place": (0.8e-3, 1.2e-3), "path": (4e-3, 6e-3),
    "journal": (0.08, 0.12),
}  # fmt: skip
"""Errors that the study of extremes lets pass, and does not, of the scale."""


@pytest.mark.parametrize("kind", KINDS)
def test_what_the_study_of_extremes_allows(kind):
    fine, wrong = ALLOWED[kind]
    right = {kind: np.array([2.0, 2.0])}
    assert compare({kind: np.array([2.0, 2.0]) * (1 + fine)}, right, {})[0] < 1
    assert compare({kind: np.array([2.0, 2.0]) * (1 + wrong)}, right, {})[0] > 1


def test_a_turn_that_closure_answers_has_four_hundred_samples():
    bar = Rigid(Section(0.005, 0.020))
    result = simulate(crank_rocker(bar, speed=30.0), 2 * np.pi / 30)
    assert 300 < len(result.time) < 500


LIMITS = {
    "compression on the way over the Euler load": (0.7, 0.9), "push of the strip over the impact's strength": (0.35, 0.45),
}  # fmt: skip


@pytest.mark.parametrize("what", LIMITS)
def test_what_a_design_may_use(what):
    fine, wrong = LIMITS[what]
    (limit,) = [each for each in limits(design(Wish(2.0, 30.0, np.radians(120.0)), Given())) if each.what == what]
    assert limit._replace(value=fine).use < 1 < limit._replace(value=wrong).use


@pytest.mark.parametrize(("off", "named"), [(1.5e-3, False), (3e-3, True)])
def test_a_cube_that_is_none(off, named):
    """Forces of three thicknesses at the slow speed, the last one off the cube."""
    p = thickness_speed.Parameters(models="strut", thicknesses="0.1mm,0.2mm,0.3mm", speeds="1")
    forces = np.array([[1.0], [8.0], [27.0 * (1 + off)]]) * np.ones(2)
    same = {"force": forces, "exact": forces, "impact": forces, "state": np.full(forces.shape, "pressed")}
    wrong = thickness_speed._off_the_cube(p, thickness_speed._metrics(p, same))
    assert [text.startswith("0.3mm at 0.1 rad/s: ratio") for text in wrong] == [True] * named
