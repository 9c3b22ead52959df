"""Exudyn: how each element becomes items of the engine, how a run is made and recorded."""

import os
from collections.abc import Callable
from typing import Any

os.environ.setdefault("EXUDYN_NO_USER_SETTINGS", "1")
System = Any
"""The engine's `MainSystem`: its own stubs say lists where it takes and returns arrays."""
Callback = Callable[..., Any]
"""A user function of the engine: of the system, the time and what the item adds."""
