"""The crank-rocker with clearance in all joints as the compiled reference runs it: parameters of the studies that use it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from buckler.mbs import Modal
from buckler.mbs.reference import JOINTS, FourBar, ModalData
from buckler.studies.kit.parameters import integer, quantity
from buckler.studies.kit.published import BAR_AREA
from buckler.studies.rattling.clearance import PlayParameters

Array = np.ndarray[Any, Any]


@dataclass(frozen=True)
class FourBarParameters(PlayParameters):
    """Parameters of every study of the compiled crank-rocker, named as those of `crank-rocker`."""

    tolerance: float = quantity(1e-7, "1", 1e-12, 1e-3, "of the integrator, relative and, in SI units, absolute", "numerics")
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


def modes_of_solid(body: Modal, length: float) -> ModalData:
    """A modal link's planar modes as the reference takes them, whose bar runs the other way, from B to C.

    Half a turn of the frame changes the sign of displacements and places, not of turns.
    """
    from buckler.mbs.modal.reduction import reduced

    model = reduced(body, length).planar()
    return ModalData(
        length, model.mass, model.inertia,
        shapes=model.shapes[[1, 0, 2]] * np.array([-1.0, -1.0, 1.0])[:, None],
        frequency=model.frequency, damping=model.damping, modal_mass=np.ones(len(model)),
        translation=-model.translation, turning=model.turning, radial=model.radial,
        gyration=(model.gyration - model.gyration.T) / 2,
    )  # fmt: skip


def _sides(fourbar: FourBar) -> Array:
    """-1 for joints whose pin is on the other body."""
    return np.array([-1.0 if joint in fourbar.turned else 1.0 for joint in JOINTS])


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
    apart = _sides(fourbar) * np.stack(
        [crank - a, a + crank - b + coupler, b + coupler - c + rocker, fourbar.frame - c - rocker], axis=1
    )
    return np.stack([apart.real, apart.imag], axis=-1)
