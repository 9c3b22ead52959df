"""Where a mechanism rests under its loads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from buckler.mbs.spectral.scene import Place, Scene
from buckler.mbs.statics.problem import Problem, Rest, StaticsError, places

Array = np.ndarray[Any, Any]
SHORTEST = 1e-4
"""Smallest part of the load that is tried at once."""


@dataclass(frozen=True)
class Equilibrium:
    """A state of rest.

    Attributes
    ----------
    scene : Scene
    q : array, shape (n,)
        Coordinates.
    multipliers : array, shape (r,)
        Of the constraints, in the order of `scene.row_names`, N or N m: -G^T lambda is the force they exert.
    load : float
        What the loads were multiplied by.
    lowest : float
        Lowest squared angular frequency, 1/s^2; nan where nothing can move. Negative: unstable.
    """

    scene: Scene
    q: Array
    multipliers: Array
    load: float
    lowest: float

    @property
    def stable(self) -> bool:
        """Whether no small motion lowers the potential energy."""
        return not self.lowest <= 0.0

    def point(self, link: str, point: str) -> Place:
        """Where a point of a link is."""
        return places(self.scene, self.q, link, point)

    def reaction(self, name: str) -> Array:
        """Multipliers of the constraint of this name."""
        found = [i for i, row in enumerate(self.scene.row_names) if row == name]
        if not found:
            raise KeyError(f"no constraint '{name}'; there are: {', '.join(dict.fromkeys(self.scene.row_names))}")
        return self.multipliers[found]


def equilibrium(
    mechanism: Any, load: float = 1.0, *, degree: int | None = None, guess: Array | None = None, scene: Scene | None = None
) -> Equilibrium:
    """Find where a mechanism rests with its drives held at t = 0 and its loads multiplied by `load`.

    Loads grow from zero in parts as large as Newton's method takes, from the stress-free start; with a guess, all at once.

    Parameters
    ----------
    mechanism : Mechanism
    load : float
        Factor of all forces, torques and gravity; springs, contacts and strips keep theirs.
    degree : int, optional
        Of the strips' polynomials.
    guess : array, shape (n,), optional
        Coordinates near the answer.
    scene : Scene, optional
        Of this mechanism, to be used again.

    Raises
    ------
    StaticsError
        If no equilibrium is found.
    """
    scene = scene or Scene.of(mechanism, degree)
    problem = Problem(scene, loads_of(scene))
    rest = Rest(scene.q0 if guess is None else np.array(guess, dtype=float), np.zeros(len(scene.row_names)), load)
    if guess is not None:
        rest = problem.newton(rest)
    else:
        rest = _grow(problem, rest, load)
    lowest = problem.stability(rest)[0]
    problem.set(1.0)
    return Equilibrium(scene, rest.q, rest.multipliers, load, float(lowest[0]) if lowest.size else float("nan"))


def loads_of(scene: Scene, names: Sequence[str] | None = None) -> list[int]:
    """Places in `tables.factors` of the loads of these names ('gravity' is one), or of all."""
    kinds = ("force", "torque", "motor")
    all_names = [*scene.force_names, "gravity"]
    if names is None:
        return [i for i, name in enumerate(all_names) if name == "gravity" or name.split(".")[0] in kinds]
    unknown = set(names) - set(all_names)
    if unknown:
        raise StaticsError(f"load = {sorted(unknown)}: unknown; known: {', '.join(all_names)}")
    return [all_names.index(name) for name in names]


def _grow(problem: Problem, rest: Rest, load: float) -> Rest:
    """Raise the load to its value in parts that converge."""
    done, part = 0.0, 1.0
    rest = rest._replace(parameter=0.0)
    while done < 1.0:
        part = min(part, 1.0 - done)
        try:
            rest = problem.newton(rest._replace(parameter=load * (done + part)))
            done, part = done + part, 2.0 * part
        except StaticsError:
            part *= 0.5
            if part < SHORTEST:
                raise StaticsError(f"no equilibrium found beyond {done:.4g} of the load; follow it with `path`") from None
    return rest
