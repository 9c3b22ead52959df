"""Published numbers that studies are held against or calibrated on: each stands here, once, with its source.

The compliant slider-crank: B. Demirel et al., Compliant Impact Generator for Required Impact and Contact Force, 2008,
doi 10.1115/IMECE2008-68796; its lengths are `buckler.mbs.library.PAPER`. The crank-rocker with clearance joints: its lengths are
`buckler.mbs.library.STEEL_CRANK_ROCKER`, its contact laws `RATTLING` and `CLOSED` of the same.
"""

from __future__ import annotations

from buckler.mbs import Material
from buckler.mbs.library import PAPER_STIFFNESS

# --- the compliant slider-crank ---------------------------------------------------------------------------------------

STRIP_WIDTH = 0.030
"""Of the strip, m (Table 1)."""
CONTACT_FORCES = {1e-4: 0.0655, 3e-4: 1.7684, 5e-4: 8.1871}
"""Largest contact force, N, of a strip thickness, m (Table 2)."""
IMPACT_SPEED, IMPACT_FORCE = 1.25, 27.0
"""Crank speed, rad/s, and impact force, N (Fig. 5)."""
VOLTAGE_FORCES = {2.5: 25.0, 3.0: 30.0}
"""Impact force, N, at a voltage of the motor, V: read from Figs 10 and 11."""
SENSOR_VOLTAGE, SENSOR_RANGE = 4.4, 44.18
"""Highest voltage, V, and the range of the force sensor, N: a bound of the force there, no reading."""
GRAVITY = 9.81
"""m/s^2, as the papers have it."""
# --- the crank-rocker with clearance joints ---------------------------------------------------------------------------

STEEL = Material(modulus=207e9, density=7850.0, poisson=0.29)
BAR_AREA = 0.020 * 0.005
"""Of the bars' section, m^2."""
CONTACT_STIFFNESS = PAPER_STIFFNESS
"""K, N/m^1.5: 2.53e5 "N/mm", read as N/mm^1.5."""
CONTACT_DAMPING = 253.0
"""Largest contact damping c_max, in one of `DAMPING_UNITS`."""
DAMPING_UNITS = {"N.s/m": 1.0, "N.s/mm": 1e3}
"""Readings of the printed unit "N×S/m" of c_max, each in N s/m."""
