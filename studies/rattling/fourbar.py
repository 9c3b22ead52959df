"""The crank-rocker with clearance in all joints as the compiled solver runs it: parameters of the studies that use it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from buckler.studies.kit.parameters import choice, integer, quantity
from buckler.studies.kit.published import BAR_AREA
from buckler.studies.rattling.assumptions import Assumptions, JointAssumptions
from buckler.studies.rattling.clearance import PlayParameters
from buckler.studies.rattling.linkage import JOINTS, FourBar
from buckler.studies.rattling.mode_sets import damped, rocker_modes

Array = np.ndarray[Any, Any]


@dataclass(frozen=True)
class FourBarParameters(PlayParameters):
    """Parameters of every study of the compiled crank-rocker, named as those of `crank-rocker`."""

    tolerance: float = quantity(1e-8, "1", 1e-12, 1e-3, "of a step, of the longest bar and a radian", "numerics")
    workers: int = integer(2, 1, 256, "threads", "numerics")

    def check(self) -> None:
        """Check parameters against each other."""
        self.fourbar()

    def fourbar(self, **changes: Any) -> FourBar:
        """The crank-rocker, some of its own fields changed."""
        given: dict[str, Any] = {
            "width": BAR_AREA / self.in_plane_depth, "thickness": self.in_plane_depth, "gap": self.clearance, "pin": self.pin,
            "law": self.law, "friction": self.friction, "speed": self.speed, "turned": self.turned, "gravity": self.pull,
        }  # fmt: skip
        return FourBar(**given | changes)


@dataclass(frozen=True)
class RockerParameters(FourBarParameters, Assumptions):
    """The same of studies whose rocker is rigid, or one of modes."""

    rocker: str = choice("rigid", ("rigid", "modal"), "rocker", "bars")

    def check(self) -> None:
        """A rigid rocker has no modes."""
        if self.rocker == "rigid" and (self.modal_damping, self.modes_of) != ("constant", "free"):
            asked = f"modal_damping = {self.modal_damping}, modes_of = {self.modes_of}"
            raise ValueError(f"{asked}: only a rocker of modes can have them; choose rocker = modal")
        self.fourbar()

    def fourbar(self, **changes: Any) -> FourBar:
        """The crank-rocker, some of its own fields changed."""
        if self.rocker == "rigid":
            return super().fourbar(**changes)
        modes = damped(rocker_modes(self.modes_of, self.in_plane_depth), self.modal_damping, self.rocker_damping)
        return super().fourbar(**{"modes": modes} | changes)

    def stated(self) -> str:
        """One sentence for a table."""
        return super().stated() if self.rocker == "modal" else f"{JointAssumptions.stated(self)}; rocker rigid"


def _sides(fourbar: FourBar) -> Array:
    """-1 for joints whose pin is on the other body."""
    return np.array([-1.0 if joint in fourbar.turned else 1.0 for joint in JOINTS])


def journals(fourbar: FourBar, q: Array) -> Array:
    """Pin centres seen from their bush centres, in the frame of the ground; m.

    Parameters
    ----------
    fourbar : FourBar
    q : array, shape (samples, 8 + modes)
        Coordinates at times from crank angles that are those of the start: whole turns.

    Returns
    -------
    array, shape (samples, 4, 2)
        For O, A, B, C.
    """
    crank = 0.5 * fourbar.crank * np.exp(1j * np.full(len(q), fourbar.start))
    coupler, rocker = 0.5 * fourbar.coupler * np.exp(1j * q[:, 4]), 0.5 * fourbar.rocker * np.exp(1j * q[:, 7])
    a, b, c = (q[:, i] + 1j * q[:, i + 1] for i in (0, 2, 5))
    start, end = -rocker, rocker  # of the rocker, at C and B, seen from its centre
    if fourbar.modes is not None:
        moved = np.einsum("sxm,nm->sxn", fourbar.modes.planar(fourbar.rocker).shapes[:2, :2], q[:, 8:])
        start, end = (x + (u[0] + 1j * u[1]) * np.exp(1j * q[:, 7]) for x, u in zip((start, end), moved, strict=True))
    apart = _sides(fourbar) * np.stack(
        [crank - a, a + crank - b + coupler, b + coupler - c - end, fourbar.frame - c - start], axis=1
    )
    return np.stack([apart.real, apart.imag], axis=-1)
