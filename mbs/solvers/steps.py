"""How long the steps of a run are: what all solvers share. It imports no engine."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from math import ceil
from typing import ClassVar

import numpy as np

from buckler.mbs.declare import Declared, declared, quantity, whole

COARSEST = 40
"""Steps of the coarsest runs, at least."""


@declared
class Controlled(Declared):
    """Steps whose size follows the local error.

    Notes
    -----
    Without a tolerance, a mechanism whose motion constraints alone decide takes equal steps, 400 a turn of its drive.
    """

    in_files = False

    tolerance: float | None = quantity(
        "1", above=0, default=None,
        doc="local position error allowed a step, relative to the mechanism's size: its longest link, or a tenth of the smallest "
        "clearance; by default 1e-5, with clearance 1e-3",
    )  # fmt: skip
    max_step: float | None = quantity("s", above=0, doc="largest step; a 200th of the duration by default", default=None)
    min_step: float = quantity("s", above=0, doc="smallest step", default=1e-9)
    contact_resolution: int = whole(
        1, 10_000, doc="steps at least taken for half an oscillation of the guided mass on its stop", default=40
    )
    max_steps: int = whole(1, 10**9, doc="a run that takes more ends as TOO_MANY_STEPS", default=1_000_000)

    adaptive: ClassVar[bool] = True
    record_every: ClassVar[int] = 1

    def longest(self, duration: float) -> float:
        """Longest step of a run, s."""
        return self.max_step or duration / 200

    def number(self, duration: float) -> int:
        """Steps of a run at least."""
        return max(1, ceil(duration / self.longest(duration)))


@declared
class Equal(Declared):
    """Steps of one size."""

    in_files = False

    count: int = whole(1, 10**9, doc="steps of the run")
    record_every: int = whole(1, 10**9, doc="one step in so many is recorded", default=1)

    adaptive: ClassVar[bool] = False
    tolerance: ClassVar[None] = None
    min_step: ClassVar[float] = 1e-9
    max_steps: ClassVar[int] = 10**9

    def longest(self, duration: float) -> float:
        """Step of a run, s."""
        return duration / self.count

    def number(self, _duration: float) -> int:
        """Steps of a run."""
        return self.count


def divided(kinks: Sequence[float], longest: float, usual: float) -> list[float]:
    """Kinks, s, with times between those that one step would join: a run whose longest step is finer is finer there too."""
    parts = max(1, ceil(usual / longest - 1e-9))
    between = (np.linspace(a, b, parts + 1)[:-1] for a, b in pairwise(kinks) if b - a < longest)
    return sorted({*kinks, *(float(t) for piece in between for t in piece)})
