"""Guards of users' functions: one that raises, or returns no number, ends the run with a message that names it."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite

from ..record.errors import Status
from . import Callback, System
from .scene import EngineScene


def describe_failure(t: float, what: str, error: BaseException, out_of_range: Status | None = None) -> tuple[Status, str]:
    """Return status and sentence for an exception of a user's function; a ValueError may have a status of its own."""
    if out_of_range is not None and isinstance(error, ValueError):
        return out_of_range, f"at t = {t:.6g} s {what}: {error}"
    return Status.FUNCTION_FAILED, f"at t = {t:.6g} s {what} raised {type(error).__name__}: {error}"


def watch(scene: EngineScene, what: str, function: Callback, out_of_range: Status | None = None) -> Callback:
    """Return a function called with (anything, time, ...) that records its first exception in `scene.stopped`.

    `what` names the function in words. A ValueError has the status `out_of_range`, any other exception FUNCTION_FAILED.
    """

    def call(system: System, t: float, *arguments: float) -> object:
        """Call the function and store its exception, which the engine alters."""
        try:
            return function(system, t, *arguments)
        except (Exception, SystemExit) as error:
            if scene.stopped is None:
                scene.stopped = describe_failure(t, what, error, out_of_range)
            raise

    return call


def guard(scene: EngineScene, name: str, function: Callback | float | Sequence[float], size: int = 1) -> Callback:
    """Return a guarded function of the time, for messages, and of its arguments, that returns `size` finite numbers.

    A number instead of a function is its constant value.
    """
    if not callable(function):
        return lambda _t, *_: function
    what = f"the function of '{name}'"
    watched = watch(scene, what, lambda _system, _t, *arguments: function(*arguments))

    def call(t: float, *arguments: float) -> float | list[float]:
        """Call the function and check its value."""
        value = watched(None, t, *arguments)
        try:
            parts = (value,) if size == 1 else tuple(value)
            if len(parts) == size and all(map(isfinite, parts)):
                return float(value) if size == 1 else [float(part) for part in parts]
        except (TypeError, ValueError):
            pass
        scene.stopped = (Status.FUNCTION_FAILED, f"at t = {t:.6g} s {what} returned {value!r}")
        raise ValueError(scene.stopped[1])

    return call
