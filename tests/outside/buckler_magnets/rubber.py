"""A contact law of rubber."""

from buckler.mbs.declare import Declared, declared, quantity
from buckler.mbs.laws.pieces import ramp


@declared
class Rubber(Declared):
    """F = k d (1 + d'/s), never negative."""

    stiffness: float = quantity("N/m", above=0, doc="k")
    slowest: float = quantity("m/s", above=0, doc="s, speed at which damping doubles the force")

    exponent = 1.0

    def force(self, depth, rate, onset):
        return self.elastic(depth) * ramp(1.0 + rate / self.slowest)

    def elastic(self, depth):
        return self.stiffness * ramp(depth)

    def potential(self, depth):
        return 0.5 * self.stiffness * ramp(depth) ** 2
