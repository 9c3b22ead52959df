"""Multifrontal LU factors of a mechanism's matrices, compiled. See `elimination` for the order.

    [ P  U ]        P = L R,   U <- L^-1 U,   W <- W R^-1,   S <- S - W U.
    [ W  S ]

A constraint whose pivot is small is exchanged, row and column, with that of the largest: of two nearly redundant constraints, as
of two bars pinned together twice, the better conditioned one is then kept in every pose. Otherwise the order is kept, as the
multiplier of a redundant constraint stays at its guess. A pivot below rounding counts as zero, and so is its multiplier.
"""

from __future__ import annotations

from typing import NamedTuple

from .compiling import draft, view
from .elimination import Fronts

ROUNDED = 1e-13
"""A row's pivot below this share of what it is a difference of is rounding."""
WEAK = 1e-4
"""Share of the largest of the diagonal below which a row's pivot gives way: rows change their order near singular poses alone."""


BITS = 32
"""Bits of a swap that hold its second place; those above hold the first. A shift is quicker than a division."""


class Orders(NamedTuple):
    """Orders of elimination: of Newton's matrices, and of mass matrix and constraints alone."""

    newton: Fronts
    mass: Fronts


@draft
def factor(order, a, factors, swaps, amount):
    """Factor the matrix of entries a (slots,): fill factors (entries of fronts) and swaps (unknowns of fronts)."""
    factors[:], amount[:] = 0.0, 0.0
    for k in range(order.entries.size):
        factors[order.position[k]] = a[order.entries[k]]
    for f in range(order.fronts.shape[0]):
        _eliminate(order, factors, swaps, amount, f)
        if order.fronts[f, 4] >= 0:
            _hand_over(order, factors, amount, f)


@draft
def _hand_over(order, factors, amount, f):
    """Add the Schur complement of a front to its parent front."""
    pivots, size, first, at, parent, places, row = order.fronts[f]
    large, start, count = order.fronts[parent, 1], order.fronts[parent, 3], size - pivots
    to, unknowns = view(order.places, places, count), view(order.unknowns, first + pivots, count)
    for i in range(count):
        left, sum = view(factors, at + (pivots + i) * size + pivots, count), view(factors, start + to[i] * large, large)
        for j in range(count):
            sum[to[j]] += left[j]
        if row == 0:
            amount[unknowns[i]] += abs(left[i])


@draft
def _eliminate(order, factors, swaps, amount, f):
    """Eliminate a front's pivots; each is replaced by its reciprocal."""
    pivots, size, first, at = order.fronts[f, 0], order.fronts[f, 1], order.fronts[f, 2], order.fronts[f, 3]
    row = order.fronts[f, 6]
    for c in range(pivots):
        upper = view(factors, at + c * size, size)
        r = _bring_strong(order, factors, amount, f, c) if row > 0 else c
        p, largest = c, abs(upper[c])
        for i in range(c + 1, pivots):
            found = abs(factors[at + i * size + c])
            if found > largest:
                p, largest = i, found
        swaps[first + c] = (r << BITS) | p
        if p != c:
            _swap_rows(factors, at, size, c, p)
        if row > 0 and largest <= ROUNDED * amount[order.unknowns[first + c]]:
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
            share = lower[0] * reciprocal
            lower[0] = share
            below = view(lower, 1, count)
            for j in range(count):
                below[j] -= share * right[j]


@draft
def _bring_strong(order, factors, amount, f, c):
    """Exchange pivot c, if it is small, with the largest on the diagonal, row and column; return the place of that."""
    pivots, size, first, at = order.fronts[f, 0], order.fronts[f, 1], order.fronts[f, 2], order.fronts[f, 3]
    r, here = c, abs(factors[at + c * (size + 1)])
    largest = here
    for i in range(c + 1, pivots):
        found = abs(factors[at + i * (size + 1)])
        if found > largest:
            r, largest = i, found
    if r == c or here > WEAK * largest:
        return c
    _swap_rows(factors, at, size, c, r)
    for i in range(size):
        k = at + i * size
        factors[k + c], factors[k + r] = factors[k + r], factors[k + c]
    u, v = order.unknowns[first + c], order.unknowns[first + r]
    amount[u], amount[v] = amount[v], amount[u]
    return r


@draft
def _swap_rows(factors, at, size, c, p):
    """Exchange rows c and p of the front that begins at `at`."""
    upper, other = view(factors, at + c * size, size), view(factors, at + p * size, size)
    for j in range(size):
        upper[j], other[j] = other[j], upper[j]


@draft
def solve(order, factors, swaps, x, room):
    """Solve in place for x (unknowns,), with room for the largest front."""
    lone = 0
    while lone < order.fronts.shape[0] and order.fronts[lone, 1] == 1:
        x[order.unknowns[order.fronts[lone, 2]]] *= factors[order.fronts[lone, 3]]
        lone += 1
    for f in range(lone, order.fronts.shape[0]):
        pivots, size, first, at = order.fronts[f, 0], order.fronts[f, 1], order.fronts[f, 2], order.fronts[f, 3]
        unknowns, swap = view(order.unknowns, first, size), view(swaps, first, pivots)
        if pivots == 1:  # as most of rigid bodies
            for i in range(1, size):
                x[unknowns[i]] -= factors[at + i * size] * x[unknowns[0]]
            continue
        for i in range(size):
            room[i] = x[unknowns[i]]
        for c in range(pivots):
            r, p = swap[c] >> BITS, swap[c] & ((1 << BITS) - 1)
            room[c], room[r] = room[r], room[c]
            room[c], room[p] = room[p], room[c]
        for i in range(1, size):
            row, total = view(factors, at + i * size, size), room[i]
            for c in range(min(i, pivots)):
                total -= row[c] * room[c]
            room[i] = total
        for i in range(size):
            x[unknowns[i]] = room[i]
    for f in range(order.fronts.shape[0] - 1, lone - 1, -1):
        pivots, size, first, at = order.fronts[f, 0], order.fronts[f, 1], order.fronts[f, 2], order.fronts[f, 3]
        unknowns = view(order.unknowns, first, size)
        if pivots == 1:
            for j in range(1, size):
                x[unknowns[0]] -= factors[at + j] * x[unknowns[j]]
            x[unknowns[0]] *= factors[at]
            continue
        for i in range(size):
            room[i] = x[unknowns[i]]
        for c in range(pivots - 1, -1, -1):
            row, total = view(factors, at + c * size, size), room[c]
            for j in range(c + 1, size):
                total -= row[j] * room[j]
            room[c] = total * row[c]
        for c in range(pivots - 1, -1, -1):
            r = swaps[first + c] >> BITS
            room[c], room[r] = room[r], room[c]
        for c in range(pivots):
            x[unknowns[c]] = room[c]
