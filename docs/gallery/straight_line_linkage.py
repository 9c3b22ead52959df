"""A linkage that draws a straight line.

Peaucellier's linkage (1864): seven links turn the circle of P into a straight line of Q, exactly.
"""

from math import cos, sin, sqrt

import numpy as np

from buckler.mbs import Drive, Link, Mechanism, Motion, Revolute, Rigid, Section, simulate

long, short, crank = 0.35, 0.15, 0.12
p = 2 * crank
q = (long**2 - short**2) / p  # OP times OQ is the same in every pose
middle = (p + q) / 2
side = sqrt(long**2 - middle**2)
bar = Rigid(Section(0.015, 0.004))
ends = {"OA": "OA", "OB": "OB", "AP": "AP", "BP": "BP", "AQ": "AQ", "BQ": "BQ", "crank": "CP"}
mechanism = Mechanism(
    points={"O": (0, 0), "C": (crank, 0), "P": (p, 0), "Q": (q, 0), "A": (middle, side), "B": (middle, -side)},
    links=[Link(name, *points, bar) for name, points in ends.items()],
    joints=[
        Revolute("O", "ground", "OA"), Revolute("O", "ground", "OB"), Revolute("C", "ground", "crank"),
        Revolute("A", "OA", "AP"), Revolute("A", "OA", "AQ"), Revolute("B", "OB", "BP"), Revolute("B", "OB", "BQ"),
        Revolute("P", "crank", "AP"), Revolute("P", "crank", "BP"), Revolute("Q", "AQ", "BQ"),
    ],
    drives=[Drive("crank", Motion(lambda t: 0.5 * sin(3 * t), lambda t: 1.5 * cos(3 * t)))],
)  # fmt: skip
result = simulate(mechanism, duration=2.1)

off = np.ptp(result.signals["Q.x"])
print(f"Q moves {np.ptp(result.signals['Q.y']):.3f} m along its line and {off:.1e} m off it")
assert off < 1e-9 and np.ptp(result.signals["Q.y"]) > 0.2
