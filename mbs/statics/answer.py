"""What answers of the statics have in common: how they ended, in a word and a sentence; paths, and checks of what is asked."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

from ..geometry import Array
from ..mechanism import Mechanism
from ..spectral.scene import Scene
from ..validate import number, one_of, positive, whole
from .problem import places

if TYPE_CHECKING:
    from matplotlib.axes import Axes


RISE = 4
"""By how much the degree of strips is raised at once."""
HIGHEST = 40
"""Degree at which that ends."""
PLACES, CRITICAL = 1e-8, 1e-6
"""Errors up to which it is raised, relative: of states of rest and frequencies; of critical points and motions."""
FIRST, LONGEST = 0.02, 0.1
"""First and longest arc of a path, by default."""


class Ending(StrEnum):
    """How a search for rest ended. Anything but OK comes with a sentence a person can act on."""

    OK = "OK"
    FREE_MOTION = "FREE_MOTION"
    """No equilibrium: a load pushes along a motion that nothing resists."""
    OPEN_CONTACT = "OPEN_CONTACT"
    """Likewise, and contacts that could resist it stay open."""
    NOT_REACHED = "NOT_REACHED"
    """Newton's method did not get there; the message says how far the load came."""
    UNSTABLE = "UNSTABLE"
    """Forces balance, but a small motion grows: a mechanism does not stay there."""
    INACCURATE = "INACCURATE"
    """Found, with an error larger than asked for."""
    SINGULAR = "SINGULAR"
    """A path cannot be followed further."""
    TOO_MANY_STEPS = "TOO_MANY_STEPS"
    """A path did not reach its end, or a search for a periodic motion used up its steps."""
    SLACK = "SLACK"
    """A rope would have to push."""


@dataclass(frozen=True)
class Answer:
    """An answer with a status, a message, and a table."""

    status: Ending
    message: str

    def rows(self) -> list[tuple[str, str]]:
        """What it found: name and value with unit."""
        raise NotImplementedError

    def __str__(self) -> str:
        """Status, message and a line a number."""
        return "\n".join(
            [f"{self.status}: {self.message}" if self.message else str(self.status), *(f"{a}: {b}" for a, b in self.rows())]
        )

    def _repr_html_(self) -> str:
        """The same as a table for a notebook."""
        lines = "".join(f"<tr><td>{escape(a)}</td><td>{escape(b)}</td></tr>" for a, b in self.rows())
        return f"<p><b>{self.status}</b> {escape(self.message)}</p><table>{lines}</table>"


def check(mechanism: Mechanism, degree: int | None) -> None:
    """Raise a ValueError if this is no mechanism, a load of it has states, or this is no degree of its strips."""
    one_of("mechanism", mechanism, (Mechanism,))
    for name, element in mechanism.elements().items():
        if element.has_states:
            raise ValueError(f"'{name}' has states, which statics do not know: they are integrated with a motion only")
    if degree is not None:
        whole("degree", degree, 2, 200)


def check_way(to: float, steps: int, step: float, longest: float, **one: object) -> None:
    """Raise a ValueError if a path or curve cannot go there in such steps, or several of what it changes are given."""
    number("to", to, -np.inf, np.inf, "1")
    whole("steps", steps, 1, 100_000)
    for name, value in (("step", step), ("longest", longest)):
        positive(name, value, "1")
    if sum(each is not None for each in one.values()) > 1:
        raise ValueError(f"{', '.join(one)}: give one of them")


def ending(ended: str, last: float, begun: float, to: float, steps: int) -> tuple[Ending, str]:
    """Status and sentence of a path or curve that ended so, at a parameter."""
    sentences = {
        "steps": f"{steps} steps led to {last:.6g}, not to {to:.6g}; give more steps or a longer one",
        "spent": f"the steps that its runs may take led to {last:.6g}, not to {to:.6g}",
        "singular": f"it cannot be followed beyond {last:.6g}",
        "closed": "it came back to its start",
        "back": f"it turned and came back to {begun:.6g}",
    }
    known = {"steps": Ending.TOO_MANY_STEPS, "spent": Ending.TOO_MANY_STEPS, "singular": Ending.SINGULAR}
    return known.get(ended, Ending.OK), sentences.get(ended, "")


def left_out(mechanism: Mechanism, friction: str) -> list[str]:
    """What statics do not know of a mechanism: dry friction, which holds it in an interval, and how good modes are."""
    rubs = [element.rubs for element in mechanism.elements().values() if element.rubs]
    modes = [link.name for link in mechanism.links if link.body.linear]
    said = [f"{friction}: {', '.join(map(repr, rubs))}"] if rubs else []
    return said + ([f"errors leave out the choice of modes of {', '.join(map(repr, modes))}"] if modes else [])


def check_coordinates(name: str, value: object, scene: Scene) -> Array:
    """Coordinates of a scene, (n,), as they were given.

    Raises
    ------
    ValueError
        If they are none.
    """
    try:
        found = np.array(value, dtype=float)
    except (TypeError, ValueError):
        found = np.empty(0)
    if found.shape != (scene.size,) or not np.isfinite(found).all():
        raise ValueError(f"{name}: must be {scene.size} finite coordinates, as of a scene of degree {scene.degree}")
    return found


def reactions(scene: Scene, multipliers: Array, name: str) -> Array:
    """Turn multipliers into what an element's signals tell, shape (states, rows).

    Of a joint that is the force on its second body, of a guide the lateral force on its block, of a drive its torque or force, of
    a rope its tension, of a gear the force at its teeth.

    Raises
    ------
    KeyError
        If no constraint has that name.
    """
    rows = [i for i, row in enumerate(scene.row_names) if row == name]
    if not rows:
        raise KeyError(f"no constraint '{name}'; there are: {', '.join(dict.fromkeys(scene.row_names))}")
    element = scene.mechanism.elements()[name]
    pushes = -element.sense * multipliers[:, rows]
    return np.hstack(list((element.reactions(pushes) or {"force": pushes}).values()))


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
        from ..view.equilibria import plot_path  # Matplotlib takes half a second to load

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
        """Force or torque of a constraint along the path, N or N m, shape (steps, rows), with the signs of a run's signals."""
        return reactions(self.scene, self.multipliers, name)
