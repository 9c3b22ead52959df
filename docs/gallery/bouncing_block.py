"""A block that bounces.

A block falls along vertical guides onto a stop whose law gives a restitution of 0.7. Each bounce is
0.49 times as high as the one before.
"""

import numpy as np

from buckler.mbs import Guide, Link, Mechanism, Rigid, Stop, simulate
from buckler.mbs.laws import ExactRestitution

drop, restitution = 0.1, 0.7
mechanism = Mechanism(
    points={"A": (0, drop), "B": (0, drop + 0.08)},
    links=[Link("block", "A", "B", Rigid.of(mass=0.5, inertia=1e-3))],
    guides=[Guide("A", "block", along=(0, 1)), Guide("B", "block", along=(0, 1))],
    stops=[Stop("A", at=0.0, law=ExactRestitution(1e10, restitution))],
    gravity=(0.0, -9.81),
)
result = simulate(mechanism, duration=0.6)

height = result.signals["A.y"]
tops = [height[k] for k in range(1, len(height) - 1) if height[k - 1] < height[k] >= height[k + 1]]
print("heights of the bounces", np.round(tops, 5), "m; ratios", np.round(np.divide(tops[1:], tops[:-1]), 4))
assert abs(tops[0] / drop - restitution**2) < 3e-3
assert abs(tops[1] / tops[0] - restitution**2) < 3e-3
