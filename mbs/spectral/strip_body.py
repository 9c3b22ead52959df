"""A strip for the compiled solver: pieces between the points on it, sums of integrated Legendre polynomials (`basis`).

The coefficients of x, y and, for Reissner's strip, the angle are coordinates. The first two are the values at the ends of the
piece; neighbouring pieces share those of their common end.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import cast

import numpy as np

from ..elements import Link, Profile, Section
from ..elements.beam import Flexible
from ..geometry import Array
from ..scene.start import Start
from .basis import basis, fit, gauss
from .builder import Attached, Builder
from .frame_body import add_separate_mass, line_of
from .motion import Piece, kirchhoff, reissner
from .tables import MarkerKind, MeasureKind, StripKind

Line = Callable[[Array], tuple[Array, Array, Array]]
"""Function from fractions of the arc (points,) to x, y and tangent angle there."""


@dataclass
class StripBody:
    """Strip: its polynomial pieces, and the arc lengths of its points."""

    offset: int  # first coordinate
    kind: int  # REISSNER or KIRCHHOFF
    elements: list[Piece]
    stations: dict[str, float]  # arc length from the start to each point of the strip [m]
    length: float  # stress-free arc length [m]
    start: Array  # place of its start at t = 0 [m], (2,)
    rigid: Array  # rates of its coordinates for unit rates of start and angle, (coordinates, 3)
    section: Section | Profile

    def marker(self, builder: Builder, point: str) -> int:
        """Return the marker of a point on the strip."""
        if point not in self.stations:
            raise ValueError(f"a strip does not reach point '{point}': it has {', '.join(self.stations)}")
        return self.marker_at(builder, self.stations[point])

    def marker_at(self, builder: Builder, arc: float, piece: int | None = None) -> int:
        """Return the marker at an arc length [m]; between two pieces on the first, unless the index `piece` is given."""
        if piece is None:
            piece = next((i for i, e in enumerate(self.elements) if arc <= e.end * (1 + 1e-12)), len(self.elements) - 1)
        element = self.elements[piece]
        x = np.clip((arc - element.start) / element.jacobian - 1.0, -1.0, 1.0)
        degree = element.degree
        value = basis(degree, x)[0]
        if self.kind == StripKind.KIRCHHOFF:  # below, 0 is the offset, which markers of strips do not use
            slope = basis(degree, x, 1)[0] / element.jacobian
            return builder.add_marker(MarkerKind.CURVE, 0, degree + 1, element.dofs.ravel().tolist(), [*value, *slope])
        used = np.flatnonzero(np.abs(value) > 1e-15)  # at an end all polynomials but one are zero
        places = element.dofs[:, used].ravel().tolist()
        return builder.add_marker(MarkerKind.LINEAR, 0, len(used), places, np.tile(value[used], 3))

    def rigid_motion(self, builder: Builder) -> Array:
        """Return the rates of all coordinates (n, 3) for unit rates of x, y of the strip's start and of its angle."""
        out = np.zeros((len(builder.q), 3))
        out[self.offset : self.offset + len(self.rigid)] = self.rigid
        return out

    def bending_rates(self, builder: Builder, start: Start, link: Link) -> Array:
        """Return the rates of all coordinates (n,) by which the initial velocities of the mechanism bend the strip."""
        out = np.zeros(len(builder.q))
        line, arc, fractions = shape_of(link, builder.mechanism.length(link.name))
        abscissae = {point: float(line(np.array([fraction]))[0][0]) for point, fraction in fractions.items()}
        for element in self.elements:
            for i, places in enumerate(element.dofs):

                def bending_speed(x: Array, i: int = i, element: Piece = element) -> Array:
                    """Return component i of the bending speed at x of the piece."""
                    return start.bending(link, abscissae, line((element.start + (x + 1) * element.jacobian) / arc)[0])[:, i]

                out[places] = fit(element.degree, bending_speed, tuple(bending_speed(np.array([-1.0, 1.0]))))
        return out


def add_strip(builder: Builder, link: Link, kind: int) -> StripBody:
    """Add a `Beam` (Reissner) or `Cable` (Kirchhoff) link in its stress-free shape."""
    start, _, chord, angle = line_of(builder, link)
    line, arc, fractions = shape_of(link, chord)
    breaks = sorted({0.0, 1.0, *fractions.values()})
    fields = 3 if kind == StripKind.REISSNER else 2
    degree = builder.degree if len(breaks) == 2 else max(3, builder.degree - 2)  # shorter pieces need less
    elements, first, rigid = [], len(builder.q), []
    c, s = np.cos(angle), np.sin(angle)
    shared: list[int] = []  # coordinates of the end of the piece before
    for left, right in pairwise(breaks):
        values = _fit_strip(line, left, right, degree, kind)
        placed = np.array([c * values[0] - s * values[1], s * values[0] + c * values[1], *values[2:]])
        placed[:2, :2] += start[:, None]  # the first two coefficients are the values at the ends
        if fields == 3:
            placed[2, :2] += angle
        places = np.zeros((fields, degree + 1), dtype=int)
        for i in range(fields):
            for j in range(degree + 1):
                if j == 0 and shared:
                    places[i, j] = shared[i]
                    continue
                places[i, j] = builder.add_coordinates((placed[i, j],))
                x, y = placed[:2, j] - (start if j < 2 else 0.0)
                rate = float(j < 2)  # only values at an end move with the start
                if i == 2:
                    builder.set_angle_units(int(places[i, j]))
                rigid.append([[rate, 0, -y], [0, rate, x], [0, 0, rate]][i])
        shared = places[:, 1].tolist()
        x_inner, y_inner = places[:2, 2:].tolist()
        builder.group_deformations(x_inner, y_inner, chord=places[:2, :2].T.ravel().tolist())
        elements.append(Piece(left * arc, right * arc, places))
    stations = {point: fraction * arc for point, fraction in fractions.items()}
    body = StripBody(first, kind, elements, stations, arc, start, np.array(rigid), link.body.section)
    for i, element in enumerate(elements):
        _tabulate(builder, body, element)
        if i and kind == StripKind.KIRCHHOFF:
            a, b = (body.marker_at(builder, element.start, piece) for piece in (i - 1, i))
            builder.add_row(f"{link.name}.slope", [(1.0, builder.add_measure(MeasureKind.ANGLE, a, b))])
    for each in builder.attached.get(link.name, ()):
        _attach(builder, body, each, link.name)
    return body


def shape_of(link: Link, chord: float) -> tuple[Line, float, dict[str, float]]:
    """Return a link's stress-free line in its frame over the fraction of the arc, its arc length [m], its points' fractions.

    Positions integrate the direction by Gauss's rule from a grid of 256 intervals.
    """
    curve = cast(Flexible, link.body).curve(chord)
    grid = np.linspace(0.0, 1.0, 257)
    on_grid = curve.places(grid)
    nodes, weights = gauss(8)

    def line(fraction: Array) -> tuple[Array, Array, Array]:
        """Return x, y and tangent angle at fractions of the arc."""
        fraction = np.atleast_1d(np.asarray(fraction, dtype=float))
        left = np.minimum((fraction * 256).astype(int), 255)
        half = (fraction - grid[left])[:, None] / 2
        angle = curve.direction(grid[left][:, None] + half * (1 + nodes))
        x, y = (on_grid[left, i] + curve.length * (f(angle) * weights * half).sum(axis=1) for i, f in ((0, np.cos), (1, np.sin)))
        return x, y, np.asarray(curve.direction(fraction))

    inner = {point: float(part) for point, part in cast(Mapping[str, float], link.carries).items()}
    return line, float(curve.length), {link.start: 0.0, link.end: 1.0, **inner}


def _fit_strip(line: Line, start: float, end: float, degree: int, kind: int) -> Array:
    """Fit the coefficients of x, y (and angle) on a piece, in the link's frame; shape (fields, degree + 1)."""
    ends, fields = line(np.array([start, end])), range(3 if kind == StripKind.REISSNER else 2)
    return np.array([fit(degree, lambda x: line(start + (end - start) * (x + 1) / 2)[i], tuple(ends[i])) for i in fields])  # noqa: B023


def _tabulate(builder: Builder, body: StripBody, element: Piece) -> None:
    """Add the mass matrix of a piece, and its row in the table of strips."""
    section, jacobian, degree = body.section, element.jacobian, element.degree
    x, w = gauss(degree + 2)
    polynomials = basis(degree, x)
    gram = (polynomials * (w * jacobian)[:, None]).T @ polynomials
    gram[np.abs(gram) < 1e-14 * gram.max()] = 0.0  # polynomials that are orthogonal but for rounding
    total = (polynomials * (w * jacobian)[:, None]).sum(axis=0)
    for i, per_length in enumerate((section.mass_per_length,) * 2 + (section.inertia_per_length,) * (len(element.dofs) - 2)):
        builder.add_mass(element.dofs[i], per_length * gram)
        if i < 2:
            builder.add_weight(element.dofs[i], per_length * builder.mechanism.gravity[i] * total)
    points = degree if body.kind == StripKind.REISSNER else degree + 1  # docs/theory-spectral.md, bodies
    x, w = gauss(points)
    values = [basis(degree, x, i) / jacobian**i for i in range(3)]
    q = np.array(builder.q)[element.dofs]
    fields = [each @ q.T for each in values]
    free_strains, _ = (reissner if body.kind == StripKind.REISSNER else kirchhoff)(fields, [0.0 * each for each in fields])
    material = section.material
    data = builder.add_numbers(
        section.axial_stiffness, section.shear_stiffness, section.bending_stiffness,
        material.bending_damping, material.axial_damping, w * jacobian, *free_strains, *values,
    )  # fmt: skip
    builder.strips.append((body.kind, degree + 1, points, len(builder.dofs), data))
    builder.dofs += element.dofs.ravel().tolist()


def _attach(builder: Builder, body: StripBody, each: Attached, link: str) -> None:
    """Add a mass at a point: as a body of its own if it has inertia and the marker is not linear, else to the mass matrix."""
    marker = body.marker(builder, each.point)
    kind, _, size, first, _, data, _ = builder.markers[marker]
    if kind != MarkerKind.LINEAR and each.inertia:
        add_separate_mass(builder, marker, each, link)
        return
    value = np.array(builder.data[data : data + size])
    gravity = builder.mechanism.gravity
    for i, amount in enumerate((each.mass, each.mass, each.inertia)):
        places = builder.dofs[first + i * size : first + (i + 1) * size]
        if amount:
            builder.add_mass(places, amount * np.outer(value, value))
            if i < 2:
                builder.add_weight(places, amount * gravity[i] * value)
