"""Ctrl-C ends a run after the step it comes in, and what the run has is kept."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

Progress = Callable[[float], None]
"""Is told what share of a run is done."""


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


class _Noted:
    """Handler that notes Ctrl-C for as long as it is the handler."""

    def __init__(self) -> None:
        self.pressed = False

    def __call__(self, number: int, frame: FrameType | None) -> None:
        self.pressed = True


@contextmanager
def ctrl_c() -> Iterator[Callable[[], bool]]:
    """Give a function that tells whether Ctrl-C came since; never, where Python's own handler does not wait for it.

    That handler would raise a KeyboardInterrupt inside a callback, where the engine makes a failed step of it. Within another
    such context the function is the outer one's.
    """
    here = threading.current_thread() is threading.main_thread()
    before = signal.getsignal(signal.SIGINT) if here else None
    noted = before if isinstance(before, _Noted) else _Noted()
    ours = before is signal.default_int_handler
    if ours:
        signal.signal(signal.SIGINT, noted)
    try:
        yield lambda: noted.pressed
    finally:
        if ours:
            signal.signal(signal.SIGINT, signal.default_int_handler)
