"""Equilibria, their paths, natural frequencies, periodic motions: on the compiled solver's equations."""

from typing import TYPE_CHECKING

from buckler.mbs.offers import on_demand

if TYPE_CHECKING:
    from buckler.mbs.statics.answer import Path
    from buckler.mbs.statics.cycles import Periodic, periodic
    from buckler.mbs.statics.follow import path
    from buckler.mbs.statics.problem import StaticsError
    from buckler.mbs.statics.resonance import Response, response
    from buckler.mbs.statics.rest import Equilibrium, equilibrium
    from buckler.mbs.statics.vibration import Frequencies, frequencies

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
