"""Multifrontal LU factors of a mechanism's matrices, compiled (Duff and Reid 1983, doi 10.1145/356044.356047).

A front is a small dense matrix whose first unknowns, the pivots, are eliminated, in the order of `elimination`. Its entries are
stored row by row in `factors`. With P those of the pivots, a front is

    [ P  U ]
    [ W  S ].

P is factored as L R, L with a unit diagonal. U is replaced by U' = L^-1 U, W by W' = W R^-1. S is replaced by the Schur
complement S - W' U', and this is added to the parent front. Within a front, rows are exchanged for the largest pivot of a column.
A constraint whose pivot is small is first exchanged with that of the largest pivot on the diagonal. So of two nearly redundant
constraints the better conditioned one is kept in every pose. A pivot below rounding counts as zero, and so does the multiplier of
its redundant constraint.

Local names: `first` is the index of a front's first unknown in `order.unknowns`, `at` that of its first entry in `factors`. The
rows of order.fronts have the columns `FrontColumn`. Nonzero order.slots[k] of the matrix is entry order.positions[k] of the
fronts.
"""

from typing import NamedTuple

from .compiling import kernel_function, view
from .elimination import FrontColumn, Fronts

ROUNDING = 1e-13
"""Ratio of a constraint's pivot to its `magnitude` below which the pivot is rounding. A pivot is a difference of terms; the
magnitude is the sum of their absolute values."""
BITS = 32
"""Bits of an entry of `swaps` that hold the row exchanged; those above hold the constraint. A shift is faster than a division."""


class EliminationOrders(NamedTuple):
    """Orders of elimination: of Newton's matrices, and of the saddle-point matrix of masses and constraints."""

    newton: Fronts
    mass: Fronts


@kernel_function
def factor(order, a, factors, swaps, magnitude):
    """Factor the matrix of nonzeros a (slots,): fill `factors` (entries of all fronts) and `swaps` (unknowns of all fronts)."""
    factors[:], magnitude[:] = 0.0, 0.0  # magnitude (unknowns,): sum of the terms of each constraint's diagonal, see `ROUNDING`
    for k in range(order.slots.size):
        factors[order.positions[k]] = a[order.slots[k]]
    for f in range(order.fronts.shape[0]):
        _eliminate_pivots(order, factors, swaps, magnitude, f)
        if order.fronts[f, FrontColumn.PARENT] >= 0:
            _add_to_parent(order, factors, magnitude, f)


@kernel_function
def _add_to_parent(order, factors, magnitude, f):
    """Add the Schur complement of front f, `count` rows and columns, to its parent front."""
    pivots, size, first, at, parent, in_parent, has_constraints = order.fronts[f]
    parent_size, parent_at = order.fronts[parent, FrontColumn.SIZE], order.fronts[parent, FrontColumn.ENTRIES]
    count = size - pivots
    target = view(order.in_parent, in_parent, count)  # indices of the later unknowns in the parent
    unknowns = view(order.unknowns, first + pivots, count)
    for i in range(count):
        row = view(factors, at + (pivots + i) * size + pivots, count)
        sums = view(factors, parent_at + target[i] * parent_size, parent_size)
        for j in range(count):
            sums[target[j]] += row[j]
        # row[i], on the diagonal, is a term of -G M^-1 G^T, M being the matrix of the coordinates. Terms from fronts of
        # constraints have the opposite sign and only reduce this sum, so they are not counted
        if has_constraints == 0:
            magnitude[unknowns[i]] += abs(row[i])


@kernel_function
def _eliminate_pivots(order, factors, swaps, magnitude, f):
    """Eliminate the pivots of front f; each is replaced by its reciprocal."""
    pivots, size, first, at, _, _, has_constraints = order.fronts[f]  # if it has constraints, all pivots are constraints
    for c in range(pivots):
        upper = view(factors, at + c * size, size)
        r = _exchange_small(order, factors, magnitude, f, c) if has_constraints > 0 else c  # constraint exchanged with c
        p, largest = c, abs(upper[c])  # row exchanged with c
        for i in range(c + 1, pivots):
            found = abs(factors[at + i * size + c])
            if found > largest:
                p, largest = i, found
        swaps[first + c] = (r << BITS) | p
        if p != c:
            _swap_rows(factors, at, size, c, p)
        # a redundant constraint gets zeros, also for the reciprocal: then its multiplier is 0
        if has_constraints > 0 and largest <= ROUNDING * magnitude[order.unknowns[first + c]]:
            for j in range(c, size):
                upper[j] = 0.0
            for i in range(c + 1, size):
                factors[at + i * size + c] = 0.0
            continue
        reciprocal, count = 1.0 / upper[c], size - c - 1
        upper[c] = reciprocal
        right = view(upper, c + 1, count)
        for i in range(c + 1, size):
            lower = view(factors, at + i * size + c, count + 1)
            factor = lower[0] * reciprocal
            lower[0] = factor
            below = view(lower, 1, count)
            for j in range(count):
                below[j] -= factor * right[j]


@kernel_function
def _exchange_small(order, factors, magnitude, f, c):
    """Exchange row and column c, if its pivot is small, with those of the largest on the diagonal; return their index, or c."""
    pivots, size, first, at, _, _, _ = order.fronts[f]
    r, pivot = c, abs(factors[at + c * (size + 1)])
    largest = pivot
    for i in range(c + 1, pivots):
        found = abs(factors[at + i * (size + 1)])
        if found > largest:
            r, largest = i, found
    if r == c or pivot > 1e-4 * largest:  # chosen: a pivot is smaller near singular poses only
        return c
    _swap_rows(factors, at, size, c, r)
    for i in range(size):
        k = at + i * size
        factors[k + c], factors[k + r] = factors[k + r], factors[k + c]
    u, v = order.unknowns[first + c], order.unknowns[first + r]
    magnitude[u], magnitude[v] = magnitude[v], magnitude[u]
    return r


@kernel_function
def _swap_rows(factors, at, size, c, p):
    """Exchange rows c and p of the front whose entries begin at `at`."""
    upper, other = view(factors, at + c * size, size), view(factors, at + p * size, size)
    for j in range(size):
        upper[j], other[j] = other[j], upper[j]


@kernel_function
def solve(order, factors, swaps, x, front):
    """Solve for x (unknowns,) in place; `front` is work of the largest front's size. Calls for each front would take long."""
    single = 0  # fronts of one unknown that meets no other come first
    while single < order.fronts.shape[0] and order.fronts[single, FrontColumn.SIZE] == 1:
        x[order.unknowns[order.fronts[single, FrontColumn.UNKNOWNS]]] *= factors[order.fronts[single, FrontColumn.ENTRIES]]
        single += 1
    for f in range(single, order.fronts.shape[0]):
        pivots, size, first, at, _, _, _ = order.fronts[f]
        unknowns, swap = view(order.unknowns, first, size), view(swaps, first, pivots)
        if pivots == 1:  # most fronts of rigid bodies
            for i in range(1, size):
                x[unknowns[i]] -= factors[at + i * size] * x[unknowns[0]]
            continue
        for i in range(size):
            front[i] = x[unknowns[i]]
        for c in range(pivots):
            r, p = swap[c] >> BITS, swap[c] & ((1 << BITS) - 1)  # constraint, then row exchanged with c
            front[c], front[r] = front[r], front[c]
            front[c], front[p] = front[p], front[c]
        for i in range(1, size):
            row, total = view(factors, at + i * size, size), front[i]
            for c in range(min(i, pivots)):  # columns of L in a row of pivots, all columns of W in the others
                total -= row[c] * front[c]
            front[i] = total
        for i in range(size):
            x[unknowns[i]] = front[i]
    for f in range(order.fronts.shape[0] - 1, single - 1, -1):
        pivots, size, first, at, _, _, _ = order.fronts[f]
        unknowns = view(order.unknowns, first, size)
        if pivots == 1:
            for j in range(1, size):
                x[unknowns[0]] -= factors[at + j] * x[unknowns[j]]
            x[unknowns[0]] *= factors[at]
            continue
        for i in range(size):
            front[i] = x[unknowns[i]]
        for c in range(pivots - 1, -1, -1):
            row, total = view(factors, at + c * size, size), front[c]
            for j in range(c + 1, size):
                total -= row[j] * front[j]
            front[c] = total * row[c]
        for c in range(pivots - 1, -1, -1):  # exchanges of constraints exchanged columns, too, and with them unknowns
            r = swaps[first + c] >> BITS
            front[c], front[r] = front[r], front[c]
        for c in range(pivots):
            x[unknowns[c]] = front[c]
