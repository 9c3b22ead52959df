"""Equilibria, their paths, natural frequencies, periodic motions: on the compiled solver's equations."""

from typing import TYPE_CHECKING

from ..offers import on_demand

if TYPE_CHECKING:
    from .answer import Path
    from .cycles import Periodic, periodic
    from .follow import path
    from .problem import StaticsError
    from .resonance import Response, response
    from .rest import Equilibrium, equilibrium
    from .vibration import Frequencies, frequencies

__all__ = [
    "Equilibrium", "Frequencies", "Path", "Periodic", "Response", "StaticsError", "equilibrium", "frequencies", "path",
    "periodic", "response",
]  # fmt: skip
__getattr__ = on_demand(__name__, {
    "Equilibrium": "rest", "Frequencies": "vibration", "Path": "answer", "Periodic": "cycles", "Response": "resonance",
    "StaticsError": "problem", "equilibrium": "rest", "frequencies": "vibration", "path": "follow", "periodic": "cycles",
    "response": "resonance",
})  # fmt: skip
"""The compiled solver takes a second to load."""
