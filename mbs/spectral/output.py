"""What the compiled integrators count, are told and leave: places in their arrays, rows of a run."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

Array = np.ndarray[Any, Any]
OK, UNDERFLOW, NOT_FINITE, TOO_MANY = 0, 1, 2, 3
STATUS, STEPS, REJECTED, JACOBIANS, ITERATIONS, SAMPLES, ONSETS, COUNTERS = 0, 1, 2, 3, 4, 5, 6, 8
"""Places in the counts."""
NOW, WANTED, HELD, PREVIOUS, MADE, SKIPPED = 0, 1, 2, 3, 4, 5
"""Places in the clock: time, s; length of the next step, s, and one held back by an onset; of the last step, and that of which
the matrices are, 0 without; steps since the last row."""
TOLERANCE, LONGEST, FIRST_STEP, BUDGET, FLOOR, GRAZE, CONTACT_TOLERANCE, FIXED_STEPS, CLOSE, EVERY, CONTROLS = (
    0,
    1,
    2,
    3,
    4,
    5,
    6,
    7,
    8,
    9,
    10,
)
"""Places in the controls: local error allowed, longest and first step, most steps, slowest onset speed, share of the fastest
approach below which onsets are not taken apart, local error allowed of the depth of a contact, 1 for steps that do not vary, size
of the last Newton step over the local error allowed, how many steps to a row."""


class Output(NamedTuple):
    """What a run leaves at each of its times: time, coordinates, rates, second rates, multipliers; of each force its onset speed,
    bristle and sliding speed at the step before, and that step's time.
    """

    time: Array
    q: Array
    v: Array
    a: Array
    lam: Array
    memory: Array


def output_for(rows: int, n: int, r: int, k: tuple[int, ...]) -> Output:
    """Make room for so many rows of n coordinates, r multipliers, memories of shape k."""
    q, v, a = (np.zeros((rows, n)) for _ in range(3))
    return Output(np.zeros(rows), q, v, a, np.zeros((rows, r)), np.zeros((rows, *k)))
