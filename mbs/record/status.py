"""How a run ended, by name."""

from __future__ import annotations

from enum import StrEnum


class Status(StrEnum):
    """How a run ended. Anything but OK comes with a sentence a person can act on."""

    OK = "OK"
    SUSPECT = "SUSPECT"
    LOCKED = "LOCKED"
    SINGULAR = "SINGULAR"
    NEWTON_DIVERGED = "NEWTON_DIVERGED"
    NOT_FINITE = "NOT_FINITE"
    TIMED_OUT = "TIMED_OUT"
    INTERRUPTED = "INTERRUPTED"
    TOO_MANY_STEPS = "TOO_MANY_STEPS"
    STRUT_OUT_OF_RANGE = "STRUT_OUT_OF_RANGE"
    FUNCTION_FAILED = "FUNCTION_FAILED"
    ENGINE_ERROR = "ENGINE_ERROR"
