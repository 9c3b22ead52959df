"""Columns of the compiled solver's states that signals are, so that statistics need no record of a run.

A column is a component of a force's report, of a marker's state or second rates, or a multiplier. Signals that are none of these
are made from the record of a stretch of the run, as those of a single run.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..elements.clearance import Clearance
from ..elements.drive import Drive
from ..elements.stop import Stop
from ..geometry import Array
from ..modal.planar import STATIONS
from ..record.lookup import unknown
from ..record.run import collect
from .compiling import jit
from .forces import add_one
from .frame_body import FrameBody
from .markers import place_markers
from .output import Output
from .recording import record_of
from .scene import CompiledScene
from .tables import AX, COUNT, FASTEST, FIRST, FRICTION, LENGTH, SLIP, VALUE, VX, Instant, X

REPORT, MARKER, ACCELERATION, MULTIPLIER = range(4)
"""Sources of a column."""
PLAIN, MAGNITUDE, POSITIVE = range(3)
"""Transforms of a column: none, its magnitude, its part above zero."""


@jit
def evaluate(tables, work, out, columns, scales, values):
    """Fill values (times, columns) from the rows of a run."""
    f, needed = np.zeros(out.q.shape[1]), np.zeros(tables.forces.shape[0], dtype=np.bool_)
    for c in range(columns.shape[0]):
        if columns[c, 0] == REPORT:
            needed[columns[c, 1]] = True
    for i in range(out.time.size):
        since = out.time[i] - out.memory[i, 0, FASTEST] if needed.size > 0 else 0.0
        now = Instant(out.time[i], since, out.q[i], out.v[i], out.lam[i], out.memory[i])
        place_markers(tables, work, now.q, now.v)
        for k in range(needed.size):
            if needed[k]:
                add_one(tables, work, k, now, f)
        for c in range(columns.shape[0]):
            source, index, component, transform = columns[c, 0], columns[c, 1], columns[c, 2], columns[c, 3]
            if source == REPORT:
                value = work.reports[index, component]
            elif source == MARKER:
                value = work.state[index, component]
            elif source == MULTIPLIER:
                value = now.lam[index]
            else:
                value = work.state[index, AX + component]
                first, count = tables.markers[index, FIRST], tables.markers[index, COUNT]
                for j in range(first, first + count):
                    value += work.slope[component, j] * out.a[i, tables.places[j]]
            value *= scales[c]
            if transform == MAGNITUDE:
                value = abs(value)
            elif transform == POSITIVE:
                value = max(value, 0.0)
            values[i, c] = value


Column = tuple[int, int, int, int, float]


@dataclass(frozen=True)
class Channels:
    """Signals by name, as columns of the compiled solver or of records."""

    names: tuple[str, ...]  # those that are columns come first
    columns: Array  # source, index, component, transform; (columns, 4)
    scales: Array  # (columns,)

    @classmethod
    def of(cls, scene: CompiledScene, names: Sequence[str]) -> Channels:
        """Find the columns of signals in a scene; markers that it lacks are added to it."""
        known = {name: column for name in names if (column := _column(scene, name)) is not None}
        order = tuple(sorted(names, key=lambda name: name not in known))
        columns = np.array([known[name][:4] for name in order if name in known], dtype=np.int64).reshape(-1, 4)
        return cls(order, columns, np.array([known[name][4] for name in order if name in known]))

    def values(self, scene: CompiledScene, out: Output) -> Array:
        """Values of all signals at the rows of a run, shape (times, signals)."""
        values, fast = np.empty((len(out.time), len(self.names))), len(self.columns)
        if fast:
            found = np.empty((len(out.time), fast))
            rows = Output(*map(np.ascontiguousarray, out))
            evaluate(scene.tables, scene.work, rows, self.columns, self.scales, found)
            values[:, :fast] = found
        if fast < len(self.names):
            record = record_of(scene, out)
            signals = collect(record, " ".join(self.names[fast:]))
            for k, name in enumerate(self.names[fast:], fast):
                if name not in signals:
                    raise unknown(name, list(collect(record)))
                values[:, k] = signals[name].values
        return values


def _column(scene: CompiledScene, name: str) -> Column | None:
    """Find the column of a signal; None where it is made from records."""
    owner, _, what = name.rpartition(".")
    for find in (_of_contact, _of_point, _of_link, _of_drive):
        if (found := find(scene, owner, what)) is not None:
            return found
    return None


def _of_contact(scene: CompiledScene, owner: str, what: str) -> Column | None:
    """Force, friction, depth, sliding speed of a joint with clearance, force and depth of a stop."""
    elements = scene.source.elements
    for k, name in enumerate(scene.force_names):
        element = elements.get(name)
        if isinstance(element, Clearance) and element.point == owner:
            columns: dict[str, Column] = {
                "normal_force": (REPORT, k, VALUE, PLAIN, 1.0), "friction_force": (REPORT, k, FRICTION, PLAIN, 1.0),
                "penetration": (REPORT, k, LENGTH, POSITIVE, 1.0), "sliding_speed": (REPORT, k, SLIP, PLAIN, 1.0),
            }  # fmt: skip
            return columns.get(what)
        if isinstance(element, Stop) and name == owner:
            stop: dict[str, Column] = {
                "contact_force": (REPORT, k, VALUE, MAGNITUDE, 1.0), "penetration": (REPORT, k, LENGTH, POSITIVE, 1.0),
            }  # fmt: skip
            return stop.get(what)
    return None


PLACES = {"x": X, "y": X + 1, "vx": VX, "vy": VX + 1}


def _of_point(scene: CompiledScene, owner: str, what: str) -> Column | None:
    """Place and velocity of a point, as part of the first link that has it."""
    links = [link for link in scene.mechanism.links if owner in link.points and not link.body.massless]
    if owner not in scene.mechanism.points or what not in PLACES or not links:
        return None
    return (MARKER, scene.marker(links[0].name, owner), PLACES[what], PLAIN, 1.0)


def _of_link(scene: CompiledScene, owner: str, what: str) -> Column | None:
    """Motion of the centre of mass of a link that is rigid or modal, and of `LINK.middle`, half-way between its ends."""
    name, _, station = owner.partition(".")
    body = scene.builder.bodies.get(name)
    if not isinstance(body, FrameBody) or what not in (*PLACES, "ax", "ay") or station not in ("", "middle"):
        return None
    if body.model is None:
        length = scene.mechanism.length(name)
        arm, shape = np.array((length / 2, 0.0) if station else scene.mechanism.link(name).body.mass_properties(length)[2]), None
    else:
        arm = body.model.centre + (body.model.place("centre") if station else 0.0)
        shape = body.model.shapes[STATIONS.index("centre")].T.copy() if station else None
    c, s = np.cos(body.angle), np.sin(body.angle)
    place = body.start + np.array([c * arm[0] - s * arm[1], s * arm[0] + c * arm[1]])
    marker = body.marker_at(scene.builder, place, shape, turned=True)
    if len(scene.builder.markers) > len(scene.tables.markers):
        scene.refresh()
    if what in PLACES:
        return (MARKER, marker, PLACES[what], PLAIN, 1.0)
    return (ACCELERATION, marker, ("ax", "ay").index(what), PLAIN, 1.0)


def _of_drive(scene: CompiledScene, owner: str, what: str) -> Column | None:
    """Torque or force of a drive."""
    if what not in ("torque", "force") or not isinstance(scene.source.elements.get(owner), Drive):
        return None
    return (MULTIPLIER, scene.row_names.index(owner), 0, PLAIN, -1.0) if owner in scene.row_names else None
