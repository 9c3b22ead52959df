"""Racks and pinions."""

from __future__ import annotations

from collections.abc import Iterator

from ..declare import declared, direction, names, quantity
from .coupling import Coupling
from .element import GROUND, Parts, Recorded, place
from .references import carried_by
from .rows import Along, Row, Turn
from .signal import Kind, Signal


@declared
class Rack(Coupling):
    """A link that travels as a pinion turns: by its radius a radian, along a line of the carrier.

    The teeth push along the line at the pitch point; what their pressure angle adds across it, which only the pinion's axle and
    the rack's guide feel, is left out. Guide and axle are joints of their own.

    Examples
    --------
    >>> Rack("pinion", "rack", radius=0.02).key
    'rack.pinion-rack'
    """

    first: str = names(doc="the pinion and the centre it turns about, such as 'pinion:O'")
    second: str = names(doc="the rack and a point of it, such as 'rack:A'")
    radius: float = quantity("m", above=0, doc="of the pinion's pitch circle")
    along: tuple[float, float] = direction(
        doc="where the rack goes, at t = 0, as the pinion turns counter-clockwise; need not be a unit vector", default=(1.0, 0.0)
    )
    carrier: str = names(doc="the link in which axle and line are fixed, or 'ground'", default=GROUND)

    def rows(self, mechanism: Parts) -> Iterator[Row]:
        """Yield that both have one speed along the line at the pitch point: travel of the rack = radius times turn."""
        pinion, rack = place(self.first), place(self.second)
        base, turns, (dx, dy) = carried_by(mechanism, self.carrier), self.carrier != GROUND, self.along
        (x1, y1), (x2, y2) = mechanism.points[pinion.point], mechanism.points[rack.point]
        lever = dy * (x1 + self.radius * dy - x2) - dx * (y1 - self.radius * dx - y2)  # of the pitch point about the rack's
        yield Row((
            (1.0, Along(rack, carried_by(mechanism, self.carrier, rack.point), self.along, turns)),
            (lever, Turn(rack, base)),
            (-1.0, Along(pinion, carried_by(mechanism, self.carrier, pinion.point), self.along, turns)),
            (-self.radius, Turn(pinion, base)),
        ))  # fmt: skip

    def signals(self, name: str, record: Recorded) -> Iterator[Signal]:
        """Yield the force of the teeth on the rack along the line, N."""
        yield Signal(f"{name}.force", record.channel(name, "effort")[:, 0], "N", Kind.REACTION)
