"""The planar model of a modal link, by the kind of its modes."""

from __future__ import annotations

from collections.abc import Callable

from buckler.mbs.elements.modal import BarModes, CraigBampton, FreeModes, Modal
from buckler.mbs.modal.bar import bar_model
from buckler.mbs.modal.planar import PlanarModel
from buckler.mbs.modal.reduction import reduced


def _of_solid(modal: Modal, length: float) -> PlanarModel:
    return reduced(modal, length).planar()


MAKERS: dict[type, Callable[[Modal, float], PlanarModel]] = {
    FreeModes: _of_solid,
    CraigBampton: _of_solid,
    BarModes: lambda modal, length: bar_model(modal, modal.modes, length),  # type: ignore[arg-type]  # it is one here
}


def planar_model(modal: Modal, length: float) -> PlanarModel:
    """What the plane of motion sees of a link this long [m]."""
    return MAKERS[type(modal.modes)](modal, length)
