"""What a run leaves for its neighbours, runs of other numbers on the same steps: factors of its Newton matrices, and by how much
each accepted step's nodes differ from their first guess. Both differ by as little as the numbers do, so that a neighbour needs
no matrix of its own, and few iterations (H. G. Bock 1983, see `buckler.mbs.sensitivity.frozen`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..geometry import Array
from .compiling import aside, copy, inner
from .elimination import Arrays

ALONE, WRITES, READS = range(3)
"""Whether a run has no neighbours, leaves a tape, or goes by one."""
MOST = 2e8
"""Bytes of factors; steps beyond have none."""
ALIKE = 1e-3
"""Relative difference of lengths up to which two runs' steps are the same one: a contact's beginning moves with the numbers."""
NEAR = 0.1
"""Of the step, up to which events in two runs are the same one."""
QUICK = 1e-3
"""Ratio of Newton steps beyond which the next step of a run that others go by has a new matrix: what two iterations of a
neighbour leave is the square of this share of the difference. The run has a fifth more matrices than with 0.03."""
SLOT, MODE, STEP, STRAY, FREE = range(5)
"""Of a room's place on a tape: factors in use; one of the modes; number of the step; 1 after an event that is not on the tape, up
to the next end of a step that is given; first factors that no step goes by."""


class Tape(NamedTuple):
    """Steps of a run. The last of the factors are no step's: there a run makes its own.

    Attributes
    ----------
    end : array, shape (steps,)
        Times at which they end, s; 0 where an event ends one, or there is none.
    length : array, shape (steps,)
        s; 0 where there is no step.
    onset : array, shape (steps,)
        Time of the event that ends it, s; 0 where none does: a contact begins or lets go, a force has a kink.
    factors : array of int, shape (steps,)
        Which of the factors each went by.
    rates, multipliers, stresses : arrays, shape (steps, 3, n), (steps, 3, r), (steps, 3, points, 3)
        At the nodes, less their first guess.
    real, complex : arrays, shape (factors, entries)
    swaps : array of int, shape (factors, 2, unknowns of fronts)
    held : array, shape (factors, points, 3, 4)
        Gradients of the strips' strains that they were made with: any others may be as good as none.
    """

    end: Array
    length: Array
    onset: Array
    factors: Array
    rates: Array
    multipliers: Array
    stresses: Array
    real: Array
    complex: Array
    swaps: Array
    held: Array


def tape_for(scene: Arrays, steps: int = 0) -> Tape:
    """Make room for so many steps of a scene."""
    n, r, points, e = scene.size, len(scene.tables.rows), int(scene.tables.strips[:, 2].sum()), scene.fronts
    most, z = 1 + min(steps, int(MOST / (24 * e.size + 96 * points))), np.zeros
    return Tape(
        z(steps), z(steps), z(steps), z(steps, dtype=np.int64), z((steps, 3, n)), z((steps, 3, r)),
        z((steps, 3, points, 3)), z((most, e.size)), z((most, e.size), dtype=complex),
        z((most, 2, len(e.unknowns)), dtype=np.int64), z((most, points, 3, 4)),
    )  # fmt: skip


def ends_of(tape: Tape, time: Array) -> Array:
    """Times at which the steps of a run that left a tape, and rows at these times, end, but for those that an event ends."""
    ends = tape.end[tape.end > 0]
    return np.append(ends, time[time > ends[-1]])


@inner
def free_slot(x):
    """Where the factors of a new matrix go."""
    last = x.tape.real.shape[0] - 1
    return min(last, x.at[FREE]) if x.at[MODE] == WRITES else last


@inner
def place(x):
    """Where on the tape the present step is; -1 off the tape."""
    return x.at[STEP] if x.at[STEP] < x.tape.end.size and x.at[STRAY] == 0 else -1


@inner
def reads(x, h):
    """Whether the present step, of this length, is on the tape that this run goes by."""
    k = place(x)
    if x.at[MODE] != READS or k < 0 or x.tape.factors[k] == x.tape.real.shape[0] - 1:
        return False
    return abs(x.tape.length[k] - h) < ALIKE * h


@inner
def strays(x):
    """Whether there was an event in this step that is not on the tape: no one has seen to its error."""
    return x.at[MODE] == READS and x.at[STRAY] == 1


@inner
def cut(x):
    """Length of a step up to just before the event that ends it on the tape; 0 where none does."""
    k = place(x)
    return (1.0 - 0.5 * ALIKE) * x.tape.length[k] if x.at[MODE] == READS and k >= 0 and x.tape.onset[k] > 0.0 else 0.0


@inner
def passed(x, h, ended, t):
    """Note an accepted step that ends at this time, by itself or by an event.

    An event that is later than on the tape makes all later steps end later: what the first short ones after it err by is far
    from constant in their lengths.
    """
    k, steps = place(x), x.tape.end.size
    if x.at[MODE] == WRITES and k >= 0:
        x.tape.length[k], x.tape.factors[k] = h, x.at[SLOT]
        x.at[FREE] = max(x.at[FREE], x.at[SLOT] + 1)
        if ended:
            x.tape.end[k] = t
        else:
            x.tape.onset[k] = t
    known = x.at[MODE] == WRITES or (k >= 0 and x.tape.onset[k] > 0.0)
    if x.at[MODE] == READS and known and not ended and abs(x.tape.onset[k] - t) < NEAR * h:
        x.late[0] = t - x.tape.onset[k]
    if ended:
        x.at[STRAY] = 0
        while x.at[STEP] < steps and x.tape.end[x.at[STEP]] == 0.0:
            x.at[STEP] += 1
    if ended or known:
        x.at[STEP] += 1
    else:
        x.at[STRAY] = 1


@aside
def _add(source, share, target):
    """Fill target with source + share * target."""
    for i in range(target.size):
        target.flat[i] = source.flat[i] + share * target.flat[i]


@aside
def guessed(x, share):
    """Note the first guess at a step's nodes (share 0), or by how much they differ from it (share -1)."""
    k = place(x)
    if x.at[MODE] == WRITES and k >= 0:
        _add(x.rates, share, x.tape.rates[k])
        _add(x.multipliers, share, x.tape.multipliers[k])
        _add(x.stresses, share, x.tape.stresses[k])


@aside
def follow(w, x, fresh):
    """Go by a step on the tape: its factors, and what it differs from its first guess."""
    k = place(x)
    _add(x.tape.rates[k], 1.0, x.rates)
    _add(x.tape.multipliers[k], 1.0, x.multipliers)
    _add(x.tape.stresses[k], 1.0, x.stresses)
    if fresh or x.at[SLOT] != x.tape.factors[k]:
        x.at[SLOT] = x.tape.factors[k]
        copy(x.tape.held[x.at[SLOT]], w.held)
