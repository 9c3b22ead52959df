"""A path of equilibria as an answer: its critical points with their errors, the paths that leave it, its diagram."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from buckler.mbs.geometry import Array
from buckler.mbs.spectral.scene import Scene
from buckler.mbs.statics.answer import Answer
from buckler.mbs.statics.problem import places

if TYPE_CHECKING:
    from matplotlib.axes import Axes

KEYS = {
    "limit": "limits",
    "branching": "branchings",
    "flutter": "flutter",
    "fold": "folds",
    "doubling": "doublings",
    "torus": "tori",
}
"""Names of kinds of critical points, several of them."""


@dataclass(frozen=True)
class Route(Answer):
    """What paths of equilibria and of periodic motions share: critical points with errors, a diagram."""

    ended: str
    scene: Scene
    parameter: Array
    q: Array
    points: list[Any]
    errors: dict[str, Array] = field(default_factory=dict)

    def _at(self, kind: str) -> list[float]:
        return [each.rest.parameter for each in self.points if each.kind == kind for _ in range(each.multiple)]

    def plot(self, link: str, point: str, axis: str = "y", ax: Axes | None = None) -> Axes:
        """Draw the diagram: a point's place, or amplitude, over the parameter, stable and unstable; returns the axes."""
        from buckler.mbs.view.equilibria import plot_path  # Matplotlib takes half a second to load

        return plot_path(self, link, point, axis, ax)

    def rows(self) -> list[tuple[str, str]]:
        """Critical points in their order, and the end."""
        out, count = [], dict.fromkeys(KEYS, 0)
        for each in self.points:
            errors = self.errors.get(KEYS[each.kind], np.array([]))
            error = f", error {errors[count[each.kind]]:.1e}" if count[each.kind] < len(errors) else ""
            times = f", {each.multiple} eigenvalues" if each.multiple > 1 else ""
            out.append((each.kind, f"{each.rest.parameter:.9g}{error}{times}"))
            count[each.kind] += each.multiple
        end = f" at {self.parameter[-1]:.9g} after {len(self.parameter)} steps" if len(self.parameter) else ""
        return [*out, ("ended", f"{self.ended}{end}")]


@dataclass(frozen=True)
class Path(Route):
    """Equilibria along a path.

    Attributes
    ----------
    status : Ending
        OK where `to` was reached.
    message : str
    ended : str
        Why it ended: 'reached', 'closed', 'steps' or 'singular'.
    scene : Scene
    parameter : array, shape (steps,)
        Factor of the loads, travel of the drive, rad or m, or the number.
    q : array, shape (steps, n)
    multipliers : array, shape (steps, r)
    growth : array, shape (steps,)
        Largest rate at which a small motion grows, 1/s; 0 where none does.
    unstable : array of int, shape (steps,)
        How many eigenvalues of K are negative.
    points : list of Critical
        Limits, branchings and flutter points in their order.
    errors : dict of str to array
        Of `limits`, `branchings`, `flutter`: what a higher degree of the strips changes; of `end`, if it was reached, in places.
    branches : list of Path
        Paths that leave its branchings, where they were asked for.
    """

    multipliers: Array = field(default_factory=lambda: np.empty((0, 0)))
    growth: Array = field(default_factory=lambda: np.empty(0))
    unstable: Array = field(default_factory=lambda: np.empty(0, int))
    branches: list[Path] = field(default_factory=list)

    def rounding(self, name: str, count: int) -> Array:
        """What rounding leaves in `limits`, `branchings` or `flutter`, shape (count,)."""
        known = [each.rounding for each in self.points if each.kind == name.rstrip("s") for _ in range(each.multiple)]
        return np.array((known + count * [0.0])[:count])

    @property
    def limits(self) -> list[float]:
        """Parameter where it turns."""
        return self._at("limit")

    @property
    def branchings(self) -> list[float]:
        """Parameter where other paths leave it; of a multiple branching as often as eigenvalues pass zero there."""
        return self._at("branching")

    @property
    def flutter(self) -> list[float]:
        """Parameter where a motion that swings begins to grow, or ceases to."""
        return self._at("flutter")

    @property
    def stable(self) -> Array:
        """Where no small motion grows, shape (steps,)."""
        return self.growth == 0.0

    def place(self, q: Array, link: str, point: str) -> Array:
        """Place of a point of a link at coordinates of the path's scene, shape (2,)."""
        return places(self.scene, q, link, point).position

    def point(self, link: str, point: str) -> Array:
        """Places of a point of a link, shape (steps, 2)."""
        return np.array([self.place(q, link, point) for q in self.q])

    def heights(self, link: str, point: str) -> tuple[Array, list[Array], str]:
        """What a diagram shows: places along the path, those of the critical points, and what they are called."""
        return self.point(link, point), [self.place(each.rest.q, link, point) for each in self.points], ""

    def reaction(self, name: str) -> Array:
        """Multipliers of a constraint along the path, shape (steps, rows)."""
        return self.multipliers[:, [i for i, row in enumerate(self.scene.row_names) if row == name]]
