"""The column under constant speed compression: its equations against Airy functions, its limits, wrong input."""

import numpy as np
import pytest

from buckler.elastica.hoff import Hoff


@pytest.mark.parametrize("perfect", [False, True])
@pytest.mark.parametrize("rate", [0.01, 1.0, 100.0])
def test_small_bows_peak_as_the_airy_functions_say(rate, perfect):
    """An integrator on the full equations; closed form while the bow does not yet lower the force."""
    column = Hoff(rate, 1e-4, perfect)
    assert column.peak_airy() == pytest.approx(column.peak(), rel=1e-3)


def test_the_closed_form_gets_better_as_the_bow_gets_smaller():
    errors = [abs(Hoff(1.0, bow).peak_airy().force / Hoff(1.0, bow).peak().force - 1) for bow in (0.1, 0.01, 1e-3)]
    assert (np.diff(errors) < 0).all() and errors[-1] < 1e-3


def test_slow_compression_measures_the_critical_load():
    """The slower, the nearer to Euler's load; a bow of a radius of gyration never reaches it."""
    peaks = [Hoff(rate, 1e-3).peak().force for rate in (0.1, 0.01, 1e-3)]
    assert (np.diff(peaks) < 0).all() and peaks[-1] == pytest.approx(1.0, abs=0.02)
    assert Hoff(1e-3, 1.0).peak().force < 0.9


def test_peak_is_the_first_maximum_of_the_motion():
    column = Hoff(0.3, 0.02)
    tau, _, force = column.motion(30.0, 30_001)
    top = int(np.argmax(np.diff(force) < 0))
    assert (tau[top], force[top]) == pytest.approx(column.peak(), rel=1e-4)


def test_a_perfect_column_without_forcing_strikes_harder():
    """A deflection at the start is no bow: nothing drives it until the critical load is passed."""
    assert Hoff(0.1, 0.01, perfect=True).peak().force > 1.2 * Hoff(0.1, 0.01).peak().force


@pytest.mark.parametrize(
    ("rate", "bow", "name"), [(0.0, 0.1, "rate"), (-1.0, 0.1, "rate"), (1.0, 0.0, "bow"), (1.0, np.nan, "bow")]
)
def test_wrong_input_is_named(rate, bow, name):
    with pytest.raises(ValueError, match=f"{name} = .*: must be positive and finite"):
        Hoff(rate, bow)
