"""Parameters of a study: ranges, and what is said of wrong ones."""

import math
import re

import numpy as np
import pytest
from made_up_study import Parameters


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"thickness": "2cm"}, "thickness = 2cm: must lie in [1e-05, 0.01] m"),
        ({"thickness": "3kg"}, "thickness = 3kg: must be in m"),
        ({"thickness": math.nan}, "thickness = nan m: must lie in [1e-05, 0.01] m"),
        ({"thickness": True}, "thickness = true: must be a number, or one with a unit"),
        ({"speed": "1e999"}, "speed = inf rad/s: must lie in [-100, 100] rad/s"),
        ({"elements": 8.5}, "elements = 8.5: must be a whole number in [1, 64]"),
        ({"models": "strut,shell"}, "models[1] = 'shell': must be one of 'stitched', "),
        ({"models": "beam,beam"}, "models = ('beam', 'beam'): must not contain an item twice"),
        ({"ending": "sad"}, "ending = 'sad': must be one of 'fine', 'suspect', 'raises'"),
        ({"widths": (0.03, 5)}, "widths[1] = 5 m: must lie in [0.001, 1] m"),
        ({"elements": 13, "thickness": "2mm"}, "elements = 13: not with a thickness above 0.001 m"),
    ],
)
def test_wrong_parameters_name_value_range_and_unit(given, message):
    with pytest.raises(ValueError, match=f"^{re.escape(message)}"):
        Parameters(**given)


def test_parameters_read_numbers_strings_and_arrays():
    made = Parameters(thickness="0.3mm", widths=np.array([0.01, 0.02]), elements=np.int64(4), models="beam, strut")
    assert (made.thickness, made.widths, made.elements) == (3e-4, (0.01, 0.02), 4)
    assert made.models == ("beam", "strut")
    assert made == Parameters(thickness=3e-4, widths="1cm,20mm", elements="4", models=["beam", "strut"])
