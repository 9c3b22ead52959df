"""A toggle clamp with a strip.

The handle pushes an arm over a thin strip. The foot lands on the work, the strip buckles, and the handle passes
its dead centre: from then on the strip holds the clamp shut, with a force that hardly depends on the height of
the work. It is that of the exact elastica on the lever of the arm. The mechanism is the example file `toggle-clamp`.
"""

from importlib.resources import files

import numpy as np

from buckler.elastica import pinned
from buckler.mbs import Mechanism, simulate

mechanism = Mechanism.load(files("buckler.studies.own.examples").joinpath("toggle-clamp.toml"))
result = simulate(mechanism, duration=1.2)

rest = np.linspace(1.0, 1.2, 2001)  # the handle has stopped, and the strip rings
mean = {name: result.at(name, rest).mean() for name in ("T.contact_force", "strip.end_shortening")}
a, b, t, c = (np.array([result.at(f"{point}.{axis}", rest).mean() for axis in "xy"]) for point in "ABTC")

strip, length = mechanism.link("strip").body.section, mechanism.length("strip")
thrust = pinned.load(mean["strip.end_shortening"] / length) * strip.bending_stiffness / length**2
push = thrust * (b - a) / np.hypot(*(b - a))
arm = b - c
exact = (arm[1] * push[0] - arm[0] * push[1]) / (t - c)[0]  # moments about C
print(f"clamping force {mean['T.contact_force']:.2f} N; exact elastica on the lever {exact:.2f} N")
assert abs(mean["T.contact_force"] / exact - 1) < 0.02
