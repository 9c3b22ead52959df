"""Links as reduced-order flexible bodies: a solid mesh, its finite-element matrices, chosen modes. No engine here.

`Modal` specifies a link; `reduced(modal, length)` gives its `ReducedModel` in space, and `.planar()` of that what
the plane of motion sees. The deformation is linear: a modal link vibrates but never buckles.
"""

from typing import TYPE_CHECKING, Any

from buckler.mbs.elements.modal import (
    AdamsDamping,
    BarModes,
    Box,
    CraigBampton,
    EndFace,
    FreeModes,
    Interface,
    MeshFile,
    Modal,
    Nearest,
    PinHole,
)

if TYPE_CHECKING:
    from buckler.mbs.modal.modes import MOTIONS
    from buckler.mbs.modal.planar import PlanarModel
    from buckler.mbs.modal.reduction import ReducedModel, reduced

__all__ = [
    "MOTIONS", "AdamsDamping", "BarModes", "Box", "CraigBampton", "EndFace", "FreeModes", "Interface", "MeshFile", "Modal",
    "Nearest", "PinHole", "PlanarModel", "ReducedModel", "reduced",
]  # fmt: skip

_HEAVY = {"MOTIONS": "modes", "PlanarModel": "planar", "ReducedModel": "reduction", "reduced": "reduction"}


def __getattr__(name: str) -> Any:
    """Load what needs scipy's sparse solvers only when it is asked for."""
    if name in _HEAVY:
        from importlib import import_module

        return getattr(import_module(f"buckler.mbs.modal.{_HEAVY[name]}"), name)
    raise AttributeError(f"module 'buckler.mbs.modal' has no attribute '{name}'")
