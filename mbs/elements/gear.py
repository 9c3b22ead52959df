"""Pairs of gears."""

from __future__ import annotations

from collections.abc import Iterator

from ..declare import declared, names, quantity
from .coupling import Coupling
from .element import GROUND, Parts, Recorded, place
from .references import carried_by, distance
from .rows import Along, Row, Turn
from .signal import Kind, Signal


@declared
class Gear(Coupling):
    """Two links whose turns keep a ratio, seen from the carrier of their axles: meshing gears.

    The teeth push at the pitch point, square to the line of centres; what their pressure angle adds along that line, which only
    the axles feel, is left out. Where both turn about one point, a torque alone acts.

    Examples
    --------
    >>> Gear("pinion", "wheel", ratio=-0.5).key
    'gear.pinion-wheel'
    """

    first: str = names(doc="a link and the centre it turns about, such as 'sun:O'; 'ground:O' is a gear that stands")
    second: str = names(doc="the same of the other gear")
    ratio: float = quantity("1", nonzero=True, doc="turns of the second for one of the first; negative with outer teeth on both")
    carrier: str = names(doc="the link that carries both axles, or 'ground'", default=GROUND)

    def check(self, mechanism: Parts) -> None:
        """Two links about two centres with a pitch point between or beside them."""
        super().check(mechanism)
        if self.ratio == 1 and distance(mechanism, self.first, self.second) > 0:
            raise ValueError(f"{self.where}: ratio = 1: gears about two centres that turn alike have no pitch point")

    def rows(self, mechanism: Parts) -> Iterator[Row]:
        """Yield that both have one speed at the pitch point, r of the first gear: r turn_1 + (distance - r) turn_2 = 0."""
        first, second, base = place(self.first), place(self.second), carried_by(mechanism, self.carrier)
        apart = distance(mechanism, self.first, self.second)
        if apart == 0:
            yield Row(((1.0, Turn(second, base)), (-self.ratio, Turn(first, base))))
            return
        (x1, y1), (x2, y2) = mechanism.points[first.point], mechanism.points[second.point]
        tangent, turns = ((y1 - y2) / apart, (x2 - x1) / apart), self.carrier != GROUND
        radius = self.ratio * apart / (self.ratio - 1)
        yield Row((
            (1.0, Along(first, carried_by(mechanism, self.carrier, first.point), tangent, turns)),
            (radius, Turn(first, base)),
            (-1.0, Along(second, carried_by(mechanism, self.carrier, second.point), tangent, turns)),
            (apart - radius, Turn(second, base)),
        ))  # fmt: skip

    def signals(self, name: str, record: Recorded) -> Iterator[Signal]:
        """Yield the torque of the teeth on the second about its centre, N m."""
        apart = distance(record.mechanism, self.first, self.second)
        arm = 1.0 if apart == 0 else apart / (1 - self.ratio)
        yield Signal(f"{name}.torque", arm * record.channel(name, "effort")[:, 0], "N m", Kind.REACTION)
