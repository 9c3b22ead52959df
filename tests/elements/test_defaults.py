"""What stands for a number that is not given: to change one changes every mechanism that leaves it out."""

from dataclasses import MISSING, fields

import numpy as np
import pytest

from buckler.mbs import elements, laws
from buckler.mbs.elements.modal import BarModes, Box, CraigBampton, FreeModes, MeshFile, Modal

DEFAULTS = {
    laws.AdamsFriction: {"v_s": 0.1, "v_d": 1.0},
    laws.Coulomb: {"v_reg": 1e-3, "viscous": 0.0},
    laws.Stribeck: {"exponent": 2.0, "v_reg": 1e-3, "viscous": 0.0},
    laws.Stiction: {"v_stribeck": 1e-2, "bristle_stiffness": 1e5, "bristle_damping": 0.0, "viscous": 0.0},
    laws.LuGre: {"bristle_stiffness": 1e5, "bristle_damping": 0.0, "viscous": 0.0},
    laws.HuntCrossley: {"exponent": 1.5},
    laws.Impact: {"exponent": 1.5},
    elements.AdamsDamping: {"low": 0.01, "middle": 0.1, "high": 1.0},
    elements.Beam: {"elements": None, "nodes": 3, "imperfection": 0.0, "shape": None},
    elements.Guide: {"along": (1.0, 0.0), "mass": 0.0, "friction": None},
    elements.GuideFriction: {"static": None, "viscous": 0.0, "regularisation": 1e-3, "stribeck": 1e-2},
    elements.Material: {"poisson": 0.3, "bending_damping": 0.0, "axial_damping": 0.0},
    elements.Motor: {"inertia": 0.0, "gear": 1.0, "friction": 0.0, "dead_band": 0.0},
    Box: {"elements": (16, 2, 1)},
    CraigBampton: {"numbers": None, "fixed": 12, "counting": "flexible"},
    MeshFile: {"normal": (0.0, 0.0, 1.0), "scale": 1.0},
    Modal: {"damping": 0.01, "order": 2},
}


@pytest.mark.parametrize("kind", DEFAULTS, ids=lambda kind: kind.__name__)
def test_a_default(kind):
    found = {field.name: field.default for field in fields(kind) if field.default is not MISSING}
    assert {name: found[name] for name in DEFAULTS[kind]} == DEFAULTS[kind]


def test_damping_of_modes_up_to_its_largest():
    section = elements.Section(0.02, 5e-3)
    assert Modal(section, BarModes(1), damping=10.0).damping == 10.0
    with pytest.raises(ValueError, match=r"damping = 10\.1"):
        Modal(section, BarModes(1), damping=10.1)
    np.testing.assert_array_equal(elements.AdamsDamping().ratios([99.0, 100.0, 1000.0, 1001.0]), [0.01, 0.1, 0.1, 1.0])


def test_modes_by_numbers_up_to_a_thousand():
    assert FreeModes((1000,)).numbers == (1000,)
    with pytest.raises(ValueError, match=r"numbers\[0\] = 1001"):
        FreeModes((1001,))
