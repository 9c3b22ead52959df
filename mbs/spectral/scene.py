"""Mechanism as arrays for the compiled kernel, with methods that assemble its equations and compute motions of points.

    M(q) a = f(q, v, lambda, t) - G(q)^T lambda,    g(q, t) = 0.

There are n coordinates q with rates v and accelerations a, and r multipliers lambda; G = dg/dq (r, n). The derivatives of g = 0
by time are G v = speed and G a = change: `speed` is -dg/dt, which is not zero for drives, `change` has all terms without a. The
tangents are C = -df/dv and K = -df/dq + d(G^T lambda)/dq. Slots are the entries of M, C, K and G that can be nonzero. Arrays
over the slots have one more entry at the end: entries that are always zero go there, and it is never read.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_array

from ..elements.stop import SLOWEST_ONSET
from ..functions import EdgeMemory, current_memory
from ..geometry import Array
from ..mechanism import Mechanism
from ..scene.scene import Scene
from . import entry_points
from .builder import Attached, Builder
from .connect import link_of
from .elimination import Fronts, fronts_of
from .lawtable import LawData
from .linear import Equations, Matrix, MatrixRow
from .packing import pack
from .registry import add_body, add_element
from .strip_body import StripBody
from .strut import join_struts
from .tables import ForceKind, Forces, Instant, MarkerKind, Markers, MeasureNumber, Memory, State, Tables, Work, allocate_work

DEGREE = 8
"""Default degree of a strip's polynomials, if the solver gives none."""


class MarkerMotion(NamedTuple):
    """Position and velocity of a marker, a point of a body with an angle."""

    position: Array  # (2,) [m]
    velocity: Array  # (2,) [m/s]
    angle: float  # [rad]
    spin: float  # rate of the angle [rad/s]


@dataclass
class CompiledScene:
    """Mechanism as arrays for the kernel."""

    mechanism: Mechanism
    degree: int  # of the strips' polynomials
    builder: Builder  # lists from which the tables are packed, again if markers are added
    tables: Tables
    q0: Array  # coordinates at t = 0: links where the points are, strips stress-free, (n,)
    row_names: list[str]  # name of the element of each constraint
    force_names: list[str]  # name of the element of each force
    notes: list[str]  # sentences for the result: which functions could not be compiled
    work: Work = field(repr=False)

    @classmethod
    def of(cls, mechanism: Mechanism, degree: int | None = None) -> CompiledScene:
        """Translate a mechanism into arrays; a ValueError names a kind that is not supported, or a strut with a free end."""
        builder = Builder(mechanism, DEGREE if degree is None else degree)
        masses = [(guide.link, guide.point, guide.mass, 0.0) for guide in mechanism.guides]
        masses += [(*link_of(builder, at), mass, inertia) for at, mass, inertia in Scene.of(mechanism).burdens]
        for link_name, point, mass, inertia in masses:
            if mass or inertia:
                builder.attached.setdefault(link_name, []).append(Attached(point, mass, inertia))
        for link in mechanism.links:
            builder.bodies[link.name] = add_body(builder, link)
        join_struts(builder)
        bodies = {*map(id, mechanism.links), *map(id, mechanism.masses)}  # equal ones may be different bodies
        for name, element in Scene.of(mechanism).elements.items():
            if id(element) not in bodies:
                add_element(builder, name, element)
        tables = pack(builder)
        scene = cls(
            mechanism, builder.degree, builder, tables, np.array(builder.q, dtype=float),
            [row.name for row in builder.rows], [force.name for force in builder.forces],
            list(dict.fromkeys(builder.notes)), allocate_work(tables),
        )  # fmt: skip
        scene.reset_turns()
        for r, row in enumerate(builder.rows):
            if row.value is None:  # the sum keeps the value that it has at t = 0
                terms = (tables.measure_numbers[i, MeasureNumber.FACTOR] * scene.measure(i, scene.q0) for i in row.measures)
                tables.values[r] = sum(terms)
        return scene

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return len(self.q0)

    @property
    def source(self) -> Scene:
        """Solver-independent scene of the mechanism."""
        return Scene.of(self.mechanism)

    @cached_property
    def edge_memory(self) -> EdgeMemory:
        """Edges of functions of time, found once for all runs of the scene; `simulate` has a memory of its own for its scenes."""
        return EdgeMemory()

    @property
    def length(self) -> float:
        """Length of the longest link [m]."""
        return self.source.linkage.size

    @property
    def units(self) -> Array:
        """Unit of each coordinate, (n,): the longest link's length [m], 1 rad, that of a mode, or 1 of a law's state."""
        units, length = self.builder.units, self.length
        return np.where(self.is_angle, 1.0, [units.get(i, length) for i in range(self.size)])

    @property
    def is_angle(self) -> Array:
        """True for coordinates that are angles, shape (n,)."""
        return np.isin(np.arange(self.size), list(self.builder.angles))

    @cached_property
    def strips(self) -> list[StripBody]:
        """Bodies of the strips."""
        return [body for body in self.builder.bodies.values() if isinstance(body, StripBody)]

    @cached_property
    def fronts(self) -> Fronts:
        """Order of elimination of Newton's matrices."""
        tables, unknowns = self.tables, self.size + len(self.tables.rows)
        return fronts_of(tables.row, tables.col, self.size, unknowns, np.ones(len(tables.row), dtype=bool))

    @cached_property
    def mass_fronts(self) -> Fronts:
        """Order of elimination of mass matrix and constraints, [M G^T; G 0]."""
        return self.find_mass_fronts(constant=False)

    def find_mass_fronts(self, constant: bool) -> Fronts:
        """Find the order of elimination of [M G^T; G 0]; if `constant`, with the part of M that never changes."""
        row, col, n, unknowns = self.tables.row, self.tables.col, self.size, self.size + len(self.tables.rows)
        is_in_jacobian = (row >= n) | (col >= n)
        can_be_nonzero = (self.tables.mass[:-1] != 0.0) | is_in_jacobian
        if not constant:
            for first, modes, _first_number in self.tables.modal:  # columns of `tables.Modal`
                link = range(first, first + 3 + modes)  # x, y, angle, modes: M changes between all of them
                can_be_nonzero |= np.isin(row, link) & np.isin(col, link)
        return fronts_of(row, col, n, unknowns, can_be_nonzero)

    def mass_entries(self, q: Array) -> Array:
        """Compute the entries of the mass matrix, (slots + 1,)."""
        values = np.empty_like(self.tables.mass)
        entry_points.mass_at(self.tables, self.work, q, values)
        return values

    def mass_at(self, q: Array, sparse: bool = False) -> Matrix:
        """Compute the mass matrix M(q), shape (n, n); it is constant without modal links."""
        return self.build_matrix(self.mass_entries(q), sparse)[: self.size, : self.size]

    def build_matrix(self, values: Array, sparse: bool = False) -> Matrix:
        """Build the matrix of all unknowns, (n + r, n + r), from its entries, (slots + 1,)."""
        unknowns = self.size + len(self.tables.rows)
        first = np.searchsorted(self.tables.row, np.arange(unknowns + 1))  # index of each row's first entry
        out = csr_array((values[:-1], self.tables.col, first), shape=(unknowns, unknowns))
        return out if sparse else out.toarray()

    def memory(self) -> Array:
        """Return the memories of forces before any onset, (forces, 4): onset speeds are the least, as laws divide by them."""
        out = np.zeros((len(self.tables.forces), 4))
        out[:, Memory.ONSET] = out[:, Memory.FASTEST] = SLOWEST_ONSET
        return out

    def assemble(
        self, q: Array, v: Array | None = None, t: float = 0.0, lam: Array | None = None, memory: Array | None = None,
        *, since: float = 0.0, tangents: bool = True, sparse: bool = False,
    ) -> Equations:  # fmt: skip
        """Compute forces, tangents, constraints at a state, by default at rest; `memory` is that of `since` seconds before."""
        v = np.zeros(self.size) if v is None else v
        lam = np.zeros(len(self.tables.rows)) if lam is None else lam
        memory = self.memory() if memory is None else memory
        now = Instant(time=float(t), since=since, q=q, v=v, lam=lam, memory=memory)
        force, sides = np.empty(self.size), np.empty((3, len(self.tables.rows)))
        matrices = np.zeros((len(MatrixRow), len(self.tables.mass)))
        filled = matrices if tangents else matrices[MatrixRow.JACOBIAN :]  # the last row alone: G and G^T, but no tangents
        entry_points.assemble(self.tables, self.work, now, filled, force, sides)
        residual, speed, change = sides  # g, and the right sides of G v = speed and G a = change
        return Equations(force, residual, speed, change, matrices, partial(self.build_matrix, sparse=sparse))

    def accelerate(self, q: Array, force: Array, change: Array) -> tuple[Array, Array]:
        """Solve M a + G^T lambda = force, G a = change at coordinates q; lambda of redundant constraints is 0."""
        out = np.concatenate([force, change])
        entry_points.accelerate(self.tables, self.mass_fronts, self.work, q, out)
        return out[: self.size], out[self.size :]

    def edges(self) -> Array:
        """Collect the jumps and kinks of laws that earlier runs found, (edges, 2): index of the force, value of its measure."""
        laws = {self.force_names[k]: k for k in np.flatnonzero(self.tables.forces[:, Forces.KIND] == ForceKind.LAW)}
        found = [np.empty((0, 2))]
        for name, arguments in current_memory(self.edge_memory).locate([*laws]).items():
            at_zero = self.tables.data[self.tables.forces[laws[name], Forces.NUMBERS] + LawData.OFFSET]  # measure at argument 0
            found.append(np.column_stack([np.full(len(arguments), float(laws[name])), arguments + at_zero]))
        return np.concatenate(found)

    def marker(self, link: str, point: str) -> int:
        """Return the marker of a point of a link, or of the ground; it is added to the scene if missing."""
        marker = self.builder.marker(link, point)
        self.refresh()
        return marker

    def read(self, marker: int, q: Array, v: Array | None = None) -> MarkerMotion:
        """Compute position and angle of a marker at coordinates q, and their rates at v (zero by default)."""
        state = self._place(q, v)[marker]
        position, velocity = state[[State.X, State.Y]], state[[State.VX, State.VY]]
        return MarkerMotion(position, velocity, float(state[State.ANGLE]), float(state[State.SPIN]))

    def _place(self, q: Array, v: Array | None = None) -> Array:
        entry_points.place(self.tables, self.work, q, np.zeros(self.size) if v is None else v)
        return self.work.state

    def measure(self, measure: int, q: Array) -> float:
        """Compute the value of a measure at coordinates q."""
        self._place(q)
        return float(entry_points.measure_at(self.tables, self.work, measure))

    def summary(self) -> dict[str, int]:
        """Count elements by kind (masses belong to bodies), coordinates, constraints and forces."""
        masses = {type(mass).__name__ for mass in self.mechanism.masses}
        parts = Counter({kind: count for kind, count in self.source.counts.items() if kind not in masses})
        if any(self.mechanism.gravity):
            parts["gravity"] += 1
        return {**parts, "coordinates": self.size, "constraints": len(self.tables.rows), "forces": len(self.tables.forces)}

    def refresh(self) -> None:
        """Pack the tables again if markers were added to the builder since."""
        if len(self.builder.markers) == len(self.tables.markers):
            return
        old = self.tables
        self.tables = pack(self.builder)
        # `of` and statics changed these since the tables were packed
        self.tables.values[:], self.tables.factors[:], self.tables.time_factor[:] = old.values, old.factors, old.time_factor
        self.work = allocate_work(self.tables)
        self.reset_turns()

    def reset_turns(self) -> None:
        """Compute the angles of all markers at t = 0, from which whole turns are counted."""
        is_on_cable = self.tables.markers[:, Markers.KIND] == MarkerKind.CURVE
        for m in np.flatnonzero(is_on_cable):  # `_place` gives a tangent's angle within half a turn of the one before
            self.work.state[m, State.ANGLE] = self.builder.angle_of(int(m))
        self._place(self.q0)
