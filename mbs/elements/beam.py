"""Flexible links: shear-deformable beams and shear-rigid cables, straight or of any stress-free shape."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ..declare import Either, Several, Vector, declared, field, part, quantity, whole
from ..functions.fields import Function
from ..geometry import Array, cross
from ..laws.pieces import Reals
from .element import Body, Linked, Recorded
from .section import Profile, Section
from .signal import Kind, Signal

DEFAULT_ELEMENTS = 8
"""Default number of elements of a flexible link."""
RULE = np.polynomial.legendre.leggauss(12)
"""Gauss points and weights between two stations of a curve."""
PANELS = 64
"""Pieces of the quadrature of the place of a point on a curved strip."""
Shape = Sequence[tuple[float, float]] | Callable[[float], tuple[float, float]]
SHAPES = Either((Function("s", "m", size=2), Several(Vector("m"), least=3)))
ELEMENTS = f"number in Exudyn's first run, {DEFAULT_ELEMENTS} by default; finer runs for an accuracy double it"
BOW = "stress-free half-sine bow at mid-span, positive to the left of the direction from start to end"
SHAPED = (
    "stress-free shape instead of a bow: points from start to end, or a function of the fraction of the arc length, in [0, 1]; "
    "it is turned and scaled so that its ends are the link's points"
)


class Flexible(Body):
    """Base of beams and cables."""

    section: Section | Profile
    meshed: ClassVar[bool] = True
    carrying: ClassVar[tuple[str, ...]] = ("fraction",)
    round_off: ClassVar[float] = 5e-12
    elements: int | None
    imperfection: float
    shape: Shape | None

    def agree(self) -> None:
        """Raise a ValueError if two stress-free shapes are given."""
        if self.imperfection and self.shape is not None:
            raise ValueError(f"imperfection = {self.imperfection:g} m and shape: give one of them")

    @property
    def count(self) -> int:
        """Number of elements."""
        return self.elements or DEFAULT_ELEMENTS

    @property
    def step(self) -> int:
        """Nodes from one element to the next."""
        return 1

    def curve(self, chord: float) -> CurvedLine:
        """Return the stress-free shape for a distance of the ends, m."""
        if self.shape is None:
            return _bow(chord, self.imperfection)
        return _spline(chord, self.shape)

    def along(self, chord: float, fraction: float) -> tuple[float, float]:
        """Return the place at a fraction of the stress-free arc length, m, in the link's frame, for a distance of the ends, m."""
        if not self.imperfection and self.shape is None:
            return chord * fraction, 0.0
        x, y = self.curve(chord).places(np.linspace(0.0, fraction, PANELS + 1))[-1]
        return float(x), float(y)

    def signals(self, link: Linked, record: Recorded) -> Iterator[Signal]:
        """Yield end shortening, m, axial force, N, tension positive, and deflection of mid-length from the chord, m."""
        strip = record.links[link.name]
        start, end = (strip.point(name)[0] for name in (link.start, link.end))
        chord, middle = end - start, strip.middle() - start
        span = np.hypot(*chord.T)
        yield Signal(f"{link.name}.end_shortening", strip.length - span, "m", Kind.STRETCH)
        yield Signal(f"{link.name}.axial_force", strip.axial_force(), "N", Kind.INTERNAL)
        yield Signal(f"{link.name}.deflection", cross(chord, middle) / span, "m", Kind.PLACE)


@declared
class Beam(Flexible):
    """A flexible link of geometrically exact (shear-deformable) beam elements.

    Examples
    --------
    >>> Beam(Section(width=0.03, thickness=3e-4), elements=6, imperfection=-3e-5).nodes
    3
    """

    section: Section | Profile = part(Section, Profile, doc="of the strip")
    elements: int | None = whole(1, 1000, doc=ELEMENTS, default=None)
    nodes: int = whole(2, 3, doc="of an element: 2 (linear) or 3 (quadratic), far more accurate at the same cost", default=3)
    imperfection: float = quantity("m", low=-1, high=1, doc=BOW, default=0.0)
    shape: Shape | None = field(SHAPES, SHAPED, default=None)

    @property
    def step(self) -> int:
        """Nodes from one element to the next."""
        return self.nodes - 1


@declared
class Cable(Flexible):
    """A flexible link of shear-rigid ANCF cable elements (cubic Hermite).

    Examples
    --------
    >>> Cable(Section(width=0.03, thickness=3e-4), elements=8).elements
    8
    """

    section: Section | Profile = part(Section, Profile, doc="of the strip")
    elements: int | None = whole(1, 1000, doc=ELEMENTS, default=None)
    imperfection: float = quantity("m", low=-1, high=1, doc=BOW, default=0.0)
    shape: Shape | None = field(SHAPES, SHAPED, default=None)

    turns: ClassVar[bool] = False


@dataclass(frozen=True)
class CurvedLine:
    """Stress-free line of a `length` [m]; `direction` maps fractions of it (n,) to angles (n,) of tangent against chord [rad]."""

    length: float
    direction: Callable[[Reals], Reals]

    def places(self, stations: Array) -> Array:
        """Integrate places in the chord's frame at increasing fractions in [0, 1], the first 0: (n, 2), m; Gauss quadrature."""
        nodes, weights = RULE
        half = np.diff(stations)[:, None] / 2
        theta = self.direction(stations[:-1, None] + half + half * nodes)
        steps = np.stack([np.cos(theta), np.sin(theta)], axis=-1) * (weights * half)[..., None]
        return self.length * np.concatenate([np.zeros((1, 2)), np.cumsum(steps.sum(axis=1), axis=0)])


def _bow(chord: float, bow: float) -> CurvedLine:
    """Return a half-sine bow: theta = A cos(pi s), so |r'| = 1 exactly; bow = A l/pi at mid-span to order A^2."""
    amplitude = np.pi * bow / chord
    unit = CurvedLine(1.0, lambda s: amplitude * np.cos(np.pi * s))
    unit_chord = float(unit.places(np.linspace(0.0, 1.0, 9))[-1, 0])
    return CurvedLine(chord / unit_chord, unit.direction)


SAMPLES = 401
"""Places taken from a shape given as a function."""


def _spline(chord: float, shape: Shape) -> CurvedLine:
    """Return the line through points, or of a function, scaled and turned to a chord: cubic in the arc length."""
    from scipy.interpolate import CubicSpline

    if callable(shape):
        points = np.array([shape(float(s)) for s in np.linspace(0.0, 1.0, SAMPLES)], dtype=float)
    else:
        points = np.array(shape, dtype=float)
    if points.ndim != 2 or points.shape[1] != 2 or not np.isfinite(points).all():
        raise ValueError("shape: must give finite (x, y)")
    ends = complex(*(points[-1] - points[0]))
    steps = np.hypot(*np.diff(points, axis=0).T)
    if not abs(ends) > 0 or not steps.min() > 0:
        raise ValueError("shape: neighbouring points, and the two ends, must differ")
    place = ((points[:, 0] + 1j * points[:, 1]) - complex(*points[0])) * chord / ends
    along = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(place)))])
    rough = CubicSpline(along, np.column_stack([place.real, place.imag]))
    fine = np.linspace(0.0, along[-1], 20 * SAMPLES)
    slope = rough(fine, 1)
    arc = np.concatenate([[0.0], np.cumsum(np.diff(fine) * (np.hypot(*slope[1:].T) + np.hypot(*slope[:-1].T)) / 2)])
    direction = CubicSpline(arc / arc[-1], np.unwrap(np.arctan2(slope[:, 1], slope[:, 0])))
    curve = CurvedLine(1.0, direction)
    end = complex(*curve.places(np.linspace(0.0, 1.0, 65))[-1])
    angle = float(np.angle(end))
    return CurvedLine(chord / abs(end), lambda s: direction(s) - angle)
