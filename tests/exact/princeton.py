"""Princeton beam bent in its plane about the thin side, as an exact elastica: clamped, with a dead force across its tip.

E. H. Dowell, J. Traybar, An experimental study of the nonlinear stiffness of a rotor blade undergoing flap, lag and twist
deformations, AMS Reports 1194 and 1257, Princeton University, 1975. O. A. Bauchau et al., Validation of flexible multibody
dynamics beam formulations using benchmark problems, doi 10.1007/s11044-016-9514-y. L. Obrezkov, A. Mikkola, M. K. Matikainen,
Performance review of locking alleviation methods for continuum ANCF beam elements, doi 10.1007/s11071-022-07518-z (beam
elements of a commercial code: the published tips).
"""

from __future__ import annotations

import numpy as np

from buckler.elastica.strip import Load, Strip

LENGTH, WIDTH, THICKNESS = 0.508, 12.3777e-3, 3.2024e-3
"""m; it bends across its thickness."""
MODULUS, POISSON = 71.7e9, 0.31
"""Aluminium 7075, Pa."""
LOADS = (4.448, 8.896, 13.345)
"""N."""


def tip(load: float, shear: bool = True) -> tuple[float, float]:
    """Displacements of the tip along the beam (towards the clamp) and across, m; Cowper's shear factor."""
    area, second = WIDTH * THICKNESS, WIDTH * THICKNESS**3 / 12.0
    k = 10.0 * (1.0 + POISSON) / (12.0 + 11.0 * POISSON)
    unit = MODULUS * second / LENGTH**2
    soft = k * MODULUS / (2.0 * (1.0 + POISSON)) * area / unit if shear else np.inf
    x, y, _ = Strip(axial=MODULUS * area / unit, shear=soft).equilibrium(Load(end=(0.0, -load / unit))).end
    return LENGTH * (1.0 - x), -LENGTH * y
