"""A crank-rocker that rattles.

The joint between coupler and rocker has a radial clearance of 0.5 mm; its pin flies and strikes.
Whatever it does, the pull of the ground and the weight change the momentum of the links by exactly
their impulse.
"""

from dataclasses import replace
from math import pi

import numpy as np

from buckler.mbs import Clearance, Revolute, Rigid, Section, crank_rocker, simulate
from buckler.mbs.laws import LankaraniNikravesh

gap = 5e-4


def joint(point, first, second):
    if point != "B":
        return Revolute(point, first, second)
    return Clearance(point, first, second, pin=5e-3, gap=gap, law=LankaraniNikravesh(1e9, 0.9))


mechanism = replace(crank_rocker(Rigid(Section(0.02, 0.005)), speed=20.0, play=joint), gravity=(0.0, -9.81))
result = simulate(mechanism, duration=2 * pi / 20.0)

time, signals = result.time, result.signals
masses = {link.name: link.mass(mechanism.length(link.name)) for link in mechanism.links}
momentum = sum(mass * signals[f"{name}.vy"] for name, mass in masses.items())
pull = signals["O.ground-crank.fy"] + signals["C.ground-rocker.fy"]
impulse = np.trapezoid(pull, time) - 9.81 * sum(masses.values()) * time[-1]
change = momentum[-1] - momentum[0]
contacts = signals["B.contacts"][-1]
print(f"{contacts:.0f} contacts; impulse {impulse:.5f} N s; change of momentum {change:.5f} N s")
assert abs(impulse - change) < 2e-2 * np.ptp(momentum)
off = np.hypot(signals["B.journal_x"], signals["B.journal_y"]).max()
assert off <= gap + signals["B.penetration"].max() + 1e-12
