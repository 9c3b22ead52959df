"""Exudyn: how each element becomes items of the engine, how a run is made and recorded."""

import os
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from ..offers import on_demand

if TYPE_CHECKING:
    from .pressed import pinned_strip

__all__ = ["Callback", "System", "pinned_strip"]
__getattr__ = on_demand(__name__, {"pinned_strip": "pressed"})

os.environ.setdefault("EXUDYN_NO_USER_SETTINGS", "1")
System = Any
"""The engine's `MainSystem`: its own stubs say lists where it takes and returns arrays."""
Callback = Callable[..., Any]
"""A user function of the engine: of the system, the time and what the item adds."""
