"""Data of the compiled integrators: controls, clock, counts, rows of a run, states and work arrays."""

from __future__ import annotations

from collections import namedtuple
from enum import IntEnum
from typing import Any, NamedTuple

import numpy as np

from ..geometry import Array
from .elimination import Fronts
from .fronts import Orders
from .tables import Tables, Work

Record = Any
"""A record, whose fields are read by name."""

Ended = IntEnum("Ended", "OK UNDERFLOW NOT_FINITE TOO_MANY", start=0)
"""Status of a run: fine; steps too short, states not finite, too many steps."""


def _record(**kinds: str) -> np.dtype[np.void]:
    """Type of records with fields of these kinds, which compiled functions read and write by name."""
    return np.dtype((np.record, [(name, kind) for kind, names in kinds.items() for name in names.split()]))


COUNTS = _record(i8="status steps rejected jacobians iterations samples onsets")
"""Counts of a run: accepted and rejected steps, Newton matrices, Newton iterations or evaluations, rows written, onsets."""
CLOCK = _record(
    f8="time wanted held previous made reach error last_error last_step grow", i8="skipped stop", b1="fresh"
)  # fmt: skip
"""Progress of a run: time, s; length of the next step, s, and one held back by an onset; of the last step, 0 after a jump; that
of which the matrices are, 0 without; how near to a stop, in steps, is at it; local error over what is allowed, of this step and
of the last one, whose length `last_step` is; how many times longer the next may be; steps since the last row; number of the next
stop; whether the next step must have new matrices."""
CONTROLS = _record(
    f8="end shortest tolerance longest first_step budget floor graze contact_tolerance close", i8="every", b1="fixed located"
)  # fmt: skip
"""Controls of a run: its end and the shortest step, s; local error allowed; longest and first step, s; most steps; slowest onset
speed, m/s; share of the fastest approach below which onsets are not taken apart; local error allowed of the depth of a contact;
size of the last Newton step over the local error allowed; how many steps to a row; whether steps do not vary;
whether explicit ones end at onsets of all contacts, also of those that begin smoothly."""


def blank(kind: np.dtype[np.void]) -> Record:
    """A record of zeros."""
    return np.zeros(1, kind).view(np.recarray)[0]


class Output(NamedTuple):
    """Rows of a run: time, coordinates, rates, second rates, multipliers; of each force its onset speed,
    bristle and sliding speed at the step before, and that step's time.
    """

    time: Array
    q: Array
    v: Array
    a: Array
    lam: Array
    memory: Array


def output_for(rows: int, n: int, r: int, k: tuple[int, ...]) -> Output:
    """Allocate rows of n coordinates, r multipliers, memories of shape k."""
    q, v, a = (np.zeros((rows, n)) for _ in range(3))
    return Output(np.zeros(rows), q, v, a, np.zeros((rows, r)), np.zeros((rows, *k)))


RadauState = namedtuple(
    "RadauState",
    "q v a lam stress places rates seconds multipliers stresses slacks past past_lam past_stress residual right step "
    "complex_step dq dv force gap speed change jacobian base mass damping stiffness matrix complex_matrix real complex "
    "real_swaps complex_swaps bare heavy heavy_swaps amount_of_row part complex_part memory before shifted largest old rest "
    "whole amount weight across turn remainder",
)
"""A state (q, v, a, lam, stress), the step's unknowns at the nodes, and room to work in.

`weight` is one over the unit of each coordinate, zero for those of vectors, whose units along and across their chord are
`whole` and `across`; `turn` is the chord's direction.
"""


class Radau(NamedTuple):
    """Data of the implicit integrator: a mechanism, orders of elimination of its matrices, work arrays, state."""

    tables: Tables
    orders: Orders
    work: Work
    state: RadauState


DormandPrinceState = namedtuple(
    "DormandPrinceState",
    "y new trial rates lam force residual speed change jacobian factored matrix factors swaps amount part right memory "
    "before pace units begun apart",
)
"""State y = (q, v, bristles), its seven rates, and room to work in."""


class DormandPrince(NamedTuple):
    """Data of the explicit integrator: a mechanism, order of elimination of its mass matrix, work arrays, state."""

    tables: Tables
    order: Fronts
    work: Work
    flight: DormandPrinceState
