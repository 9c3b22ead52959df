"""A double pendulum in its slow mode.

Two equal masses on two equal light rods swing in their lower natural mode, of which the period is
known in closed form: the square of the circular frequency is (2 - sqrt 2) g/l.
"""

from math import pi, sqrt

import numpy as np

from buckler.mbs import Link, Mechanism, Revolute, Rigid, simulate

length, gravity, angle = 0.5, 9.81, 0.06
bob = Rigid.of(mass=1.0, inertia=1e-6, centre=(length, 0.0))
# In the slow mode the lower rod swings sqrt 2 times as far as the upper one.
first = np.array([np.sin(angle), -np.cos(angle)]) * length
second = first + np.array([np.sin(sqrt(2) * angle), -np.cos(sqrt(2) * angle)]) * length
mechanism = Mechanism(
    points={"O": (0, 0), "A": tuple(first), "B": tuple(second)},
    links=[Link("upper", "O", "A", bob), Link("lower", "A", "B", bob)],
    joints=[Revolute("O", "ground", "upper"), Revolute("A", "upper", "lower")],
    gravity=(0.0, -gravity),
)
period = 2 * pi / sqrt((2 - sqrt(2)) * gravity / length)
result = simulate(mechanism, duration=period, accuracy=1e-4)

quarter = np.interp(0.0, -result.signals["B.x"][: len(result.time) // 2], result.time[: len(result.time) // 2])
print(f"period {4 * quarter:.5f} s; small oscillations {period:.5f} s")
assert abs(4 * quarter / period - 1) < 5e-4
