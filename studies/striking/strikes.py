"""Strikes in a sampled contact force: where each begins and ends, its largest force and its impulse."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

Array = np.ndarray[Any, Any]


class Strike(NamedTuple):
    """One contact, by its samples.

    Attributes
    ----------
    before, after : int
        The unloaded samples beside it; its own first and last one where the run begins or ends in contact.
    first, last : int
        Its first and last sample with a force.
    """

    before: int
    first: int
    last: int
    after: int

    @property
    def pulse(self) -> slice:
        """All its samples, those beside it too."""
        return slice(self.before, self.after + 1)

    def peak(self, force: Array) -> float:
        """Largest force, N."""
        return float(force[self.pulse].max())

    def impulse(self, time: Array, force: Array) -> float:
        """Impulse, N s."""
        return float(np.trapezoid(force[self.pulse], time[self.pulse]))


def strikes(force: Array) -> list[Strike]:
    """Each contact in a force, N: from its first positive sample until it returns to zero."""
    touching = np.concatenate([[False], force > 0, [False]])
    changes = np.flatnonzero(touching[1:] != touching[:-1])
    end = len(force) - 1
    return [
        Strike(max(int(first) - 1, 0), int(first), int(free) - 1, min(int(free), end))
        for first, free in zip(changes[::2], changes[1::2], strict=True)
    ]
