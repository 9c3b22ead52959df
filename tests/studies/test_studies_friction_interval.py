"""Force on the stop that dry friction leaves open: the interval by virtual work."""

import numpy as np
import pytest
from scipy.optimize import linprog

from buckler.studies.strips import contact_force_table
from buckler.studies.strips.contact_force_table import friction_interval

EXACT = 1.7246507


@pytest.mark.parametrize(("push", "limit"), [(1.7, 0.3), (0.2, 0.3), (8.0, 0.0)])
def test_interval_is_all_that_equilibrium_allows(push, limit):
    """Push, friction within its limit and a stop that only presses: extremes of the stop's force by linear programming."""
    ends = []
    for sign in (1, -1):
        found = linprog([sign, 0], A_eq=[[1, -1]], b_eq=[push], bounds=[(0, None), (-limit, limit)])
        ends.append(found.x[0])
    np.testing.assert_allclose(friction_interval(push, limit), ends, atol=1e-9)


def test_rows_of_the_study():
    result = contact_force_table.run(contact_force_table.Parameters(thicknesses=3e-4, elements=4, angles=3))
    low, high = (result.metrics[f"friction_h0.3.{end}"].value for end in ("low", "high"))
    assert (high - low) / 2 == pytest.approx(0.15 * 0.3 * 9.81) and (high + low) / 2 == pytest.approx(EXACT, rel=1e-6)
