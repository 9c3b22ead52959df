"""A dwell six-bar with a motor.

While the crank turns by 100 degrees a point of the coupler runs an arc about the end of the output,
which rests meanwhile. A motor runs the linkage up from rest; the mechanism is the example file
`dwell-six-bar`, and the places of its points follow from two intersections of circles.
"""

from importlib.resources import files

import numpy as np

from buckler.mbs import Mechanism, simulate

mechanism = Mechanism.load(files("buckler.studies.own.examples").joinpath("dwell-six-bar.toml"))
result = simulate(mechanism, duration=0.6)
crank, output = result.signals["crank.angle"], result.signals["output.angle"]


def meet(p, long, q, short):
    """Return the points at these distances from p and q, to the left of the way from p to q."""
    way = q - p
    along = (long**2 - short**2 + abs(way) ** 2) / (2 * abs(way))
    return p + way / abs(way) * (along + 1j * np.sqrt(long**2 - along**2))


r = 0.05  # complex numbers stand for places in the plane
a = r * np.exp(1j * (np.pi / 2 + crank))  # `angle` is that since the start
b = meet(a, 2.5 * r, 2 * r, 2.5 * r)
p = a + (b - a) * (1 - np.exp(-0.4j * np.pi))  # at the distance of A from B, 72 degrees from it
f = r * (3.08805 + 0.952959j)
d = meet(f, 2.4 * r, p, 3.157683 * r)
exact = np.unwrap(np.angle((d - f) / (d - f)[0]))

turn = np.linspace(crank[-1] - 2 * np.pi, crank[-1], 361)
angle = np.interp(turn, crank, output)
dwell = min(np.ptp(angle[k : k + 101]) for k in range(260))
print(f"output: {np.degrees(np.ptp(angle)):.1f} degrees in a turn, {np.degrees(dwell):.2f} in 100 degrees of it")
print(f"farthest from the rigid linkage: {np.degrees(abs(output - exact).max()):.3f} degrees")
assert abs(output - exact).max() < np.radians(0.1) and np.degrees(dwell) < 0.5
