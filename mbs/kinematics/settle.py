"""A start in which strips do not ring: what is fast in them, along the strip and in shear, has no acceleration of its own.

A strip that starts at full speed without strain lacks the force that its motion takes, and rings along itself for ever if nothing
damps it: its stretch accelerates, and with it its elastic force F. In a mode of unit mass and of angular frequency w a
displacement by -F"/w^4 stops that. Slow modes must stay as they were given. The filter

    -(K + w0^2 M)^-1 M (K + w0^2 M)^-1 F",

with the constraints among the equations, does both without finding modes: of a fast mode it takes 1/(1 + w0^2/w^2)^2 of what is
there, of a slow one (w/w0)^4. Velocities stay as they are: theirs is a share of w_turning/w of the same. It is the bounded
derivative method: H.-O. Kreiss, Problems with different time scales for ordinary differential equations, SIAM J. Numer. Anal. 16
(1979) 980, doi 10.1137/0716072.
"""

from __future__ import annotations

from collections.abc import Callable
from math import pi
from typing import Any, NamedTuple, Protocol

import numpy as np

from ..geometry import Array
from ..mechanism import Mechanism
from ..scene.scene import Scene

SLOWER = 0.35
"""Centre of the filter, relative to the lowest axial angular frequency of a strip that bears all mass."""
ROUNDS = 4
"""Times it is applied: a mode at three times the middle keeps a thousandth; more rounds would take slow modes along."""
STEP = 1e-2
"""Step of the differences of force along the motion, relative to the filter's period over 2 pi."""


class About(NamedTuple):
    """The equations about a state: the mass matrix, and the solution of (K + w0^2 M) x + G^T mu = f, G x = 0."""

    mass: Any
    solve: Callable[[Array], Array]


class Equations(Protocol):
    """Protocol of a solver's scene."""

    def about(self, q: Array, v: Array, shift: float) -> About:
        """Linearise the equations about a state."""

    def acceleration(self, q: Array, v: Array) -> Array:
        """Return the acceleration of all coordinates at t = 0."""

    def force(self, q: Array, v: Array) -> Array:
        """Return the force on all coordinates at t = 0."""

    def project(self, q: Array, v: Array) -> tuple[Array, Array]:
        """Project a state on the constraints."""


def settles(mechanism: Mechanism) -> bool:
    """Return True if there is a strip to settle and the mechanism asks for it."""
    return mechanism.start == "settled" and any(link.body.meshed for link in mechanism.links)


def settle_strips(equations: Equations, mechanism: Mechanism, q: Array, v: Array) -> tuple[Array, Array]:
    """Return the state at t = 0 with its strips settled; unchanged where that does not calm them."""
    try:
        return _filter(equations, SLOWER * 2 * pi / Scene.of(mechanism).axial_period, q, v)
    except ArithmeticError:  # free motions, or constraints that say the same
        return q, v


def _filter(equations: Equations, slow: float, q: Array, v: Array) -> tuple[Array, Array]:
    h, begun, first = STEP / slow, (q, v), 0.0
    for _ in range(ROUNDS):
        mass, solve = equations.about(q, v, slow**2)
        a = equations.acceleration(q, v)
        before, middle, after = (equations.force(q + s * v + s * s / 2 * a, v) for s in (0.0, h, 2 * h))
        moved = -solve(mass @ solve((after - 2 * middle + before) / h**2))
        first = first or float(np.linalg.norm(moved))
        if not np.linalg.norm(moved) <= first:
            return begun
        q, v = equations.project(q + moved, v)
    return q, v
