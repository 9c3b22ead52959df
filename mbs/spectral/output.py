"""Data that Python and the compiled integrators exchange: controls, clock, counts, rows of a run, states, work arrays.

Numbers are fields of records, arrays those of named tuples. Sizes: n coordinates, r constraints, k forces, p Gauss points of all
strips, e rows of `Tables.elastic`. Such a row is one inner coordinate of a mode or strip, or two as a vector (x, y). A slot is an
entry of a matrix that can be nonzero. Constraints are g(q, t) = 0; derivatives by time G v = speed, G a = change, with G = dg/dq.
"""

from collections import namedtuple
from collections.abc import Iterator, Mapping
from enum import IntEnum
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..geometry import Array
from .elimination import Fronts
from .fronts import EliminationOrders
from .tables import Tables, Work

Record = Any
"""A record of numbers, whose fields Python and compiled functions read and write by name."""

Ended = IntEnum("Ended", "OK UNDERFLOW NOT_FINITE TOO_MANY", start=0)
"""Status of a run: no failure; step below the shortest; state not finite; more steps than allowed."""


def record_type(**kinds: str) -> np.dtype[np.void]:
    """Build the type of records with fields of these names and NumPy kinds."""
    return np.dtype((np.record, list(kinds.items())))


COUNTS = record_type(**dict.fromkeys("status steps rejected jacobians iterations samples onsets".split(), "i8"))
"""Status of a run (`Ended`) and its counts: accepted steps, rejected steps, Newton matrices, Newton iterations (in the explicit
method evaluations of the accelerations), rows that this call has written, onsets of contacts."""
CLOCK = record_type(
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
CONTROLS = record_type(
    end="f8",  # end of the run [s]
    shortest="f8",  # shortest step [s]
    tolerance="f8",  # local error allowed, in units of the coordinates
    longest="f8",  # longest step [s]
    longest_turn="f8",  # implicit: largest turn of a link in a step [rad]
    first_step="f8",  # first step, or all if they are fixed [s]
    max_steps="i8",  # largest number of tried steps
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


def allocate(shapes: Mapping[str, str], sizes: Mapping[str, int], values: Mapping[str, ArrayLike]) -> Iterator[Array]:
    """Yield an array for each shape, numbers and names of sizes, with its `values` or zeros."""
    for name, shape in shapes.items():
        axes, _, kind = shape.partition(":")  # the type, if it is not float
        array = np.zeros([sizes[axis] if axis in sizes else int(axis) for axis in axes.split()], kind or float)
        array[:] = values.get(name, 0)
        yield array


class Output(NamedTuple):
    """Rows of a run, one for each time; `memory` has what each force depends on beside q and v: onset speed, bristle."""

    time: Array  # (times,) [s]
    q: Array  # coordinates, (times, n)
    v: Array  # rates, (times, n)
    a: Array  # second rates, (times, n)
    lam: Array  # multipliers, (times, r)
    memory: Array  # (times, k, 4): columns ONSET, BRISTLE, SLIDING of `tables.Memory`, STEP_START


RADAU_SHAPES = {
    "q": "n", "v": "n", "a": "n", "lam": "r", "stress": "p 3",  # at the step's start; stress: N, Q, M (`strips`)
    "node_q": "3 n", "node_v": "3 n", "node_a": "3 n", "node_lam": "3 r",  # at the three nodes
    "node_stress": "3 p 3", "node_stress_residual": "3 p 3",  # at the three nodes; `Work.stress_residual`
    "past_v": "4 n", "past_lam": "r", "past_stress": "p 3",  # last step: v at its start and nodes; lam, stress at its second node
    "residual": "3 u", "dq": "3 n", "dv": "3 n",  # Newton's method: residuals and increments at the nodes
    "right_side": "u", "real_solution": "u", "complex_solution": "u:complex",  # of linear equations
    "force": "n", "violation": "r", "speed": "r", "change": "r",  # f, g, right sides of G v = speed and G a = change
    "jacobian": "g", "start_jacobian": "g",  # G, now and at the step's start
    "saddle_mass": "s", "damping": "s", "stiffness": "s",  # [M G^T-df/dlambda; G 0], as friction depends on lambda; C; K
    "real_matrix": "s", "real_factors": "newton_entries", "real_swaps": "newton_swaps:int",  # of Newton's method
    "complex_matrix": "s:complex", "complex_factors": "newton_entries:complex", "complex_swaps": "newton_swaps:int",
    "saddle": "s", "saddle_factors": "saddle_entries", "saddle_swaps": "saddle_swaps:int",  # [M G^T; G 0]
    "row_magnitude": "u", "front_work": "front", "complex_front_work": "front:complex",  # work arrays of factorisations
    "memory": "k 4", "start_memory": "k 4", "start_reports": "k 8", "end_reports": "k 8",  # columns of `Memory` and `Report`
    "largest_force": "k",  # largest force so far [N]
    "start_deformation": "e", "largest_deformation": "e",  # of each row at t = 0; largest change since, by `Elastic.GROUP`
    "unit": "n", "inverse_error_unit": "n", "error_unit_across": "e", "chord": "e 2",  # units, see below
    "turns": "n",  # 1 for the angle of a rigid or modal link, 0 for other coordinates
    "error_ratio": "1",  # error after a Newton increment over the increment, from the rate of convergence
}  # fmt: skip
"""Shapes of the fields of `RadauState`, floats unless a type follows.

Sizes beside n, r, k, p, e: u = n + r unknowns of linear equations, from which stresses are eliminated; s slots + 1 (`tables`);
g entries of G; factors of a matrix have entries and swaps (exchanges of rows); `front` is the work space of the largest front."""
RadauState = namedtuple("RadauState", RADAU_SHAPES)  # type: ignore[misc]
"""State of the implicit integrator, unknowns of its step, work arrays.

The error control has units of its own, the inverse of `inverse_error_unit`, which is 0 for a vector (x, y) of `Tables.elastic`.
Along the strip's chord, whose direction is `chord`, the vector has the `unit` of a length; across it, `error_unit_across`.
"""


class Radau(NamedTuple):
    """Data of the implicit integrator: a mechanism, orders of elimination of its matrices, work arrays, state."""

    tables: Tables
    orders: EliminationOrders
    work: Work
    state: RadauState


DORMAND_PRINCE_SHAPES = {
    "y": "y", "y_new": "y", "y_stage": "y", "stage_rates": "7 y",  # states (q, v, bristles) at start, end, a stage; their rates
    "lam": "r", "force": "n", "violation": "r", "speed": "r", "change": "r", "jacobian": "g",  # as in `RADAU_SHAPES`
    "memory": "k 4", "start_reports": "k 8",  # as in `RADAU_SHAPES`
    "matrix": "s", "factors": "saddle_entries", "swaps": "saddle_swaps:int", "factored_jacobian": "g",  # [M G^T; G 0]; its G
    "row_magnitude": "u", "front_work": "front", "right_side": "u",  # work arrays of the factorisation
    "units": "n", "largest_rate": "1",  # units of coordinates; largest rate so far in these units [1/s]
    "has_factors": "1:int", "free_modes": "1:int",  # 1 once there are factors; 1 to solve for modes in `couple_modes`
}  # fmt: skip
"""Shapes of the fields of `DormandPrinceState`. If no constraint acts on modal links, `free_modes` is 1."""
DormandPrinceState = namedtuple("DormandPrinceState", DORMAND_PRINCE_SHAPES)  # type: ignore[misc]
"""State of the explicit integrator and its work arrays."""


class DormandPrince(NamedTuple):
    """Data of the explicit integrator: a mechanism, order of elimination of [M G^T; G 0], work arrays, state."""

    tables: Tables
    order: Fronts
    work: Work
    state: DormandPrinceState
