"""A contact force with tolerances.

Thickness, modulus, length and stop of a strip scatter as parts do. Sobol' indices by SciPy say which
of them makes the force of the pressed slider-crank scatter. A run confirms the force at the means.
"""

from math import pi

import numpy as np
from scipy import stats

from buckler.elastica import pinned
from buckler.mbs import Beam, Section, simulate, slider_crank
from buckler.mbs.laws import CarvalhoMartins

CRANK, WIDTH = 0.140, 0.030
MEANS = {"thickness": 0.3e-3, "modulus": 210e9, "length": 0.310, "stop": 0.3553}
SPREADS = {"thickness": 2e-6, "modulus": 4e9, "length": 2e-3, "stop": 5e-3}


def contact_force(x):
    """Force of the elastica on the stop, the crank at its dead centre [N]; x has a row an input."""
    thickness, modulus, length, stop = x
    stiffness = modulus * WIDTH * thickness**3 / 12
    return pinned.load(1 - (stop - CRANK) / length) * stiffness / length**2


inputs = [stats.norm(MEANS[name], SPREADS[name]) for name in MEANS]
found = stats.sobol_indices(func=contact_force, n=2**13, dists=inputs, rng=np.random.default_rng(1))
print("share of the force's variance:")
for name, first, total in zip(MEANS, found.first_order, found.total_order, strict=True):
    print(f"  {name}: {first:.3f} alone, {total:.3f} with others")

mean = np.array(list(MEANS.values()))
steps = np.diag(1e-4 * mean)
slopes = [(contact_force(mean + step) - contact_force(mean - step)) / 2e-4 for step in steps]
linear = (np.array(slopes) * list(SPREADS.values()) / mean) ** 2
np.testing.assert_allclose(found.first_order, linear / linear.sum(), atol=0.01)
assert abs(slopes[0] / contact_force(mean) - 3) < 1e-6  # the force goes with the cube of the thickness

body = Beam(Section(WIDTH, MEANS["thickness"]).damped(0.05, MEANS["length"]), elements=6, imperfection=-3.1e-5)
mechanism = slider_crank(body, law=CarvalhoMartins(1e6, 0.8, exponent=1.0), mass=0.3, speed=1.25)
result = simulate(mechanism, duration=1.2 * pi / 1.25)
force = result.at("B.contact_force", pi / 1.25)
print(f"force at 180 degrees: {force:.4f} N by a run, {contact_force(mean):.4f} N by the elastica")
assert abs(force / contact_force(mean) - 1) < 2e-3
