"""Modal links: reduced-order models of flexible bodies, from a solid mesh, its finite-element matrices and chosen modes.

`Modal` specifies a link. `reduced(modal, length)` computes its `ReducedModel` in space, whose attribute `plane` is the model in
the plane of motion. The deformation is linear: a modal link vibrates but never buckles.
"""

from typing import TYPE_CHECKING

from ..elements.modal import AdamsDamping, BarModes, Box, CraigBampton, EndFace, FreeModes, Interface, MeshFile, Modal, PinHole
from ..imports import lazy_attributes

if TYPE_CHECKING:
    from .planar import PlanarModel
    from .reduction import ReducedModel, reduced

__all__ = [
    "AdamsDamping", "BarModes", "Box", "CraigBampton", "EndFace", "FreeModes", "Interface", "MeshFile", "Modal",
    "PinHole", "PlanarModel", "ReducedModel", "reduced",
]  # fmt: skip

__getattr__ = lazy_attributes(__name__, {"PlanarModel": "planar", "ReducedModel": "reduction", "reduced": "reduction"})
"""Names that need SciPy's sparse solvers, imported on demand."""
