"""Published numbers with which studies are compared or calibrated, with their sources.

Compliant slider-crank: B. Demirel et al., Compliant Impact Generator for Required Impact and Contact Force, 2008,
doi 10.1115/IMECE2008-68796; its lengths are `buckler.mbs.library.PAPER`. Crank-rocker with clearance joints, of unknown
authors: its lengths are `buckler.mbs.library.STEEL_CRANK_ROCKER`, its contact laws `RATTLING` and `CLOSED` of that module.
"""

from buckler.mbs.library import BAR, RATTLING

STRIP_WIDTH = 0.030
"""Width of the strip [m] (Table 1)."""
CONTACT_FORCES = {1e-4: 0.0655, 3e-4: 1.7684, 5e-4: 8.1871}
"""Largest contact force [N] by strip thickness [m] (Table 2)."""
IMPACT_SPEED = 1.25
"""Constant speed of the crank [rad/s] (Fig. 5)."""
IMPACT_FORCE = 27.0
"""Largest impact force at `IMPACT_SPEED` [N] (Fig. 5)."""
VOLTAGE_FORCES = {2.5: 25.0, 3.0: 30.0}
"""Largest impact force [N] by voltage of the motor [V], read from Figs 10 and 11."""
SENSOR_VOLTAGE = 4.4
"""Highest voltage of the motor [V]."""
SENSOR_RANGE = 44.18
"""Range of the force sensor [N]: an upper bound of the impact force at the highest voltage, not a measured value."""
GRAVITY = 9.81
"""Acceleration of gravity [m/s^2], the value of the papers."""

STEEL = BAR.material
"""Material of the bars of the crank-rocker."""
CONTACT_DAMPING = RATTLING.damping
"""Largest contact damping c_max as printed; its unit is one of `DAMPING_UNITS`."""
DAMPING_UNITS = {"N.s/m": 1.0, "N.s/mm": 1e3}
"""Readings of the printed unit "N×S/m" of c_max, and the size of each in N s/m."""
