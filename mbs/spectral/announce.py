"""Tell once that the solver is being compiled: the first run on a machine waits for it."""

from __future__ import annotations

import sys
from typing import Any

from numba.core.event import Listener, register

TEXT = "What this run needs of the compiled solver is being compiled, up to a minute or two; it is kept for later runs."


class Announcer(Listener):
    """Writes to stderr when the first of the solver's functions is compiled, and not when it is read from disk."""

    def __init__(self) -> None:
        self.told = False

    def on_start(self, event: Any) -> None:
        """Numba begins to compile a function."""
        if not self.told and str(event.data["dispatcher"].py_func.__module__).startswith("buckler.mbs.spectral."):
            self.told = True
            print(TEXT, file=sys.stderr)

    def on_end(self, event: Any) -> None:
        """Numba has compiled a function."""


def announce() -> None:
    """Tell it once in this process, if it happens."""
    register("numba:compile", Announcer())
