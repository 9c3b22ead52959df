"""A bifurcation diagram of a block that bounces on a shaken table.

A Scotch yoke shakes the table with Γ times gravity. Up to Γ = π √(a² + b²), a = (1 - e)/(1 + e),
b = 2 (1 + e²)/(π (1 + e)²), e the restitution, each bounce is as high as the one before; then every
second one is, and so on to chaos. A section takes the height once a turn, 20 times. Closed form:
N. B. Tufillaro et al., An Experimental Approach to Nonlinear Dynamics and Chaos (1992), chapter 1.
"""

from concurrent.futures import ThreadPoolExecutor
from math import acos, cos, hypot, pi, sin

import numpy as np
from matplotlib.figure import Figure

from buckler.mbs import Controlled, Drive, Guide, Link, Mechanism, Revolute, Rigid, Slot, Spectral, Stop, simulate
from buckler.mbs.laws import KelvinVoigt
from buckler.mbs.spectral.run import once

radius, speed, restitution = 0.015, 10 * pi, 0.5
turn, mean = 2 * pi / speed, (1 - restitution) / (1 + restitution)
body = Rigid.of(mass=1.0, inertia=1e-3)


def shaken(ratio: float) -> Mechanism:
    """Return the block at the top of a bounce as high as the next one."""
    gravity, phase = radius * speed**2 / ratio, acos(pi * mean / ratio)
    table, top = -radius * sin(phase), radius * sin(phase) + gravity * turn**2 / 8
    return Mechanism(
        points={
            "O": (0.0, 0.0), "A": (-radius * cos(phase), table), "S": (0.0, table), "T": (0.0, table - 0.05),
            "P": (0.0, top), "Q": (0.0, top + 0.02),
        },
        links=[Link("crank", "O", "A", body), Link("table", "S", "T", body), Link("block", "P", "Q", body)],
        joints=[Revolute("O", "ground", "crank"), Slot("A", "crank", "table")],
        guides=[Guide(point, link, along=(0, 1)) for point, link in zip("STPQ", ["table"] * 2 + ["block"] * 2, strict=True)],
        drives=[Drive("crank", speed)],
        stops=[Stop("P", table, KelvinVoigt.from_restitution(1e7, restitution, 1.0), along=(0, 1), on="table")],
        gravity=(0.0, -gravity),
    )  # fmt: skip


ratios, solver = np.linspace(1.30, 1.80, 20), Spectral(Controlled(1e-6))
times = turn * np.arange(32, 40)


def once_a_turn(ratio: float) -> np.ndarray:
    """Return the heights of the block at the section."""
    run = once(shaken(ratio), 40 * turn, solver)
    return np.interp(times, run.record.time, run.values["P.y"])


with ThreadPoolExecutor() as pool:
    heights = np.array(list(pool.map(once_a_turn, ratios)))
result = simulate(shaken(1.6), 10 * turn, solver=solver)
picture = Figure(figsize=(6, 4))
axes = picture.subplots()
axes.plot(np.repeat(ratios, len(times)), 1e3 * heights.ravel(), ".")
axes.set(xlabel="acceleration of the table over gravity", ylabel="height, once a turn [mm]")

double = pi * hypot(mean, 2 * (1 + restitution**2) / pi / (1 + restitution) ** 2)
parted = np.abs(heights[:, -1] - heights[:, -2]) > 1.5e-3
first, step = ratios[np.argmax(parted)], ratios[1] - ratios[0]
print(f"bounces double between {first - step:.3f} and {first:.3f}; closed form {double:.3f}")
assert parted.any() and not parted[0] and abs(first - double) < step
assert len(np.unique(np.round(1e3 * heights[-1]))) > 5  # chaos
