"""Order of elimination of the unknowns of a mechanism's matrices by minimum degree: fronts for the multifrontal `fronts`.

Unknowns are coordinates, then constraints, for their multipliers. A constraint is eliminated after all its coordinates. Sources
and reasons: docs/theory-spectral.md, matrices.
"""

from enum import IntEnum
from functools import lru_cache
from heapq import heapify, heappop, heappush
from typing import NamedTuple

import numpy as np

from ..geometry import Array

FrontColumn = IntEnum("FrontColumn", "PIVOTS SIZE UNKNOWNS ENTRIES PARENT PLACES CONSTRAINTS", start=0)
"""Columns of the table of fronts: number of pivots; number of unknowns; index of its first unknown in `Fronts.unknowns`; index of
its first entry among those of all fronts; parent, or -1; index of its first place in `Fronts.places`; 1 if its pivots are
constraints."""


class Fronts(NamedTuple):
    """Order of elimination for the kernel: fronts, small dense matrices, in which pivots are eliminated."""

    fronts: Array  # (fronts, 7), columns of `FrontColumn`; a front stands before its parent
    unknowns: Array  # unknowns of each front, its pivots first
    places: Array  # of each front's unknowns after its pivots: their indices among the unknowns of its parent
    entries: Array  # nonzeros of the matrix, front by front, (entries,)
    position: Array  # index of each among the entries of all fronts, (entries,)

    @property
    def size(self) -> int:
        """Number of entries of all fronts."""
        return int((self.fronts[:, FrontColumn.SIZE] ** 2).sum())

    @property
    def largest(self) -> int:
        """Size of the largest front."""
        return int(self.fronts[:, FrontColumn.SIZE].max(initial=1))


class _Front(NamedTuple):
    """Front by the numbers of its unknowns, before its places in its parent are known."""

    pivots: list[int]
    later: list[int]  # its unknowns that are eliminated in other fronts
    has_constraints: bool  # all pivots are constraints, else none


def fronts_of(row: Array, col: Array, coordinates: int, unknowns: int, filled: Array) -> Fronts:
    """Return the fronts of a matrix with so many `unknowns`, of which the first are its `coordinates`, the others constraints.

    The nonzeros of the matrix are its slots (row, col), arrays (slots,), where `filled` (slots,) is true.
    """
    pattern = (np.ascontiguousarray(each).tobytes() for each in (row, col, filled))
    return _build_fronts(*pattern, coordinates, unknowns)


@lru_cache(maxsize=256)
def _build_fronts(rows: bytes, cols: bytes, fills: bytes, coordinates: int, unknowns: int) -> Fronts:
    """Number the fronts and place the nonzeros in them; cached for each pattern."""
    row, col = (np.frombuffer(each, dtype=np.int64) for each in (rows, cols))
    entries = np.flatnonzero(np.frombuffer(fills, dtype=bool))
    row, col = row[entries], col[entries]
    fronts = _eliminate(*_group_unknowns(row, col, coordinates, unknowns), coordinates)
    order = np.empty(unknowns, dtype=np.int64)  # place of each unknown in the order of elimination
    order[[u for front in fronts for u in front.pivots]] = np.arange(unknowns)
    owner = np.repeat(np.arange(len(fronts)), [len(front.pivots) for front in fronts])[order]  # front that eliminates it
    members: list[int] = []
    places: list[int] = []
    table, size = np.zeros((len(fronts), len(FrontColumn)), dtype=np.int64), 0
    local = np.full(unknowns, -1, dtype=np.int64)  # index of each unknown in the front at hand
    home = np.minimum(owner[row], owner[col])  # front in which a nonzero is eliminated
    by_front = np.argsort(home, kind="stable")
    entries, row, col, home = entries[by_front], row[by_front], col[by_front], home[by_front]
    position, bounds = np.empty(len(entries), dtype=np.int64), np.searchsorted(home, np.arange(len(fronts) + 1))
    for k, front in enumerate(fronts):
        later = sorted(front.later, key=order.__getitem__)
        unknowns_here = [*front.pivots, *later]
        count = len(unknowns_here)
        parent = owner[later[0]] if later else -1
        table[k] = len(front.pivots), count, len(members), size, parent, len(places), front.has_constraints
        local[unknowns_here] = np.arange(count)
        here = slice(bounds[k], bounds[k + 1])
        position[here] = size + local[row[here]] * count + local[col[here]]
        members += unknowns_here
        places += later
        size += count**2
    for pivots, count, _, _, parent, at, _ in table[table[:, FrontColumn.PARENT] >= 0]:
        first, large = table[parent, FrontColumn.UNKNOWNS], table[parent, FrontColumn.SIZE]
        local[members[first : first + large]] = np.arange(large)
        here = slice(at, at + count - pivots)
        places[here] = local[places[here]].tolist()
    return Fronts(table, np.array(members, dtype=np.int64), np.array(places, dtype=np.int64), entries, position)


def _group_unknowns(row: Array, col: Array, coordinates: int, unknowns: int) -> tuple[list[list[int]], list[set[int]]]:
    """Return the groups of unknowns with the same nonzeros in the matrix, and the set of neighbouring groups of each."""
    neighbours: list[set[int]] = [set() for _ in range(unknowns)]
    for i, j in zip(row.tolist(), col.tolist(), strict=True):
        neighbours[i].add(j)
        neighbours[j].add(i)
    group_of_key: dict[object, int] = {}
    groups: list[list[int]] = []
    group_of = [0] * unknowns
    for u in range(unknowns):
        is_coordinate = u < coordinates
        if is_coordinate:  # its own neighbour, so that coordinates which are all coupled have equal sets
            neighbours[u].add(u)
        else:  # constraints are not coupled, so those on equal coordinates have equal sets without themselves
            neighbours[u].discard(u)
        key = is_coordinate, frozenset(neighbours[u])
        group_of[u] = group_of_key.setdefault(key, len(groups))
        if group_of[u] == len(groups):
            groups.append([])
        groups[group_of[u]].append(u)
    adjacent = [{group_of[v] for v in neighbours[members[0]]} - {g} for g, members in enumerate(groups)]
    return groups, adjacent


def _eliminate(groups: list[list[int]], adjacent: list[set[int]], coordinates: int) -> list[_Front]:
    """Return the fronts, one for each group, by minimum degree, constraints after their coordinates; overwrite `adjacent`."""
    size, is_constraint = [len(members) for members in groups], [members[0] >= coordinates for members in groups]
    # waiting: number of groups of coordinates to eliminate before a constraint; constraints: those on a group of coordinates
    waiting = [sum(not is_constraint[m] for m in adjacent[g]) if is_constraint[g] else 0 for g in range(len(groups))]
    constraints = [[] if is_constraint[g] else [m for m in adjacent[g] if is_constraint[m]] for g in range(len(groups))]

    def degree(group: int) -> int:
        """Count the unknowns that are neighbours of a group."""
        return sum(size[m] for m in adjacent[group])

    heap = [(degree(g), g) for g in range(len(groups)) if not waiting[g]]
    heapify(heap)
    done, fronts = [False] * len(groups), []
    while heap:
        known_degree, g = heappop(heap)
        if done[g] or known_degree != degree(g):  # pushed again since with its present degree
            continue
        done[g] = True
        fronts.append(_Front(groups[g], [u for m in adjacent[g] for u in groups[m]], is_constraint[g]))
        for m in constraints[g]:
            waiting[m] -= 1
        for m in adjacent[g]:
            adjacent[m] |= adjacent[g]
            adjacent[m] -= {g, m}
        for m in (*adjacent[g], *constraints[g]):
            if not waiting[m] and not done[m]:
                heappush(heap, (degree(m), m))
    return fronts
