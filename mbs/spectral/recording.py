"""Record of a run of the compiled solver: motions of links and blocks, data of elements, as plain arrays.

`times` are the rows of the run. A trace is the motion of a marker: (x, y, angle), their rates and second rates, (3, times, 3).
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..elements.link import Link
from ..geometry import Array, rotate
from ..mechanism import Mechanism
from ..modal.planar import ModalHistory
from ..record.lookup import corrected_trapezoidal
from ..record.record import BlockMotion, Record, RigidMotion
from .compiling import copy, inline, jit
from .forces import add_forces
from .frame_body import FrameBody
from .markers import place_markers
from .motion import Piece, SpectralStrip
from .output import Output
from .scene import CompiledScene
from .strip_body import StripBody
from .tables import ForceKind, Forces, Instant, Markers, Memory, Report, State, StatefulData

UNREPORTED = (ForceKind.JOURNAL, ForceKind.FRICTION, ForceKind.STATEFUL)
"""Kinds of forces whose signals are computed from memories and states; signals of the others need the columns `Report`."""


@inline
def compute_acceleration(tables, work, m, component, a):
    """Return the second rate of marker m, component 0 to 2 of (x, y, angle), at second rates a of the coordinates.

    It is the marker's Jacobian times a, plus the second rate at a = 0, which the state has from column AX on.
    """
    total, first = work.state[m, State.AX + component], tables.markers[m, Markers.FIRST]
    for j in range(first, first + tables.markers[m, Markers.COUNT]):
        total += work.jacobian[component, j] * a[tables.dofs[j]]
    return total


@jit
def follow(tables, work, out, wanted, traces, reports):
    """Fill the traces of `wanted` markers, (wanted, rate 0 to 2, component, times), and the reports of all forces.

    `reports` has the shape (times, forces, columns of `Report`), or (0, ...) if none are wanted.
    """
    unused_forces = np.zeros(out.q.shape[1])
    for i in range(out.q.shape[0]):
        place_markers(tables, work, out.q[i], out.v[i])
        for k in range(wanted.size):
            m = wanted[k]
            for c in range(3):
                traces[k, 0, c, i], traces[k, 1, c, i] = work.state[m, State.X + c], work.state[m, State.VX + c]
                traces[k, 2, c, i] = compute_acceleration(tables, work, m, c, out.a[i])
        if reports.shape[0] > 0:
            since = out.time[i] - out.memory[i, 0, Memory.STEP_START]  # the same for all forces
            add_forces(tables, work, Instant(out.time[i], since, out.q[i], out.v[i], out.lam[i], out.memory[i]), unused_forces)
            copy(work.reports, reports[i])


def record_of(scene: CompiledScene, out: Output) -> Record:
    """Convert the rows of a run to a record."""
    mechanism, builder = scene.mechanism, scene.builder
    guides = {guide.point: scene.marker(guide.link, guide.point) for guide in mechanism.guides}
    frames = {}
    for link in mechanism.links:
        body = builder.bodies[link.name]
        if isinstance(body, FrameBody) and body.model is None:  # a rigid link; one with a model is modal
            frames[link.name] = _add_centre_frame(scene, link, body)
    scene.refresh()  # packs the markers just added into the tables
    wanted = [*(marker for marker, *_ in frames.values()), *guides.values()]
    kinds = scene.tables.forces[:, Forces.KIND]
    reported_times = 0 if np.isin(kinds, UNREPORTED).all() else len(out.time)
    reports = np.empty((reported_times, len(kinds), len(Report)))
    traces = dict(zip(wanted, follow_markers(scene, out, wanted, reports), strict=True))

    links: dict[str, Any] = {}
    for link in mechanism.links:
        body = builder.bodies[link.name]
        if link.name in frames:
            marker, mass, inertia, centre = frames[link.name]
            arms = {name: np.subtract(place, centre) for name, place in mechanism.points.items()}
            links[link.name] = RigidMotion(mass, inertia, arms, *traces[marker])
        elif isinstance(body, FrameBody):
            links[link.name] = _record_modal(link, body, out)
        elif isinstance(body, StripBody):
            links[link.name] = _record_strip(scene, body, out)
    blocks = {point: _record_block(mechanism, point, traces[marker]) for point, marker in guides.items()}
    channels, undetermined = _channels(scene, out, reports), scene.source.undetermined
    return Record(mechanism, out.time, links, blocks, channels, rule=corrected_trapezoidal, undetermined=undetermined)


def follow_markers(scene: CompiledScene, out: Output, wanted: Sequence[int], reports: Array) -> Array:
    """Compute the traces of some markers, (wanted, 3, times, 3); fill the reports of forces, see `follow`."""
    traces = np.empty((len(wanted), 3, 3, len(out.time)))
    follow(scene.tables, scene.work, out, np.array(wanted, int), traces, reports)
    return traces.swapaxes(2, 3)  # each component stays contiguous in memory


def _add_centre_frame(scene: CompiledScene, link: Link, body: FrameBody) -> tuple[int, float, float, Array]:
    """Add a marker at the centre of mass of a rigid link, attached masses left out; return it, mass, inertia, place at t = 0."""
    mass, inertia, (x, y) = link.body.mass_properties(scene.mechanism.length(link.name))
    centre = body.start + rotate(np.array(body.angle), (x, y))
    marker = body.marker_at(scene.builder, centre, from_start=True)  # its angle is the turn since t = 0
    return marker, mass, inertia, centre


def _record_modal(link: Link, body: Any, out: Output) -> ModalHistory:
    """Return the motion of a modal link."""
    columns = slice(body.offset, body.offset + 3 + body.modes)
    stations = {link.start: "start", link.end: "end"}
    return ModalHistory(body.model, out.q[:, columns], out.v[:, columns], out.a[:, columns], stations, body.angle)


def _record_strip(scene: CompiledScene, body: StripBody, out: Output) -> SpectralStrip:
    """Return the motion of a strip, whose dofs number its own coordinates, not those of the mechanism."""
    dofs = np.unique(np.concatenate([piece.dofs.ravel() for piece in body.pieces]))
    pieces = [Piece(e.start, e.end, np.searchsorted(dofs, e.dofs)) for e in body.pieces]
    states = (out.q[:, dofs], out.v[:, dofs], out.a[:, dofs])
    return SpectralStrip(body.section, pieces, body.stations, scene.q0[dofs], *states)


def _record_block(mechanism: Mechanism, point: str, trace: Array) -> BlockMotion:
    """Return the motion of a guide's block along the guide, from the trace of its point."""
    guide = mechanism.guide(point)
    along, origin = np.array(guide.along), mechanism.points[point]
    travel, rate, second = ((each[:, :2] - start) @ along for each, start in zip(trace, (origin, 0.0, 0.0), strict=True))
    return BlockMotion(guide.mass, origin, guide.along, travel, rate, second)


def _channels(scene: CompiledScene, out: Output, reports: Array) -> dict[str, dict[str, Array]]:
    """Collect data of elements by name: reactions, forces of stops and loads, memories of joints with clearance."""
    channels: dict[str, dict[str, Array]] = {}
    names, elements = np.array(scene.row_names), scene.source.elements
    for name in dict.fromkeys(scene.row_names):
        loads = -out.lam[:, names == name]  # forces are -G^T lambda
        is_of_element = name in elements  # not if it is within a link, as between the pieces of a strip
        channels[name] = dict(elements[name].reactions(loads) or {}) if is_of_element else {}
    for i, name in enumerate(scene.force_names):
        kind = scene.tables.forces[i, Forces.KIND]
        found = channels.setdefault(name, {})
        if kind in (ForceKind.JOURNAL, ForceKind.FRICTION):
            found["memory"] = out.memory[:, i]
        elif kind == ForceKind.CONTACT:
            found["force"] = np.abs(reports[:, i, [Report.VALUE]])  # its sign is the side of the face
        elif kind == ForceKind.STATEFUL:
            dofs = _find_state_dofs(scene, i)
            found["states"] = np.hstack([out.v[:, dofs], out.a[:, dofs]])  # the states, then their rates
        else:
            found["value"] = reports[:, i, [Report.VALUE]]
    return channels


def _find_state_dofs(scene: CompiledScene, force: int) -> slice:
    """Find the dofs of the coordinates whose rates are the states of a force's law; marker B has the first (`stateful`)."""
    marker, numbers = scene.tables.forces[force, [Forces.B, Forces.NUMBERS]]
    first, count = scene.tables.markers[marker, Markers.OFFSET], int(scene.tables.data[numbers + StatefulData.STATES])
    return slice(first, first + count)
