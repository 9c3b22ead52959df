"""What users give the engine to call: an exception is kept by type and named first."""

from __future__ import annotations

from collections.abc import Callable
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
        except (Exception, SystemExit) as error:  # the engine mangles what leaves a function
            if scene is not None and scene.stopped is None:
                scene.stopped = failed(t, what, error, out_of_range)
            raise

    return call


def failed(t: float, what: str, error: BaseException, out_of_range: Status | None = None) -> tuple[Status, str]:
    """Status and sentence for an exception of a user's function."""
    if out_of_range is not None and isinstance(error, ValueError):
        return out_of_range, f"at t = {t:.6g} s {what}: {error}"
    return Status.FUNCTION_FAILED, f"at t = {t:.6g} s {what} raised {type(error).__name__}: {error}"
