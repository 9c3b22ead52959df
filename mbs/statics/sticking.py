"""Equilibria with dry friction of guides: the drawn pose, and the interval about the equilibrium without friction.

A guide resists up to T = mu |N| or T = F. Forces balance in a pose for some |T_i| within that limit: a linear programme in the
multipliers and T. The interval ends where all T are at their limits, in either direction of the softest motion.
"""

from __future__ import annotations

from dataclasses import fields, replace
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import linprog

from ..elements import Guide, GuideFriction, Rope
from ..geometry import Array
from ..laws import FrictionLaw
from ..spectral.start import slopes
from .problem import Problem, Rest, StaticsError
from .spectrum import Tangent, spectrum

ROUNDS = 100
"""Most iterations of friction over the reaction on which it depends."""
SPEEDS = np.geomspace(1e-9, 1.0, 400)
"""Speeds at which the largest coefficient of a law is sought [m/s]."""


class Rub(NamedTuple):
    """Guide with friction: row, direction (n,), coefficient, and constant force [N]."""

    row: int
    along: Array
    coefficient: float
    force: float

    def most(self, multipliers: Array) -> float:
        """Return the largest resistance [N]."""
        return self.force + self.coefficient * abs(float(multipliers[self.row]))


def rubs(problem: Problem, q: Array) -> list[Rub]:
    """List guides with dry friction; bristle models are not supported here."""
    scene, out = problem.scene, list[Rub]()
    for name, guide in scene.mechanism.elements().items():
        if not isinstance(guide, Guide) or not isinstance(guide.friction, GuideFriction | FrictionLaw):
            continue
        if name not in scene.row_names:  # others hold it, too: its reaction is not known
            return []
        law: Any = guide.friction
        row, most, coefficient = scene.row_names.index(name), 0.0, 0.0
        if isinstance(law, GuideFriction):
            most = law.dynamic + law.static_offset
        else:
            still = replace(law, viscous=0.0) if "viscous" in {field.name for field in fields(law)} else law
            coefficient = max(float(still.coefficient(speed)) for speed in SPEEDS)
        along = slopes(scene, scene.marker(guide.link, guide.point), q)[:2].T @ guide.along
        out.append(Rub(row, along, coefficient, most))
    return out


def find_sticking(problem: Problem, pose: Rest) -> Rest | None:
    """Find multipliers that balance a pose together with friction; None where there are none."""
    a, found = problem.assemble(pose, False), rubs(problem, pose.q)
    if not found or np.abs(a.residual).max(initial=0.0) > 1e-9 * problem.scene.length:
        return None
    rows, m = len(pose.multipliers), len(found)
    names = problem.scene.row_names
    ropes = [names.index(name) for name, each in problem.scene.mechanism.elements().items() if isinstance(each, Rope)]
    jacobian = a.jacobian if isinstance(a.jacobian, np.ndarray) else a.jacobian.toarray()
    balance = np.hstack([-jacobian.T, np.array([rub.along for rub in found]).T]) * problem.units[:, None]
    size = max(float(np.abs(a.force * problem.units).max()), 1e-300)
    for signs in product((1.0, -1.0), repeat=m):
        limit = np.zeros((2 * m, rows + m))
        for i, (rub, sign) in enumerate(zip(found, signs, strict=True)):
            limit[2 * i : 2 * i + 2, rub.row] = -sign * rub.coefficient
            limit[2 * i : 2 * i + 2, rows + i] = 1.0, -1.0
        bounds: list[tuple[float | None, float | None]] = [(None, None)] * (rows + m)
        for rope in ropes:
            bounds[rope] = (0.0, None)
        for rub, sign in zip(found, signs, strict=True):
            bounds[rub.row] = (0.0, None) if sign > 0 else (None, 0.0)
        forces = np.repeat([rub.force for rub in found], 2) / size
        answer = linprog(np.zeros(rows + m), limit, forces, balance, -a.force * problem.units / size, bounds)
        if answer.status == 0:
            return pose._replace(multipliers=answer.x[:rows] * size)
    return None


def ends(problem: Problem, rest: Rest) -> list[Rest]:
    """Find the two states with friction at its limit, about an equilibrium without friction; none where it wedges."""
    found = rubs(problem, rest.q)
    if not found:
        return []
    smooth = Tangent.at(problem.scene, rest.q, rest.multipliers).without_damping()
    shape = np.real(spectrum(replace(smooth, test=smooth.free), count=1).shapes[:, 0])
    ways = np.sign([rub.along @ shape for rub in found])
    out = []
    for side in (1.0, -1.0):
        state, before = rest, np.full(problem.scene.size, np.inf)
        try:
            for _ in range(ROUNDS):
                sliding = zip(ways, rubs(problem, state.q), strict=True)
                push = sum((side * way * rub.most(state.multipliers) * rub.along for way, rub in sliding), np.zeros_like(rest.q))
                if np.abs(push - before).max() <= 1e-12 * np.abs(push).max(initial=1e-300):
                    out.append(state)
                    break
                problem.push = before = push
                state = problem.newton(state)
        except StaticsError:
            pass
        finally:
            problem.push = 0.0
    return out if len(out) == 2 else []
