"""Single shooting: periodic motions as fixed points of the map over a period, by Newton's method.

The map P leads from a state x = (q, v) on the constraints to the state a period T later; a periodic motion has P(x) = x. Its
Floquet multipliers are the eigenvalues of the monodromy matrix dP/dx (Floquet 1883, doi 10.24033/asens.220; Seydel 2010, ch. 7,
doi 10.1007/978-1-4419-1740-9). Columns of this matrix are central differences of runs on the same steps (Bock 1983,
doi 10.1007/978-1-4684-7324-7_7), so that P is smooth. If contacts begin, at times that differ between runs, each run adapts its
steps with a smaller tolerance. Changes of a state are (2 f,): f free coordinates in their units, and their rates over `pace`.
"""

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from ..geometry import Array
from ..progress import watching
from ..solvers import Controlled, Spectral
from ..spectral.output import Output
from ..spectral.run import RunState, integrate, memory_at_end
from ..spectral.scene import CompiledScene
from .algebra import null_space, solve
from .problem import LONGEST_STEP, StaticsError

CLOSED = 1e-7
"""Largest residual of a periodic motion, in units of coordinates: about the error of runs of undamped motions."""
BUDGET = 1_000_000
"""Most steps of all runs of a search with one degree and one tolerance."""
ITERATIONS = 12
"""Most iterations of Newton's method in an attempt of a search: chosen."""


class SpentError(StaticsError):
    """Failure of a search because it needs too many steps."""


class Found(NamedTuple):
    """Periodic state, its period, largest component of the `residual` P(x) - x, run over the period, and monodromy matrix."""

    state: RunState
    period: float
    residual: float
    out: Output
    monodromy: Array


@dataclass
class Shooting:
    """Map of a state to the state a period [s] later, by runs that may take `steps_left` steps together.

    `tolerance` and `longest`, a step over the period, belong to the run that chooses the steps. Differences have the half width
    `width`. `autonomous` is True if nothing depends on time, `has_onsets` if contacts begin in the motion. `grazes` is True if
    their number differs on both sides of the motion.
    """

    scene: CompiledScene
    period: float
    tolerance: float = 1e-7
    longest: float = 1 / 64  # the tenth harmonic then has six steps in each of its periods
    width: float = 2e-5  # in units of coordinates and rates: truncation errors are about its square
    steps_left: int = field(default_factory=lambda: BUDGET)

    def __post_init__(self) -> None:
        self.units = self.scene.units
        self.autonomous = self._is_autonomous()
        self.step_ends: Array = np.array([1.0])  # of the stored steps, over the period
        self.has_onsets = self.grazes = False
        self.onsets = 0  # number of onsets in the latest run

    @property
    def pace(self) -> float:
        """Unit of the rate of a coordinate, over the unit of the coordinate [1/s]."""
        return 2 * np.pi / self.period

    def finer(self, degree: int) -> "Shooting":
        """Return the map with shorter steps, strips of another degree and narrower differences."""
        scene = CompiledScene.of(self.scene.mechanism, degree) if degree != self.scene.degree else self.scene
        tolerance = self.tolerance / 2**5  # for half the step, as collocation at three Radau points has the order 5
        width = max(1e-5, self.width / 2)  # not less, as it divides errors of events, about 1e-10
        return Shooting(scene, self.period, tolerance, self.longest / 2, width)

    def _is_autonomous(self) -> bool:
        """Return True if the equations are the same at three times, for an arbitrary state near the start."""
        equations = []
        q, v = (0.01 * self.units * np.cos(np.arange(1 + k, self.scene.size + 1 + k)) for k in range(2))
        for share in (0.0, 0.217, 0.618):  # no simple fractions, at which harmonics may be equal
            a = self.scene.assemble(self.scene.q0 + q, self.pace * v, t=share * self.period, tangents=False)
            # f and g, and the values that constraints with drives require of G v and G a
            equations.append(np.concatenate([a.force, a.residual, a.speed, a.change]))
        return all(np.array_equal(equations[0], other) for other in equations[1:])

    def run(self, state: RunState, *, adaptive: bool = False) -> Output:
        """Integrate a period on the stored steps, or on new ones with onsets of contacts; if adaptive, store the new steps."""
        ends, every, most = None, 1, self.steps_left  # every step is a row of the output
        if self.has_onsets:  # steps of two runs differ, so that errors do not cancel: 1e-3, chosen, keeps them small
            tolerance = 1e-3 * self.tolerance
        elif adaptive:  # every second step is a row, from which `ends_of_steps` makes two steps again
            tolerance, every = self.tolerance, 2
        else:  # 1e-10, chosen, locates events on the stored steps; 20: far more than a run without a failure takes
            tolerance, ends, most = 1e-10, self.step_ends * self.period, min(most, 20 * len(self.step_ends))
        steps = Controlled(tolerance=tolerance, max_step=self.longest * self.period, max_steps=max(1, most))
        solver = Spectral(steps, method="implicit", contact_tolerance=1e4 * tolerance)  # 1e4: as by default
        watching.get().step()
        time_left = watching.get().time_left
        out, failure, counts = integrate(self.scene, self.period, solver, time_left, state=state, ends=ends, every=every)
        self.steps_left -= int(counts.steps)
        if self.steps_left <= 0:
            where = f"a motion of period {self.period:.6g} s"
            raise SpentError(f"{BUDGET} steps did not lead to {where}; damp it, or start nearer to it")
        watching.get().end_run(failure)
        if failure:
            raise StaticsError(f"{failure.status}: {failure.message}")
        self.onsets = int(counts.onsets)
        if adaptive:
            # after a run with onsets, where each step is a row, these are twice as many steps as needed
            self.step_ends, self.has_onsets = ends_of_steps(out.time) / self.period, bool(counts.onsets)
        return out

    def advance(self, state: RunState, periods: int) -> RunState:
        """Integrate a number of periods; return the state at the end, at time 0 and without whole turns of angles."""
        for _ in range(periods):
            out = self.run(state, adaptive=True)
            turns = np.where(self.scene.is_angle, np.round((out.q[-1] - self.scene.q0) / (2 * np.pi)), 0.0)
            state = RunState(0.0, out.q[-1] - 2 * np.pi * turns, out.v[-1], memory_at_end(out))
        return state

    def project(self, state: RunState) -> RunState:
        """Project a nearby state onto the constraints g = 0, G v = speed by the least change in the norm of the mass matrix."""
        scene, q, v = self.scene, state.q, state.v
        no_force = np.zeros(scene.size)  # the change is the acceleration a with M a + G^T lambda = 0 and G a = g or speed - G v
        for _ in range(4):  # of Newton's method; where g = 0 to rounding, q stays
            q = q - scene.accelerate(q, no_force, scene.assemble(q, tangents=False).residual)[0]
        equations = scene.assemble(q, tangents=False)
        return state._replace(q=q, v=v + scene.accelerate(q, no_force, equations.speed - equations.jacobian @ v)[0])

    def basis(self, state: RunState) -> Array:
        """Return a basis of the free coordinates, the motions that the constraints allow, (n, f), orthonormal in units."""
        return null_space(self.scene.assemble(state.q, tangents=False).jacobian, self.units)

    def displace(self, state: RunState, basis: Array, change: Array) -> RunState:
        """Displace a state by a change (2 f,), and project it onto the constraints."""
        f = basis.shape[1]
        return self.project(state._replace(q=state.q + basis @ change[:f], v=state.v + self.pace * (basis @ change[f:])))

    def change(self, state: RunState, basis: Array, out: Output) -> Array:
        """Return the change (2 f,) from a state to the end of a run, without whole turns of angles."""
        to_free = basis.T / self.units**2  # left inverse of the basis, which is orthonormal in units
        q = out.q[-1] - state.q
        q = q - np.where(self.scene.is_angle, 2 * np.pi * np.round(q / (2 * np.pi)), 0.0)
        return np.concatenate([to_free @ q, to_free @ (out.v[-1] - state.v) / self.pace])

    def monodromy(self, state: RunState, basis: Array, out: Output) -> Array:
        """Compute dP/dx for changes of free coordinates and rates, (2 f, 2 f); `out` is the latest run, from the state."""
        undisplaced, onsets, self.grazes = self.change(state, basis, out), self.onsets, False
        columns = [self._difference(state, basis, unit, undisplaced, onsets) for unit in self.width * np.eye(2 * basis.shape[1])]
        return np.array(columns).reshape(len(columns), len(columns)).T

    def _difference(self, state: RunState, basis: Array, unit: Array, undisplaced: Array, onsets: int) -> Array:
        """Differentiate the map along a displacement: centrally, or on the side with the same number of onsets as the motion."""

        def evaluate(widths: float) -> tuple[Array, bool]:
            """Return the change from a displaced state, and True if the number of onsets stays."""
            found = self.change(state, basis, self.run(self.displace(state, basis, widths * unit)))
            return found, self.onsets == onsets

        (plus, same_plus), (minus, same_minus) = evaluate(1.0), evaluate(-1.0)
        # the map has a kink where a contact is just touched; if both sides differ, multipliers are not determined: `grazes`
        if same_plus == same_minus:
            self.grazes = self.grazes or not same_plus
            return (plus - minus) / (2 * self.width)
        near, side = (plus, 1.0) if same_plus else (minus, -1.0)
        far, same_far = evaluate(2.0 * side)
        difference = (4.0 * near - 3.0 * undisplaced - far) / 2.0 if same_far else near - undisplaced
        return side * difference / self.width

    def search(self, state: RunState, matrix: Array | None = None) -> Found:
        """Find a periodic motion by Newton's method, from the `matrix` of a nearby one if given; advance after a failure."""
        least, period = np.inf, self.period
        for _ in range(6):  # attempts; chosen, as are the eight periods after each
            found = self.newton(self.project(state), matrix)
            is_rest = self.autonomous and self.largest_range(found.out) <= 1e-5  # by convention; it has any period
            if found.residual <= CLOSED and not is_rest:
                return found
            least = min(least, found.residual)
            self.period = period  # Newton's method has changed it, if nothing depends on time
            state = self.advance(state, periods=8)
        reason = "; only rest" if least <= CLOSED else f": a period leaves {least:.1e} of the longest link"
        raise StaticsError(f"no motion of period {period:.6g} s was found{reason}")

    def largest_range(self, out: Output) -> float:
        """Return the largest range of a coordinate in a period, in its unit."""
        return float((np.ptp(out.q, axis=0) / self.units).max(initial=0.0))

    def newton(self, state: RunState, matrix: Array | None = None) -> Found:
        """Solve P(x) = x by modified Newton's method; compute the monodromy matrix again if convergence is slow."""
        basis, at_matrix, previous = self.basis(state), np.inf, np.inf  # at_matrix: residual where the matrix was computed
        if matrix is None or len(matrix) != 2 * basis.shape[1]:
            matrix = np.empty((0, 0))
        best = Found(state, self.period, np.inf, self.run(state, adaptive=True), matrix)
        for _ in range(ITERATIONS):
            out = self.run(state)
            change = self.change(state, basis, out)
            residual = float(np.abs(change).max(initial=0.0))
            if residual < best.residual:
                best = Found(state, self.period, residual, out, matrix)
            elif at_matrix <= CLOSED:  # the matrix is that of the motion: the residual is now an error of the runs
                break
            if not matrix.size or residual > 0.5 * previous:  # 0.5: slow, chosen
                basis, at_matrix = self.basis(state), residual
                change, matrix = self.change(state, basis, out), self.monodromy(state, basis, out)
            previous = residual
            state = self._newton_step(state, basis, out, matrix, change)
        self.period = best.period
        if best.residual <= CLOSED and at_matrix > 1e-9:  # a hundredth of `CLOSED`: else the matrix was computed too far away
            matrix = self.monodromy(best.state, self.basis(best.state), self.run(best.state))
        return best._replace(monodromy=matrix)

    def _newton_step(self, state: RunState, basis: Array, out: Output, matrix: Array, change: Array) -> RunState:
        """Take a step of Newton's method; if nothing depends on time, the period is unknown, and the step has the least norm."""
        square = matrix - np.eye(len(matrix))  # derivative of P(x) - x
        if self.autonomous:
            to_free = basis.T / self.units**2
            by_period = np.concatenate([to_free @ out.v[-1], to_free @ out.a[-1] / self.pace])  # derivative of P(x) [1/s]
            by_phase = by_period / self.pace  # by the phase at the end, 2 pi times the relative change of the period
            # singular values below 1e-6 of the largest, chosen, are of free directions, along which motions stay periodic
            solution = np.linalg.lstsq(np.column_stack([square, by_phase]), -change, rcond=1e-6)[0]
            step, change_of_phase = solution[:-1], float(solution[-1])
            self.period *= 1.0 + float(np.clip(change_of_phase / (2 * np.pi), -0.2, 0.2))  # at most a fifth
        else:
            step = solve(square, -change)
        longest = LONGEST_STEP * max(1.0, self.largest_range(out))
        return self.displace(state, basis, step * min(1.0, longest / max(float(np.abs(step).max(initial=0.0)), 1e-300)))


def ends_of_steps(time: Array) -> Array:
    """Return ends of steps for later runs, from the times of a run that wrote every second step, and two rows at an event."""
    rows = time[np.append(np.diff(time) > 1e-9 * time[-1], True)]
    gaps = np.diff(rows)  # with ends at a quarter and three quarters: none is at an event, whose time differs in later runs
    return np.append(np.sort(np.concatenate([rows[:-1] + 0.25 * gaps, rows[:-1] + 0.75 * gaps])), time[-1])


def find_multipliers(matrix: Array) -> Array:
    """Return the Floquet multipliers, eigenvalues of a monodromy matrix, the largest first."""
    values = np.linalg.eigvals(matrix)
    return np.asarray(values[np.argsort(-np.abs(values), kind="stable")])


def distances_to(values: Array, others: Array) -> Array:
    """Return the distance of each multiplier to the nearest one of others."""
    return np.asarray(np.abs(values[:, None] - others[None]).min(axis=1, initial=np.inf))
