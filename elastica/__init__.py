"""The elastic strip in closed form (`pinned`), as a boundary value problem (`rod`, `strip`), as a fast force law (`law`).

All quantities are normalised by the strip's length L and bending stiffness E I: shortening
u = U/L, load p = P L^2/(E I). Needs numpy and scipy only.
"""

from importlib import import_module
from typing import Any

__all__ = ["law", "pinned", "rod", "strip"]


def __getattr__(name: str) -> Any:
    """Import a module at its first use: most need scipy, which takes longer to load than many runs."""
    if name in __all__:
        return import_module(f"buckler.elastica.{name}")
    raise AttributeError(f"module 'buckler.elastica' has no attribute '{name}'")
