"""Self-check of driven linkages: do rigid links in ideal joints move as loop closure says?

It says so of all recorded times at once, from places alone (see `mbs.kinematics.linkage`).
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from buckler.mbs.checks.check import Check
from buckler.mbs.checks.dead_centre import dead_centre, followed, not_determined
from buckler.mbs.geometry import Array
from buckler.mbs.kinematics.linkage import solved
from buckler.mbs.mechanism import Mechanism
from buckler.mbs.record.record import Record
from buckler.mbs.record.result import Result
from buckler.mbs.record.run import Run

CLOSURE = 0.035
"""Error of a speed or an acceleration, relative to the largest of the run, beyond which a run is suspect."""
JUMP, SETTLED = 0.2, 20
"""A drive's acceleration that changes by this share of its largest within a step has jumped; so many steps later that is over."""


def _closed(run: Run, _result: Result) -> Iterator[str]:
    """Nothing is said where constraints alone do not decide the motion."""
    record = run.record
    mechanism = record.mechanism
    known = followed(record)
    if known is None or dead_centre(known) is not None:
        return
    closure, places, jacobian = known
    driven = closure.acceleration(record.time)
    speed = solved(jacobian, closure.speed(record.time))
    acceleration = solved(jacobian, closure.system(places, speed.reshape(places.shape))[2] + driven)
    steady = ~_after_jumps(driven)
    for what, found, right in (
        ("speed", _turning(record, "q_t"), speed),
        ("acceleration", _turning(record, "q_tt"), acceleration),
    ):
        off, scale = _apart(mechanism, found, right, speed)
        off[~steady] = 0.0
        if off.max() > CLOSURE * scale:
            k = int(np.argmax(off))
            share = f"{off[k] / scale:.2g} of the largest in the run"
            yield f"at t = {record.time[k]:.4g} s loop closure gives another {what}, by {share}: lower max_step"


def _apart(mechanism: Mechanism, found: Array, right: Array, speed: Array) -> tuple[Array, float]:
    """Distance of the turning found from the right one, times length, shape (times,), and its scale.

    That is the largest there is of all links' starts and turns; of accelerations, of those towards the centre of a turn and of
    speed^2 over length too.
    """
    lengths = np.array([mechanism.length(link.name) for link in mechanism.links])
    off = (np.abs(found - right[:, 2::3]) * lengths).max(axis=1)

    def largest(rates: Array) -> float:
        return float(np.abs(np.stack([rates[:, 0::3], rates[:, 1::3], rates[:, 2::3] * lengths])).max())

    if right is speed:
        return off, largest(right)
    around = float((speed[:, 2::3] ** 2 * lengths).max())
    return off, max(largest(right), around, largest(speed) ** 2 / float(lengths.max()))


def _turning(record: Record, rate: str) -> Array:
    """Rates of all links' angles, shape (times, links)."""
    return np.column_stack([getattr(record.links[link.name], rate)[:, 2] for link in record.mechanism.links])


def _after_jumps(driven: Array) -> Array:
    """True for samples about and shortly after a jump of the drive's acceleration, which no integrator follows at once."""
    change = np.abs(np.diff(driven.sum(axis=1)))
    jumps = np.flatnonzero(change > JUMP * np.abs(driven).max())
    after = np.zeros(len(driven), dtype=bool)
    after[:SETTLED] = np.any(driven[0])  # the engine does not know it until the first step is over
    for k in jumps:
        after[max(0, k - 1) : k + SETTLED] = True
    return after


CHECK = Check(
    "CLOSURE",
    "failed when a driven linkage has other speeds or accelerations than its own loops allow",
    _closed,
    {"of the largest": CLOSURE, "jump": JUMP, "steps after a jump": SETTLED},
    not_determined,
)
