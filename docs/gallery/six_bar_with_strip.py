"""A Watt six-bar that strikes a stop.

A strip joins the two loops of the linkage; the mechanism is the example file `six-bar`, here turned
slowly. Where the output meets its stop, the strip buckles and from then on presses as the exact
elastica does.
"""

from importlib.resources import files

import numpy as np

from buckler.elastica import pinned
from buckler.mbs import Mechanism, simulate

document = Mechanism.load(files("buckler.studies.own.examples").joinpath("six-bar.toml")).to_dict()
document["drives"][0]["speed"] = "3 rpm"
document["links"]["strip"]["body"]["imperfection"] = "0.02 mm"
mechanism = Mechanism.from_dict(document)
result = simulate(mechanism, duration=4.2, accuracy=1e-2, of=["strip.axial_force.mean"])  # stiff: asked for by name

signals, strip, length = result.signals, mechanism.links[3].body.section, mechanism.length("strip")
bent = signals["strip.end_shortening"] > 2e-3
weights = np.gradient(result.time)[bent]
force = np.average(-signals["strip.axial_force"][bent], weights=weights)
shortening = np.average(signals["strip.end_shortening"][bent], weights=weights) / length
exact = pinned.load(shortening) * strip.bending_stiffness / length**2 * (1 - shortening)  # along the strip, on average
print(f"normal force of the buckled strip {force:.3f} N; exact elastica {exact:.3f} N")
assert abs(force / exact - 1) < 1e-2
