"""Signals of ensembles, read from the compiled solver's states where possible: statistics then need no record of a run.

Such a signal is a column: a component of a force's report, of a marker's state or acceleration, or a multiplier, times a factor.
Other signals are made from a record of each part of the run.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from ..elements.clearance import Clearance
from ..elements.drive import Drive
from ..elements.stop import Stop
from ..geometry import Array, rotate
from ..modal.planar import STATIONS
from ..record.lookup import unknown
from ..record.run import collect
from .compiling import jit
from .forces import add_one
from .frame_body import FrameBody
from .markers import place_markers
from .output import Output
from .recording import compute_acceleration, record_of
from .scene import CompiledScene
from .tables import Instant, Memory, Report, State

Source = IntEnum("Source", "REPORT MARKER ACCELERATION MULTIPLIER", start=0)
"""Sources of a column: report of a force, state of a marker, its acceleration, multiplier of a constraint."""
Transform = IntEnum("Transform", "PLAIN MAGNITUDE POSITIVE", start=0)
"""Transforms of a column: none, its magnitude, its part above zero."""


@jit
def evaluate(tables, work, out, columns, scales, values):
    """Fill values (times, columns) from the rows of a run; `columns` and `scales` are those of `Channels`."""
    unused_forces, needed = np.zeros(out.q.shape[1]), np.zeros(tables.forces.shape[0], dtype=np.bool_)
    for c in range(columns.shape[0]):
        if columns[c, 0] == Source.REPORT:
            needed[columns[c, 1]] = True
    for i in range(out.time.size):
        since = out.time[i] - out.memory[i, 0, Memory.STEP_START] if needed.size > 0 else 0.0
        now = Instant(out.time[i], since, out.q[i], out.v[i], out.lam[i], out.memory[i])
        place_markers(tables, work, now.q, now.v)
        for k in range(needed.size):
            if needed[k]:
                add_one(tables, work, k, now, unused_forces)
        for c in range(columns.shape[0]):
            source, index, component, transform = columns[c, 0], columns[c, 1], columns[c, 2], columns[c, 3]
            if source == Source.REPORT:
                value = work.reports[index, component]
            elif source == Source.MARKER:
                value = work.state[index, component]
            elif source == Source.MULTIPLIER:
                value = now.lam[index]
            else:
                value = compute_acceleration(tables, work, index, component, out.a[i])
            value *= scales[c]
            if transform == Transform.MAGNITUDE:
                value = abs(value)
            elif transform == Transform.POSITIVE:
                value = max(value, 0.0)
            values[i, c] = value


Column = tuple[int, int, int, int, float]
"""Source of a signal, index of the force, marker or constraint, component, transform, and factor."""


@dataclass(frozen=True)
class Channels:
    """Signals by name, with the columns of those that have one."""

    names: tuple[str, ...]  # those with a column come first
    columns: Array  # the first four entries of each `Column`, (columns, 4)
    scales: Array  # factors, (columns,)

    @classmethod
    def of(cls, scene: CompiledScene, names: Sequence[str]) -> Channels:
        """Find the columns of signals in a scene, to which missing markers are added."""
        known = {name: column for name in names if (column := _find_column(scene, name)) is not None}
        order = tuple(sorted(names, key=lambda name: name not in known))
        columns = np.array([known[name][:4] for name in order if name in known], dtype=np.int64).reshape(-1, 4)
        return cls(order, columns, np.array([known[name][4] for name in order if name in known]))

    def values(self, scene: CompiledScene, out: Output) -> Array:
        """Compute all signals at the rows of a run, shape (times, signals)."""
        values, count = np.empty((len(out.time), len(self.names))), len(self.columns)
        if count:
            found = np.empty((len(out.time), count))
            rows = Output(*map(np.ascontiguousarray, out))
            evaluate(scene.tables, scene.work, rows, self.columns, self.scales, found)
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


JOINT = {
    "normal_force": (Report.VALUE, Transform.PLAIN), "friction_force": (Report.FRICTION, Transform.PLAIN),
    "penetration": (Report.LENGTH, Transform.POSITIVE), "sliding_speed": (Report.SLIP, Transform.PLAIN),
}  # fmt: skip
"""Columns of the report of a joint with clearance, by quantity."""
STOP = {"contact_force": (Report.VALUE, Transform.MAGNITUDE), "penetration": (Report.LENGTH, Transform.POSITIVE)}
"""Columns of the report of a stop, by quantity."""


def _find_contact(scene: CompiledScene, owner: str, quantity: str) -> Column | None:
    """Find the column of a joint with clearance (`JOINT`) or of a stop (`STOP`)."""
    for k, name in enumerate(scene.force_names):
        element = scene.source.elements.get(name)
        joint = isinstance(element, Clearance) and element.point == owner
        if joint or (isinstance(element, Stop) and name == owner):
            found = (JOINT if joint else STOP).get(quantity)
            return found and (Source.REPORT, k, *found, 1.0)
    return None


POINT = {"x": State.X, "y": State.Y, "vx": State.VX, "vy": State.VY}
"""Columns of the state of a marker, by quantity."""


def _find_point(scene: CompiledScene, owner: str, quantity: str) -> Column | None:
    """Find position and velocity of a point, on the first link that has it."""
    links = [link for link in scene.mechanism.links if owner in link.points and not link.body.massless]
    if owner not in scene.mechanism.points or quantity not in POINT or not links:
        return None
    return (Source.MARKER, scene.marker(links[0].name, owner), POINT[quantity], Transform.PLAIN, 1.0)


def _find_link(scene: CompiledScene, owner: str, quantity: str) -> Column | None:
    """Find the motion of the centre of mass of a rigid or modal link, and of `LINK.middle`, half-way between its ends."""
    name, _, station = owner.partition(".")
    body = scene.builder.bodies.get(name)
    if not isinstance(body, FrameBody) or quantity not in (*POINT, "ax", "ay") or station not in ("", "middle"):
        return None
    if body.model is None:  # a rigid link; `arm` leads from its start to the point, in its axes [m]
        length = scene.mechanism.length(name)
        arm, shape = np.array((length / 2, 0.0) if station else scene.mechanism.link(name).body.mass_properties(length)[2]), None
    else:
        arm = body.model.centre + (body.model.place("centre") if station else 0.0)
        shape = body.model.shapes[STATIONS.index("centre")].T.copy() if station else None
    marker = body.marker_at(scene.builder, body.start + rotate(np.array(body.angle), arm), shape, turned=True)
    scene.refresh()
    if quantity in POINT:
        return (Source.MARKER, marker, POINT[quantity], Transform.PLAIN, 1.0)
    return (Source.ACCELERATION, marker, ("ax", "ay").index(quantity), Transform.PLAIN, 1.0)


def _find_drive(scene: CompiledScene, owner: str, quantity: str) -> Column | None:
    """Find the torque or force of a drive, which is its multiplier with opposite sign."""
    if quantity not in ("torque", "force") or not isinstance(scene.source.elements.get(owner), Drive):
        return None
    return (Source.MULTIPLIER, scene.row_names.index(owner), 0, Transform.PLAIN, -1.0) if owner in scene.row_names else None
