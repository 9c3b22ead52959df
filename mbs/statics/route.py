"""A path of equilibria as an answer: its critical points with their errors, the paths that leave it, its diagram."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from buckler.mbs.geometry import Array
from buckler.mbs.spectral.scene import Scene
from buckler.mbs.statics.answer import Answer, Ending
from buckler.mbs.statics.critical import Critical
from buckler.mbs.statics.problem import places


@dataclass(frozen=True)
class Path(Answer):
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

    status: Ending
    message: str
    ended: str
    scene: Scene
    parameter: Array
    q: Array
    multipliers: Array
    growth: Array
    unstable: Array
    points: list[Critical]
    errors: dict[str, Array] = field(default_factory=dict)
    branches: list[Path] = field(default_factory=list)

    def _at(self, kind: str) -> list[float]:
        return [each.rest.parameter for each in self.points if each.kind == kind for _ in range(each.multiple)]

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

    def plot(self, link: str, point: str, axis: str = "y", ax: Any = None) -> Any:
        """Draw the bifurcation diagram: a point's place over the parameter, stable and unstable; returns the axes."""
        from buckler.mbs.view.equilibria import plot_path  # Matplotlib takes half a second to load

        return plot_path(self, link, point, axis, ax)

    def reaction(self, name: str) -> Array:
        """Multipliers of a constraint along the path, shape (steps, rows)."""
        return self.multipliers[:, [i for i, row in enumerate(self.scene.row_names) if row == name]]

    def rows(self) -> list[tuple[str, str]]:
        """Critical points in their order, and the end."""
        out, count = [], dict.fromkeys(("limit", "branching", "flutter"), 0)
        keys = {"limit": "limits", "branching": "branchings", "flutter": "flutter"}
        for each in self.points:
            errors = self.errors.get(keys[each.kind], np.array([]))
            error = f", error {errors[count[each.kind]]:.1e}" if count[each.kind] < len(errors) else ""
            times = f", {each.multiple} eigenvalues" if each.multiple > 1 else ""
            out.append((each.kind, f"{each.rest.parameter:.9g}{error}{times}"))
            count[each.kind] += each.multiple
        return [*out, ("ended", f"{self.ended} at {self.parameter[-1]:.9g} after {len(self.parameter)} steps")]
