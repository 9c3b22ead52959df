"""Planar mechanisms that buckle, rattle and strike. Importing it does not load the engine; `simulate` does."""

from typing import TYPE_CHECKING, Any

from buckler.mbs.elements import (
    STEEL,
    Beam,
    Cable,
    Clearance,
    Drive,
    Guide,
    GuideFriction,
    Link,
    Material,
    Modal,
    Motion,
    Ramp,
    Revolute,
    Rigid,
    Section,
    Slider,
    Slot,
    Stop,
    Strut,
    Weld,
)
from buckler.mbs.engine.settings import Controlled, Equal, Exudyn
from buckler.mbs.library import crank_rocker, slider_crank
from buckler.mbs.mechanism import Mechanism
from buckler.mbs.record.result import Result, Status
from buckler.mbs.spectral.solver import Spectral

if TYPE_CHECKING:
    from buckler.mbs.engine.scene import build
    from buckler.mbs.simulation import simulate

__all__ = [
    "STEEL", "Beam", "Cable", "Clearance", "Controlled", "Drive", "Equal", "Exudyn", "Guide", "GuideFriction", "Link",
    "Material", "Mechanism", "Modal", "Motion", "Ramp", "Result", "Revolute", "Rigid", "Section", "Slider", "Slot",
    "Spectral", "Status",
    "Stop", "Strut", "Weld", "build", "crank_rocker", "simulate", "slider_crank",
]  # fmt: skip

_ENGINE = {"simulate": "buckler.mbs.simulation", "build": "buckler.mbs.engine.scene"}


def __getattr__(name: str) -> Any:
    """Load what needs the engine only when it is asked for."""
    if name in _ENGINE:
        from importlib import import_module

        return getattr(import_module(_ENGINE[name]), name)
    raise AttributeError(f"module 'buckler.mbs' has no attribute '{name}'")


def __dir__() -> list[str]:
    """Names on the door, those too that are loaded on demand."""
    return sorted(__all__)
