"""A cantilever that rings.

A steel strip is clamped at one end; a force at the other sets in at once and stays. The tip rings
about the static deflection F L^3/(3 E I), with the period of Euler and Bernoulli's first mode.
"""

from math import pi, sqrt

import numpy as np

from buckler.mbs import Beam, Force, Link, Mechanism, Section, Weld, simulate

length, force = 0.3, 0.5
strip = Section(width=0.020, thickness=0.002).damped(0.01, length)
mechanism = Mechanism(
    points={"A": (0, 0), "B": (length, 0)},
    links=[Link("strip", "A", "B", Beam(strip, elements=6))],
    joints=[Weld("A", "ground", "strip")],
    loads=[Force("B", (0.0, -force))],
)
period = 2 * pi / (1.8751**2 * sqrt(strip.bending_stiffness / (strip.mass_per_length * length**4)))
result = simulate(mechanism, duration=4 * period)

sag = -np.trapezoid(result.signals["B.y"], result.time) / result.time[-1]
exact = force * length**3 / (3 * strip.bending_stiffness)
print(f"mean deflection over four periods {1e3 * sag:.4f} mm; static {1e3 * exact:.4f} mm")
assert abs(sag / exact - 1) < 1e-2
