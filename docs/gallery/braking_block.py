"""A block that friction brakes.

A block slides along a level guide under its own weight, with Coulomb friction from the guide's own
reaction. It stops after v^2/(2 mu g), and stays.
"""

from buckler.mbs import Guide, Link, Mechanism, Rigid, simulate
from buckler.mbs.laws import Stiction

friction, speed = 0.2, 1.0
law = Stiction(static=friction, dynamic=friction)
mechanism = Mechanism(
    points={"A": (0, 0), "B": (0.1, 0)},
    links=[Link("block", "A", "B", Rigid.of(mass=0.5, inertia=1e-3))],
    guides=[Guide("A", "block", (1, 0), friction=law), Guide("B", "block", (1, 0), friction=law)],
    gravity=(0.0, -9.81),
    velocities={"A": (speed, 0.0)},
)
result = simulate(mechanism, duration=0.8)

way = result.signals["A.x"][-1]
exact = speed**2 / (2 * friction * 9.81)
print(f"stops after {way:.5f} m; closed form {exact:.5f} m")
assert abs(way / exact - 1) < 1e-3
