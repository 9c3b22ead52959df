"""Named signals with units from what a run recorded."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from buckler.mbs.engine.modal import PlacedModal
from buckler.mbs.engine.recording import Record
from buckler.mbs.engine.scene import Scene
from buckler.mbs.mechanism import Beam, Cable, Guide, Rigid, Strut
from buckler.mbs.modal.spec import Modal
from buckler.mbs.record.contacts import add_joints, moment_of_contacts
from buckler.mbs.record.result import Shape
from buckler.mbs.record.strips import Strip, centre_weights

Array = np.ndarray[Any, Any]


@dataclass(frozen=True)
class History:
    """The recorded coordinates of a scene as arrays.

    Attributes
    ----------
    time : array, shape (times,)
    q, q_t, q_tt : array, shape (times, coordinates)
        Displacements from the reference, as the engine keeps them, and their rates.
    multipliers : array, shape (times, constraints)
    contact : array, shape (times, stops)
        Contact forces, N.
    memory : list of array, shape (times, joints, 4)
        What `clearance.MEMORY` names, of each group of joints with play.
    """

    scene: Scene
    time: Array
    q: Array
    q_t: Array
    q_tt: Array
    multipliers: Array
    contact: Array
    memory: list[Array]

    @classmethod
    def of(cls, scene: Scene, record: Record) -> History:
        """Stack a record."""
        rows = len(record.time)
        contact = np.array(record.contact).reshape(rows, len(scene.stops))
        q, q_t, q_tt, forces = (np.array(getattr(record, name)).reshape(rows, -1) for name in ("q", "q_t", "q_tt", "multipliers"))
        kept = iter(np.array(part) for part in zip(*record.memory, strict=True))
        memory = [next(kept) if group.remembers else np.tile(group.memory, (rows, 1, 1)) for group in scene.clearances]
        return cls(scene, np.array(record.time), q, q_t, q_tt, forces, contact, memory)

    def strip(self, name: str) -> Any:
        """A flexible link's history."""
        placed = self.scene.placed[name]
        if isinstance(placed, PlacedModal):
            return placed.history(self.scene.system, self.q, self.q_t, self.q_tt)
        columns = placed.columns(self.scene.system)
        return Strip(placed, self.scene.arc_length(name), self.q[:, columns] + placed.reference, self.q_t[:, columns])

    def point(self, body: str, point: str) -> tuple[Array, Array]:
        """Position and velocity of a body's point, each of shape (times, 2)."""
        placed = self.scene.placed[body]
        if isinstance(placed, PlacedModal):
            return self.strip(body).motion(point)[:2]
        columns = placed.columns(self.scene.system)
        if isinstance(placed.body, Guide):
            s, v = self.q[:, columns[0, 0]], self.q_t[:, columns[0, 0]]
            return placed.origin + np.outer(s, placed.along), np.outer(v, placed.along)
        if isinstance(placed.body, Rigid):
            return self._rigid_point(placed, columns[0], point)
        node = 0 if point == self.scene.mechanism.link(body).start else -1
        cols = columns[node, :2]
        return self.q[:, cols] + placed.reference[node, :2], self.q_t[:, cols]

    def _rigid_point(self, placed: Any, columns: Array, point: str) -> tuple[Array, Array]:
        arm = np.subtract(self.scene.mechanism.points[point], placed.reference[0, :2])
        turn, spin = self.q[:, columns[2]], self.q_t[:, columns[2]]
        c, s = np.cos(turn), np.sin(turn)
        offset = np.column_stack([c * arm[0] - s * arm[1], s * arm[0] + c * arm[1]])
        place = self.q[:, columns[:2]] + placed.reference[0, :2] + offset
        return place, self.q_t[:, columns[:2]] + spin[:, None] * np.column_stack([-offset[:, 1], offset[:, 0]])

    def where(self, point: str) -> tuple[Array, Array]:
        """Position and velocity of a point, from whatever body carries it; fixed if none does."""
        mechanism = self.scene.mechanism
        carriers = [point] if point in self.scene.placed else []
        carriers += [link.name for link in mechanism.links if point in link.points and link.name in self.scene.placed]
        if carriers:
            return self.point(carriers[0], point)
        fixed = np.tile(mechanism.points[point], (len(self.time), 1))
        return fixed, np.zeros_like(fixed)

    def force(self, constraint: str) -> Array:
        """What a constraint exerts on its second body, shape (times, rows): minus its Lagrange multipliers."""
        return -self.multipliers[:, self.scene.multipliers(constraint)]


def collect(history: History) -> tuple[dict[str, Array], dict[str, str]]:
    """All signals and their units."""
    signals: dict[str, Array] = {}
    units: dict[str, str] = {}

    def add(name: str, values: Array, unit: str) -> None:
        signals[name], units[name] = values, unit

    mechanism = history.scene.mechanism
    for point in mechanism.points:
        place, speed = history.where(point)
        for axis, letter in enumerate("xy"):
            add(f"{point}.{letter}", place[:, axis], "m")
            add(f"{point}.v{letter}", speed[:, axis], "m/s")
    for k, (name, contact) in enumerate(history.scene.stops.items()):
        travel = history.q[:, history.scene.placed[contact.stop.point].columns(history.scene.system)[0, 0]]
        add(f"{name}.contact_force", history.contact[:, k], "N")
        add(f"{name}.penetration", np.maximum(contact.depth(travel), 0.0), "m")
    for name in history.scene.constraints:
        if name.startswith("joint "):
            force, joint = history.force(name), name.removeprefix("joint ")
            add(f"{joint}.fx", force[:, 0], "N")
            add(f"{joint}.fy", force[:, 1], "N")
    for group in range(len(history.scene.clearances)):
        add_joints(history, group, add)
    if mechanism.drive is not None:
        _add_drive(history, add)
    for name in [link.name for link in mechanism.links if link.name in history.scene.placed]:
        _add_centre(history, name, add)
    for link in mechanism.links:
        if isinstance(link.body, Beam | Cable):
            _add_strip(history, link.name, add)
        elif isinstance(link.body, Modal):
            _add_modal(history, link.name, add)
        elif isinstance(link.body, Strut):
            _add_strut(history, link.name, add)
    return signals, units


def drive_coordinate(history: History) -> tuple[Array, Array]:
    """The driven coordinate and its rate."""
    drive = history.scene.mechanism.drive
    assert drive is not None
    columns = history.scene.placed[drive.target].columns(history.scene.system)[0]
    column = columns[2 if drive.target not in history.scene.mechanism.points else 0]
    return history.q[:, column], history.q_t[:, column]


def drive_effort(history: History) -> Array:
    """Torque, N m, or force, N, of the drive."""
    if "drive" in history.scene.constraints:
        return history.force("drive")[:, 0]
    drive = history.scene.mechanism.drive
    assert drive is not None
    return -moment_of_contacts(history, drive.target)  # a flywheel: the drive cancels the contacts


def drive_power(history: History) -> Array:
    """Power the drive gives, W."""
    return drive_effort(history) * drive_coordinate(history)[1]


def _add_drive(history: History, add: Any) -> None:
    drive = history.scene.mechanism.drive
    rotary = drive is not None and drive.target not in history.scene.mechanism.points
    add("drive.torque" if rotary else "drive.force", drive_effort(history), "N m" if rotary else "N")
    add("drive.position", drive_coordinate(history)[0], "rad" if rotary else "m")


def _add_centre(history: History, name: str, add: Any) -> None:
    """Centre of mass of a link with its velocity and acceleration, by the mass-weighted mean of its coordinates."""
    placed = history.scene.placed[name]
    columns = placed.columns(history.scene.system)
    weights = centre_weights(placed.body, history.scene.arc_length(name))
    for axis, letter in enumerate("xy"):
        rows = columns[:, axis::2][:, : weights.shape[1]]
        base = float((placed.reference[:, axis::2][:, : weights.shape[1]] * weights).sum())
        add(f"{name}.{letter}", base + (history.q[:, rows] * weights).sum(axis=(1, 2)), "m")
        add(f"{name}.v{letter}", (history.q_t[:, rows] * weights).sum(axis=(1, 2)), "m/s")
        add(f"{name}.a{letter}", (history.q_tt[:, rows] * weights).sum(axis=(1, 2)), "m/s^2")


def _add_strip(history: History, name: str, add: Any) -> None:
    strip = history.strip(name)
    line = strip.points(2)
    chord = line[:, -1] - line[:, 0]
    span = np.hypot(*chord.T)
    middle = line[:, line.shape[1] // 2] - line[:, 0]
    add(f"{name}.end_shortening", history.scene.arc_length(name) - span, "m")
    add(f"{name}.axial_force", strip.axial_force(), "N")
    add(f"{name}.deflection", (chord[:, 0] * middle[:, 1] - chord[:, 1] * middle[:, 0]) / span, "m")


def _add_modal(history: History, name: str, add: Any) -> None:
    modal = history.strip(name)
    add(f"{name}.end_shortening", modal.end_shortening(), "m")
    add(f"{name}.deflection", modal.deflection(), "m")


def strut_state(history: History, name: str) -> tuple[Array, Array]:
    """Elongation of a strut, m, and its rate, m/s."""
    link = history.scene.mechanism.link(name)
    (start, start_t), (end, end_t) = history.where(link.start), history.where(link.end)
    chord = end - start
    span = np.hypot(*chord.T)
    return span - history.scene.mechanism.length(name), (chord * (end_t - start_t)).sum(axis=1) / span


def _add_strut(history: History, name: str, add: Any) -> None:
    elongation, _ = strut_state(history, name)
    elastic = history.scene.struts[name].elastic
    add(f"{name}.end_shortening", -elongation, "m")
    add(f"{name}.compression", -np.array([elastic(float(e)) for e in elongation]), "N")


def shapes_at(history: History, times: Array) -> dict[str, Shape]:
    """Flexible links at chosen times: cubic Hermite interpolation of recorded coordinates and rates."""
    from scipy.interpolate import CubicHermiteSpline

    last = history.time[-1]
    times = np.minimum(times[times <= last * (1 + 1e-9)], last)  # a run that failed did not get to the others
    if len(history.time) < 2:
        return {}
    found = {}
    for link in history.scene.mechanism.links:
        placed = history.scene.placed.get(link.name)
        if isinstance(placed, PlacedModal):
            q = CubicHermiteSpline(history.time, history.q, history.q_t)(times)
            line = placed.history(history.scene.system, q, np.zeros_like(q)).points()
            found[link.name] = Shape(times, line, link.body.section.thickness)
        elif isinstance(link.body, Beam | Cable):
            placed = history.scene.placed[link.name]
            columns = placed.columns(history.scene.system)
            q = CubicHermiteSpline(history.time, history.q[:, columns], history.q_t[:, columns])(times) + placed.reference
            strip = Strip(placed, history.scene.arc_length(link.name), q, np.zeros_like(q))
            found[link.name] = Shape(times, strip.points(), link.body.section.thickness)
    return found
