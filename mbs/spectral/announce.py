"""Tell that the solver is being compiled: the first run on a machine waits. A bar shows it, and its seconds are counted."""

from __future__ import annotations

import sys
from time import perf_counter

from numba.core.event import Event, Listener, register
from tqdm import tqdm

from ..process import COMPILING

TEXT = "What this run needs of the compiled solver is being compiled, up to a minute or two; it is kept for later runs."


class Announcer(Listener):
    """Writes to stderr when the first of the solver's functions is compiled, and not when it is read from disk.

    On a terminal a bar counts functions, of about `total`.
    """

    def __init__(self, total: int = 0) -> None:
        self.told, self.total = False, total
        self._depth, self._begun, self._bar = 0, 0.0, None

    def on_start(self, event: Event) -> None:
        """Numba begins to compile a function."""
        if not _ours(event):
            return
        if not self.told:
            self.told = True
            print(f"{TEXT} `buckler --compile` does it beforehand.", file=sys.stderr)
        if self._depth == 0:
            self._begun = perf_counter()
        if self._bar is None:
            self._bar = tqdm(desc="compiling", total=self.total or None, unit=" functions", leave=False, disable=None)
        self._depth += 1

    def on_end(self, event: Event) -> None:
        """Numba has compiled a function."""
        if not _ours(event) or self._depth == 0:
            return
        self._depth -= 1
        self._bar.update()  # type: ignore[attr-defined]
        if self._depth == 0:
            COMPILING.seconds += perf_counter() - self._begun

    def close(self) -> None:
        """Nothing more is compiled for now: take the bar away."""
        if self._bar is not None:
            self._bar.close()
            self._bar = None


def _ours(event: Event) -> bool:
    return str(event.data["dispatcher"].py_func.__module__).startswith("buckler.mbs.spectral.")


ANNOUNCER = Announcer()


def announce(total: int) -> None:
    """Tell it in this process, if it happens; of about so many functions."""
    ANNOUNCER.total = total
    register("numba:compile", ANNOUNCER)
