"""Ctrl-C ends a run after the step it comes in, and what the run has is kept."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any


class Interrupted(KeyboardInterrupt):
    """Ctrl-C ended `simulate`: scripts end as they do without it, unless they ask for what there is.

    Attributes
    ----------
    result : Result
        INTERRUPTED: the run that got farthest, as far as it got. No check looked at it.
    """

    def __init__(self, result: Any) -> None:
        super().__init__(result.message)
        self.result = result


@contextmanager
def ctrl_c() -> Iterator[Callable[[], bool]]:
    """Give a function that tells whether Ctrl-C came since; never, where Python's own handler does not wait for it.

    That handler would raise a KeyboardInterrupt inside a callback, where the engine makes a failed step of it.
    """
    pressed: list[int] = []
    ours = threading.current_thread() is threading.main_thread() and signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if ours:
        signal.signal(signal.SIGINT, lambda number, _frame: pressed.append(number))
    try:
        yield lambda: bool(pressed)
    finally:
        if ours:
            signal.signal(signal.SIGINT, signal.default_int_handler)
