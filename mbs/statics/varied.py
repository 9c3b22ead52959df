"""Equilibria over any number of a mechanism, with a new scene for each of its values."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..documents.document import change, get
from ..geometry import Array
from ..mechanism import Mechanism
from ..spectral.scene import CompiledScene
from .problem import Problem, Rest

STEP = 1e-5
"""Relative step of the differences by the number."""


class Varied(Problem):
    """Problem whose parameter is a number of the mechanism, such as links.strip.body.section.thickness."""

    def __init__(self, mechanism: Mechanism, name: str, degree: int | None) -> None:
        self.name, self.document, self.degree = name, mechanism.to_dict(), degree
        try:
            found = get(self.document, name)
        except (KeyError, IndexError) as error:
            raise ValueError(f"parameter = '{name}': there is no {error} in the mechanism") from None
        if isinstance(found, bool) or not isinstance(found, int | float):
            raise ValueError(f"parameter = '{name}': must be a number of the mechanism, in SI, not {found!r}")
        self.begun = self.current = float(found)
        super().__init__(CompiledScene.of(mechanism, degree))

    def start(self, parameter: float) -> Rest:
        """Return the pose that is drawn with this number."""
        self.set(parameter)
        return super().start(parameter)

    def set(self, parameter: float) -> None:
        """Make the scene with this number."""
        if parameter != self.current:
            self.current = parameter
            self.scene = CompiledScene.of(Mechanism.from_dict(change(self.document, {self.name: parameter})), self.degree)

    def slope(self, rest: Rest, here: tuple[Array, Array] | None = None) -> Array:
        """Compute the derivative of (f - G^T lambda, g) by the number, by central differences."""
        step = STEP * max(abs(rest.parameter), abs(self.begun), 1e-300)
        at = []
        for p in (rest.parameter + step, rest.parameter - step):
            self.set(p)
            a = self.scene.assemble(rest.q, tangents=False)
            at.append(np.concatenate([a.force - a.jacobian.T @ rest.multipliers, a.residual]))
        return np.asarray((at[0] - at[1]) / (2 * step))


@dataclass
class Paced(Problem):
    """Problem whose parameter is the frequency of a motion [Hz]; all functions of time are scaled with it."""

    drawn: float = 1.0

    def set(self, parameter: float) -> None:
        """Set the frequency of the functions of time."""
        self.scene.tables.pace[0] = parameter / self.drawn


def raise_degree(problem: Problem, by: int) -> Problem:
    """Return a copy of a problem with a higher degree and a separate scene."""
    degree = problem.scene.degree + by
    if isinstance(problem, Varied):
        return Varied(Mechanism.from_dict(problem.document), problem.name, degree)
    return replace(problem, scene=CompiledScene.of(problem.scene.mechanism, degree))
