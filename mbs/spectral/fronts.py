"""Factors of a mechanism's matrices, front by front, compiled. See `elimination` for the order.

    [ P  U ]        P = L R,   U <- L^-1 U,   W <- W R^-1,   S <- S - W U.
    [ W  S ]

Among rows of constraints one that is weak on the diagonal gives way to the largest, with its column: where two rows say nearly
the same, as the pins of two bars do that are pinned twice, the better one is kept in every pose. Else they keep their order, as
a multiplier that is left out stays as it is guessed. A row's pivot of rounding counts as none: its multiplier is zero.
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
    """Add what is left of a front to the one that takes over."""
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
    """Eliminate a front's pivots; in place of each stands its reciprocal then."""
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
    """Let pivot c, where it is weak on the diagonal, change places with the largest, row and column; return that one's place."""
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
    """Let rows c and p of the front that begins at `at` change places."""
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
        if pivots == 1:  # as most are of rigid bodies: in place
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
