"""Equations of equilibrium of a mechanism, f(q) = G^T lambda and g(q) = 0, with a parameter of loads or of a drive.

Coordinates q (n,) have units: the longest link for lengths, 1 rad for angles. Multipliers lambda (r,) belong to the rows of the
constraints g, whose Jacobian is G. K is the derivative of -f + G^T lambda by q.
"""

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.sparse import block_array

from ..geometry import Array
from ..progress import USER_STOPS, watching
from ..spectral.entry_points import place, update_stresses
from ..spectral.linear import Equations, MatrixRow
from ..spectral.scene import CompiledScene
from ..spectral.strips import PLAIN as STRESSES_BY_COORDINATES
from ..spectral.strips import RENEWED as STRESSES_ARE_UNKNOWNS
from ..spectral.tables import Report, State
from .algebra import DEPENDENT, EPS, LOWEST_COUNT, Matrix, least_squares, solve
from .spectrum import ROUNDING, Spectrum, Tangent, spectrum

LONGEST_STEP = 0.3
"""Largest change of a coordinate in an iteration, in its unit."""
BALANCED = 1e-8
"""Largest residual force at the end of the iteration, over the largest force."""


class StaticsError(ValueError):
    """Failure of the statics: Newton's method does not converge, or a name is unknown."""


SEARCH_STOPS = (StaticsError, *USER_STOPS)
"""Exceptions that end a search: failure, time limit or Ctrl-C. The answer is then the last state found."""


class Rest(NamedTuple):
    """State of the statics, an equilibrium or a trial one: coordinates q (n,), multipliers lambda (r,), parameter p."""

    q: Array
    multipliers: Array
    parameter: float


class Plane(NamedTuple):
    """Plane normal . x = value of states x = (q, lambda, p), (n + r + 1,); the last unknown of Newton's method is p/`unit`."""

    normal: Array
    value: float
    unit: float


@dataclass
class Problem:
    """Equations of equilibrium of a scene over a parameter, whose value is `initial` in the mechanism as given.

    The parameter is the factor of the `loads`, indices in `tables.factors`, or is added to the value of the constraint `row`, -1
    for none. `shift` [1/s^2] of the latest search for eigenvalues on a path begins the next one; 0 at first.
    """

    scene: CompiledScene
    loads: Sequence[int] = ()
    row: int = -1
    initial: float = 1.0
    shift: float = 0.0

    def __post_init__(self) -> None:
        self.units = self.scene.units
        self.value = 0.0  # value of the constraint `row` in the mechanism as given
        self.label = "factor of the loads"  # name of the parameter in drawings
        if self.row >= 0:
            self.value, self.label = self.scene.tables.values[self.row], f"travel of {self.scene.row_names[self.row]} [rad or m]"

    @property
    def extents(self) -> Array:
        """Extents of the coordinates, (n,): as `units`, with the size of the mechanism in place of the longest link's length."""
        points = np.array(list(self.scene.mechanism.points.values()))
        extent = max(self.scene.length, float(np.ptp(points, axis=0).max()))
        return np.where(self.scene.is_angle, 1.0, self.units * (extent / self.scene.length))

    def with_degree(self, increment: int) -> "Problem":
        """Return the problem with a separate scene, whose strips have a degree that is higher by `increment`."""
        finer = CompiledScene.of(self.scene.mechanism, self.scene.degree + increment)
        names = [*self.scene.force_names, "gravity"]  # a line load has more forces at a higher degree
        return replace(self, scene=finer, loads=loads_of(finer, {names[i] for i in self.loads}))

    def refine(self, rest: Rest, increment: int) -> tuple["Problem", Rest]:
        """Return the problem with strips of a degree higher by `increment`, and the state there, with zero new coefficients."""
        finer = self.with_degree(increment)
        guess = finer.start(rest.parameter)._replace(q=prolong(self.scene, finer.scene, rest.q))
        return finer, guess._replace(multipliers=finer.compute_multipliers(guess))

    def start(self, parameter: float) -> Rest:
        """Return the pose of the mechanism as given, with zero multipliers."""
        return Rest(self.scene.q0, np.zeros(len(self.scene.row_names)), parameter)

    def set_parameter(self, parameter: float) -> None:
        """Set the parameter in the tables of the scene."""
        if self.row >= 0:
            self.scene.tables.values[self.row] = self.value + parameter
        self.scene.tables.factors[list(self.loads)] = parameter

    def assemble(self, rest: Rest, tangents: bool = True) -> Equations:
        """Assemble forces, constraints and their derivatives at a state."""
        self.set_parameter(rest.parameter)
        sparse = self.scene.size + len(rest.multipliers) >= 220  # where dense and sparse solvers take the same time
        return self.scene.assemble(rest.q, lam=rest.multipliers, tangents=tangents, sparse=sparse)

    def residual(self, rest: Rest, tangents: bool = True) -> tuple[Array, Array, Equations]:
        """Return the residuals f - G^T lambda (n,) of the forces and g (r,) of the constraints, and the assembled equations."""
        a = self.assemble(rest, tangents)
        return a.force - a.jacobian.T @ rest.multipliers, a.residual, a

    def slope(self, rest: Rest, residuals: tuple[Array, Array] | None = None) -> Array:
        """Return the derivative (n + r,) of f - G^T lambda and g by p: values at p + 1 less those at p, as they are linear."""
        force, gap = residuals or self.residual(rest, False)[:2]
        next_force, next_gap, _ = self.residual(rest._replace(parameter=rest.parameter + 1.0), False)
        return np.concatenate([next_force - force, next_gap - gap])

    def scale_matrix(self, a: Equations, added: Array | float = 0.0) -> tuple[Matrix, float]:
        """Return [[U K U/F, (G U)^T], [G U, 0]], U = diag(units), and the force unit F; `added` entries are added to K."""
        unknown_units = np.concatenate([self.units, np.ones(len(self.scene.tables.rows))])
        row, column = self.scene.tables.row, self.scene.tables.col  # indices of the entries in the matrix
        entry_units = np.append(unknown_units[row] * unknown_units[column], 0.0)  # 0 for the last entry, which is in no matrix
        k = (a.entries[MatrixRow.STIFFNESS] + added) * entry_units
        diagonal = np.abs(k[:-1][row == column])
        force_unit = float(np.median(diagonal[diagonal > 0.0])) if diagonal.any() else 1.0  # F
        return a.build(k / force_unit + a.entries[MatrixRow.JACOBIAN] * entry_units), force_unit  # JACOBIAN: G and G^T

    def newton(self, rest: Rest, plane: Plane | None = None, must_decrease: bool = False, origin: Rest | None = None) -> Rest:
        """Find an equilibrium by Newton's method at the parameter of a state or on a plane; raise a StaticsError if it diverges.

        With `must_decrease` a step longer than the one before counts as divergence. Stresses of strips are more unknowns, which
        the assembly eliminates. They start from the stresses at the `origin`, an equilibrium near the guess, `rest` by default.
        """
        previous, converges = np.inf, False
        with self._free_stresses(origin or rest, rest.q):
            for _ in range(25):  # chosen, as the limits below, for changes in units of the coordinates
                rest, largest = self.step(rest, plane)
                next_step = largest * (largest / previous) ** 2  # quadratic convergence squares the ratio of successive steps
                cannot_improve = next_step < 10 * EPS or largest > 0.1 * previous  # above 0.1 it is not quadratic any more
                grows_by_rounding = previous < largest < 1e-8  # near a critical point rounding may exceed 1e-10: it is accepted
                converges = (largest < 1e-10 and cannot_improve) or grows_by_rounding
                if converges or not np.isfinite(largest) or (must_decrease and largest > previous):
                    break
                previous = largest
            is_found = converges and self.is_balanced(rest)
        if not is_found:
            raise StaticsError(f"no equilibrium found near parameter {rest.parameter:.6g}: Newton's method does not converge")
        has_redundant_rows = bool(self.scene.source.undetermined)  # then multipliers are not unique: take the least ones
        return rest._replace(multipliers=self.compute_multipliers(rest)) if has_redundant_rows else rest

    @contextmanager
    def _free_stresses(self, origin: Rest, q: Array) -> Iterator[None]:
        """Make the stresses of strips unknowns within the context, extrapolated from an equilibrium to coordinates q."""
        scene, work = self.scene, self.scene.work
        work.stress[:] = 0.0
        work.strip_form[:] = STRESSES_ARE_UNKNOWNS  # a flag for compiled code, in an array of one number
        try:
            self.assemble(origin, False)  # stores the stresses of the origin and their derivatives
            update_stresses(scene.tables, work, q - origin.q)  # sets `work.stress` by them
            yield
        finally:
            work.strip_form[:] = STRESSES_BY_COORDINATES

    def step(self, rest: Rest, plane: Plane | None = None) -> tuple[Rest, float]:
        """Take one step of Newton's method, limited to `LONGEST_STEP`; return the state and the largest change without limit."""
        watching.get().check()
        n, r = self.scene.size, len(rest.multipliers)
        change_p = 0.0
        if plane is None:  # K dq + G^T dlambda = f - G^T lambda, G dq = -g
            force, gap, a = self.residual(rest)
            matrix, force_unit = self.scale_matrix(a)
            step = solve(matrix, np.concatenate([force * self.units / force_unit, -gap]))
        else:
            bordered, force_unit, force, gap = self._border_matrix(rest, plane.normal, plane.unit)
            distance = plane.value - float(plane.normal @ self.vector(rest))
            step = solve(bordered, np.concatenate([force * self.units / force_unit, -gap, [distance]]))
            change_p = float(step[-1]) * plane.unit
        largest = float(np.abs(step[:n]).max(initial=0.0))
        share = min(1.0, LONGEST_STEP / max(largest, 1e-300))  # meaningless if the step is not finite: `newton` then ends
        q = rest.q + share * step[:n] * self.units
        if self.scene.work.strip_form[0] != STRESSES_BY_COORDINATES:
            update_stresses(self.scene.tables, self.scene.work, q - rest.q)
        return Rest(q, rest.multipliers + share * step[n : n + r] * force_unit, rest.parameter + share * change_p), largest

    def is_balanced(self, rest: Rest) -> bool:
        """Return True if g is small, and residual forces are small against applied forces, weights, reactions or rounding."""
        force, gap, a = self.residual(rest)
        scene, units = self.scene, self.units
        # rough scale of forces times units of coordinates [N m]: a torque is multiplied by the longest link as well
        applied = np.abs(scene.work.reports[:, Report.VALUE]).max(initial=0.0) * scene.length
        weight = np.abs(scene.tables.factors[-1] * scene.tables.weight * units).max(initial=0.0)  # the last factor is gravity's
        reactions = abs(a.jacobian * units * rest.multipliers[:, None]).max() if min(a.jacobian.shape) else 0.0
        stiffest = float(np.abs(a.stiffness.diagonal() * units**2).max(initial=0.0))
        rounding = 1e3 * EPS * stiffest  # force by rounding of the stiffest coordinate, with a margin of 1e3
        limit = max(BALANCED * max(applied, weight, reactions), rounding)
        is_closed = np.abs(gap).max(initial=0.0) <= 1e-9 * max(1.0, scene.length)  # constraints in m or rad; 1e-9: chosen
        return bool(is_closed and np.abs(force * units).max(initial=0.0) <= limit)

    def compute_multipliers(self, rest: Rest) -> Array:
        """Compute the multipliers (r,) that balance the forces best, by least squares; the least ones if rows are redundant."""
        if not len(rest.multipliers):
            return np.zeros(0)
        a = self.assemble(rest, False)
        return least_squares((a.jacobian * self.units).T, a.force * self.units, DEPENDENT)

    def vector(self, rest: Rest) -> Array:
        """Return coordinates, multipliers and parameter, (n + r + 1,)."""
        return np.concatenate([rest.q, rest.multipliers, [rest.parameter]])

    def tangent(self, rest: Rest, normal: Array, unit: float) -> Array:
        """Return the tangent of (q, lambda, p) along the path whose product with the normal is 1; p is solved over `unit`."""
        matrix, force_unit, _, _ = self._border_matrix(rest, normal, unit)
        right = np.zeros(matrix.shape[0])
        right[-1] = 1.0
        out, n = solve(matrix, right), self.scene.size
        return np.concatenate([out[:n] * self.units, out[n:-1] * force_unit, [out[-1] * unit]])

    def _border_matrix(self, rest: Rest, normal: Array, unit: float) -> tuple[Matrix, float, Array, Array]:
        """Border the scaled matrix by the column of p/unit and the normal; return it, the unit of force and both residuals."""
        n = self.scene.size
        force, gap, a = self.residual(rest)
        slope = self.slope(rest, (force, gap))
        matrix, force_unit = self.scale_matrix(a)
        column = unit * np.concatenate([-slope[:n] * self.units / force_unit, slope[n:]])  # K is of -f + G^T lambda, G of g
        row = np.concatenate([normal[:n] * self.units, normal[n:-1] * force_unit, [normal[-1] * unit]])
        blocks = [[matrix, column[:, None]], [row[None, :-1], row[None, -1:]]]
        bordered = np.block(blocks) if isinstance(matrix, np.ndarray) else block_array(blocks, format="csr")
        return bordered, force_unit, force, gap

    def rounding(self, rest: Rest) -> float:
        """Estimate the rounding error of p by that of axial forces of strips over the largest df/dp; 0 for drives (df/dp = 0)."""
        stiffest = max((body.section.axial_stiffness for body in self.scene.strips), default=0.0)
        slope, n = np.abs(self.slope(rest)), self.scene.size
        force = float((slope[:n] * self.units).max(initial=0.0)) / self.scene.length  # a torque is one at this arm
        return ROUNDING * stiffest / force if force else 0.0  # a strain has the rounding error ROUNDING

    def spectrum(self, rest: Rest, count: int = LOWEST_COUNT) -> Spectrum:
        """Compute the eigenvalues of small motions about a state: for many coordinates the lowest `count` and all that grow."""
        watching.get().check()
        return spectrum(self.linearise(rest), count=count)

    def linearise(self, rest: Rest) -> Tangent:
        """Make the equations of small motions about a state."""
        self.set_parameter(rest.parameter)
        return Tangent.at(self.scene, rest.q, rest.multipliers)


def prolong(coarse: CompiledScene, fine: CompiledScene, q: Array) -> Array:
    """Return the coordinates of a state in a scene of higher degree; coefficients of the additional polynomials are zero."""
    out, is_other, is_other_fine = np.zeros(fine.size), np.ones(coarse.size, bool), np.ones(fine.size, bool)
    for body, finer_body in zip(coarse.strips, fine.strips, strict=True):
        for piece, finer in zip(body.pieces, finer_body.pieces, strict=True):
            out[finer.dofs[:, : piece.dofs.shape[1]]] = q[piece.dofs]
            is_other[piece.dofs] = is_other_fine[finer.dofs] = False
    out[is_other_fine] = q[is_other]  # coordinates that are not of strips, in the same order in both scenes
    return out


def distance_between(scene: CompiledScene, a: Array, b: Array) -> float:
    """Return the largest distance of two poses a and b (n,), in units of the coordinates; along strips an estimate."""
    change = np.abs(a - b) / scene.units
    for strip in scene.strips:
        for piece in strip.pieces:
            # coordinates of a field: end values, then coefficients of integrated Legendre polynomials of degree 2, 3, ...
            ends, inner = piece.dofs[:, :2], piece.dofs[:, 2:]
            # sizes of these polynomials, see `basis`: chosen, 0.5 for degree 2, whose maximum is 0.61, else above the maximum
            sizes = 1.0 / np.sqrt(2.0 * np.arange(2, 2 + inner.shape[1]))
            change[ends] += (change[inner] * sizes).sum(axis=1)[:, None]
            change[inner] = 0.0
    return float(change.max(initial=0.0))


def find_moving_link(scene: CompiledScene, q: Array, shape: Array) -> str:
    """Return the name of the link that moves most in a motion `shape` (n,) from coordinates q; '' if all links are massless."""
    links = [link for link in scene.mechanism.links if not link.body.massless]
    if not links:
        return ""
    markers = [[scene.marker(link.name, point) for point in (link.start, link.end)] for link in links]
    place(scene.tables, scene.work, q, shape)  # states of the markers at q, with the shape as rates
    motions = np.abs(scene.work.state[markers, State.VX : State.SPIN + 1] / [scene.length, scene.length, 1.0])
    return links[int(motions.max(axis=(1, 2)).argmax())].name


def loads_of(scene: CompiledScene, names: Iterable[str] | None = None) -> list[int]:
    """Return the indices in `tables.factors` of the named loads, of which 'gravity' is one; by default of all loads."""
    kinds = ("force", "line_load", "torque", "motor", "gravity")  # springs and contacts are no loads
    # a line load is several forces of one name
    known = [(i, name) for i, name in enumerate([*scene.force_names, "gravity"]) if name.split(".")[0] in kinds]
    names_of_loads = dict.fromkeys(name for _, name in known)
    loads = set(names_of_loads) if names is None else set(names)
    if unknown := loads - set(names_of_loads):
        raise StaticsError(f"load = {', '.join(map(repr, sorted(unknown)))}: unknown; known: {', '.join(names_of_loads)}")
    return [i for i, name in known if name in loads]
