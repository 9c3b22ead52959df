"""A motor that runs up.

A DC motor turns a flywheel from rest. The speed approaches voltage over constant exponentially,
with the time constant J R/k^2.
"""

import numpy as np

from buckler.mbs import Link, Mechanism, Motor, Revolute, Rigid, simulate

voltage, resistance, constant, inertia = 1.5, 1.5, 0.05, 2e-3
mechanism = Mechanism(
    points={"O": (0, 0), "A": (0.05, 0)},
    links=[Link("wheel", "O", "A", Rigid.of(mass=0.2, inertia=inertia, centre=(0.0, 0.0)))],
    joints=[Revolute("O", "ground", "wheel")],
    loads=[Motor("wheel", voltage=voltage, resistance=resistance, constant=constant)],
)
lag = inertia * resistance / constant**2
result = simulate(mechanism, duration=4 * lag, accuracy=1e-4)

exact = voltage / constant * (1 - np.exp(-result.time / lag))
worst = abs(result.signals["wheel.spin"] - exact).max() / exact.max()
print(f"speed at the end {result.signals['wheel.spin'][-1]:.4f} rad/s; closed form {exact[-1]:.4f} rad/s")
assert worst < 1e-3
