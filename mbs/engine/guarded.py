"""Functions that users give: one that raises, or returns what is no number, ends the run by name."""

from __future__ import annotations

from collections.abc import Callable
from math import isfinite
from typing import Any

from buckler.mbs.engine.watched import failed
from buckler.mbs.record.status import Status


class Guarded:
    """A user's function of an element; `scene.stopped` tells why it could not give a value.

    Call it with the time, for the message, and with the function's own arguments.
    """

    def __init__(self, scene: Any, name: str, function: Callable[..., Any]) -> None:
        self.scene, self.name, self.function = scene, name, function

    def number(self, t: float, *arguments: float) -> float:
        """One number."""
        value = self._value(t, arguments)
        try:
            if isfinite(value):
                return float(value)
        except TypeError:
            pass
        raise self._stop(t, f"returned {value!r}")

    def pair(self, t: float, *arguments: float) -> tuple[float, float]:
        """Two numbers."""
        value = self._value(t, arguments)
        try:
            x, y = value
            if isfinite(x) and isfinite(y):
                return float(x), float(y)
        except (TypeError, ValueError):
            pass
        raise self._stop(t, f"returned {value!r}")

    def _value(self, t: float, arguments: tuple[float, ...]) -> Any:
        try:
            return self.function(*arguments)
        except (Exception, SystemExit) as error:  # the engine mangles what leaves a function
            self.scene.stopped = failed(t, f"the function of '{self.name}'", error)
            raise

    def _stop(self, t: float, what: str) -> ValueError:
        message = f"at t = {t:.6g} s the function of '{self.name}' {what}"
        self.scene.stopped = (Status.FUNCTION_FAILED, message)
        return ValueError(message)
