"""Guards of users' functions: an exception, or a value that is no finite number, ends the run with a message.

The engine replaces exceptions of callbacks by its own. Therefore the first one is stored in `scene.stopped`.
"""

from collections.abc import Sequence
from math import isfinite

from ..record.errors import Failure, Status
from . import Callback, System
from .scene import EngineScene


def describe_failure(t: float, what: str, error: BaseException, out_of_range: Status | None = None) -> Failure:
    """Return status and message for an exception of the function `what`; a ValueError has the status `out_of_range`."""
    if out_of_range is not None and isinstance(error, ValueError):
        return Failure(out_of_range, f"at t = {t:.6g} s {what}: {error}")
    return Failure(Status.FUNCTION_FAILED, f"at t = {t:.6g} s {what} raised {type(error).__name__}: {error}")


def watch(scene: EngineScene, what: str, function: Callback, out_of_range: Status | None = None) -> Callback:
    """Return a callback (system, time, ...) that calls a function and stores its first exception; see `describe_failure`."""

    def call(system: System, t: float, *arguments: float) -> object:
        """Call the function, as the engine does."""
        try:
            return function(system, t, *arguments)
        except (Exception, SystemExit) as error:
            scene.stopped = scene.stopped or describe_failure(t, what, error, out_of_range)
            raise

    return call


def guard(scene: EngineScene, name: str, function: Callback | float | Sequence[float], size: int = 1) -> Callback:
    """Wrap a user's function of some arguments as (t, *arguments), where the time t [s] is for messages alone; see `watch`.

    The value of the user's function must be `size` finite numbers. A constant is wrapped as a function that returns it.
    """
    if not callable(function):
        return lambda _t, *_: function
    what = f"the function of '{name}'"
    watched = watch(scene, what, lambda _system, _t, *arguments: function(*arguments))

    def call(t: float, *arguments: float) -> float | list[float]:
        """Call the user's function without the time t, and check its value."""
        value = watched(None, t, *arguments)
        try:
            numbers = (value,) if size == 1 else tuple(value)
            if len(numbers) == size and all(map(isfinite, numbers)):
                return float(value) if size == 1 else [float(number) for number in numbers]
        except (TypeError, ValueError):
            pass
        message = f"at t = {t:.6g} s {what} returned {value!r}"
        scene.stopped = scene.stopped or Failure(Status.FUNCTION_FAILED, message)
        raise ValueError(message)

    return call
