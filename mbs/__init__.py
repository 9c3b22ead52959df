"""Planar mechanisms that buckle, rattle and strike. Importing it does not load the engine; `simulate` does."""

from typing import TYPE_CHECKING, Any

from buckler.mbs.elements import (
    STEEL,
    AdamsDamping,
    Beam,
    Cable,
    Clearance,
    Drive,
    Force,
    Guide,
    GuideFriction,
    Link,
    Mass,
    Material,
    Modal,
    Motion,
    Motor,
    Ramp,
    Revolute,
    Rigid,
    Section,
    Slider,
    Slot,
    Spring,
    Stop,
    Strut,
    Torque,
    TorsionSpring,
    Weld,
)
from buckler.mbs.engine.settings import Controlled, Equal, Exudyn
from buckler.mbs.library import crank_rocker, slider_crank
from buckler.mbs.mechanism import Mechanism
from buckler.mbs.record.result import Result
from buckler.mbs.record.status import Status
from buckler.mbs.spectral.solver import Spectral

if TYPE_CHECKING:
    from buckler.mbs.engine.scene import build
    from buckler.mbs.simulation import simulate
    from buckler.mbs.statics import equilibrium, frequencies, path

__all__ = [
    "STEEL", "AdamsDamping", "Beam", "Cable", "Clearance", "Controlled", "Drive", "Equal", "Exudyn", "Force", "Guide",
    "GuideFriction", "Link", "Mass", "Material", "Mechanism", "Modal", "Motion", "Motor", "Ramp", "Result", "Revolute", "Rigid",
    "Section", "Slider", "Slot", "Spectral", "Spring", "Status", "Stop", "Strut", "Torque", "TorsionSpring", "Weld", "build",
    "crank_rocker",    "equilibrium", "frequencies", "path", "simulate", "slider_crank",
]  # fmt: skip

_ENGINE = {
    "simulate": "buckler.mbs.simulation",
    "build": "buckler.mbs.engine.scene",
    "equilibrium": "buckler.mbs.statics",
    "path": "buckler.mbs.statics",
    "frequencies": "buckler.mbs.statics",
}


def __getattr__(name: str) -> Any:
    """Load what needs the engine only when it is asked for."""
    if name in _ENGINE:
        from importlib import import_module

        return getattr(import_module(_ENGINE[name]), name)
    raise AttributeError(f"module 'buckler.mbs' has no attribute '{name}'")


def __dir__() -> list[str]:
    """Names on the door, those too that are loaded on demand."""
    return sorted(__all__)
