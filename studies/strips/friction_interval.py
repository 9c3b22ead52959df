"""What friction leaves open of the force on the stop: the interval of true Coulomb friction, and where friction laws end in it.

A slider at rest against the stop is held by the strip's push F(theta), the stop and friction, which may be anything up to its
limit f = mu m g: the stop feels anything in [max(F - f, 0), F + f], by what went before. `settled` follows a slider pressed
against a stop that gives way, from one crank angle to another, with any law: a regularised one creeps, so that in the end it
carries nothing or all of f by its regularisation speed; LuGre's bristles carry a part.

References
----------
F. Marques et al., A survey and comparison of several friction force models, doi 10.1007/s11071-016-2999-3.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.integrate import solve_ivp

from buckler.elastica import pinned
from buckler.mbs.geometry import Array
from buckler.mbs.laws import Coulomb, LuGre, Stribeck
from buckler.mbs.laws.pieces import Reals
from buckler.mbs.library import PAPER, PAPER_STOP

from ..kit.published import GRAVITY

DAMPING_RATIO = 0.2
"""Of slider and stop."""


def friction_interval(force: ArrayLike, limit: float) -> tuple[Array, Array]:
    """Least and largest force on the stop, N, of a resting slider that the strip pushes with `force`, by a friction limit, N."""
    return np.maximum(np.asarray(force) - limit, 0.0), np.asarray(force) + limit


def laws(static: float, dynamic: float) -> dict[str, Any]:
    """Friction laws by name: regularised at two speeds, with stiction, and LuGre."""
    return {
        "regularised_1e-3": Coulomb(dynamic, 1e-3),
        "regularised_1e-6": Coulomb(dynamic, 1e-6),
        "stiction": Stribeck(static, dynamic, 1e-4, v_reg=1e-6),
        "lugre": LuGre(static, dynamic, 1e-4, bristle_stiffness=1e5, bristle_damping=sqrt(1e5)),
    }


@dataclass(frozen=True)
class Pressed:
    """A slider of mass, kg, pressed by a strip of bending stiffness, N m^2, against a stop of stiffness, N/m, on a guide.

    Attributes
    ----------
    speed : of the crank, rad/s
    weight : force between slider and guide, N, from which friction comes
    """

    rigidity: float
    mass: float = 0.3
    stiffness: float = 7.2e4
    speed: float = 1.25
    weight: float = 0.3 * GRAVITY

    def push(self, angle: Reals, depth: Reals = 0.0) -> Reals:
        """Force of the strip on the slider along its line, N, at crank angles, rad, the slider so deep in the stop, m."""
        return PAPER.push(pinned.load, self.rigidity, angle, PAPER_STOP - depth)

    def settled(self, law: Any, start: float, end: float, held: float = 0.0) -> float:
        """Force on the stop at a crank angle, N, of a slider that was at rest at another.

        Parameters
        ----------
        law : FrictionLaw or LuGre
        start, end : crank angles, rad
        held : share of the dynamic friction that holds the slider off the stop at the start, -1 to 1: what it remembers
        """
        bristles = isinstance(law, LuGre)
        hold = held * law.dynamic
        depth = max(float(self.push(start) - hold * self.weight), 0.0) / self.stiffness
        damping = 2 * DAMPING_RATIO * sqrt(self.stiffness * self.mass)

        def stop(x: float, v: float) -> float:
            return max(self.stiffness * x + damping * v, 0.0) if x > 0 else 0.0  # it presses only

        def rates(t: float, y: Array) -> list[float]:
            x, v, z = y
            mu = law.coefficient(v, z) if bristles else law.coefficient(v)
            total = self.push(start + self.speed * t, x) - stop(x, v) - mu * self.weight
            return [v, float(total) / self.mass, float(law.rate(z, v)) if bristles else 0.0]

        begin = [depth, 0.0, hold / law.bristle_stiffness if bristles else 0.0]
        run = solve_ivp(rates, (0.0, (end - start) / self.speed), begin, "Radau", rtol=1e-8, atol=[1e-13, 1e-12, 1e-14])
        if not run.success:
            raise RuntimeError(run.message)
        return stop(float(run.y[0, -1]), float(run.y[1, -1]))
