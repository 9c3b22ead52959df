"""Published numbers with which studies are compared or calibrated, with their sources.

Compliant slider-crank: B. Demirel et al., Compliant Impact Generator for Required Impact and Contact Force, 2008,
doi 10.1115/IMECE2008-68796; its lengths are `buckler.mbs.library.PAPER`. Crank-rocker with clearance joints: its lengths are
`buckler.mbs.library.STEEL_CRANK_ROCKER`, its contact laws `RATTLING` and `CLOSED` of the same.
"""

from __future__ import annotations

from buckler.mbs.library import BAR, RATTLING

# --- the compliant slider-crank ---------------------------------------------------------------------------------------

STRIP_WIDTH = 0.030
"""Width of the strip [m] (Table 1)."""
CONTACT_FORCES = {1e-4: 0.0655, 3e-4: 1.7684, 5e-4: 8.1871}
"""Largest contact force [N] by strip thickness [m] (Table 2)."""
IMPACT_SPEED = 1.25
"""Crank speed of the impact [rad/s] (Fig. 5)."""
IMPACT_FORCE = 27.0
"""Impact force at that speed [N] (Fig. 5)."""
VOLTAGE_FORCES = {2.5: 25.0, 3.0: 30.0}
"""Impact force [N] by voltage of the motor [V], read from Figs 10 and 11."""
SENSOR_VOLTAGE = 4.4
"""Highest voltage [V]."""
SENSOR_RANGE = 44.18
"""Range of the force sensor [N]: a bound of the force at the highest voltage, no reading."""
GRAVITY = 9.81
"""Gravity [m/s^2], as in the papers."""

# --- the crank-rocker with clearance joints ---------------------------------------------------------------------------

STEEL = BAR.material
BAR_AREA = BAR.width * BAR.thickness
"""Area of the bars' section [m^2]."""
CONTACT_DAMPING = RATTLING.damping
"""Largest contact damping c_max, in one of `DAMPING_UNITS`."""
DAMPING_UNITS = {"N.s/m": 1.0, "N.s/mm": 1e3}
"""Interpretations of the printed unit "N×S/m" of c_max [N s/m]."""
