"""Equilibria, their paths, natural frequencies, periodic motions: on the compiled solver's equations."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from buckler.mbs.statics.answer import Path
    from buckler.mbs.statics.cycles import Periodic, periodic
    from buckler.mbs.statics.follow import path
    from buckler.mbs.statics.problem import StaticsError
    from buckler.mbs.statics.resonance import Response, response
    from buckler.mbs.statics.rest import Equilibrium, equilibrium
    from buckler.mbs.statics.vibration import Frequencies, frequencies

__all__ = [
    "Equilibrium",
    "Frequencies",
    "Path",
    "Periodic",
    "Response",
    "StaticsError",
    "equilibrium",
    "frequencies",
    "path",
    "periodic",
    "response",
]
_ROOMS = {
    "Equilibrium": "rest",
    "Frequencies": "vibration",
    "Path": "route",
    "Periodic": "cycles",
    "Response": "resonance",
    "StaticsError": "problem",
    "equilibrium": "rest",
    "frequencies": "vibration",
    "path": "follow",
    "periodic": "cycles",
    "response": "resonance",
}


def __getattr__(name: str) -> Any:
    """Import what is asked for only then: the compiled solver takes a second to load."""
    if name not in _ROOMS:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    return getattr(import_module(f"{__name__}.{_ROOMS[name]}"), name)
