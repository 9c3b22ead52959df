"""Equilibria."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from buckler.mbs.statics.equilibrium import Equilibrium, equilibrium
    from buckler.mbs.statics.frequencies import Frequencies, frequencies
    from buckler.mbs.statics.path import Path, path
    from buckler.mbs.statics.problem import StaticsError

__all__ = ["Equilibrium", "Frequencies", "Path", "StaticsError", "equilibrium", "frequencies", "path"]
_ROOMS = {"Equilibrium": "equilibrium", "Frequencies": "frequencies", "Path": "path", "StaticsError": "problem"}


def __getattr__(name: str) -> Any:
    """Import what is asked for only then: the compiled solver takes a second to load."""
    if name not in __all__:
        raise AttributeError(name)
    from importlib import import_module

    return getattr(import_module(f"{__name__}.{_ROOMS.get(name, name)}"), name)
