"""The map of a state to that a period later, its fixed points by Newton's method, and its derivative.

A state x = (q, v) that the constraints allow returns after a period T: P(x) = x. Newton's method takes the monodromy matrix
dP/dx, whose eigenvalues, the multipliers, tell by how much small motions grow in a period. Its columns are central
differences of runs on the same steps, which are those of one smooth map. Where contacts begin, the derivative jumps at times that
differ from run to run: there each run chooses its own steps, with a tolerance a thousand times smaller.

References
----------
G. Floquet, Ann. sci. ENS 12 (1883) 47-88, doi 10.24033/asens.220.
R. Seydel, Practical Bifurcation and Stability Analysis (2010), ch. 7, doi 10.1007/978-1-4419-1740-9.
H. G. Bock, in: Numerical treatment of inverse problems in differential and integral equations, Birkhäuser 1983, 95-121,
doi 10.1007/978-1-4684-7324-7_7: differences on shared steps.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from ..geometry import Array
from ..solvers import Controlled, Spectral
from ..spectral.output import Output
from ..spectral.run import State, integrate, memory_at_end
from ..spectral.scene import Scene
from .lowest import null_space
from .problem import LONGEST_STEP, StaticsError, solve

TOLERANCE, COARSER, FINE = 1e-7, 1e4, 1e-10
"""Local error of the run that chooses the steps, how much larger that of depths of contacts is, over the depth; and the local
error, in the sense of the solver, within which runs of given steps locate events, and which is the least of the former."""
STRUCK = 1e-3
"""Local error where contacts begin, of that elsewhere: their runs share no steps, and differ by what they err by."""
LONGEST = 1 / 64
"""Longest step, of the period."""
OFFSET, LEAST = 2e-5, 1e-5
"""Half width of the differences, in units of coordinates and rates, and the least: a hundredth of `FINE` over it is an error."""
RETRIES = 20
"""Steps that a run may take for each that is given."""
CLOSED, THERE = 1e-7, 1e-9
"""What a period may leave open, in the same units: the error of the steps, where nothing is damped; and from how far a monodromy
matrix is that of the motion."""
BUDGET = 1_000_000
"""Steps of all runs of a search, at each degree and width."""
SEARCHES, ITERATIONS, ONWARD = 6, 12, 8
"""Searches, steps of Newton's method in each, and periods that are run in between."""
MOVES = 1e-5
"""Way, in units of coordinates, below which a motion is rest."""
FREE = 1e-6
"""Share of the largest singular value below which a direction of Newton's matrix is taken for none."""


class SpentError(StaticsError):
    """The steps that a search may take are used up."""


class Found(NamedTuple):
    """A state that returns, after how long, how far from itself, the way there, and the monodromy matrix."""

    state: State
    period: float
    open: float
    out: Output
    matrix: Array


@dataclass
class Shooting:
    """The map of a state to that a period later.

    Attributes
    ----------
    scene : Scene
    period : float
        s
    tolerance, longest : float
        Local error of the run that chooses the steps, and the longest one, of the period: rest says nothing of them.
    width : float
        Half width of the differences.
    left : int
        Steps that its runs may still take.
    """

    scene: Scene
    period: float
    tolerance: float = TOLERANCE
    longest: float = LONGEST
    width: float = OFFSET
    left: int = field(default_factory=lambda: BUDGET)

    def __post_init__(self) -> None:
        self.units = self.scene.units
        self.free = self._autonomous()
        self.shares: Array = np.array([1.0])
        self.struck = False

    @property
    def pace(self) -> float:
        """What a coordinate's unit is multiplied by for its rate, rad/s."""
        return 2 * np.pi / self.period

    def finer(self, degree: int) -> Shooting:
        """The same with shorter steps, strips of another degree and narrower differences."""
        scene = Scene.of(self.scene.mechanism, degree) if degree != self.scene.degree else self.scene
        return Shooting(scene, self.period, self.tolerance / 32, self.longest / 2, max(LEAST, self.width / 2))

    def _autonomous(self) -> bool:
        """Whether nothing depends on time: seen at three times, somewhere beside the start."""
        seen = []
        q, v = (0.01 * self.units * np.cos(np.arange(1 + k, self.scene.size + 1 + k)) for k in range(2))
        for share in (0.0, 0.217, 0.618):
            a = self.scene.assemble(self.scene.q0 + q, self.pace * v, t=share * self.period, tangents=False)
            seen.append(np.concatenate([a.force, a.residual, a.speed, a.change]))
        return all(np.array_equal(seen[0], other) for other in seen[1:])

    def run(self, state: State, *, own: bool = False) -> Output:
        """A period from a state, on shared steps; or on its own, which are shared from then on unless a contact begins."""
        alone = own or self.struck
        tolerance = self.tolerance * (STRUCK if self.struck else 1.0) if alone else FINE
        most = max(1, self.left if alone else min(self.left, RETRIES * len(self.shares)))
        steps = Controlled(tolerance=tolerance, max_step=self.longest * self.period, max_steps=most)
        solver = Spectral(steps, method="implicit", contact_tolerance=COARSER * tolerance)
        ends = None if alone else self.shares * self.period
        every = 2 if alone and not self.struck else 1
        out, failure, counts = integrate(self.scene, self.period, solver, state=state, ends=ends, every=every)
        self.left -= int(counts.steps)
        if self.left <= 0:
            where = f"a motion of period {self.period:.6g} s"
            raise SpentError(f"{BUDGET} steps did not lead to {where}; damp it, or start nearer to it")
        if failure:
            raise StaticsError(f"{failure[0]}: {failure[1]}")
        if own:
            self.shares, self.struck = between(out.time) / self.period, bool(counts.onsets)
        return out

    def onward(self, state: State, periods: int) -> State:
        """The state some periods later, all forces that depend on time as at the start of one."""
        for _ in range(periods):
            state = self._last(self.run(state, own=True))
        return state

    def _last(self, out: Output) -> State:
        q = out.q[-1]
        turns = np.where(self.units == 1.0, np.round((q - self.scene.q0) / (2 * np.pi)), 0.0)
        return State(0.0, q - 2 * np.pi * turns, out.v[-1], memory_at_end(out))

    def met(self, state: State) -> State:
        """The nearest state that the constraints allow."""
        scene, q, v = self.scene, state.q, state.v
        still = np.zeros(scene.size)
        for _ in range(4):
            q = q - scene.held(q, still, scene.assemble(q, tangents=False).residual)[0]
        a = scene.assemble(q, tangents=False)
        return state._replace(q=q, v=v + scene.held(q, still, a.speed - a.jacobian @ v)[0])

    def basis(self, state: State) -> Array:
        """Columns that span what the constraints allow, (n, f), of length 1 in units."""
        return null_space(self.scene.assemble(state.q, tangents=False).jacobian, self.units)

    def moved(self, state: State, basis: Array, change: Array) -> State:
        """The state that is a change (2 f,) of places and rates, in units, away."""
        f = basis.shape[1]
        return self.met(state._replace(q=state.q + basis @ change[:f], v=state.v + self.pace * (basis @ change[f:])))

    def change(self, state: State, basis: Array, out: Output) -> Array:
        """Where a run ends, counted from a state, whole turns left out, (2 f,)."""
        back = basis.T / self.units**2
        q = out.q[-1] - state.q
        q = q - np.where(self.units == 1.0, 2 * np.pi * np.round(q / (2 * np.pi)), 0.0)
        return np.concatenate([back @ q, back @ (out.v[-1] - state.v) / self.pace])

    def monodromy(self, state: State, basis: Array, *, own: bool = False) -> tuple[Output, Array]:
        """A period, on shared or on its own steps, and dP/dx on what the constraints allow, (2 f, 2 f)."""
        out, columns = self.run(state, own=own), []
        for unit in self.width * np.eye(2 * basis.shape[1]):
            one, other = (self.change(state, basis, self.run(self.moved(state, basis, side * unit))) for side in (1, -1))
            columns.append((one - other) / (2 * self.width))
        return out, np.array(columns).reshape(len(columns), len(columns)).T

    def search(self, state: State, matrix: Array | None = None) -> Found:
        """Newton's method, from further on where it does not converge; the matrix is that of a motion nearby.

        Raises
        ------
        StaticsError
        """
        left, period = np.inf, self.period
        for _ in range(SEARCHES):
            self.period = period
            found = self.newton(self.met(state), matrix)
            if found.open <= CLOSED and self._moves(found):
                return found
            left, self.period = min(left, found.open), period
            state = self.onward(state, ONWARD)
        rest = "; only rest" if left <= CLOSED else f": a period leaves {left:.1e} of the longest link"
        raise StaticsError(f"no motion of period {period:.6g} s was found{rest}")

    def _moves(self, found: Found) -> bool:
        """Whether it is more than rest, which has any period."""
        return not self.free or self._way(found.out) > MOVES

    def _way(self, out: Output) -> float:
        """Largest way of a coordinate in a period, in its unit."""
        return float((np.ptp(out.q, axis=0) / self.units).max(initial=0.0))

    def newton(self, state: State, matrix: Array | None = None) -> Found:
        """Newton's method; the monodromy matrix is made anew where the old one does not do."""
        basis, made, before = self.basis(state), np.inf, np.inf
        if matrix is None or len(matrix) != 2 * basis.shape[1]:
            matrix = np.empty((0, 0))
        best = Found(state, self.period, np.inf, self.run(state, own=True), matrix)
        for _ in range(ITERATIONS):
            out = self.run(state)
            miss = self.change(state, basis, out)
            left = float(np.abs(miss).max(initial=0.0))
            if left < best.open:
                best = Found(state, self.period, left, out, matrix)
            elif made <= CLOSED:  # what is left is the error of the steps
                break
            if not matrix.size or left > 0.5 * before:
                basis, made = self.basis(state), left
                miss, matrix = self.change(state, basis, out), self.monodromy(state, basis)[1]
            before = left
            state = self._stepped(state, basis, out, matrix, miss)
        self.period = best.period
        if best.open <= CLOSED and made > THERE:
            matrix = self.monodromy(best.state, self.basis(best.state))[1]
        return best._replace(matrix=matrix)

    def _stepped(self, state: State, basis: Array, out: Output, matrix: Array, miss: Array) -> State:
        """A step of Newton's method; where nothing depends on time the period is an unknown, too, and the step the shortest."""
        square = matrix - np.eye(len(matrix))
        if self.free:
            back = basis.T / self.units**2
            flow = np.concatenate([back @ out.v[-1], back @ out.a[-1] / self.pace]) / self.pace
            step = np.linalg.lstsq(np.column_stack([square, flow]), -miss, rcond=FREE)[0]
            self.period *= 1.0 + float(np.clip(step[-1] / (2 * np.pi), -0.2, 0.2))
            step = step[:-1]
        else:
            step = solve(square, -miss)
        longest = LONGEST_STEP * max(1.0, self._way(out))  # in units of the motion where it is larger
        return self.moved(state, basis, step * min(1.0, longest / max(float(np.abs(step).max(initial=0.0)), 1e-300)))


def between(time: Array) -> Array:
    """Ends of steps as long as those of a run that wrote every second one, none at an event of it."""
    rows = time[np.append(np.diff(time) > 1e-9 * time[-1], True)]
    gaps = np.diff(rows)
    return np.append(np.sort(np.concatenate([rows[:-1] + 0.25 * gaps, rows[:-1] + 0.75 * gaps])), time[-1])


def values_of(matrix: Array) -> Array:
    """Multipliers, the largest first."""
    values = np.linalg.eigvals(matrix)
    return np.asarray(values[np.argsort(-np.abs(values), kind="stable")])


def off_from(values: Array, others: Array) -> Array:
    """Distance of each multiplier to the nearest of others."""
    return np.asarray(np.abs(values[:, None] - others[None]).min(axis=1, initial=np.inf))
