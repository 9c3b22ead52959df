"""A truss that snaps through.

Two springs hold a post above the line of their feet, and a drive presses it slowly down. The force
rises, falls and changes its sign. Its largest value has a closed form (von Mises, 1923).
"""

from math import hypot, sqrt

from buckler.mbs import Drive, Guide, Link, Mechanism, Rigid, Spring, simulate

half, rise, stiffness = 0.2, 0.08, 2000.0
mechanism = Mechanism(
    points={"L": (-half, 0), "R": (half, 0), "M": (0, rise), "T": (0, rise + 0.1)},
    links=[Link("post", "M", "T", Rigid.of(mass=0.1, inertia=1e-4))],
    guides=[Guide("M", "post", along=(0, 1)), Guide("T", "post", along=(0, 1))],
    drives=[Drive("M", speed=-0.05)],
    loads=[Spring("ground:L", "post:M", stiffness), Spring("ground:R", "post:M", stiffness)],
)
result = simulate(mechanism, duration=2 * rise / 0.05)

free = hypot(half, rise)
length = (free * half**2) ** (1 / 3)  # of a spring where the force is largest
exact = 2 * stiffness * (free / length - 1) * sqrt(length**2 - half**2)
force = max(-result.signals["drive.force"])
print(f"largest force {force:.4f} N; closed form {exact:.4f} N")
assert abs(force / exact - 1) < 1e-4
