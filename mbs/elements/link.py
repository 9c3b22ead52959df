"""Links, which connect two points and may carry further points.

The frame of a link has its origin at the start and x towards the end, y is to the left of x. The chord is the line from start
to end, or its length [m].
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from math import hypot, pi
from typing import Any, ClassVar

from ..declare import Either, Name, Named, Nothing, Quantity, Several, Vector, declared, field, names, part, quantity
from ..geometry import Array
from ..validate import positive
from .element import Body, LinkBase, Parts, Recorded
from .references import check_known
from .signal import Energy, Kind, MovingBody, Signal, vector


class Frozen(Mapping[str, Any]):
    """Immutable mapping of names to values; it can be compared, hashed and pickled."""

    __slots__ = ("_items",)

    def __init__(self, items: Mapping[str, object] | Iterable[tuple[str, object]] = ()) -> None:
        self._items = dict(items)

    def __getitem__(self, name: str) -> Any:
        return self._items[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._items)

    def __len__(self) -> int:
        return len(self._items)

    def __hash__(self) -> int:
        return hash(frozenset(self._items.items()))

    def __repr__(self) -> str:
        return repr(self._items)

    def __setitem__(self, name: str, _value: object) -> None:
        raise TypeError(f"cannot set '{name}': a mechanism does not change; make another with dataclasses.replace")


_PLACES = Named(Either((Quantity("1", 0.0, 1.0), Vector("m"), Nothing())))
"""Specification of carried points by name: a fraction of the length, a place in the link's frame, or None."""


class Carried(Either):
    """Specification of carried points: names, or names with a fraction of the length or a place in the link's frame."""

    words = "a sequence of names or a mapping of names to fractions, or to places (x, y) from the link's start, x towards its end"

    def read(self, name: str, raw: object) -> Frozen:
        """Return a mapping of names to fractions or places; None where the points of the mechanism give the place."""
        found = super().read(name, raw)
        return Frozen(found if isinstance(found, dict) else dict.fromkeys(found))

    def write(self, name: str, value: Any) -> Any:
        """Return a list if no point has a place, else a table."""
        return list(value) if all(each is None for each in value.values()) else _PLACES.write(name, value)


LARGEST_BOW = 0.25
"""Largest imperfection over the length: chosen. There the bow of `Beam.curve` is 10 % higher than the imperfection."""


@declared
class Link(LinkBase):
    """A named link from one point to another.

    >>> Link("crank", "O", "A", Rigid(Section(width=0.03, thickness=5e-3))).end
    'A'
    """

    title: ClassVar[str] = "link '{name}'"
    label: ClassVar[str] = "{name}"

    name: str = names(doc="of the link")
    start: str = names(doc="the point at one end")
    end: str = names(doc="the point at the other end")
    body: Body = part(Body, doc="model of the link: Rigid, Strut, Beam, Cable or Modal, with section and material")
    carries: Sequence[str] | Mapping[str, float | tuple[float, float]] = field(
        Carried((Several(Name()), _PLACES)),
        "further points: names of those whose places the mechanism has (rigid links only); or a table of names with the fraction "
        "of the length, 0 to 1 (rigid links, beams, cables), or the place (x, y), m, from the start, x towards the end (rigid)",
        default=(),
    )
    length: float | None = quantity("m", above=0, default=None, doc="distance of the ends; then `points` may leave out one end")
    angle: float | None = field(
        Quantity("rad", -2 * pi, 2 * pi, hint="a number without a unit is in rad; write degrees as '60 deg'"),
        "from the x-axis to the direction from start to end, at t = 0",
        default=None,
    )

    def agree(self) -> None:
        """Raise a ValueError for carried points that the body cannot have."""
        carried: Any = self.carries  # a mapping, which `Carried` has read
        kind, forms = type(self.body).__name__, self.body.carried_point_forms  # some of "fraction" and "place"
        if carried and not forms:
            raise ValueError(f"{self.where}: only Rigid links, beams and cables carry further points, not a {kind}")
        if "place" not in forms and not all(isinstance(at, float) for at in carried.values()):
            raise ValueError(f"{self.where}: only a Rigid link carries points by name or place, not a {kind}; give fractions")

    def check(self, mechanism: Parts) -> None:
        """Raise a ValueError unless the points are known and differ, and a flexible link is long and straight enough."""
        for point in self.points:
            check_known("point", point, mechanism.points, self.where)
        length = positive(f"length of link '{self.name}'", mechanism.length(self.name), "m")
        thickness = self.body.section.thickness if self.body.flexible else 0.0
        if thickness >= length:
            what = f"thickness of flexible link '{self.name}' = {thickness:g} m"
            raise ValueError(f"{what}: must be below its length, {length:g} m; it is no strip")
        bow = getattr(self.body, "imperfection", 0.0)  # of strips alone
        if abs(bow) > LARGEST_BOW * length:
            what = f"imperfection of flexible link '{self.name}' = {bow:g} m"
            raise ValueError(f"{what}: must be at most {LARGEST_BOW:g} of its length, {length:g} m; give a higher bow as shape")

    def locate_carried(self, start: tuple[float, float], end: tuple[float, float]) -> dict[str, tuple[float, float]]:
        """Return the places [m] of carried points in the plane from the places of both ends; none for points without a place."""
        chord = hypot(end[0] - start[0], end[1] - start[1])
        if chord == 0:  # an error, which `check` reports
            return {}
        cos, sin = (end[0] - start[0]) / chord, (end[1] - start[1]) / chord
        places = self.carried_places(chord)
        return {point: (start[0] + cos * x - sin * y, start[1] + sin * x + cos * y) for point, (x, y) in places.items()}

    def carried_places(self, chord: float) -> dict[str, tuple[float, float]]:
        """Return the places [m] of carried points in the link's frame; none for points given by name alone."""
        carried: Any = self.carries
        known = {point: at for point, at in carried.items() if at is not None}
        return {point: at if isinstance(at, tuple) else self.body.place_at(chord, at) for point, at in known.items()}

    def mass(self, length: float) -> float:
        """Return the mass [kg] for a distance of the ends [m], also of a strut, whose model leaves it out."""
        mass, _, _ = self.body.mass_properties(length)
        return mass

    def signals(self, name: str, record: Recorded) -> Iterator[Signal]:
        """Yield place, velocity and acceleration of the centre of mass, then the signals of the body."""
        if name in record.links:  # a strut is not: it has no motion of its own
            yield from make_motion_signals(name, *record.links[name].centre())
        yield from self.body.signals(self, record)

    def energies(self, name: str, record: Recorded) -> Iterator[Energy]:
        """Yield kinetic energy, potential energy of gravity, and the energies of the body."""
        if name in record.links:
            motion = record.links[name]
            yield Energy("stored", "kinetic", motion.kinetic())
            yield from yield_weight_energy(motion, record)
        yield from self.body.energies(self, record)


def make_motion_signals(name: str, *motion: Array) -> Iterator[Signal]:
    """Yield the signals `name.x`, `name.vx`, `name.ax`, `name.y`, ... of place, velocity and perhaps acceleration (times, 2)."""
    stems = [f"{name}.", f"{name}.v", f"{name}.a"][: len(motion)]  # of names, to which `vector` appends x or y
    rate_stems = [*stems[1:], ""]  # stem of each signal's derivative; '' if there is none
    units, kinds = ("m", "m/s", "m/s^2"), (Kind.PLACE, Kind.RATE, Kind.ACCELERATION)
    for stem, values, unit, kind, rate_stem in zip(stems, motion, units, kinds, rate_stems, strict=False):
        yield from vector(stem, values, unit, kind, rate=rate_stem)


def yield_weight_energy(motion: MovingBody, record: Recorded) -> Iterator[Energy]:
    """Yield the potential energy of a body in gravity; nothing without gravity in the plane of motion."""
    gravity = record.mechanism.gravity
    if hypot(*gravity) > 0:
        place, _, _ = motion.centre()
        yield Energy("stored", "weight", -motion.mass * (place @ gravity))
