"""A slider-crank that buckles.

The coupler is a strip 0.3 mm thick. When the slider meets its stop, the strip buckles and the crank
turns on. With the crank at 180 degrees the force on the stop is that of the exact elastica.
"""

from math import pi

from buckler.elastica import pinned
from buckler.mbs import Beam, Drive, Guide, Link, Mechanism, Revolute, Rigid, Section, Stop, simulate
from buckler.mbs.laws import CarvalhoMartins

strip = Section(width=0.030, thickness=0.3e-3).damped(0.05, length=0.310)
mechanism = Mechanism(
    points={"O": (0, 0), "A": (0.140, 0), "B": (-0.170, 0)},
    links=[
        Link("crank", "O", "A", Rigid(Section(0.030, 0.005))),
        Link("coupler", "A", "B", Beam(strip, elements=6, imperfection=-3.1e-5)),
    ],
    joints=[Revolute("O", "ground", "crank"), Revolute("A", "crank", "coupler")],
    guides=[Guide("B", "coupler", along=(1, 0), mass=0.3)],
    stops=[Stop("B", at=-0.3553, law=CarvalhoMartins(7.2e4, 0.8, exponent=1.0))],
    drives=[Drive("crank", speed=1.25)],
)
result = simulate(mechanism, duration=2 * pi / 1.25)

force = result.at("B.contact_force", pi / 1.25)
shortening = 1 - (0.3553 - 0.140 - force / 7.2e4) / 0.310
exact = pinned.load(shortening) * strip.bending_stiffness / 0.310**2
print(f"contact force at 180 degrees: {force:.4f} N; exact elastica {exact:.4f} N")
assert abs(force / exact - 1) < 2e-3
