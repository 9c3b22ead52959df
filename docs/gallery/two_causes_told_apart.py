"""A force with two causes told apart.

Impact forces of 25 N and 30 N were measured at 2.5 V and 3 V; the sensor ends at 44.2 N, which bounds the
force at 4.4 V. A stop of some stiffness may explain them alone, or with a bow of the strip. `fit` finds the
best numbers of both causes: no stop brings the straight strip within 1 N of both readings, a bow does.
"""

from math import pi

import numpy as np

from buckler.mbs import Beam, Controlled, GuideFriction, Section, Spectral, fit, simulate, slider_crank
from buckler.mbs.laws import CarvalhoMartins
from buckler.mbs.sensitivity.data import Experiment, Read

LENGTH, SPEED_PER_VOLT, PEAK = 0.310, 1.25 / 2.7, "peak(B.contact_force, 1)"
READINGS = {2.5: Read(25.0, 1.0), 3.0: Read(30.0, 1.0), 4.4: Read(44.18, 1.0, "at most")}


def mechanism(stiffness, voltage, bow=1e-4):
    """Slider-crank with a stop [kN/m], its strip bowed by a share of its length to the side of its inertia."""
    strip = Section(0.030, 0.3e-3).damped(0.05, LENGTH)
    return slider_crank(
        Beam(strip, elements=8, imperfection=-bow * LENGTH),
        law=CarvalhoMartins(1e3 * stiffness, 0.8, exponent=1.0),
        mass=0.3,
        speed=SPEED_PER_VOLT * voltage,
        friction=GuideFriction(0.294),
    )


def experiment(voltage, reading):
    """Run until the first impact is over, at a crank angle of 135 degrees."""
    return Experiment(readings={PEAK: reading}, settings={"voltage": voltage}, duration=3 / 4 * pi / SPEED_PER_VOLT / voltage)


measured = [experiment(voltage, reading) for voltage, reading in READINGS.items()]
causes = {"stop alone": {"stiffness": (1.0, 20.0)}, "stop and bow": {"stiffness": (5.0, 100.0), "bow": (3e-3, 0.03)}}
off = {}
for cause, free in causes.items():
    found = fit(mechanism, measured, free=free, starts=1, solver=Spectral(Controlled(1e-5)))
    forces = [said[PEAK] for said in found.predicted]
    off[cause] = np.abs(np.array(forces[:2]) - (25.0, 30.0)).max()
    values = ", ".join(f"{name} {value:.3g}" for name, value in found.values.items())
    print(f"{cause}: {values}; forces", *(f"{force:.1f} N" for force in forces))
assert off["stop alone"] > 1.05 and off["stop and bow"] < 0.5 and forces[2] < 45.0

result = simulate(mechanism(voltage=3.0, **found.values), duration=pi / SPEED_PER_VOLT / 3.0)
assert abs(result.signals["B.contact_force"].max() - 30.0) < 1.0
