"""Verdicts on runs that are compared with a reference, and the errors allowed."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from enum import StrEnum
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from buckler.mbs import Status
from buckler.mbs.geometry import Array

Measures = Mapping[str, Any]
NOTHING = MappingProxyType[str, float]({})
MODEL_CHECKS = frozenset(("PENETRATION", "LINEAR"))
"""Checks that say that a law is used beyond its range: a reference of the same model cannot refute them."""


class Verdict(StrEnum):
    """Outcome of a run compared with a reference.

    A run is right if it is reported fine and errs by less than is allowed. It is named if it is refused, fails, runs out of time,
    or is suspect and wrong. It is a false alarm if it is suspect though right, and silent if it is reported fine though wrong.
    """

    RIGHT = "right"
    NAMED = "named"
    FALSE_ALARM = "false alarm"
    SILENT = "silent"
    NO_REFERENCE = "no reference"


def decide(status: str, message: str, error: float | None) -> Verdict:
    """Decide on a run by its status and its error over what is allowed, None without a reference."""
    if status not in (Status.OK, Status.SUSPECT):
        return Verdict.NAMED
    if error is None:
        return Verdict.NO_REFERENCE if status == Status.OK else Verdict.NAMED
    if not error <= 1.0:
        return Verdict.SILENT if status == Status.OK else Verdict.NAMED
    if status == Status.OK:
        return Verdict.RIGHT
    checks = set(re.findall(r"(?:^|; )([A-Z]+): ", message))
    return Verdict.NAMED if checks and checks <= MODEL_CHECKS else Verdict.FALSE_ALARM


def find_largest(values: Array) -> float:
    """Find the largest magnitude."""
    return float(np.abs(values).max())


class AllowedError(NamedTuple):
    """Error allowed of a measure over its scale, and the norm of the error."""

    allowed: float
    norm: Callable[[Array], float] = find_largest


KINDS = {"force": AllowedError(0.05), "impulse": AllowedError(0.05), "place": AllowedError(1e-3), "path": AllowedError(5e-3)}
KINDS["journal"] = AllowedError(0.1, lambda off: float(np.sqrt((off**2).mean(axis=-1)).max()))
"""Kinds of measures; a measure is called `kind` or `kind of what`.

Contact laws are known no better than forces to 5 %, and an impulse changes speeds as a restitution wrong by 5 % does. Places are
relative to the longest link: 1e-3 is what a drawing shows, `path`, where something strikes, what a rebound wrong by 5 % errs by.
A journal is a place relative to the clearance, by its root mean square: at 0.1 the pin is on the right side of its bush.
"""


def compare(
    found: Measures, right: Measures, scales: Mapping[str, float] = NOTHING, reported: Mapping[str, float] = NOTHING
) -> tuple[float, str]:
    """Find the largest error of all measures over what is allowed, and the measure's name.

    A measure without a scale is compared with the reference's largest value. An error that the run reports itself, relative to
    its own values, is allowed.
    """
    errors = {}
    for name, value in right.items():
        kind, own = KINDS[name.split()[0]], np.asarray(found[name])
        allowed = kind.allowed * max(scales.get(name) or find_largest(value), 1e-12)
        off = kind.norm(own[..., : np.shape(value)[-1]] - value)  # a reference may end where trajectories part
        errors[name] = float(np.nan_to_num(off / max(allowed, reported.get(name, 0.0) * find_largest(own)), nan=np.inf))
    worst = max(errors, key=lambda name: errors[name])
    return errors[worst], worst
