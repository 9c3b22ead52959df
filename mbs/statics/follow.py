"""Paths of equilibria by arc length, through limit points, with stability and a choice of branch.

References
----------
E. Riks, An incremental approach to the solution of snapping and buckling problems, Int. J. Solids Structures 15 (1979) 529-551,
doi 10.1016/0020-7683(79)90081-7.
H. B. Keller, Numerical solution of bifurcation and nonlinear eigenvalue problems, in: P. Rabinowitz (ed.), Applications of
Bifurcation Theory (1977) 359-384.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from buckler.mbs.spectral.scene import Scene
from buckler.mbs.spectral.start import slopes
from buckler.mbs.statics.problem import Problem, Rest, StaticsError, loads_of, places

Array = np.ndarray[Any, Any]
Branch = tuple[str, str, tuple[float, float]]
SHORTEST = 1e-7


@dataclass(frozen=True)
class Path:
    """Equilibria along a path.

    Attributes
    ----------
    scene : Scene
    parameter : array, shape (steps,)
        Factor of the loads, or travel of the drive, rad or m.
    q : array, shape (steps, n)
    multipliers : array, shape (steps, r)
    lowest : array, shape (steps,)
        Lowest squared angular frequency at the held parameter, 1/s^2: negative where unstable.
    limits : list of float
        Parameter at the limit points, refined.
    branchings : list of float
        Parameter where stability changes and the parameter does not turn.
    """

    scene: Scene
    parameter: Array
    q: Array
    multipliers: Array
    lowest: Array
    limits: list[float]
    branchings: list[float]

    @property
    def stable(self) -> Array:
        """Where the equilibrium is stable, shape (steps,)."""
        return self.lowest > 0.0

    def point(self, link: str, point: str) -> Array:
        """Places of a point of a link, shape (steps, 2)."""
        return np.array([places(self.scene, q, link, point).position for q in self.q])

    def reaction(self, name: str) -> Array:
        """Multipliers of a constraint along the path, shape (steps, rows)."""
        return self.multipliers[:, [i for i, row in enumerate(self.scene.row_names) if row == name]]


def path(
    mechanism: Any, *, to: float, load: str | list[str] | None = None, drive: str | None = None, steps: int = 200,
    step: float = 0.02, longest: float = 0.1, branch: Branch | None = None, degree: int | None = None,
) -> Path:  # fmt: skip
    """Follow the equilibria of a mechanism from its stress-free start, at parameter 0, as a load grows or a drive moves.

    Parameters
    ----------
    mechanism : Mechanism
    to : float
        Parameter at which the path ends: factor of the load, or travel of the drive, rad or m.
    load : str or list of str, optional
        Names of the loads that grow ('gravity', 'force.A', ...); all by default, where no drive is named. Others stay at 1.
    drive : str, optional
        Name of the drive that moves ('drive').
    steps : int
        Most steps; a path that has not reached `to` by then ends where it is.
    step, longest : float
        First and longest arc: root mean square of changes, lengths in units of the longest link, angles in rad, the parameter
        in units of `to`.
    branch : (link, point, (x, y)), optional
        At the first branching leave the straight path towards the side on which this point moves in this direction.
    degree : int, optional
        Of the strips' polynomials.

    Raises
    ------
    StaticsError
        If the start is no equilibrium, or steps become too short.
    """
    scene = Scene.of(mechanism, degree)
    if drive is not None:
        if drive not in scene.row_names:
            raise StaticsError(f"drive = '{drive}': unknown; constraints: {', '.join(dict.fromkeys(scene.row_names))}")
        problem = Problem(scene, (), scene.row_names.index(drive))
    else:
        problem = Problem(scene, loads_of(scene, [load] if isinstance(load, str) else load))
    follower = _Follower(problem, to, branch)
    rest = problem.newton(Rest(scene.q0, np.zeros(len(scene.row_names)), 0.0))
    try:
        return follower.run(rest, steps, step, longest)
    finally:
        problem.set(1.0 if problem.row < 0 else 0.0)


NEAR = 1e-9
"""Arc, in the measure of the path, that is not told apart from none."""


class _Follower:
    """Bordered Newton steps along a path."""

    def __init__(self, problem: Problem, to: float, branch: Branch | None) -> None:
        self.problem, self.to, self.branch = problem, to, branch
        n, r = problem.scene.size, len(problem.scene.row_names)
        self.metric = np.concatenate([1.0 / problem.units**2 / n, np.zeros(r), [1.0 / to**2]])
        self.limits: list[float] = []
        self.branchings: list[float] = []

    def run(self, rest: Rest, steps: int, step: float, longest: float) -> Path:
        """Follow from a state of rest."""
        rests, lowest = [rest], [self._lowest(rest)]
        direction = self._direction(rest, None)
        for _ in range(steps):
            new, step = self._advance(rest, direction, step)
            low = self._lowest(new)
            if (low < 0) != (lowest[-1] < 0) and not self._turns(direction, rest, new):
                critical, shape = self._critical(rest, new, direction, lowest[-1])
                self.branchings.append(critical.parameter)
                if self.branch is not None:
                    rests.append(critical)
                    lowest.append(0.0)
                    direction, rest, self.branch = self._towards(critical, shape), critical, None
                    continue
            after = self._direction(new, direction)
            if direction[-1] * after[-1] < 0:
                self.limits.append(self._limit(rest, new, direction, after))
            rest, direction, step = new, after, min(longest, step * 1.3)
            rests.append(rest)
            lowest.append(low)
            if (rest.parameter - self.to) * np.sign(self.to) >= 0:
                rests[-1] = self.problem.newton(rest._replace(parameter=self.to))
                lowest[-1] = self._lowest(rests[-1])
                break
        q, multipliers, parameter = (np.array(x) for x in zip(*rests, strict=True))
        return Path(self.problem.scene, parameter, q, multipliers, np.array(lowest), self.limits, self.branchings)

    def _advance(self, rest: Rest, direction: Array, step: float) -> tuple[Rest, float]:
        while step > SHORTEST:
            try:
                return self._on_plane(rest, direction, step), step
            except StaticsError:
                step *= 0.5
        raise StaticsError(f"the path cannot be followed beyond parameter {rest.parameter:.6g}")

    def _on_plane(self, rest: Rest, direction: Array, step: float) -> Rest:
        """The equilibrium at a distance along a direction."""
        problem, n = self.problem, len(rest.q)
        normal = self.metric * direction
        value = float(normal @ problem.vector(rest)) + step
        moved = problem.vector(rest) + step * direction
        guess = Rest(moved[:n], moved[n:-1], float(moved[-1]))
        new = problem.newton(guess, (normal, value, abs(self.to)))
        way, apart = step * direction, problem.vector(new) - moved
        for part in (slice(None), slice(n)):  # places on their own too: beside a large load their way is short
            expected, off = (float(np.sqrt(self.metric[part] @ x[part] ** 2)) for x in (way, apart))
            if off > 0.5 * expected + NEAR:
                raise StaticsError("too far from where the path was expected")
        return new

    def _direction(self, rest: Rest, before: Array | None) -> Array:
        """Unit tangent of the path, on from the one before."""
        out = np.append(self.problem.tangent(rest), 1.0)
        out /= np.sqrt(float(self.metric @ out**2))
        forward = self.to * out[-1] if before is None else float(self.metric * before @ out)
        return np.asarray(out if forward >= 0 else -out)

    def _lowest(self, rest: Rest) -> float:
        found = self.problem.spectrum(rest)
        if not len(found.values):
            return float("nan")
        grows = float(found.growth.max())
        return -(grows**2) if grows > 0.0 else float(np.abs(found.values[0]) ** 2)

    def _turns(self, direction: Array, rest: Rest, new: Rest) -> bool:
        """Whether a limit point lies between."""
        return bool(direction[-1] * self._direction(new, direction)[-1] < 0)

    def _critical(self, rest: Rest, new: Rest, direction: Array, low: float) -> tuple[Rest, Array]:
        """Where between the two the lowest eigenvalue is zero, by bisection on the arc; and its shape."""
        apart = self.problem.vector(new) - self.problem.vector(rest)
        a, b, best = 0.0, float(self.metric * direction @ apart), new
        fine = 1e-7 * b
        for _ in range(40):
            middle = 0.5 * (a + b)
            try:
                best = self._on_plane(rest, direction, middle)
            except StaticsError:
                break
            if (self._lowest(best) < 0) == (low < 0):
                a = middle
            else:
                b = middle
            if b - a < fine:
                break
        return best, np.real(self.problem.spectrum(best).shapes[:, 0])

    def _towards(self, rest: Rest, shape: Array) -> Array:
        """Unit direction along a shape, to the side that the branch names."""
        assert self.branch is not None
        link, point, along = self.branch
        scene = self.problem.scene
        side = float(np.array(along) @ (slopes(scene, scene.marker(link, point), rest.q)[:2] @ shape))
        out = np.concatenate([shape, np.zeros(len(rest.multipliers) + 1)])
        return np.asarray(np.sign(side or 1.0) * out / np.sqrt(float(self.metric @ out**2)))

    def _limit(self, rest: Rest, new: Rest, before: Array, after: Array) -> float:
        """Parameter at the limit point between two equilibria, by secants on dp/ds along the first one's tangent."""
        a, b = 0.0, float(self.metric * before @ (self.problem.vector(new) - self.problem.vector(rest)))
        fa, fb, middle = before[-1], after[-1], new
        for _ in range(12):
            s = a - fa * (b - a) / (fb - fa)
            s = min(max(s, a + 0.05 * (b - a)), b - 0.05 * (b - a))
            try:
                middle = self._on_plane(rest, before, s)
            except StaticsError:
                break
            f = self._direction(middle, before)[-1]
            if (f < 0) == (fa < 0):
                a, fa = s, f
            else:
                b, fb = s, f
            if b - a < 1e-10 or abs(f) < 1e-9 * max(abs(before[-1]), abs(after[-1])):
                break
        return float(middle.parameter)
