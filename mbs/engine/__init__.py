"""Solver by the multibody engine Exudyn: translation of elements into items of the engine, runs and their recording."""

import os
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from ..imports import lazy_attributes

if TYPE_CHECKING:
    from .pressed import pinned_strip

__all__ = ["Callback", "System", "pinned_strip"]
__getattr__ = lazy_attributes(__name__, {"pinned_strip": "pressed"})

os.environ.setdefault("EXUDYN_NO_USER_SETTINGS", "1")  # so that runs do not depend on a file in the home directory
System = Any
"""Exudyn's `MainSystem`, without its type, as its stubs declare lists instead of arrays."""
Callback = Callable[..., Any]
"""User function that the engine calls with the system, the time and arguments that depend on the item."""
