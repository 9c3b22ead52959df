"""A mechanism for the compiled kernel: its arrays, and functions that assemble its equations and compute motions of points.

M(q) a = f(q, v, t) - G(q)^T lambda,    g(q, t) = 0.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_array

from ..elements.element import Element
from ..elements.stop import SLOWEST_ONSET
from ..functions import EdgeMemory, locate
from ..geometry import Array
from ..mechanism import Mechanism
from ..scene.scene import Scene
from . import entry_points
from .builder import Attached, Builder
from .connect import link_of
from .elimination import Fronts, fronts_of
from .linear import Equations, Linear, Matrix
from .packing import pack
from .registry import add_body, add_element
from .strip_body import StripBody
from .strut import StrutBody, find_hosts, join_strut
from .tables import Directions, ForceKind, Forces, Instant, MarkerKind, Markers, Memory, State, Tables, Work, work_for

DEGREE = 8
"""Default degree of a strip's polynomials."""


class MarkerMotion(NamedTuple):
    """State of a marker: position (2,), velocity (2,), angle, spin."""

    position: Array
    velocity: Array
    angle: float
    spin: float


@dataclass
class CompiledScene:
    """A mechanism as arrays for the kernel."""

    mechanism: Mechanism
    degree: int  # of the strips' polynomials
    builder: Builder
    tables: Tables
    q0: Array  # coordinates at t = 0: links where the points are, strips stress-free, (n,)
    row_names: list[str]  # of the constraints' rows
    force_names: list[str]  # of the forces
    notes: list[str]  # sentences for the result
    work: Work = field(repr=False)

    @classmethod
    def of(cls, mechanism: Mechanism, degree: int | None = None) -> CompiledScene:
        """Translate a mechanism into arrays; `degree` of the strips' polynomials, 8 by default.

        A ValueError if this solver does not know an element's kind, or a strut is not pinned to a body.
        """
        builder = Builder(mechanism, DEGREE if degree is None else degree)
        _attach_masses(builder)
        for link in mechanism.links:
            builder.bodies[link.name] = add_body(builder, link)
        struts = [body for body in builder.bodies.values() if isinstance(body, StrutBody)]
        for _ in struts:
            for body in struts:
                find_hosts(builder, body)
        for body in struts:
            join_strut(builder, body)
        for name, element in _elements_of(mechanism).items():
            add_element(builder, name, element)
        tables = pack(builder)
        scene = cls(
            mechanism, builder.degree, builder, tables, np.array(builder.q, dtype=float),
            [row.name for row in builder.rows], [force.name for force in builder.forces],
            list(dict.fromkeys(builder.notes)), work_for(tables),
        )  # fmt: skip
        scene._begin()
        scene._hold_start()
        return scene

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return len(self.q0)

    @property
    def source(self) -> Scene:
        """Scene of the mechanism, which it translates."""
        return Scene.of(self.mechanism)

    @cached_property
    def edge_memory(self) -> EdgeMemory:
        """Edges of functions of time, found once for all runs of the scene outside of `simulate`."""
        return EdgeMemory()

    @property
    def length(self) -> float:
        """Length of the longest link [m]."""
        return self.source.size

    @property
    def units(self) -> Array:
        """Unit of each coordinate, shape (n,): the longest link's length, 1 rad."""
        out = np.full(self.size, self.length)
        for i, unit in self.builder.units.items():
            out[i] = unit
        return out

    @cached_property
    def strip_places(self) -> list[tuple[Array, Array]]:
        """Coordinates x and y of strips, one element after the other."""
        bodies = (body for body in self.builder.bodies.values() if isinstance(body, StripBody))
        return [(element.places[0], element.places[1]) for body in bodies for element in body.elements]

    @cached_property
    def fronts(self) -> Fronts:
        """Order of elimination of Newton's matrices."""
        s, unknowns = self.tables, self.size + len(self.tables.rows)
        return fronts_of(s.row, s.col, self.size, unknowns, np.ones(len(s.row), dtype=bool))

    @cached_property
    def mass_fronts(self) -> Fronts:
        """Order of elimination of mass matrix and constraints."""
        return self._find_mass_fronts(constant=False)

    @cached_property
    def constant_mass_fronts(self) -> Fronts:
        """Order of elimination of the constant part of the mass matrix, diagonal for modal links, and constraints."""
        return self._find_mass_fronts(constant=True)

    def _find_mass_fronts(self, constant: bool) -> Fronts:
        s, n, unknowns = self.tables, self.size, self.size + len(self.tables.rows)
        filled = (s.mass[:-1] != 0.0) | (s.row >= n) | (s.col >= n)
        for o, m, _ in [] if constant else s.modal:
            filled |= (o <= s.row) & (s.row < o + 3 + m) & (o <= s.col) & (s.col < o + 3 + m)
        return fronts_of(s.row, s.col, n, unknowns, filled)

    def mass_entries(self, q: Array) -> Array:
        """Compute the nonzeros of the mass matrix, (slots + 1,)."""
        values = np.empty_like(self.tables.mass)
        entry_points.mass_at(self.tables, self.work, q, values)
        return values

    def mass_at(self, q: Array, sparse: bool = False) -> Matrix:
        """Mass matrix M(q), shape (n, n); it is constant without modal links."""
        made = self.sparse_matrix if sparse else self.full_matrix
        return made(self.mass_entries(q))[: self.size, : self.size]

    def full_matrix(self, values: Array) -> Array:
        """Matrix of all unknowns from its nonzeros, shape (n + r, n + r)."""
        unknowns = self.size + len(self.tables.rows)
        out = np.zeros((unknowns, unknowns))
        out[self.tables.row, self.tables.col] = values[:-1]
        return out

    def sparse_matrix(self, values: Array) -> csr_array:
        """Matrix of all unknowns from its nonzeros, sparse."""
        s, unknowns = self.tables, self.size + len(self.tables.rows)
        return csr_array((values[:-1], s.col, np.searchsorted(s.row, np.arange(unknowns + 1))), shape=(unknowns, unknowns))

    def memory(self) -> Array:
        """Memories of forces at the start, shape (forces, 4): see `tables`."""
        out = np.zeros((len(self.tables.forces), 4))
        out[:, Memory.ONSET] = out[:, Memory.FASTEST] = SLOWEST_ONSET
        return out

    def assemble(
        self, q: Array, v: Array | None = None, t: float = 0.0, lam: Array | None = None, memory: Array | None = None,
        *, tangents: bool = True, sparse: bool = False,
    ) -> Equations:  # fmt: skip
        """Forces, tangents and constraints at coordinates q, rates v (zero by default), time t and multipliers lam (zero).

        Matrices are sparse arrays of SciPy if `sparse`.
        """
        v, lam = (np.zeros(self.size) if v is None else v), (np.zeros(len(self.tables.rows)) if lam is None else lam)
        return self.at(Instant(float(t), 0.0, q, v, lam, self.memory() if memory is None else memory), tangents, sparse)

    def at(self, now: Instant, tangents: bool = True, sparse: bool = False) -> Equations:
        """Assemble the same at an instant, with the time over which bristles bend."""
        force, sides = np.empty(self.size), np.empty((3, len(self.tables.rows)))
        matrices = np.zeros((4, len(self.tables.mass)))
        entry_points.assemble(self.tables, self.work, now, matrices if tangents else matrices[3:], force, sides)
        return Equations(force, sides[0], sides[1], sides[2], matrices, self.sparse_matrix if sparse else self.full_matrix)

    def accelerate(self, q: Array, force: Array, change: Array) -> tuple[Array, Array]:
        """Solve M a + G^T lambda = force, G a = change at coordinates q; lambda is 0 of redundant rows."""
        out = np.concatenate([force, change])
        entry_points.accelerate(self.tables, self.mass_fronts, self.work, q, out)
        return out[: self.size], out[self.size :]

    def linear(
        self, q: Array, v: Array | None = None, t: float = 0.0, lam: Array | None = None, memory: Array | None = None,
        *, tangents: bool = True,
    ) -> Linear:  # fmt: skip
        """The equations of motion, linear about a state, as sparse matrices."""
        a = self.assemble(q, v, t, lam, memory, tangents=tangents, sparse=True)
        return Linear(self.mass_at(q, sparse=True), *(csr_array(each) for each in (a.damping, a.stiffness, a.jacobian, a.cross)))

    def edges(self) -> Array:
        """Edges of laws found by earlier runs, (edges, 2): number of the force, and value of its measure there."""
        rows = {self.force_names[row]: row for row in np.flatnonzero(self.tables.forces[:, Forces.KIND] == ForceKind.LAW)}
        found = [np.empty((0, 2))]
        for name, values in locate([*rows]).items():
            places = values + self.tables.data[self.tables.forces[rows[name], Forces.NUMBERS] + 2]
            found.append(np.column_stack([np.full(len(places), float(rows[name])), places]))
        return np.concatenate(found)

    def marker(self, link: str, point: str) -> int:
        """Marker of a point of a link, or of the ground; added to the scene if missing."""
        marker = self.builder.marker(link, point)
        if len(self.builder.markers) > len(self.tables.markers):
            self.refresh()
        return marker

    def read(self, marker: int, q: Array, v: Array | None = None) -> MarkerMotion:
        """Compute the place of a marker at coordinates q and its velocity at rates v."""
        entry_points.place(self.tables, self.work, q, np.zeros(self.size) if v is None else v)
        s = self.work.state[marker]
        return MarkerMotion(s[:2].copy(), s[3:5].copy(), float(s[2]), float(s[5]))

    def turns(self, q: Array) -> Array:
        """Angles of markers, with whole turns, at the last of q (times, n) from t = 0, that turn by less than pi each."""
        self._begin()
        for each in q if (self.tables.markers[:, Markers.KIND] == MarkerKind.CURVE).any() else q[-1:]:
            entry_points.place(self.tables, self.work, each, np.zeros(self.size))
        return self.work.state[:, State.TURN].copy()

    def measure(self, measure: int, q: Array) -> float:
        """Value of a measure at coordinates q."""
        entry_points.place(self.tables, self.work, q, np.zeros(self.size))
        return float(entry_points.measure_at(self.tables, self.work, measure, np.zeros(6), np.zeros((6, 6))))

    def summary(self) -> dict[str, int]:
        """Count parts, coordinates and constraints."""
        parts = self.source.counts - Counter(dict.fromkeys({type(mass).__name__ for mass in self.mechanism.masses}, 10**9))
        if any(self.mechanism.gravity):
            parts["gravity"] += 1
        return {**parts, "coordinates": self.size, "constraints": len(self.tables.rows), "forces": len(self.tables.forces)}

    def _hold_start(self) -> None:
        """Set the values of rows constrained to their measures at t = 0."""
        for r, row in enumerate(self.builder.rows):
            if row.value is None:
                row.value = sum(self.builder.directions[i][Directions.FACTOR] * self.measure(i, self.q0) for i in row.measures)
                self.tables.values[r] = row.value

    def refresh(self) -> None:
        """Pack the tables again, with markers added since."""
        old, numbers = self.tables, len(self.builder.data)
        self.tables = pack(self.builder)
        del self.builder.data[numbers:]  # of forces, which `pack` appends
        self.tables.values[:], self.tables.factors[:] = old.values, old.factors
        self.tables.time_factor[:] = old.time_factor
        self.work = work_for(self.tables)
        self._begin()

    def _begin(self) -> None:
        """Set markers' angles to those at t = 0, as whole turns are counted from there."""
        for m in np.flatnonzero(self.tables.markers[:, Markers.KIND] == MarkerKind.CURVE):
            self.work.state[m, State.TURN] = self.builder.angle_of(int(m))


def _elements_of(mechanism: Mechanism) -> dict[str, Element]:
    """Joints, guides, stops, loads and drives of a mechanism by name; links and masses are bodies."""
    bodies = {*map(id, mechanism.links), *map(id, mechanism.masses)}
    return {name: element for name, element in Scene.of(mechanism).elements.items() if id(element) not in bodies}


def _attach_masses(builder: Builder) -> None:
    """List the masses attached to each link: guided blocks, point masses, rotors."""
    mechanism = builder.mechanism

    def attach(link: str, point: str, mass: float, inertia: float) -> None:
        """Attach a point's mass [kg] and inertia [kg m^2] to a link."""
        if mass or inertia:
            builder.attached.setdefault(link, []).append(Attached(point, mass, inertia))

    for guide in mechanism.guides:
        attach(guide.link, guide.point, guide.mass, 0.0)
    for at, mass, inertia in Scene.of(mechanism).burdens:
        attach(*link_of(builder, at), mass, inertia)
