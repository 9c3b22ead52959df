"""Order of elimination of the unknowns of a mechanism's matrices by minimum degree: frontal matrices for `fronts`.

A constraint's multiplier is eliminated after all coordinates in it. Sources and reasons: docs/theory-spectral.md, matrices.
"""

from __future__ import annotations

from functools import lru_cache
from heapq import heapify, heappop, heappush
from typing import NamedTuple

import numpy as np

from ..geometry import Array


class Fronts(NamedTuple):
    """The order of elimination for the kernel.

    Columns of fronts: pivots; size; where its unknowns begin; where its matrix begins; the front that takes over what is left, or
    -1; where the places there of its later unknowns begin; 1 where its pivots are rows of constraints. Each comes before the one
    that takes over.
    """

    fronts: Array  # (fronts, 7)
    unknowns: Array  # of each front, its pivots first
    places: Array  # of each front's later unknowns in the front that takes over
    entries: Array  # of the matrix, front by front, (entries,)
    position: Array  # where they stand among those of all fronts, (entries,)

    @property
    def size(self) -> int:
        """Entries of all fronts."""
        return int((self.fronts[:, 1] ** 2).sum())

    @property
    def largest(self) -> int:
        """Size of the largest front."""
        return int(self.fronts[:, 1].max(initial=1))


class _Front(NamedTuple):
    """A front before numbering: its pivots, later unknowns, and whether its pivots are constraints."""

    pivots: list[int]
    later: list[int]
    row: bool


def fronts_of(row: Array, col: Array, coordinates: int, unknowns: int, filled: Array) -> Fronts:
    """Fronts for a matrix of `unknowns`, first `coordinates` and then constraints; cached for each pattern.

    Entries have a row and a column, and are `filled` if they may be nonzero; shape (slots,).
    """
    pattern = (np.ascontiguousarray(each).tobytes() for each in (row, col, filled))
    return _fronts_of(*pattern, coordinates, unknowns)


@lru_cache(maxsize=256)
def _fronts_of(rows: bytes, cols: bytes, fills: bytes, coordinates: int, unknowns: int) -> Fronts:
    row, col = (np.frombuffer(each, dtype=np.int64) for each in (rows, cols))
    entries = np.flatnonzero(np.frombuffer(fills, dtype=bool))
    row, col = row[entries], col[entries]
    made = _eliminate(*_groups(row, col, coordinates, unknowns), coordinates)
    order = np.empty(unknowns, dtype=np.int64)
    order[[u for front in made for u in front.pivots]] = np.arange(unknowns)
    owner = np.repeat(np.arange(len(made)), [len(front.pivots) for front in made])[order]
    members: list[int] = []
    places: list[int] = []
    table, size = np.zeros((len(made), 7), dtype=np.int64), 0
    local = np.full(unknowns, -1, dtype=np.int64)
    home = np.minimum(owner[row], owner[col])
    turn = np.argsort(home, kind="stable")
    entries, row, col, home = entries[turn], row[turn], col[turn], home[turn]
    position, bounds = np.empty(len(entries), dtype=np.int64), np.searchsorted(home, np.arange(len(made) + 1))
    for k, front in enumerate(made):
        later = sorted(front.later, key=order.__getitem__)
        own = [*front.pivots, *later]
        table[k] = len(front.pivots), len(own), len(members), size, owner[later[0]] if later else -1, len(places), front.row
        local[own] = np.arange(len(own))
        here = slice(bounds[k], bounds[k + 1])
        position[here] = size + local[row[here]] * len(own) + local[col[here]]
        members += own
        places += later
        size += len(own) ** 2
    for pivots, wide, _, _, parent, at, _ in table[table[:, 4] >= 0]:
        first, large = table[parent, 2], table[parent, 1]
        local[members[first : first + large]] = np.arange(large)
        here = slice(at, at + wide - pivots)
        places[here] = local[places[here]].tolist()
    whole = np.array(members, dtype=np.int64), np.array(places, dtype=np.int64)
    return Fronts(table, *whole, entries, position)


def _groups(row: Array, col: Array, coordinates: int, unknowns: int) -> tuple[list[list[int]], list[set[int]]]:
    """Groups of unknowns with the same neighbours in the matrix, and the neighbouring groups of each."""
    near: list[set[int]] = [set() for _ in range(unknowns)]
    for i, j in zip(row.tolist(), col.tolist(), strict=True):
        near[i].add(j)
        near[j].add(i)
    found: dict[object, int] = {}
    groups: list[list[int]] = []
    of = [0] * unknowns
    for u in range(unknowns):
        if u < coordinates:
            near[u].add(u)
        else:
            near[u].discard(u)
        key = u < coordinates, frozenset(near[u])
        of[u] = found.setdefault(key, len(groups))
        if of[u] == len(groups):
            groups.append([])
        groups[of[u]].append(u)
    meets = [{of[v] for v in near[members[0]]} - {g} for g, members in enumerate(groups)]
    return groups, meets


def _eliminate(groups: list[list[int]], meets: list[set[int]], coordinates: int) -> list[_Front]:
    """Fronts, one for each group, in the order of elimination."""
    weight = [len(members) for members in groups]
    row = [members[0] >= coordinates for members in groups]
    waits = [sum(not row[m] for m in meets[g]) if row[g] else 0 for g in range(len(groups))]
    held = [[m for m in meets[g] if row[m]] if not row[g] else [] for g in range(len(groups))]
    heap = [(sum(weight[m] for m in meets[g]), g) for g in range(len(groups)) if not waits[g]]
    heapify(heap)
    done, out = [False] * len(groups), []
    while heap:
        degree, g = heappop(heap)
        if done[g] or degree != sum(weight[m] for m in meets[g]):
            continue
        done[g] = True
        out.append(_Front(groups[g], [u for m in meets[g] for u in groups[m]], row[g]))
        for m in held[g]:
            waits[m] -= 1
        for m in meets[g]:
            meets[m] |= meets[g]
            meets[m] -= {g, m}
        for m in (*meets[g], *held[g]):
            if not waits[m] and not done[m]:
                heappush(heap, (sum(weight[k] for k in meets[m]), m))
    return out
