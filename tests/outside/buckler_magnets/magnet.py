"""Magnets that draw two points together."""

import numpy as np

from buckler.mbs.declare import declared, names, quantity
from buckler.mbs.elements.element import GROUND, Energy, Kind, Signal, place, refers
from buckler.mbs.elements.load import Load, Push, held_at, unit


@declared
class Magnet(Load):
    """Two poles that attract each other: strength over distance squared."""

    a: str = names(doc="a point reference")
    b: str = names(doc="the same of the other pole")
    strength: float = quantity("N m^2", above=0, doc="force at 1 m")

    @property
    def key(self):
        return f"magnet.{place(self.a).point}-{place(self.b).point}"

    def check(self, mechanism):
        for at in (self.a, self.b):
            refers(mechanism, at, self.key)

    def apart(self, record):
        """Distance, m, and direction from a to b."""
        a, b = (record.point(held_at(record.mechanism, at))[0] for at in (self.a, self.b))
        return unit(b - a)

    def pushes(self, name, record):
        length, along = self.apart(record)
        for at, sign in ((self.a, 1.0), (self.b, -1.0)):
            held = held_at(record.mechanism, at)
            if place(held).body != GROUND:
                yield Push(held, sign * (self.strength / length**2)[:, None] * along, np.zeros_like(length))

    def signals(self, name, record):
        yield Signal(f"{name}.force", self.strength / self.apart(record)[0] ** 2, "N", Kind.INTERNAL)

    def energies(self, name, record):
        yield Energy("held", "spring", -self.strength / self.apart(record)[0])
