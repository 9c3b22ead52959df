"""Single shooting: periodic motions as fixed points of the map over a period, by Newton's method.

A state x = (q, v) on the constraints is mapped to that a period T later; a periodic motion has P(x) = x. The eigenvalues of the
monodromy matrix dP/dx are the Floquet multipliers (Floquet 1883, doi 10.24033/asens.220; Seydel 2010, ch. 7,
doi 10.1007/978-1-4419-1740-9). Its columns are central differences of runs on the same steps (Bock 1983,
doi 10.1007/978-1-4684-7324-7_7), so that the map is smooth. With onsets of contacts, whose times differ from run to run, each run
adapts its steps with a tolerance a thousand times smaller.
"""

from __future__ import annotations

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

TOLERANCE = 1e-7
"""Tolerance of the run that chooses the steps."""
COARSER = 1e4
"""Relative tolerance of depths of contacts over the tolerance."""
FINE = 1e-10
"""Tolerance within which runs on given steps locate events."""
STRUCK = 1e-3
"""Factor of the tolerance with onsets of contacts: such runs have different steps, so that their errors do not cancel."""
LONGEST = 1 / 64
"""Longest step over the period."""
OFFSET = 2e-5
"""Half width of the differences, in units of coordinates and rates."""
LEAST = 1e-5
"""Least half width of the differences, limited by the error `FINE` of events over it."""
RETRIES = 20
"""Most steps of a run over the number of given ones."""
CLOSED = 1e-7
"""Largest residual of a periodic motion, in units of coordinates: the error of the steps without damping."""
CONVERGED = 1e-9
"""Residual below which a monodromy matrix is not computed again."""
BUDGET = 1_000_000
"""Most steps of all runs of a search, at each degree and width."""
SEARCHES = 6
"""Most searches by Newton's method."""
ITERATIONS = 12
"""Most iterations of Newton's method in each search."""
ONWARD = 8
"""Number of periods integrated between two searches."""
AT_REST = 1e-5
"""Range of coordinates, in their units, below which a motion is rest."""
FREE = 1e-6
"""Singular value of Newton's matrix, over the largest, below which a direction counts as free."""


class SpentError(StaticsError):
    """Error of a search that needs too many steps."""


class Found(NamedTuple):
    """Periodic state, its period, residual `open`, run over the period, and monodromy matrix."""

    state: RunState
    period: float
    open: float
    out: Output
    matrix: Array


@dataclass
class Shooting:
    """Map of a state to that a period [s] later; `left` is the remaining number of steps.

    The run that chooses the steps has a tolerance, and a longest step over the period; `width` is half that of the differences.
    """

    scene: CompiledScene
    period: float
    tolerance: float = TOLERANCE
    longest: float = LONGEST
    width: float = OFFSET
    left: int = field(default_factory=lambda: BUDGET)

    def __post_init__(self) -> None:
        self.units = self.scene.units
        self.free = self._autonomous()
        self.shares: Array = np.array([1.0])
        self.struck = self.grazes = False
        self.onsets = 0

    @property
    def pace(self) -> float:
        """Factor from the unit of a coordinate to that of its rate [rad/s]."""
        return 2 * np.pi / self.period

    def finer(self, degree: int) -> Shooting:
        """Return the map with shorter steps, strips of another degree and narrower differences."""
        scene = CompiledScene.of(self.scene.mechanism, degree) if degree != self.scene.degree else self.scene
        return Shooting(scene, self.period, self.tolerance / 32, self.longest / 2, max(LEAST, self.width / 2))

    def _autonomous(self) -> bool:
        """Return True if nothing depends on time, tested at three times for a state near the start."""
        found = []
        q, v = (0.01 * self.units * np.cos(np.arange(1 + k, self.scene.size + 1 + k)) for k in range(2))
        for share in (0.0, 0.217, 0.618):
            a = self.scene.assemble(self.scene.q0 + q, self.pace * v, t=share * self.period, tangents=False)
            found.append(np.concatenate([a.force, a.residual, a.speed, a.change]))
        return all(np.array_equal(found[0], other) for other in found[1:])

    def run(self, state: RunState, *, adaptive: bool = False) -> Output:
        """Integrate a period on stored steps; or with adaptive ones, which are then stored unless there is an onset."""
        alone = adaptive or self.struck
        tolerance = self.tolerance * (STRUCK if self.struck else 1.0) if alone else FINE
        most = max(1, self.left if alone else min(self.left, RETRIES * len(self.shares)))
        steps = Controlled(tolerance=tolerance, max_step=self.longest * self.period, max_steps=most)
        solver = Spectral(steps, method="implicit", contact_tolerance=COARSER * tolerance)
        ends = None if alone else self.shares * self.period
        every = 2 if alone and not self.struck else 1
        watching.get().step()
        left = watching.get().time_left
        out, failure, counts = integrate(self.scene, self.period, solver, left, state=state, ends=ends, every=every)
        self.left -= int(counts.steps)
        if self.left <= 0:
            where = f"a motion of period {self.period:.6g} s"
            raise SpentError(f"{BUDGET} steps did not lead to {where}; damp it, or start nearer to it")
        watching.get().end_run(failure)
        if failure:
            raise StaticsError(f"{failure[0]}: {failure[1]}")
        self.onsets = int(counts.onsets)
        if adaptive:
            self.shares, self.struck = between(out.time) / self.period, bool(counts.onsets)
        return out

    def onward(self, state: RunState, periods: int) -> RunState:
        """Integrate some periods; return the state at the end, with the time reset to 0."""
        for _ in range(periods):
            out = self.run(state, adaptive=True)
            turns = np.where(self.units == 1.0, np.round((out.q[-1] - self.scene.q0) / (2 * np.pi)), 0.0)
            state = RunState(0.0, out.q[-1] - 2 * np.pi * turns, out.v[-1], memory_at_end(out))
        return state

    def project(self, state: RunState) -> RunState:
        """Project a state onto the constraints."""
        scene, q, v = self.scene, state.q, state.v
        still = np.zeros(scene.size)
        for _ in range(4):
            q = q - scene.accelerate(q, still, scene.assemble(q, tangents=False).residual)[0]
        a = scene.assemble(q, tangents=False)
        return state._replace(q=q, v=v + scene.accelerate(q, still, a.speed - a.jacobian @ v)[0])

    def basis(self, state: RunState) -> Array:
        """Return a basis of the motions that the constraints allow, (n, f), orthonormal in units."""
        return null_space(self.scene.assemble(state.q, tangents=False).jacobian, self.units)

    def displace(self, state: RunState, basis: Array, change: Array) -> RunState:
        """Displace a state by a change (2 f,) of coordinates and rates, in units."""
        f = basis.shape[1]
        return self.project(state._replace(q=state.q + basis @ change[:f], v=state.v + self.pace * (basis @ change[f:])))

    def change(self, state: RunState, basis: Array, out: Output) -> Array:
        """Return the end of a run less a state, without whole turns of angles, (2 f,)."""
        back = basis.T / self.units**2
        q = out.q[-1] - state.q
        q = q - np.where(self.units == 1.0, 2 * np.pi * np.round(q / (2 * np.pi)), 0.0)
        return np.concatenate([back @ q, back @ (out.v[-1] - state.v) / self.pace])

    def monodromy(self, state: RunState, basis: Array) -> tuple[Output, Array]:
        """Integrate a period and compute dP/dx on the free coordinates, (2 f, 2 f)."""
        out = self.run(state)
        here, onsets, self.grazes = self.change(state, basis, out), self.onsets, False
        columns = [self._difference(state, basis, unit, here, onsets) for unit in self.width * np.eye(2 * basis.shape[1])]
        return out, np.array(columns).reshape(len(columns), len(columns)).T

    def _difference(self, state: RunState, basis: Array, unit: Array, here: Array, onsets: int) -> Array:
        """Differentiate the map: centrally, or on the side with the same number of onsets as in the motion.

        The map has a kink where a contact is just touched. If the numbers differ on both sides, the motion `grazes`.
        """

        def at(steps: float) -> tuple[Array, bool]:
            """Return the map a number of units away; True if the number of onsets is the same."""
            found = self.change(state, basis, self.run(self.displace(state, basis, steps * unit)))
            return found, self.onsets == onsets

        (plus, same_plus), (minus, same_minus) = at(1.0), at(-1.0)
        if same_plus == same_minus:
            self.grazes = self.grazes or not same_plus
            return (plus - minus) / (2 * self.width)
        near, side = (plus, 1.0) if same_plus else (minus, -1.0)
        far, same_far = at(2.0 * side)
        difference = (4.0 * near - 3.0 * here - far) / 2.0 if same_far else near - here
        return side * difference / self.width

    def search(self, state: RunState, matrix: Array | None = None) -> Found:
        """Find a periodic motion by Newton's method, from later periods if it fails; `matrix` is that of a nearby motion."""
        left, period = np.inf, self.period
        for _ in range(SEARCHES):
            self.period = period
            found = self.newton(self.project(state), matrix)
            if found.open <= CLOSED and (not self.free or self._range(found.out) > AT_REST):  # rest has any period
                return found
            left, self.period = min(left, found.open), period
            state = self.onward(state, ONWARD)
        rest = "; only rest" if left <= CLOSED else f": a period leaves {left:.1e} of the longest link"
        raise StaticsError(f"no motion of period {period:.6g} s was found{rest}")

    def _range(self, out: Output) -> float:
        """Return the largest range of a coordinate in a period, in its unit."""
        return float((np.ptp(out.q, axis=0) / self.units).max(initial=0.0))

    def newton(self, state: RunState, matrix: Array | None = None) -> Found:
        """Iterate by modified Newton's method; compute the monodromy matrix again if convergence is slow."""
        basis, made, before = self.basis(state), np.inf, np.inf
        if matrix is None or len(matrix) != 2 * basis.shape[1]:
            matrix = np.empty((0, 0))
        best = Found(state, self.period, np.inf, self.run(state, adaptive=True), matrix)
        for _ in range(ITERATIONS):
            out = self.run(state)
            miss = self.change(state, basis, out)
            left = float(np.abs(miss).max(initial=0.0))
            if left < best.open:
                best = Found(state, self.period, left, out, matrix)
            elif made <= CLOSED:  # the residual is the error of the steps
                break
            if not matrix.size or left > 0.5 * before:
                basis, made = self.basis(state), left
                miss, matrix = self.change(state, basis, out), self.monodromy(state, basis)[1]
            before = left
            state = self._newton_step(state, basis, out, matrix, miss)
        self.period = best.period
        if best.open <= CLOSED and made > CONVERGED:
            matrix = self.monodromy(best.state, self.basis(best.state))[1]
        return best._replace(matrix=matrix)

    def _newton_step(self, state: RunState, basis: Array, out: Output, matrix: Array, miss: Array) -> RunState:
        """Take a step of Newton's method; if nothing depends on time, the period is unknown, and the step has the least norm."""
        square = matrix - np.eye(len(matrix))
        if self.free:
            back = basis.T / self.units**2
            flow = np.concatenate([back @ out.v[-1], back @ out.a[-1] / self.pace]) / self.pace
            step = np.linalg.lstsq(np.column_stack([square, flow]), -miss, rcond=FREE)[0]
            self.period *= 1.0 + float(np.clip(step[-1] / (2 * np.pi), -0.2, 0.2))
            step = step[:-1]
        else:
            step = solve(square, -miss)
        longest = LONGEST_STEP * max(1.0, self._range(out))  # larger for a large motion
        return self.displace(state, basis, step * min(1.0, longest / max(float(np.abs(step).max(initial=0.0)), 1e-300)))


def between(time: Array) -> Array:
    """Return the ends of steps of a run that wrote every second one: a quarter and three quarters between rows, no events."""
    rows = time[np.append(np.diff(time) > 1e-9 * time[-1], True)]
    gaps = np.diff(rows)
    return np.append(np.sort(np.concatenate([rows[:-1] + 0.25 * gaps, rows[:-1] + 0.75 * gaps])), time[-1])


def values_of(matrix: Array) -> Array:
    """Return the eigenvalues of a monodromy matrix, the largest first."""
    values = np.linalg.eigvals(matrix)
    return np.asarray(values[np.argsort(-np.abs(values), kind="stable")])


def distances_to(values: Array, others: Array) -> Array:
    """Return the distance of each multiplier to the nearest of others."""
    return np.asarray(np.abs(values[:, None] - others[None]).min(axis=1, initial=np.inf))
