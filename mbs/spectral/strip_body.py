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
from .tables import MarkerKind, Markers, MeasureKind, StripKind

Line = Callable[[Array], tuple[Array, Array, Array]]
"""Function from fractions of the arc (points,) to x, y and tangent angle there."""


@dataclass
class StripBody:
    """Strip: its polynomial pieces, and the arc lengths of its points."""

    kind: int  # of `StripKind`
    elements: list[Piece]
    stations: dict[str, float]  # arc length from the start to each point of the strip [m]
    length: float  # stress-free arc length [m]
    start: Array  # place of its start at t = 0 [m], (2,)
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
        dofs = element.dofs[:, used].ravel().tolist()
        return builder.add_marker(MarkerKind.LINEAR, 0, len(used), dofs, np.tile(value[used], 3))

    def rigid_motion(self, builder: Builder) -> Array:
        """Return the rates of all coordinates (n, 3) for unit rates of x, y of the strip's start and of its angle, at t = 0.

        The first two coefficients of a polynomial are its values at the ends of the piece; the others do not move with the start.
        """
        out, q = np.zeros((len(builder.q), 3)), np.array(builder.q)
        for element in self.elements:
            x_dofs, y_dofs, *angle_dofs = element.dofs
            x, y = q[x_dofs], q[y_dofs]
            x[:2] -= self.start[0]
            y[:2] -= self.start[1]
            out[x_dofs[:2], 0] = out[y_dofs[:2], 1] = 1.0
            out[x_dofs, 2], out[y_dofs, 2] = -y, x
            for dofs in angle_dofs:
                out[dofs[:2], 2] = 1.0
        return out

    def bending_rates(self, builder: Builder, start: Start, link: Link) -> Array:
        """Return the rates of all coordinates (n,) by which the initial velocities of the mechanism bend the strip."""
        out = np.zeros(len(builder.q))
        line, arc, fractions = shape_of(link, builder.mechanism.length(link.name))
        abscissae = {point: float(line(np.array([fraction]))[0][0]) for point, fraction in fractions.items()}  # along the chord
        for element in self.elements:
            for i, dofs in enumerate(element.dofs):

                def interpolate(xi: Array, i: int = i, element: Piece = element) -> Array:
                    """Interpolate component i of the bending velocity (vx, vy, spin) of the link's points at xi of the piece."""
                    x, _, _ = line((element.start + (xi + 1) * element.jacobian) / arc)
                    return start.interpolate(link, abscissae, x)[:, i]

                out[dofs] = fit(element.degree, interpolate, tuple(interpolate(np.array([-1.0, 1.0]))))
        return out


def add_strip(builder: Builder, link: Link, kind: int) -> StripBody:
    """Add a `Beam` (Reissner) or `Cable` (Kirchhoff) link in its stress-free shape."""
    start, _, chord, angle = line_of(builder, link)
    line, arc, fractions = shape_of(link, chord)
    breaks = sorted({0.0, 1.0, *fractions.values()})
    fields = 3 if kind == StripKind.REISSNER else 2
    has_one_piece = len(breaks) == 2
    degree = builder.degree if has_one_piece else max(3, builder.degree - 2)  # two less for shorter pieces, however many
    elements, c, s = [], np.cos(angle), np.sin(angle)
    shared: list[int] = []  # coordinates of the end of the piece before
    for left, right in pairwise(breaks):
        values = _fit_strip(line, left, right, degree, fields)
        placed = np.array([c * values[0] - s * values[1], s * values[0] + c * values[1], *values[2:]])
        placed[:2, :2] += start[:, None]  # the first two coefficients are the values at the ends
        if fields == 3:
            placed[2, :2] += angle
        dofs = np.zeros((fields, degree + 1), dtype=int)
        for i in range(fields):
            own = placed[i, 1:] if shared else placed[i]
            first = builder.add_coordinates(own.tolist())
            dofs[i] = [*shared[i : i + 1], *range(first, first + len(own))]
        if fields == 3:
            builder.set_angle_units(*dofs[2].tolist())
        shared = dofs[:, 1].tolist()
        x_inner, y_inner = dofs[:2, 2:].tolist()
        builder.group_deformations(x_inner, y_inner, chord=dofs[:2, :2].T.ravel().tolist())
        elements.append(Piece(left * arc, right * arc, dofs))
    stations = {point: fraction * arc for point, fraction in fractions.items()}
    body = StripBody(kind, elements, stations, arc, start, link.body.section)
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


def _fit_strip(line: Line, start: float, end: float, degree: int, fields: int) -> Array:
    """Fit the coefficients of x, y and, with 3 fields, angle on a piece, in the link's frame; shape (fields, degree + 1)."""
    ends = line(np.array([start, end]))

    def fit_field(i: int) -> Array:
        return fit(degree, lambda x: line(start + (end - start) * (x + 1) / 2)[i], tuple(ends[i]))

    return np.array([fit_field(i) for i in range(fields)])


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
    builder.strips.append((body.kind, degree + 1, points, len(builder.dofs), data))  # columns of `StripColumn`
    builder.dofs += element.dofs.ravel().tolist()


def _attach(builder: Builder, body: StripBody, each: Attached, link: str) -> None:
    """Add a mass at a point: as a body of its own if it has inertia and the marker is not linear, else to the mass matrix."""
    marker = body.marker(builder, each.point)
    kind, size, first, data = (builder.markers[marker][c] for c in (Markers.KIND, Markers.SIZE, Markers.FIRST, Markers.DATA))
    if kind != MarkerKind.LINEAR and each.inertia:
        add_separate_mass(builder, marker, each, link)
        return
    value = np.array(builder.data[data : data + size])
    gravity = builder.mechanism.gravity
    for i, amount in enumerate((each.mass, each.mass, each.inertia)):
        dofs = builder.dofs[first + i * size : first + (i + 1) * size]
        if amount:
            builder.add_mass(dofs, amount * np.outer(value, value))
            if i < 2:
                builder.add_weight(dofs, amount * gravity[i] * value)
