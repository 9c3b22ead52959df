"""Data that Python and the compiled integrators exchange: controls, clock, counts, rows of a run, states, work arrays.

Numbers are fields of records, arrays those of named tuples. Sizes: n coordinates, r constraints, k forces, p Gauss points of all
strips, e rows of `Tables.elastic`, each one inner coordinate of a mode or strip, or two as a vector (x, y). A slot is an entry of
a matrix that can be nonzero. Constraints are g(q, t) = 0; differentiated in time G v = speed, G a = change, with G = dg/dq.
"""

from collections import namedtuple
from enum import IntEnum
from typing import Any, NamedTuple

import numpy as np

from ..geometry import Array
from .elimination import Fronts
from .fronts import EliminationOrders
from .tables import Tables, Work

Record = Any
"""A record of numbers, whose fields Python and compiled functions read and write by name."""

Ended = IntEnum("Ended", "OK UNDERFLOW NOT_FINITE TOO_MANY", start=0)
"""Status of a run: no failure; step below the shortest; state not finite; more steps than allowed."""


def _record_type(**kinds: str) -> np.dtype[np.void]:
    """Build the type of records with fields of these names and NumPy kinds."""
    return np.dtype((np.record, list(kinds.items())))


COUNTS = _record_type(**dict.fromkeys("status steps rejected jacobians iterations samples onsets".split(), "i8"))
"""Status of a run (`Ended`) and its counts: accepted steps, rejected steps, Newton matrices, Newton iterations (in the explicit
method evaluations of the accelerations), rows that this call has written, onsets of contacts."""
CLOCK = _record_type(
    time="f8",  # [s]
    next_step="f8",  # length of the next step [s]
    resumed_step="f8",  # explicit: length before an onset cut the step short, from which to go on; else 0 [s]
    previous="f8",  # length of the last step, 0 after a jump [s]
    matrix_step="f8",  # length for which the Newton matrices are factored, 0 if none are [s]
    reach="f8",  # implicit: a step ends at the next of `step_ends` if `reach` times the step's length gets there
    error="f8",  # local error of this step over the one allowed
    last_error="f8",  # local error of the last accepted step over the one allowed
    last_step="f8",  # length of the step of `last_error` [s]
    max_growth="f8",  # largest ratio of the next step length to this one
    skipped="i8",  # steps since the last row
    end_index="i8",  # index of the next of `step_ends`, the times at which a step must end
    needs_matrix="?",  # the next step needs new Newton matrices
)
"""State of the step size control, kept from call to call."""
CONTROLS = _record_type(
    end="f8",  # end of the run [s]
    shortest="f8",  # shortest step [s]
    tolerance="f8",  # local error allowed, in units of the coordinates
    longest="f8",  # longest step [s]
    first_step="f8",  # first step, or all if they are fixed [s]
    max_steps="f8",  # largest number of tried steps, a whole number
    least_onset="f8",  # least onset speed of a contact [m/s]
    least_onset_ratio="f8",  # least onset speed over the fastest onset so far
    face_tolerance="f8",  # a contact this near to its face as a step starts has no onset in it; the same holds at edges [m]
    stop_gap="f8",  # gap before a face or edge at which a step to it ends: a tenth of `face_tolerance`; 0 if explicit [m]
    closing_gap="f8",  # a step that ends within this gap, moving towards the face or edge, has reached it: twice `stop_gap` [m]
    rounding="f8",  # rounding of a distance [m]
    contact_tolerance="f8",  # local error allowed of a contact's depth, relative to it
    newton_share="f8",  # error that Newton's method may leave, over the local error allowed
    every="i8",  # steps per row
    fixed="?",  # all steps but those to onsets have the same length, without error control
    stops_at_all_onsets="?",  # steps also end at onsets of contacts whose force begins smoothly
    writes_within_steps="?",  # rows are also written within steps, by the implicit method
)
"""Options of an integrator, constant during a run."""
SMALLEST_RATIO = 0.2
"""Least ratio of the length of a step to that of the step before: as in the codes DOPRI5 and RADAU5 (Hairer, Wanner)."""
LARGEST_RATIO = 5.0
"""Largest ratio of these lengths; 1.5 to 5 are usual (Hairer, Nørsett and Wanner 1993, II.4)."""
STEP_END_REACH = 1.0001
"""Value of `reach`: a step is stretched by a ten thousandth to a step end, as the next one would be tiny. For a step to an onset
or edge `reach` is 1, as stretching would take the step past it."""


def blank(kind: np.dtype[np.void]) -> Record:
    """Return a record of zeros."""
    return np.zeros(1, kind).view(np.recarray)[0]


class Output(NamedTuple):
    """Rows of a run, one for each time; `memory` has what each force depends on beside q and v: onset speed, bristle."""

    time: Array  # (times,) [s]
    q: Array  # coordinates, (times, n)
    v: Array  # rates, (times, n)
    a: Array  # second rates, (times, n)
    lam: Array  # multipliers, (times, r)
    memory: Array  # (times, k, 4): columns ONSET, BRISTLE, SLIDING, STEP_START of `tables.Memory`


RadauState = namedtuple(
    "RadauState",
    "q v a lam stress "  # state at the start of the step; stress (p, 3): N, Q, M, unknowns too, see `strips`
    "node_q node_v node_a node_lam node_stress node_stress_residual "  # at the three nodes; residual: `Work.stress_residual`
    "past_v past_lam past_stress "  # last step: v at start and nodes (4, n), others at its second node, as the third is the start
    "residual right_side real_solution complex_solution dq dv "  # Newton's method: residuals (3, n + r), increments (3, n)
    "force violation speed change jacobian start_jacobian "  # f (n,); g, speed, change (r,); entries of G, also at the start
    "saddle_mass damping stiffness "  # (slots + 1,), see `tables`: [M G^T-df/dlambda; G 0], as friction depends on lambda; C; K
    "real_matrix complex_matrix "  # (slots + 1,): matrices of Newton's method
    "real_factors complex_factors real_swaps complex_swaps "  # factors and row exchanges of the Newton matrices
    "saddle saddle_factors saddle_swaps "  # nonzeros of the saddle-point matrix [M G^T; G 0], its factors, row exchanges
    "row_magnitude front_work complex_front_work "  # work arrays of the factorisation and the solution
    "memory start_memory start_reports end_reports largest_force "  # of forces: (k, 4) and (k, 8), see `tables`; [N] (k,)
    "start_deformation largest_deformation "  # inner coordinates at t = 0; their largest change by `Elastic.GROUP`; both (e,)
    "unit inverse_error_unit error_unit_across chord "  # units of coordinates (n,); units of the error control, see below
    "error_ratio",  # error after a Newton increment over the increment, from the rate of convergence, (1,)
)
"""State of the implicit integrator, unknowns of its step, work arrays.

The error control has units of its own. `inverse_error_unit` (n,) is one over them. A vector (x, y) of `Tables.elastic` has two
other units, so `inverse_error_unit` is 0 for x and y. Its component along the strip's chord, whose direction is `chord` (e, 2),
has the `unit` of a length. Its component across the chord has the unit `error_unit_across` (e,).
"""


class Radau(NamedTuple):
    """Data of the implicit integrator: a mechanism, orders of elimination of its matrices, work arrays, state."""

    tables: Tables
    orders: EliminationOrders
    work: Work
    state: RadauState


DormandPrinceState = namedtuple(
    "DormandPrinceState",
    "y y_new y_stage stage_rates "  # states (q, v, bristles) at start, end, one stage; rates of all stages
    "lam force violation speed change jacobian "  # as those of `RadauState`
    "factored_jacobian matrix factors swaps row_magnitude front_work right_side "  # of [M G^T; G 0]
    "memory start_reports "  # as those of `RadauState`
    "largest_rate units "  # largest rate so far in units of coordinates (1,) [1/s]; these units (n,)
    "has_factors free_modes",  # 1 once there are factors; 1 if there are modal links and no constraint acts on them
)
"""State of the explicit integrator and its work arrays."""


class DormandPrince(NamedTuple):
    """Data of the explicit integrator: a mechanism, order of elimination of [M G^T; G 0], work arrays, state."""

    tables: Tables
    order: Fronts
    work: Work
    state: DormandPrinceState
