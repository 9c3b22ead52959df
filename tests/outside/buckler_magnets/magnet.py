"""Magnets that draw two points together."""

import numpy as np

from buckler.mbs.declare import declared, names, quantity
from buckler.mbs.elements.load import Load, on_both
from buckler.mbs.elements.references import check_reference, holder_reference
from buckler.mbs.elements.signal import Energy, Kind, Signal
from buckler.mbs.geometry import unit


@declared
class Magnet(Load):
    """Two poles that attract each other: strength over distance squared."""

    title = label = "magnet.{a:point}-{b:point}"

    a: str = names(doc="a point reference")
    b: str = names(doc="point reference of the other pole")
    strength: float = quantity("N m^2", above=0, doc="force at 1 m")

    def check(self, mechanism):
        for at in (self.a, self.b):
            check_reference(mechanism, at, self.where)

    def apart(self, record):
        """Distance, m, and direction from a to b."""
        a, b = (record.point(holder_reference(record.mechanism, at))[0] for at in (self.a, self.b))
        return unit(b - a)

    def pushes(self, name, record):
        length, along = self.apart(record)
        ends = [holder_reference(record.mechanism, at) for at in (self.a, self.b)]
        yield from on_both(ends, (self.strength / length**2)[:, None] * along, np.zeros_like(length))

    def signals(self, name, record):
        yield Signal(f"{name}.force", self.strength / self.apart(record)[0] ** 2, "N", Kind.INTERNAL)

    def energies(self, name, record):
        yield Energy("stored", "spring", -self.strength / self.apart(record)[0])
