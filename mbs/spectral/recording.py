"""Record of a run of the compiled solver: motions of links and blocks, data of elements, as plain arrays.

`times` are the rows of the run. A trace is the motion of a marker: (x, y, angle), their rates and second rates, (3, times, 3).
"""

from collections.abc import Sequence
from typing import Any, cast

import numpy as np

from ..geometry import Array
from ..mechanism import Mechanism
from ..modal.planar import ModalHistory, PlanarModel
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
from .tables import STEP_START, ForceKind, Forces, Instant, Markers, Report, State, StatefulData


@inline
def compute_acceleration(tables, work, m, component, a):
    """Return the second rate of marker m, component 0 to 2 of (x, y, angle), at second rates a of the coordinates."""
    total, first = work.state[m, State.AX + component], tables.markers[m, Markers.FIRST]  # total: the second rate at a = 0
    for j in range(first, first + tables.markers[m, Markers.COUNT]):
        total += work.jacobian[component, j] * a[tables.dofs[j]]
    return total


@jit
def follow(tables, work, out, wanted, traces, reports):
    """Fill traces of `wanted` markers, (wanted, rate 0 to 2, component, times), and reports (times or 0, forces, `Report`)."""
    unused_forces = np.zeros(out.q.shape[1])
    for i in range(out.q.shape[0]):
        place_markers(tables, work, out.q[i], out.v[i])
        for k in range(wanted.size):
            m = wanted[k]
            for c in range(3):
                traces[k, 0, c, i], traces[k, 1, c, i] = work.state[m, State.X + c], work.state[m, State.VX + c]
                traces[k, 2, c, i] = compute_acceleration(tables, work, m, c, out.a[i])
        if reports.shape[0] > 0:
            since = out.time[i] - out.memory[i, 0, STEP_START]  # time over which bristles deflect, the same for each force
            add_forces(tables, work, Instant(out.time[i], since, out.q[i], out.v[i], out.lam[i], out.memory[i]), unused_forces)
            copy(work.reports, reports[i])


def record_of(scene: CompiledScene, out: Output) -> Record:
    """Convert the rows of a run to a record."""
    mechanism, builder = scene.mechanism, scene.builder
    guides = {guide.point: scene.marker(guide.link, guide.point) for guide in mechanism.guides}
    rigid_links = {  # by name: marker of the centre of mass, whose angle is the turn since t = 0
        name: body.marker_at(builder, body.link_centre, from_zero=True)
        for name, body in builder.bodies.items()
        if isinstance(body, FrameBody) and body.model is None  # one with a model is modal
    }
    scene.refresh()  # packs the markers just added into the tables
    wanted = [*rigid_links.values(), *guides.values()]
    kinds = scene.tables.forces[:, Forces.KIND]
    has_stops = (kinds == ForceKind.CONTACT).any()  # signals of other forces follow from the motion and the memories
    reports = np.empty((len(out.time) if has_stops else 0, len(kinds), len(Report)))
    traces = dict(zip(wanted, follow_markers(scene, out, wanted, reports), strict=True))

    links: dict[str, Any] = {}
    for link in mechanism.links:
        body = builder.bodies[link.name]
        if isinstance(body, FrameBody) and body.model is None:
            mass, inertia, _ = link.body.mass_properties(mechanism.length(link.name))
            # elements may ask for any point of the mechanism as a point of this link
            arms = {name: np.subtract(place, body.link_centre) for name, place in mechanism.points.items()}
            links[link.name] = RigidMotion(mass, inertia, arms, *traces[rigid_links[link.name]])
        elif isinstance(body, FrameBody):
            q, v, a = (each[:, body.offset : body.offset + 3 + body.modes] for each in (out.q, out.v, out.a))
            stations = {link.start: "start", link.end: "end"}
            links[link.name] = ModalHistory(cast(PlanarModel, body.model), q, v, a, stations, body.angle)
        elif isinstance(body, StripBody):
            dofs = np.unique(np.concatenate([piece.dofs.ravel() for piece in body.pieces]))
            q, v, a = (each[:, dofs] for each in (out.q, out.v, out.a))
            pieces = [Piece(e.start, e.end, np.searchsorted(dofs, e.dofs)) for e in body.pieces]  # dofs: columns of this q
            links[link.name] = SpectralStrip(body.section, pieces, body.stations, scene.q0[dofs], q, v, a)
    blocks = {point: _record_block(mechanism, point, traces[marker]) for point, marker in guides.items()}
    channels, undetermined = _channels(scene, out, reports), scene.source.undetermined
    return Record(mechanism, out.time, links, blocks, channels, rule=corrected_trapezoidal, undetermined=undetermined)


def follow_markers(scene: CompiledScene, out: Output, wanted: Sequence[int], reports: Array) -> Array:
    """Compute the traces of some markers, (wanted, 3, times, 3); fill the reports of forces, see `follow`."""
    traces = np.empty((len(wanted), 3, 3, len(out.time)))
    follow(scene.tables, scene.work, out, np.array(wanted, int), traces, reports)
    return traces.swapaxes(2, 3)  # each component stays contiguous in memory


def _record_block(mechanism: Mechanism, point: str, trace: Array) -> BlockMotion:
    """Return the motion of a guide's block along the guide, from the trace of its point."""
    guide = mechanism.guide(point)
    along, origin = np.array(guide.along), mechanism.points[point]
    origins = (origin, 0.0, 0.0)  # of position, velocity, acceleration
    travel, rate, second = ((each[:, :2] - start) @ along for each, start in zip(trace, origins, strict=True))
    return BlockMotion(guide.mass, origin, guide.along, travel, rate, second)


def _channels(scene: CompiledScene, out: Output, reports: Array) -> dict[str, dict[str, Array]]:
    """Collect data of elements by name: reactions, forces of stops, states of loads, memories of friction and of clearances."""
    channels: dict[str, dict[str, Array]] = {}
    names, elements = np.array(scene.row_names), scene.source.elements
    for name in dict.fromkeys(scene.row_names):
        forces = -out.lam[:, names == name]  # forces are -G^T lambda
        is_of_element = name in elements  # not if it is within a link, as between the pieces of a strip
        reactions = elements[name].reactions(forces) if is_of_element else None  # None, too, of an element without reactions
        channels[name] = dict(reactions or {})
    for i, name in enumerate(scene.force_names):
        kind = scene.tables.forces[i, Forces.KIND]
        found = channels.setdefault(name, {})
        if kind in (ForceKind.JOURNAL, ForceKind.FRICTION):
            found["memory"] = out.memory[:, i]
        elif kind == ForceKind.CONTACT:
            found["force"] = np.abs(reports[:, i, [Report.VALUE]])  # its sign is the side of the face
        elif kind == ForceKind.STATEFUL:
            marker, data = scene.tables.forces[i, [Forces.B, Forces.NUMBERS]]  # marker B: of the first state's coordinate
            first = scene.tables.dofs[scene.tables.markers[marker, Markers.FIRST]]
            dofs = slice(first, first + int(scene.tables.data[data + StatefulData.STATES]))
            found["states"] = np.hstack([out.v[:, dofs], out.a[:, dofs]])  # a state is the rate of its coordinate
    return channels
