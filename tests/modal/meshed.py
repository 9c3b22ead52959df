"""Solid bars and their modes."""

import pytest

pytest.importorskip("skfem")
from buckler.mbs.elements.section import Material, Section
from buckler.mbs.modal.mesh import bar_grid
from buckler.mbs.modal.solid import assemble

STEEL = Material(modulus=207e9, density=7850.0, poisson=0.29)
LENGTH, WIDE, THIN = 0.175, 0.020, 0.005
FLAT = Section(width=WIDE, thickness=THIN, material=STEEL)  # bends over its 5 mm
TALL = Section(width=THIN, thickness=WIDE, material=STEEL)  # bends over its 20 mm


def solid_bar(depth, width, elements, material=STEEL):
    """Matrices of a bar of hexahedra."""
    return assemble(bar_grid(LENGTH, depth, width, elements), LENGTH, material)
