"""Force on the stop that dry friction leaves open: the interval by virtual work, laws within it, its limits."""

import numpy as np
import pytest
from scipy.optimize import linprog

from buckler.mbs.laws import Coulomb, LuGre
from buckler.studies.strips import contact_force_table
from buckler.studies.strips.contact_force_table import Pressed, friction_interval, laws

SLIDER = Pressed(0.014175)
EXACT = 1.7246507
FROM = np.radians(150.0)


@pytest.mark.parametrize(("push", "limit"), [(1.7, 0.3), (0.2, 0.3), (8.0, 0.0)])
def test_interval_is_all_that_equilibrium_allows(push, limit):
    """Push, friction within its limit and a stop that only presses: extremes of the stop's force by linear programming."""
    ends = []
    for sign in (1, -1):
        found = linprog([sign, 0], A_eq=[[1, -1]], b_eq=[push], bounds=[(0, None), (-limit, limit)])
        ends.append(found.x[0])
    np.testing.assert_allclose(friction_interval(push, limit), ends, atol=1e-9)


def test_without_friction_the_elastica_decides():
    assert float(SLIDER.push(np.pi)) == pytest.approx(EXACT, rel=1e-6)
    assert SLIDER.settle(Coulomb(0.0, 1e-3), FROM, np.pi) == pytest.approx(EXACT, rel=1e-4)  # the stop gives way by 24 um


def test_a_regularised_law_forgets_by_creeping_and_carries_what_its_speed_says():
    """Fast regularisation: the drag of the creep, mu N F'/(K v); slow: all of the friction, against the last motion."""
    creep = float(SLIDER.push(np.pi) - SLIDER.push(np.pi - 1e-3)) / 1e-3 * 1.25 / 7.2e4
    wanted = EXACT - 0.1 * SLIDER.weight * creep / 1e-3
    assert SLIDER.settle(Coulomb(0.1, 1e-3), FROM, np.pi, -1.0) == pytest.approx(wanted, rel=2e-4)
    low, _ = friction_interval(EXACT, 0.1 * SLIDER.weight)
    assert SLIDER.settle(Coulomb(0.1, 1e-7), FROM, np.pi, 1.0) == pytest.approx(low, rel=1e-2)


@pytest.mark.parametrize("name", laws(0.15, 0.1))
def test_every_law_ends_within_the_interval_and_remembers_in_order(name):
    low, high = friction_interval(EXACT, 0.15 * SLIDER.weight)
    forces = [SLIDER.settle(laws(0.15, 0.1)[name], FROM, np.pi, held) for held in (1.0, 0.0, -1.0)]
    assert low - 1e-3 <= forces[0] <= forces[1] + 1e-6 <= forces[2] + 2e-6 <= high + 1e-3
    assert (forces[2] - forces[0] > 0.2) == (name != "regularised_1e-3")


def test_a_stop_does_not_pull():
    """The 0.1 mm strip pushes by less than friction can hold: held off, its slider rests without a force on the stop."""
    thin = Pressed(0.014175 / 27)
    low, high = friction_interval(thin.push(np.pi), 0.1 * thin.weight)
    assert low == 0.0
    for held in (1.0, 0.0, -1.0):
        assert 0.0 <= thin.settle(Coulomb(0.1, 1e-6), FROM, np.pi, held) <= high + 1e-3


def test_stiff_bristles_stick():
    """Pressed by less than the bristles can hold, the stop's force hardly changes: they carry the strip's."""
    stiff = LuGre(0.5, 0.5, 1e-4, bristle_stiffness=1e8, bristle_damping=1e4)
    begun = float(SLIDER.push(FROM))
    assert SLIDER.settle(stiff, FROM, np.pi) == pytest.approx(begun, rel=0.01) and begun < 0.93 * EXACT


def test_rows_of_the_study():
    result = contact_force_table.run(contact_force_table.Parameters(thicknesses=3e-4, elements=4, angles=3))
    low, high = (result.metrics[f"friction_h0.3.{end}"].value for end in ("low", "high"))
    assert (high - low) / 2 == pytest.approx(0.15 * 0.3 * 9.81) and (high + low) / 2 == pytest.approx(EXACT, rel=1e-6)
    assert result.metrics["friction_h0.3.lugre.fresh"].exact == pytest.approx(EXACT, rel=1e-6)
    assert "The interval is the answer" in str(result)
    with pytest.raises(ValueError, match="static_friction"):
        contact_force_table.Parameters(static_friction=0.05)
