"""What users give the engine to call: an exception is kept by type and named first; Ctrl-C ends a run after its step."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from buckler.mbs.record.status import Status


def watched(scene: Any, what: str, function: Callable[..., Any], out_of_range: Status | None = None) -> Callable[..., Any]:
    """Return a user function of the engine, called with (system, time, ...), that tells `scene.stopped` what it raised.

    Parameters
    ----------
    scene : Scene or None
    what : str
        What raises, in words.
    function : callable
    out_of_range : Status, optional
        What a ValueError means; any other exception, and it too by default, is FUNCTION_FAILED.
    """

    def call(system: Any, t: float, *arguments: Any) -> Any:
        try:
            return function(system, t, *arguments)
        except Exception as error:
            if scene is not None and scene.stopped is None:
                scene.stopped = failed(t, what, error, out_of_range)
            raise

    return call


def failed(t: float, what: str, error: Exception, out_of_range: Status | None = None) -> tuple[Status, str]:
    """Status and sentence for an exception of a user's function."""
    if out_of_range is not None and isinstance(error, ValueError):
        return out_of_range, f"at t = {t:.6g} s {what}: {error}"
    return Status.FUNCTION_FAILED, f"at t = {t:.6g} s {what} raised {type(error).__name__}: {error}"


@contextmanager
def interruptible(control: Any) -> Iterator[None]:
    """Let Ctrl-C end the run after the step it comes in: `control.raised` is a KeyboardInterrupt then.

    Python's own handler would raise it inside one of the engine's callbacks, where the engine makes a failed step of it.
    """
    ours = threading.current_thread() is threading.main_thread() and signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if not ours:
        yield
        return

    def end(_number: int, _frame: Any) -> None:
        control.raised = KeyboardInterrupt()

    signal.signal(signal.SIGINT, end)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)
