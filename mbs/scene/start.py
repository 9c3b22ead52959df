"""Velocities at the start, which satisfy drives, given velocities and constraints with the least kinetic energy.

Links move as rigid bodies if the equations allow it. If not, as in a truss of strips, the points of flexible links, here called
stations, have additional velocities. These are the smallest in a norm weighted by the stiffness of the link.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ..elements.element import GROUND, Place, place
from ..elements.link import Link
from ..elements.rows import Along, Row, Turn, row
from ..geometry import Array, rotate_left
from ..mechanism import Mechanism
from .forms import Forms
from .linkage import DEPENDENT, KinematicsError, Linkage, involved_elements, mass_matrix, rank

EXACT = 1e-9
"""Largest residual, relative to the right-hand side or 1, of velocities that satisfy their equations: far above rounding."""


@dataclass(frozen=True)
class Start:
    """Velocities at t = 0: `rates` (links, 3) of start points [m/s] and angles [rad/s] of links as rigid bodies.

    `additional` velocities (vx, vy, spin) by flexible link and point are empty if all links move as rigid bodies.
    """

    linkage: Linkage
    rates: Array
    additional: Mapping[str, Mapping[str, Array]] = field(default_factory=dict)

    def velocity(self, link: str, point: str) -> Array:
        """Return the velocity of a point of a link [m/s]."""
        i = self.linkage.index[link]
        arm = self.linkage.mechanism.points[point] - self.linkage.reference[i, :2]
        rigid = self.rates[i, :2] + self.rates[i, 2] * rotate_left(arm)
        return rigid + self.additional[link][point][:2] if link in self.additional else rigid

    def interpolate(self, link: Link, distances: Mapping[str, float], x: Array) -> Array:
        """Interpolate the additional velocity (vx, vy, spin) of a flexible link at distances x along its chord [m], (n, 3).

        `distances` has x of each of its points [m]. Between points the velocity along the link is linear, and cubic across it.
        """
        if link.name not in self.additional:
            return np.zeros((len(x), 3))
        from scipy.interpolate import CubicHermiteSpline

        (x0, y0), (x1, y1) = (self.linkage.mechanism.points[p] for p in (link.start, link.end))
        along = np.array([x1 - x0, y1 - y0]) / np.hypot(x1 - x0, y1 - y0)
        across = np.array([-along[1], along[0]])
        points = sorted(distances, key=lambda point: distances[point])
        knots, rates = [distances[point] for point in points], np.array([self.additional[link.name][point] for point in points])
        lateral = CubicHermiteSpline(knots, rates[:, :2] @ across, rates[:, 2])
        velocity = np.outer(np.interp(x, knots, rates[:, :2] @ along), along) + np.outer(lateral(x), across)
        return np.column_stack([velocity, lateral(x, 1)])


class Stations:
    """Stations: points of flexible links, each with three additional velocities in the link's axes, weighted by stiffness."""

    def __init__(self, mechanism: Mechanism) -> None:
        links = [link for link in mechanism.links if link.body.flexible]
        self.mechanism = mechanism
        self.points = [Place(link.name, point) for link in links for point in link.points]
        # matrices (3, 3) from weighted velocities, along and across the link and of the angle, to (vx, vy, spin)
        axes: list[Array] = []
        for link in links:
            x, y = np.subtract(mechanism.points[link.end], mechanism.points[link.start])
            length, axial, bending = np.hypot(x, y), link.body.section.axial_stiffness, link.body.section.bending_stiffness
            # a weighted velocity is the velocity times the square root of its stiffness
            stiffnesses = np.array([axial / length, bending / length**3, bending / length])
            turned = np.array([[x / length, -y / length, 0.0], [y / length, x / length, 0.0], [0.0, 0.0, 1.0]])
            axes += [turned / np.sqrt(stiffnesses)] * len(link.points)
        self.axes = np.array(axes).reshape(-1, 3, 3)

    def jacobian(self, rows: Sequence[Row]) -> Array:
        """Compute the derivatives of rows by the weighted velocities of all n stations, (rows, 3 n)."""
        count, points = len(self.points), self.mechanism.points
        origins = {station: (k, complex(*points[station.point])) for k, station in enumerate(self.points)}
        forms = Forms(rows, count, points, locate=lambda end: origins.get(end, (count, 0j)))  # with all other bodies at rest
        poses = np.array([(*points[station.point], 0.0) for station in self.points]).reshape(count, 3)
        _, by_pose = forms.system(poses)
        return np.einsum("rki,kij->rkj", by_pose.reshape(len(rows), count, 3), self.axes).reshape(len(rows), 3 * count)


def compute_jacobians(linkage: Linkage, q: Array) -> tuple[Array, Array]:
    """Compute the rows' derivatives by coordinates of m rigid links, (rows, 3 m), and by n stations, (rows, 3 n)."""
    return linkage.jacobian(q), Stations(linkage.mechanism).jacobian(linkage.rows)


def name_surplus_drives(linkage: Linkage) -> str:
    """Explain that a mechanism has more drives than degrees of freedom; return '' if it has not."""
    matrix = np.hstack(compute_jacobians(linkage, linkage.general_pose))  # not at t = 0, where rows may be dependent by chance
    driven = [k for k in linkage.permanent_rows if k in linkage.motions]  # rows that follow a drive throughout a run
    constraints = [k for k in linkage.permanent_rows if k not in linkage.motions]
    free = matrix.shape[1] - rank(matrix[constraints])
    if len(driven) <= free:
        return ""
    names = ", ".join(f"'{linkage.names[k]}'" for k in driven)
    return f"{len(driven)} drives ({names}) for a mobility of {free}: leave {len(driven) - free} out, or their motions must agree"


def start(linkage: Linkage) -> Start:
    """Compute the velocities at t = 0; raise a KinematicsError at a dead centre or if they contradict each other."""
    rigid, flexible = compute_jacobians(linkage, linkage.reference)
    right, names = linkage.drive_travel(0.0, order=1), list(linkage.names)  # speeds of the drives, 0 in other rows
    stations = Stations(linkage.mechanism)
    for name, given, value in _velocity_rows(linkage.mechanism):
        _, of_links = linkage.make_forms([given]).system(linkage.reference * (1.0, 1.0, 0.0))  # with angles since t = 0
        rigid, flexible = np.vstack([rigid, of_links]), np.vstack([flexible, stations.jacobian([given])])
        right, names = np.append(right, value), [*names, name]
    weighted, residual = _solve_flexible(rigid, flexible, right)
    scale = max(1.0, np.abs(right).max(initial=0.0))
    gap = float(np.abs(residual).max(initial=0.0))
    if gap > EXACT * scale:
        involved = ", ".join(f"'{name}'" for name in involved_elements(names, residual))
        reasons = [f"{involved} contradict each other, or the linkage is at a dead centre", name_surplus_drives(linkage)]
        raise KinematicsError(f"velocities at t = 0 s do not exist (gap {gap:.3g}): {'; '.join(filter(None, reasons))}")
    rates = _least_energy(mass_matrix(linkage), rigid, right - flexible @ weighted).reshape(-1, 3)
    velocities = np.einsum("kij,kj->ki", stations.axes, weighted.reshape(-1, 3))
    additional: dict[str, dict[str, Array]] = {}
    if np.abs(velocities).max(initial=0.0) > EXACT * scale:
        for (link, point), velocity in zip(stations.points, velocities, strict=True):
            additional.setdefault(link, {})[point] = velocity
    return Start(linkage, rates, additional)


def _solve_flexible(rigid: Array, flexible: Array, right: Array) -> tuple[Array, Array]:
    """Return the least weighted velocities of stations with which rigid motions satisfy the rows, and the rows' residual."""
    scale = max(1.0, np.abs(right).max(initial=0.0))
    missing = right - rigid @ np.linalg.lstsq(rigid, right, rcond=DEPENDENT)[0] if rigid.size and right.any() else right
    if not flexible.size or np.abs(missing).max(initial=0.0) <= EXACT * scale:
        return np.zeros(flexible.shape[1]), missing
    projector = np.eye(len(right)) - rigid @ np.linalg.pinv(rigid, rcond=DEPENDENT)  # removes all that rigid motions can do
    weighted = np.linalg.pinv(projector @ flexible, rcond=DEPENDENT) @ missing
    return weighted, missing - projector @ flexible @ weighted


def _least_energy(mass: Array, rows: Array, right: Array) -> Array:
    """Return the rates u with rows u = right and the least u^T mass u, by least squares in coordinates of unit mass."""
    if not right.any():
        return np.zeros(len(mass))
    unit = 1 / np.sqrt(np.diag(mass))
    try:
        factor = np.linalg.cholesky(mass * np.outer(unit, unit))  # scaled to a diagonal of ones
    except np.linalg.LinAlgError:
        raise KinematicsError("velocities at t = 0 s: masses differ by too many orders of magnitude; check their units") from None
    to_rates = unit[:, None] * np.linalg.inv(factor).T
    rates: Array = to_rates @ np.linalg.lstsq(rows @ to_rates, right, rcond=DEPENDENT)[0]
    residual = right - rows @ rates  # rounding, which is large if masses differ by orders of magnitude
    return rates + to_rates @ np.linalg.lstsq(rows @ to_rates, residual, rcond=DEPENDENT)[0]


def _velocity_rows(mechanism: Mechanism) -> Iterator[tuple[str, Row, float]]:
    """Yield the rows of the given `velocities`: name in messages, row, value of its rate [m/s or rad/s]."""
    for name, value in mechanism.velocities.items():
        where = f"velocities['{name}']"
        if isinstance(value, float):
            yield where, row(Turn(Place(name, ""), Place(GROUND, ""))), value  # without a point: of the link as a rigid body
            continue
        body, point = place(name)  # without a body any link that has the point will do: joints hold them
        moving = Place(body or next(link.name for link in mechanism.links if point in link.points), point)
        for direction, component in zip(((1.0, 0.0), (0.0, 1.0)), value, strict=True):
            yield where, row(Along(moving, Place(GROUND, point), direction)), component
