"""Bodies with a frame: rigid links, and modal links by the planar floating frame of `buckler.mbs.modal.planar`."""

from dataclasses import dataclass, field
from math import atan2, hypot
from typing import cast

import numpy as np

from ..elements import Link, Modal
from ..geometry import Array, rotate
from ..modal.planar import STATIONS, PlanarModel
from .builder import Attached, Builder, SeparateMass
from .tables import MarkerKind, MeasureKind


@dataclass
class FrameBody:
    """Rigid or modal link: coordinates (x, y, theta) of the frame at the centre of mass, then the modal coordinates."""

    offset: int  # first coordinate
    centre: Array  # place of the frame at t = 0 [m], (2,)
    angle: float  # theta at t = 0, the direction of the link [rad]
    start: Array  # place of the link's start at t = 0 [m], (2,)
    link_centre: Array  # centre of mass of the link without attached masses at t = 0 [m], (2,)
    modes: int = 0  # number of modes
    shapes: dict[str, Array] = field(default_factory=dict)  # mode shapes at the ends, the only points of a modal link
    model: PlanarModel | None = None  # of a link with modes

    def marker(self, builder: Builder, point: str) -> int:
        """Return the marker of a point of the link."""
        return self.marker_at(builder, np.array(builder.mechanism.points[point]), self.shapes.get(point))

    def marker_at(self, builder: Builder, place: Array, shape: Array | None = None, from_zero: bool = False) -> int:
        """Return the marker of a point at `place` (2,) at t = 0; its angle is theta, or its change since then if `from_zero`."""
        local = [*rotate(np.array(-self.angle), place - self.centre), -self.angle if from_zero else 0.0]
        modes = np.zeros((self.modes, 3)) if shape is None else shape  # at the point: x, y in the frame, rotation
        dofs = range(self.offset, self.offset + 3 + self.modes)
        return builder.add_marker(MarkerKind.FRAME, self.modes, dofs, [*local, *modes.ravel()])

    def rigid_motion(self, builder: Builder) -> Array:
        """Return the rates of all coordinates (n, 3) for unit rates of x and y of the link's start and of theta."""
        out = np.zeros((len(builder.q), 3))
        arm = self.centre - self.start
        out[self.offset : self.offset + 3] = [[1, 0, -arm[1]], [0, 1, arm[0]], [0, 0, 1]]
        return out


def line_of(builder: Builder, link: Link) -> tuple[Array, float, float]:
    """Return the position of a link's start at t = 0, (2,) [m], its length [m] and direction [rad]."""
    start, end = (np.array(builder.mechanism.points[p], dtype=float) for p in (link.start, link.end))
    dx, dy = end - start
    return start, hypot(dx, dy), atan2(dy, dx)


def add_separate_mass(builder: Builder, marker: int, each: Attached, link: str) -> None:
    """Add an attached mass with coordinates of its own: a point mass pinned to the marker, a rotor that turns with it."""
    (x, y), name = builder.mechanism.points[each.point], f"mass.{each.point}"
    if each.mass:
        builder.separate_masses.append(SeparateMass(len(builder.q), link, each.point))
        builder.pin(name, builder.add_point(x, y, each.mass), marker)
    if each.inertia:
        builder.separate_masses.append(SeparateMass(len(builder.q), link, each.point, is_rotor=True))
        turn = builder.add_coordinates((0.0,))
        builder.angles.add(turn)
        builder.add_mass((turn,), np.array([[each.inertia]]))
        factors = (0.0, 0.0, 1.0)  # of this one coordinate in the marker's x, y and angle
        rotor = builder.add_marker(MarkerKind.LINEAR, 1, (turn,) * 3, factors)
        builder.add_row(name, [builder.add_measure(MeasureKind.ANGLE, rotor, marker)])


def add_rigid(builder: Builder, link: Link) -> FrameBody:
    """Add a `Rigid` link, merged with the masses attached to it."""
    start, length, angle = line_of(builder, link)
    bar_mass, bar_inertia, arm = link.body.mass_properties(length)  # arm (2,): from start to centre of mass, along the link
    bar_centre = start + rotate(np.array(angle), arm)
    attached, points = builder.attached.get(link.name, ()), builder.mechanism.points
    parts = [(bar_mass, bar_centre, bar_inertia), *((each.mass, np.array(points[each.point]), each.inertia) for each in attached)]
    mass = sum(m for m, _, _ in parts)
    centre = sum((m * place for m, place, _ in parts), np.zeros(2)) / mass if mass else bar_centre
    inertia = sum(j + m * float(((place - centre) ** 2).sum()) for m, place, j in parts)  # Steiner's theorem
    o = builder.add_coordinates((*centre, angle))
    builder.angles.add(o + 2)
    builder.add_mass((o, o + 1, o + 2), np.diag([mass, mass, inertia]))
    builder.add_weight((o, o + 1), mass * np.array(builder.mechanism.gravity))
    return FrameBody(o, centre, angle, start, bar_centre)


def add_modal(builder: Builder, link: Link) -> FrameBody:
    """Add a `Modal` link, undeformed at t = 0. Attached masses are bodies of their own, as they would couple its modes."""
    start, length, angle = line_of(builder, link)
    model = cast(Modal, link.body).planar(length)
    m, centre = len(model), start + rotate(np.array(angle), model.centre)
    o = builder.add_coordinates((*centre, angle, *np.zeros(m)))
    builder.angles.add(o + 2)
    largest = np.abs(model.line_shapes).max(axis=(0, 1), initial=0.0)  # (m,): displacement per unit of each modal coordinate
    for i in range(m):  # a unit moves some point of the link by its length; 1e-12: a mode may not move it at all
        builder.units[o + 3 + i] = float(length / max(largest[i], 1e-12))
    builder.add_mass(range(o, o + 3 + m), np.diag([model.mass, model.mass, model.inertia, *np.ones(m)]))
    builder.add_weight((o, o + 1), model.mass * np.array(builder.mechanism.gravity))
    if m:
        damping_rates = 2 * model.damping * model.frequency  # 2 zeta omega [1/s], (m,)
        # integrals of X.phi_i, phi_i.phi_j and phi_i x phi_j in `kernel`; stiffness and damping of each mode
        at = builder.add_numbers(model.radial, model.gram, model.gyration, model.stiffness, damping_rates)
        builder.modal.append((o, m, at))
        builder.group_deformations(range(o + 3, o + 3 + m))  # scaled by the largest of them in the error control
    shapes = {p: model.shapes[STATIONS.index(n)].T.copy() for p, n in ((link.start, "start"), (link.end, "end"))}
    body = FrameBody(o, centre, angle, start, centre, m, shapes, model)
    for each in builder.attached.get(link.name, ()):
        add_separate_mass(builder, body.marker(builder, each.point), each, link.name)
    return body
