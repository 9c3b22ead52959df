"""Strips of finite elements: shear-deformable beams and shear-rigid cables, straight or of any stress-free shape.

The chord is the line from start to end. A stress-free shape is kept as its tangent angle theta over the fraction s of the arc
length. Places are integrals of (cos theta, sin theta), so that the arc length is exact.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ..declare import Either, Several, Vector, declared, field, part, quantity, whole
from ..functions.fields import Function
from ..geometry import Array, cross
from ..laws.pieces import Reals
from .element import Body, LinkBase, Recorded
from .section import Profile, Section
from .signal import Kind, Signal

DEFAULT_ELEMENTS = 8
"""Default number of finite elements of a strip; chosen. The spectral solver has none."""
RULE = np.polynomial.legendre.leggauss(12)
"""Twelve Gauss points and weights for the integral of the tangent over each piece of the arc."""
PANELS = 64
"""Equal pieces of the arc in the integral of a place, each by `RULE`.

The cubic spline through a shape's points has jumps of its third derivative within the pieces. They limit the error: at the end
of a strip with three waves it is 1e-6 of the length, with ten times as many pieces 2e-10."""
SAMPLES = 401
"""Points at which a shape's function is sampled; the error of the cubic spline falls with their number to the power -4."""
Shape = Sequence[tuple[float, float]] | Callable[[float], tuple[float, float]]
"""Stress-free shape: points (x, y) [m], or a function of the fraction of the arc length that returns a point."""
SHAPE_FORMS = Either((Function("s", "m", size=2), Several(Vector("m"), least=3)))
ELEMENTS_DOC = f"number in Exudyn's first run, {DEFAULT_ELEMENTS} by default; with an accuracy each finer run has twice as many"
BOW_DOC = "stress-free half-sine bow at mid-span, positive to the left of the direction from start to end"
SHAPE_DOC = (
    "stress-free shape instead of a bow: points from start to end, or a function of the fraction of the arc length, in [0, 1]; "
    "it is turned and scaled so that its ends are the link's points"
)


class Flexible(Body):
    """Base of strips of finite elements: beams and cables. `Body` describes the class variables."""

    section: Section | Profile
    meshed: ClassVar[bool] = True
    carried_point_forms: ClassVar[tuple[str, ...]] = ("fraction",)
    force_rounding: ClassVar[float] = 5e-12  # ten times the rounding error of the elements' forces, over E A
    elements: int | None
    nodes: int
    imperfection: float
    shape: Shape | None

    def agree(self) -> None:
        """Raise a ValueError if both an imperfection and a shape are given."""
        if self.imperfection and self.shape is not None:
            raise ValueError(f"imperfection = {self.imperfection:g} m and shape: give one of them")

    @property
    def count(self) -> int:
        """Number of finite elements."""
        return self.elements or DEFAULT_ELEMENTS

    @property
    def node_stride(self) -> int:
        """Difference of the indices of an element's last and first node; the last one is the first of the next element."""
        return self.nodes - 1

    def curve(self, chord: float) -> CurvedLine:
        """Return the stress-free shape for a length of the chord [m].

        The half-sine bow is theta = A cos(pi s), A = pi imperfection/chord. Its height is the imperfection up to a relative error
        of A^2.
        """
        if self.shape is not None:
            return _spline(chord, self.shape)
        amplitude = np.pi * self.imperfection / chord
        unit = CurvedLine(1.0, lambda s: amplitude * np.cos(np.pi * s))
        unit_chord = float(unit.places(np.linspace(0.0, 1.0, 9))[-1, 0])  # 8 pieces: exact to rounding up to A = 6
        return CurvedLine(chord / unit_chord, unit.direction)

    def place_at(self, chord: float, fraction: float) -> tuple[float, float]:
        """Return the place at a fraction of the stress-free arc length in the link's frame [m], for a length of the chord [m]."""
        if not self.imperfection and self.shape is None:
            return chord * fraction, 0.0
        x, y = self.curve(chord).places(np.linspace(0.0, fraction, PANELS + 1))[-1]
        return float(x), float(y)

    def signals(self, link: LinkBase, record: Recorded) -> Iterator[Signal]:
        """Yield end shortening (arc length minus chord) [m], tension [N], and deflection of mid-length from the chord [m]."""
        strip = record.links[link.name]
        (start, _), (end, _) = strip.point(link.start), strip.point(link.end)  # places, without velocities
        chord, middle = end - start, strip.middle() - start
        span = np.hypot(*chord.T)
        yield Signal(f"{link.name}.end_shortening", strip.length - span, "m", Kind.STRETCH)
        yield Signal(f"{link.name}.axial_force", strip.axial_force(), "N", Kind.INTERNAL)
        yield Signal(f"{link.name}.deflection", cross(chord, middle) / span, "m", Kind.PLACE)


@declared
class Beam(Flexible):
    """A flexible link of geometrically exact (shear-deformable) beam elements.

    >>> Beam(Section(width=0.03, thickness=3e-4), elements=6, imperfection=-3e-5).nodes
    3
    """

    section: Section | Profile = part(Section, Profile, doc="of the strip")
    elements: int | None = whole(1, 1000, doc=ELEMENTS_DOC, default=None)
    nodes: int = whole(2, 3, doc="of an element: 2 (linear) or 3 (quadratic), far more accurate at the same cost", default=3)
    imperfection: float = quantity("m", low=-1, high=1, doc=BOW_DOC, default=0.0)
    shape: Shape | None = field(SHAPE_FORMS, SHAPE_DOC, default=None)


@declared
class Cable(Flexible):
    """A flexible link of shear-rigid ANCF cable elements (cubic Hermite).

    >>> Cable(Section(width=0.03, thickness=3e-4), elements=8).elements
    8
    """

    section: Section | Profile = part(Section, Profile, doc="of the strip")
    elements: int | None = whole(1, 1000, doc=ELEMENTS_DOC, default=None)
    imperfection: float = quantity("m", low=-1, high=1, doc=BOW_DOC, default=0.0)
    shape: Shape | None = field(SHAPE_FORMS, SHAPE_DOC, default=None)

    nodes: ClassVar[int] = 2  # type: ignore[misc]
    has_angles: ClassVar[bool] = False  # nodes have slopes


@dataclass(frozen=True)
class CurvedLine:
    """Stress-free line of a `length` [m]; `direction` is theta [rad] as a function of an array of fractions s."""

    length: float
    direction: Callable[[Reals], Reals]

    def places(self, fractions: Array) -> Array:
        """Integrate the places (n, 2) [m] at increasing fractions (n,) in [0, 1], the first of them 0, by Gauss quadrature."""
        nodes, weights = RULE
        half = np.diff(fractions)[:, None] / 2
        theta = self.direction(fractions[:-1, None] + half + half * nodes)  # (n - 1, points of `RULE`)
        steps = np.stack([np.cos(theta), np.sin(theta)], axis=-1) * (weights * half)[..., None]
        return self.length * np.concatenate([np.zeros((1, 2)), np.cumsum(steps.sum(axis=1), axis=0)])


def _spline(chord: float, shape: Shape) -> CurvedLine:
    """Return the smooth line through a shape's points x + i y, scaled and turned onto the chord.

    A first cubic spline over the polygon's length gives the arc length, by the trapezoidal rule. A second spline gives theta over
    the fraction of the arc length. Its line is turned and scaled once more, as its ends miss the chord by the spline's error.
    """
    from scipy.interpolate import CubicSpline

    given = [shape(s) for s in np.linspace(0.0, 1.0, SAMPLES).tolist()] if callable(shape) else shape
    points = np.array(given, dtype=float)
    if points.ndim != 2 or points.shape[1] != 2 or not np.isfinite(points).all():
        raise ValueError("shape: must give finite (x, y)")
    span = complex(*(points[-1] - points[0]))  # its length and angle: a division by it scales and turns
    steps = np.hypot(*np.diff(points, axis=0).T)
    if not abs(span) > 0 or not steps.min() > 0:
        raise ValueError("shape: neighbouring points, and the two ends, must differ")
    place = ((points[:, 0] + 1j * points[:, 1]) - complex(*points[0])) * chord / span
    polygon = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(place)))])
    line = CubicSpline(polygon, np.column_stack([place.real, place.imag]))
    fine = np.linspace(0.0, polygon[-1], 20 * SAMPLES)  # the trapezoidal rule has order 2 only
    tangent = line(fine, 1)
    speed = np.hypot(*tangent.T)
    arc = np.concatenate([[0.0], np.cumsum(np.diff(fine) * (speed[1:] + speed[:-1]) / 2)])
    direction = CubicSpline(arc / arc[-1], np.unwrap(np.arctan2(tangent[:, 1], tangent[:, 0])))
    end = complex(*CurvedLine(1.0, direction).places(np.linspace(0.0, 1.0, PANELS + 1))[-1])
    angle = float(np.angle(end))
    return CurvedLine(chord / abs(end), lambda s: direction(s) - angle)
