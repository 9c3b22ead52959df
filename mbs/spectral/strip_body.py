"""A strip for the compiled solver: pieces between the points on it, sums of integrated Legendre polynomials (`basis`).

The fields are x, y and, for Reissner's strip, the angle; their coefficients are coordinates. The first two coefficients are the
values at the ends of the piece; neighbouring pieces share those of their common end. xi runs from -1 to 1 along a piece.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import NamedTuple, cast

import numpy as np

from ..elements import Link, Profile, Section
from ..elements.beam import Flexible
from ..geometry import Array
from ..scene.start import Start
from .basis import basis, fit, gauss
from .builder import Attached, Builder
from .frame_body import add_separate_mass, line_of
from .motion import Piece, kirchhoff, locate, reissner
from .tables import MarkerKind, MeasureKind, StripColumn, StripKind

Line = Callable[[Array], tuple[Array, Array, Array]]
"""Function from fractions of the arc (points,) to x, y [m] and tangent angle [rad] there."""


class StripShape(NamedTuple):
    """Stress-free shape of a strip, in its frame: origin at the start, x axis along the chord."""

    line: Line
    length: float  # arc length [m]
    fractions: dict[str, float]  # of the arc, from the start to each point of the strip


@dataclass
class StripBody:
    """Strip: its polynomial pieces, and the arc lengths of its points."""

    kind: int  # of `StripKind`
    pieces: list[Piece]
    stations: dict[str, float]  # arc length from the start to each point of the strip [m]
    start: Array  # place of its start at t = 0 [m], (2,)
    section: Section | Profile

    def marker(self, builder: Builder, point: str) -> int:
        """Return the marker of a point on the strip."""
        if point not in self.stations:
            raise ValueError(f"a strip does not reach point '{point}': it has {', '.join(self.stations)}")
        return self.marker_at(builder, self.stations[point])

    def marker_at(self, builder: Builder, arc: float, index: int | None = None) -> int:
        """Return the marker at an arc length [m]; between two pieces on the first, unless the `index` of one is given."""
        piece, position = locate(self.pieces if index is None else [self.pieces[index]], arc)
        xi = np.array([position])
        value = basis(piece.degree, xi)[0]
        if self.kind == StripKind.KIRCHHOFF:
            slope = basis(piece.degree, xi, 1)[0] / piece.half_length
            dofs, numbers = piece.dofs.ravel().tolist(), [*value, *slope]
            return builder.add_marker(MarkerKind.CURVE, len(value), dofs, numbers)
        used = np.flatnonzero(np.abs(value) > 1e-15)  # at an end all polynomials but one are zero
        dofs = piece.dofs[:, used].ravel().tolist()
        factors = np.tile(value[used], 3)  # the same in x, y and angle
        return builder.add_marker(MarkerKind.LINEAR, len(used), dofs, factors)

    def rigid_motion(self, builder: Builder) -> Array:
        """Return the rates of all coordinates (n, 3) for unit rates of x, y of the strip's start and of its angle, at t = 0."""
        out, q = np.zeros((len(builder.q), 3)), np.array(builder.q)
        for piece in self.pieces:
            x_dofs, y_dofs, *angle_dofs = piece.dofs
            x, y = q[x_dofs], q[y_dofs]
            x[:2] -= self.start[0]  # only the first two coefficients, the values at the ends, move with the start
            y[:2] -= self.start[1]
            out[x_dofs[:2], 0] = out[y_dofs[:2], 1] = 1.0
            out[x_dofs, 2], out[y_dofs, 2] = -y, x
            for dofs in angle_dofs:
                out[dofs[:2], 2] = 1.0
        return out

    def bending_rates(self, builder: Builder, start: Start, link: Link) -> Array:
        """Return the rates of all coordinates (n,) by which the initial velocities `start` of the mechanism bend the strip."""
        out = np.zeros(len(builder.q))
        shape = find_shape(link, builder.mechanism.length(link.name))
        x_of_points = shape.line(np.array([*shape.fractions.values()]))[0]
        along_chord = dict(zip(shape.fractions, x_of_points.tolist(), strict=True))  # x of each point on the chord [m]

        def interpolate(piece: Piece, i: int, xi: Array) -> Array:
            """Interpolate component i of the bending velocity (vx, vy, spin) at xi in [-1, 1] of a piece."""
            x, _, _ = shape.line((piece.start + (xi + 1) * piece.half_length) / shape.length)
            return start.interpolate(link, along_chord, x)[:, i]

        for piece in self.pieces:
            for i, dofs in enumerate(piece.dofs):
                component = partial(interpolate, piece, i)
                out[dofs] = fit(piece.degree, component, tuple(component(np.array([-1.0, 1.0]))))
        return out


def add_strip(builder: Builder, link: Link, kind: int) -> StripBody:
    """Add a `Beam` (Reissner) or `Cable` (Kirchhoff) link in its stress-free shape."""
    start, chord, angle = line_of(builder, link)
    shape = find_shape(link, chord)
    breaks = sorted({0.0, 1.0, *shape.fractions.values()})
    has_one_piece = len(breaks) == 2
    degree = builder.degree if has_one_piece else max(3, builder.degree - 2)  # chosen: two less, as pieces are shorter
    fields = 3 if kind == StripKind.REISSNER else 2  # x, y and, with shear, the angle
    pieces: list[Piece] = []
    for left, right in pairwise(breaks):
        coefficients = _fit_piece(shape.line, left, right, degree, fields)
        x, y = coefficients[:2]
        coefficients[:2] = np.cos(angle) * x - np.sin(angle) * y, np.sin(angle) * x + np.cos(angle) * y
        coefficients[:2, :2] += start[:, None]  # the first two coefficients are the values at the ends
        coefficients[2:, :2] += angle
        dofs = _add_coordinates(builder, coefficients, pieces[-1] if pieces else None)
        pieces.append(Piece(left * shape.length, right * shape.length, dofs))
    stations = {point: fraction * shape.length for point, fraction in shape.fractions.items()}
    body = StripBody(kind, pieces, stations, start, link.body.section)
    for i, piece in enumerate(pieces):
        _add_piece_mass(builder, body.section, piece)
        _tabulate(builder, body, piece)
        if i and kind == StripKind.KIRCHHOFF:  # a common end does not give a common direction
            a, b = (body.marker_at(builder, piece.start, each) for each in (i - 1, i))
            builder.add_row(f"{link.name}.slope", [builder.add_measure(MeasureKind.ANGLE, a, b)])
    for each in builder.attached.get(link.name, ()):
        _attach(builder, body, each, link.name)
    return body


def find_shape(link: Link, chord: float) -> StripShape:
    """Find the stress-free shape of a link: its tangent integrated by Gauss's rule with 8 points in each of 256 intervals."""
    # for a cubic spline of three waves through 17 points the error is 3e-9 of the length; with a tenth of the intervals 1e-5
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
    return StripShape(line, float(curve.length), {link.start: 0.0, link.end: 1.0, **inner})


def _fit_piece(line: Line, start: float, end: float, degree: int, fields: int) -> Array:
    """Fit the coefficients of a piece between two fractions of the arc, in the link's frame; (fields, degree + 1)."""

    def evaluate(i: int, xi: Array) -> Array:
        """Evaluate field i (x, y, angle) at xi in [-1, 1]."""
        return line(start + (end - start) * (xi + 1) / 2)[i]

    ends = line(np.array([start, end]))
    return np.array([fit(degree, partial(evaluate, i), tuple(ends[i])) for i in range(fields)])


def _add_coordinates(builder: Builder, coefficients: Array, before: Piece | None) -> Array:
    """Add the coefficients of a piece, (fields, degree + 1), as coordinates; return their dofs in the same shape."""
    dofs, first_new = np.zeros(coefficients.shape, dtype=int), 0
    if before is not None:  # coefficient 0 is the value at the start, coefficient 1 that at the end
        dofs[:, 0], first_new = before.dofs[:, 1], 1
    for own, values in zip(dofs[:, first_new:], coefficients[:, first_new:], strict=True):
        own[:] = builder.add_coordinates(values.tolist()) + np.arange(len(values))
    for angle_dofs in dofs[2:]:
        builder.angles.update(angle_dofs.tolist())
    x_inner, y_inner = dofs[:2, 2:].tolist()
    chord = dofs[:2, :2].T.ravel().tolist()  # x and y of the start, then of the end
    builder.group_deformations(x_inner, y_inner, chord=chord)  # for the units of the error control
    return dofs


def _add_piece_mass(builder: Builder, section: Section | Profile, piece: Piece) -> None:
    """Add the mass matrix and the weight of a piece."""
    x, w = gauss(piece.degree + 2)
    polynomials, lengths = basis(piece.degree, x), w * piece.half_length
    gram = (polynomials * lengths[:, None]).T @ polynomials
    gram[np.abs(gram) < 1e-14 * gram.max()] = 0.0  # polynomials that are orthogonal but for rounding
    total = (polynomials * lengths[:, None]).sum(axis=0)
    _add_mass(builder, piece.dofs, section.mass_per_length, section.inertia_per_length, gram, total)


def _add_mass(builder: Builder, fields: Array, mass: float, inertia: float, gram: Array, values: Array) -> None:
    """Add mass and inertia times the matrix `gram` (m, m), and weight times `values` (m,), at `fields` (fields, m) of dofs."""
    x_dofs, y_dofs, *angle_dofs = fields
    if mass:
        for dofs, gravity in zip((x_dofs, y_dofs), builder.mechanism.gravity, strict=True):
            builder.add_mass(dofs, mass * gram)
            builder.add_weight(dofs, mass * gravity * values)
    if inertia:
        for dofs in angle_dofs:
            builder.add_mass(dofs, inertia * gram)


def _tabulate(builder: Builder, body: StripBody, piece: Piece) -> None:
    """Add the row of a piece to the table of strips, with its numbers in the order of `StripData`."""
    section, degree = body.section, piece.degree
    is_reissner = body.kind == StripKind.REISSNER
    points = degree if is_reissner else degree + 1  # docs/theory-spectral.md, Bodies
    xi, weights = gauss(points)
    # polynomials and their first and second derivatives by the arc length, each (points, degree + 1)
    functions = [basis(degree, xi, order) / piece.half_length**order for order in range(3)]
    coefficients = np.array(builder.q)[piece.dofs]  # (fields, degree + 1)
    fields = [each @ coefficients.T for each in functions]
    at_rest = [np.zeros_like(each) for each in fields]
    free_strains, _ = (reissner if is_reissner else kirchhoff)(fields, at_rest)  # axial, shear, bending, each (points,)
    material = section.material
    data = builder.add_numbers(
        section.axial_stiffness, section.shear_stiffness, section.bending_stiffness,
        material.bending_damping, material.axial_damping, weights * piece.half_length, *free_strains, *functions,
    )  # fmt: skip
    first_point = sum(row[StripColumn.POINTS] for row in builder.strips)
    builder.strips.append((body.kind, degree + 1, points, len(builder.dofs), data, first_point))  # columns of `StripColumn`
    builder.dofs += piece.dofs.ravel().tolist()


def _attach(builder: Builder, body: StripBody, each: Attached, link: str) -> None:
    """Add a mass at a point: as a body of its own if it has inertia and the marker is not linear, else to the mass matrix."""
    marker = body.marker(builder, each.point)
    row = builder.markers[marker]
    if row.kind != MarkerKind.LINEAR and each.inertia:
        add_separate_mass(builder, marker, each, link)
        return
    values = np.array(builder.data[row.data : row.data + row.size])
    fields = np.reshape(builder.dofs[row.first : row.first + row.dof_count], (-1, row.size))  # x, y and, if linear, the angle
    _add_mass(builder, fields, each.mass, each.inertia, np.outer(values, values), values)
