"""The crank-rocker with play in all joints as the compiled reference runs it: parameters of the studies that use it."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from typing import Any

import numpy as np

from mbs.laws import AdamsFriction, Impact
from mbs.reference import FourBar
from studies.clearance import AREA, DAMPING_UNITS, STIFFNESS
from studies.parameters import StudyParameters, choice, integer, quantity

Array = np.ndarray[Any, Any]


@dataclass(frozen=True)
class FourBarParameters(StudyParameters):
    """Parameters of every study of the compiled crank-rocker, named as those of `crank-rocker`."""

    in_plane_depth: float = quantity(20e-3, "m", 5e-3, 20e-3, "side of the 20 mm x 5 mm bars in the plane", "bars")
    clearance: float = quantity(2.5e-4, "m", 1e-6, 2e-3, "radial clearance", "joints")
    pin: float = quantity(5e-3, "m", 1e-3, 1e-2, "radius of the pins", "joints")
    stiffness: float = quantity(STIFFNESS, "N/m^1.5", 1e6, 1e14, "contact stiffness K", "contact")
    damping: float = quantity(253.0, "1", 0, 1e5, "largest contact damping c_max, in damping_unit", "contact")
    damping_unit: str = choice("N.s/m", tuple(DAMPING_UNITS), "how the published unit of c_max is read", "contact")
    damping_depth: float = quantity(1e-5, "m", 1e-8, 1e-3, "depth d_max at which the damping is full", "contact")
    static_friction: float = quantity(0.3, "1", 0, 2, "static Coulomb coefficient", "contact")
    dynamic_friction: float = quantity(0.1, "1", 0, 2, "dynamic Coulomb coefficient", "contact")
    stiction_speed: float = quantity(0.1, "m/s", 1e-5, 10, "sliding speed at which friction is static", "contact")
    friction_speed: float = quantity(1.0, "m/s", 2e-5, 100, "sliding speed from which friction is dynamic", "contact")
    speed: float = quantity(10 * pi, "rad/s", 0.1, 500, "speed of the crank", "drive")
    tolerance: float = quantity(1e-7, "1", 1e-12, 1e-3, "of the integrator, relative and, in SI units, absolute", "numerics")
    workers: int = integer(2, 1, 256, "threads", "numerics")

    @property
    def law(self) -> Impact:
        """Contact law."""
        return Impact(self.stiffness, self.damping * DAMPING_UNITS[self.damping_unit], self.damping_depth)

    @property
    def friction(self) -> AdamsFriction:
        """Friction law."""
        return AdamsFriction(self.static_friction, self.dynamic_friction, self.stiction_speed, self.friction_speed)

    def check(self) -> None:
        """Check parameters against each other."""
        self.fourbar()

    def fourbar(self, **changes: Any) -> FourBar:
        """The crank-rocker, some of its own fields changed."""
        given: dict[str, Any] = {
            "width": AREA / self.in_plane_depth, "thickness": self.in_plane_depth, "gap": self.clearance, "pin": self.pin,
            "law": self.law, "friction": self.friction, "speed": self.speed,
        }  # fmt: skip
        return FourBar(**given | changes)


def journals(fourbar: FourBar, q: Array) -> Array:
    """Pin centres seen from their bush centres, in the frame of the ground; m.

    Parameters
    ----------
    fourbar : FourBar
        With a rigid rocker.
    q : array, shape (samples, 8)
        Coordinates at times from crank angles that are those of the start: whole turns.

    Returns
    -------
    array, shape (samples, 4, 2)
        For O, A, B, C.
    """
    crank = 0.5 * fourbar.crank * np.exp(1j * np.full(len(q), fourbar.start))
    coupler, rocker = 0.5 * fourbar.coupler * np.exp(1j * q[:, 4]), 0.5 * fourbar.rocker * np.exp(1j * q[:, 7])
    a, b, c = (q[:, i] + 1j * q[:, i + 1] for i in (0, 2, 5))
    apart = np.stack([crank - a, a + crank - b + coupler, b + coupler - c + rocker, fourbar.frame - c - rocker], axis=1)
    return np.stack([apart.real, apart.imag], axis=-1)
