"""A compliant gripper.

Two strips that are clamped to the ground carry the jaws. A slider pulls them together until they grip a free
block, and then bends the strips into an S. The grip follows from the shape of the exact elastica between the
clamp and the jaw, found by shooting. The mechanism is the example file `gripper`.
"""

from importlib.resources import files

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve

from buckler.mbs import Mechanism, simulate

mechanism = Mechanism.load(files("buckler.studies.own.examples").joinpath("gripper.toml"))
result = simulate(mechanism, duration=0.3)

rest = np.linspace(0.25, 0.3, 2001)  # the slider has stopped
names = ("J1.contact_force", "J2.contact_force", "F1.x", "F1.y", "J1.x", "jaw1.angle")
grip, other, x, y, jaw_x, turn = (result.at(name, rest).mean() for name in names)

link = mechanism.link("flex1")
stiffness, length = link.body.section.bending_stiffness, mechanism.length("flex1")
start = mechanism.points["G1"]


def shape(unknown):
    """Return place, angle and curvature along the strip, of its curvature at the clamp and its two inner forces."""
    bend, fx, fy = unknown

    def rates(_, state):
        angle, curvature = state[2:]
        return np.cos(angle), np.sin(angle), curvature, (fx * np.sin(angle) - fy * np.cos(angle)) / stiffness

    return solve_ivp(rates, (0, length), [*start, 0.0, bend], rtol=1e-9, atol=1e-12).y[:, -1]


end = shape(fsolve(lambda unknown: shape(unknown)[:3] - (x, y, turn), [0.0, 0.0, 0.0]))
exact = stiffness * end[3] / (jaw_x - x)  # moments about F1
print(f"grip {grip:.3f} N and {other:.3f} N; exact elastica {exact:.3f} N")
assert abs(grip / exact - 1) < 0.02 and abs(grip / other - 1) < 1e-2
