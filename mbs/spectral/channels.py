"""Signals of ensembles, computed from the rows of a run without a record of it where possible.

Such a signal has a `Column`: a component of a force's report, of a marker's state or acceleration, or a multiplier, times a
factor. All others are read from a record of the rows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from ..elements.clearance import Clearance
from ..elements.drive import Drive
from ..elements.stop import Stop
from ..geometry import Array, rotate
from ..modal.planar import STATIONS
from ..record.lookup import unknown
from ..record.run import collect
from .compiling import jit
from .contacts import get_depth
from .forces import apply_force
from .frame_body import FrameBody
from .markers import place_markers
from .output import Output
from .recording import compute_acceleration, record_of
from .scene import CompiledScene
from .tables import STEP_START, Instant, Report, State

Source = IntEnum("Source", "REPORT DEPTH MARKER ACCELERATION MULTIPLIER", start=0)
"""Sources of a column: report of a force, depth of a contact, state of a marker, its acceleration, multiplier of a constraint."""
Transform = IntEnum("Transform", "PLAIN OPPOSITE MAGNITUDE POSITIVE", start=0)
"""Transforms of a column: none, its opposite, its magnitude, its part above zero."""


@jit
def evaluate(tables, work, out, columns, values):
    """Fill values (times, columns) from the rows of a run; `columns` are those of `Channels`."""
    forces, unused_sum = tables.forces.shape[0], np.zeros(out.q.shape[1])
    is_needed = np.zeros(forces, dtype=np.bool_)  # forces whose report is a signal
    for source, index, _, _ in columns:
        if source == Source.REPORT or source == Source.DEPTH:
            is_needed[index] = True
    for i in range(out.time.size):
        # time since the step began, over which bristles deflect; all forces have the same
        since = out.time[i] - out.memory[i, 0, STEP_START] if forces > 0 else 0.0
        now = Instant(out.time[i], since, out.q[i], out.v[i], out.lam[i], out.memory[i])
        place_markers(tables, work, now.q, now.v)
        for k in range(forces):
            if is_needed[k]:
                apply_force(tables, work, k, now, unused_sum)  # for its report
        for c in range(columns.shape[0]):
            source, index, component, transform = columns[c]
            if source == Source.REPORT:
                value = work.reports[index, component]
            elif source == Source.DEPTH:
                value, _ = get_depth(tables, work.reports, index)
            elif source == Source.MARKER:
                value = work.state[index, component]
            elif source == Source.MULTIPLIER:
                value = now.lam[index]
            else:
                value = compute_acceleration(tables, work, index, component, out.a[i])
            if transform == Transform.OPPOSITE:
                value = -value
            elif transform == Transform.MAGNITUDE:
                value = abs(value)
            elif transform == Transform.POSITIVE:
                value = max(value, 0.0)
            values[i, c] = value


class Column(NamedTuple):
    """Place of a signal in the solver's arrays."""

    source: Source
    number: int  # index of the force, marker or constraint
    component: int  # of the report, state or acceleration
    transform: Transform = Transform.PLAIN


@dataclass(frozen=True)
class Channels:
    """Names of the signals that an ensemble records, with the columns of those that have one."""

    names: tuple[str, ...]  # those with a column come first
    columns: Array  # each `Column`, (columns, 4)

    @classmethod
    def of(cls, scene: CompiledScene, names: Sequence[str]) -> Channels:
        """Find the columns of signals in a scene, to which missing markers are added."""
        known = {name: column for name in names if (column := _find_column(scene, name)) is not None}
        others = [name for name in names if name not in known]
        return cls((*known, *others), np.array([*known.values()], dtype=np.int64).reshape(-1, 4))

    def values(self, scene: CompiledScene, out: Output) -> Array:
        """Compute all signals at the rows of a run, shape (times, signals)."""
        values, count = np.empty((len(out.time), len(self.names))), len(self.columns)
        if count:
            found = np.empty((len(out.time), count))
            rows = Output(*map(np.ascontiguousarray, out))
            evaluate(scene.tables, scene.work, rows, self.columns, found)
            values[:, :count] = found
        if count < len(self.names):
            record = record_of(scene, out)
            signals = collect(record, " ".join(self.names[count:]))
            for k, name in enumerate(self.names[count:], count):
                if name not in signals:
                    raise unknown(name, list(collect(record)))
                values[:, k] = signals[name].values
        return values


def _find_column(scene: CompiledScene, name: str) -> Column | None:
    """Find the column of a signal OWNER.QUANTITY; None if it has none."""
    owner, _, quantity = name.rpartition(".")
    found = (find(scene, owner, quantity) for find in (_find_contact, _find_point, _find_link, _find_drive))
    return next((column for column in found if column is not None), None)


PENETRATION = Column(Source.DEPTH, 0, 0, Transform.POSITIVE)
"""Column of the penetration of force 0, a contact, whose depth is negative while it is open."""
CONTACT = {
    (Clearance, "normal_force"): Column(Source.REPORT, 0, Report.VALUE),
    (Clearance, "friction_force"): Column(Source.REPORT, 0, Report.FRICTION),
    (Clearance, "sliding_speed"): Column(Source.REPORT, 0, Report.SLIP),
    (Clearance, "penetration"): PENETRATION,
    (Stop, "contact_force"): Column(Source.REPORT, 0, Report.VALUE, Transform.MAGNITUDE),  # signed, as it is along a measure
    (Stop, "penetration"): PENETRATION,
}
"""Columns of the signals of contacts, by class and quantity, if the contact were force 0."""


def _find_contact(scene: CompiledScene, owner: str, quantity: str) -> Column | None:
    """Find the column of a joint with clearance, whose owner is its point, or of a stop."""
    for k, name in enumerate(scene.force_names):
        element = scene.source.elements.get(name)
        column = CONTACT.get((type(element), quantity))
        if column and owner == (element.point if isinstance(element, Clearance) else name):
            return column._replace(number=k)
    return None


POINT = {"x": State.X, "y": State.Y, "vx": State.VX, "vy": State.VY}
"""Components of the state of a marker, by quantity: indices, as in `Column.component`."""


def _find_point(scene: CompiledScene, owner: str, quantity: str) -> Column | None:
    """Find position and velocity of a point, on the first link that has it."""
    links = [link for link in scene.mechanism.links if owner in link.points and not link.body.massless]
    if owner not in scene.mechanism.points or quantity not in POINT or not links:
        return None
    return Column(Source.MARKER, scene.marker(links[0].name, owner), POINT[quantity])


def _find_link(scene: CompiledScene, owner: str, quantity: str) -> Column | None:
    """Find the motion of a rigid or modal link at its centre of mass or, for LINK.middle, half-way between its joints."""
    name, _, station = owner.partition(".")
    body = scene.builder.bodies.get(name)
    if not isinstance(body, FrameBody) or quantity not in (*POINT, "ax", "ay") or station not in ("", "middle"):
        return None
    model = body.model  # of a modal link; None for a rigid one
    place, shape = body.link_centre, None  # shape: x, y and angle of each mode there, (modes, 3); modes do not move the centre
    if station:
        place = body.start + rotate(np.array(body.angle), np.array((scene.mechanism.length(name) / 2, 0.0)))
        shape = None if model is None else model.shapes[STATIONS.index("middle")].T.copy()
    marker = body.marker_at(scene.builder, place, shape)
    scene.refresh()  # gives the added marker a place in the tables, as `scene.marker` does
    if quantity in POINT:
        return Column(Source.MARKER, marker, POINT[quantity])
    return Column(Source.ACCELERATION, marker, ("ax", "ay").index(quantity))


def _find_drive(scene: CompiledScene, owner: str, quantity: str) -> Column | None:
    """Find the torque or force of a drive, which is its multiplier with opposite sign."""
    is_drive = isinstance(scene.source.elements.get(owner), Drive) and owner in scene.row_names
    if not is_drive or quantity not in ("torque", "force"):
        return None
    return Column(Source.MULTIPLIER, scene.row_names.index(owner), 0, Transform.OPPOSITE)
