"""What the check of the branch is made of, against closed forms."""

import numpy as np
import pytest

from buckler.mbs import Section
from buckler.mbs.checks.unbuckled import grown, recent_mean, resistance

TIME = np.linspace(1.0, 5.0, 4001)


def test_a_disturbance_grows_only_while_the_load_is_beyond_critical_and_starts_anew_each_time():
    """At 1.25 critical loads the rate is half the frequency."""
    loaded = np.where((TIME > 2) & (TIME <= 3) | (TIME > 4), 1.25, 0.9)
    found = np.interp([2.0, 2.5, 3.5, 4.4, 5.0], TIME, grown(TIME, loaded, 8.0))
    assert found == pytest.approx([0, 2, 0, 1.6, 4], abs=0.01)


def test_the_mean_looks_back_by_its_span_and_not_before_the_start():
    found = np.interp([1.0, 1.3, 3.0, 5.0], TIME, recent_mean(TIME, 2 * TIME, 1.0))
    assert found == pytest.approx([2.0, 2.3, 5.0, 9.0], abs=1e-9)


@pytest.mark.parametrize(("clamped", "wave", "pressed"), [(0, np.pi, np.pi), (1, 3.9266, 4.4934), (2, 4.7300, 2 * np.pi)])
def test_clamped_ends_raise_frequency_and_critical_load(clamped, wave, pressed):
    """The frequency is wave^2 sqrt(E I/(m L^4)), the load pressed^2 E I/L^2."""
    section, length = Section(0.02, 0.001), 0.4
    frequency, critical = resistance(section, length, clamped)
    assert critical == pytest.approx(pressed**2 * section.bending_stiffness / length**2, rel=1e-4)
    exact = wave**2 * np.sqrt(section.bending_stiffness / section.mass_per_length) / length**2
    assert 0.87 * exact < frequency < 1.001 * exact
