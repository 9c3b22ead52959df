"""Order of elimination of a mechanism's unknowns by minimum degree, as fronts: small matrices, which the module `fronts` factors.

Unknowns are coordinates, then constraints, for their multipliers. A constraint is eliminated after all coordinates in its own
equation. Sources and reasons: docs/theory-spectral.md, matrices.
"""

from enum import IntEnum
from functools import lru_cache
from heapq import heapify, heappop, heappush
from typing import NamedTuple

import numpy as np

from ..geometry import Array

FrontColumn = IntEnum("FrontColumn", "PIVOTS SIZE UNKNOWNS ENTRIES PARENT IN_PARENT CONSTRAINTS", start=0)
"""Columns of the table of fronts: number of pivots; number of unknowns; index of its first unknown in `Fronts.unknowns`; index of
its first entry among those of all fronts; parent, or -1; index of its first number in `Fronts.in_parent`; 1 if its pivots are
constraints."""


class Fronts(NamedTuple):
    """Order of elimination for the kernel: fronts, small dense matrices, in which pivots are eliminated."""

    fronts: Array  # (fronts, 7), columns of `FrontColumn`; a front stands before its parent
    unknowns: Array  # unknowns of each front, its pivots first
    in_parent: Array  # for each unknown of a front after its pivots: its index among the unknowns of the parent
    slots: Array  # (nonzeros,): slot of each nonzero of the matrix, its index in the arrays row and col of all slots
    positions: Array  # (nonzeros,): index of the same nonzero among the entries of all fronts

    @property
    def size(self) -> int:
        """Number of entries of all fronts."""
        return int((self.fronts[:, FrontColumn.SIZE] ** 2).sum())

    @property
    def largest(self) -> int:
        """Size of the largest front."""
        return int(self.fronts[:, FrontColumn.SIZE].max(initial=1))


def fronts_of(row: Array, col: Array, coordinates: int, unknowns: int, filled: Array) -> Fronts:
    """Return the fronts of a matrix with slots at row, col (slots,), of which the `filled` are nonzero; coordinates are first."""
    return _build_fronts(np.array([row, col, filled], dtype=np.int64).tobytes(), coordinates, unknowns)


@lru_cache(maxsize=256)
def _build_fronts(pattern: bytes, coordinates: int, unknowns: int) -> Fronts:
    """Number the fronts and place the nonzeros in them; cached for each pattern (row, col, filled), given as bytes."""
    row, col, filled = np.frombuffer(pattern, dtype=np.int64).reshape(3, -1)
    slots = np.flatnonzero(filled)
    row, col = row[slots], col[slots]
    fronts = _eliminate(*_group_unknowns(row, col, coordinates, unknowns), coordinates)
    rank = np.empty(unknowns, dtype=np.int64)  # of each unknown in the order of elimination
    rank[[u for pivots, _ in fronts for u in pivots]] = np.arange(unknowns)
    front_by_rank = np.repeat(np.arange(len(fronts)), [len(pivots) for pivots, _ in fronts])
    owner = front_by_rank[rank]  # front that eliminates an unknown
    members = [[*pivots, *sorted(later, key=rank.__getitem__)] for pivots, later in fronts]  # unknowns of each front
    index = [{u: i for i, u in enumerate(each)} for each in members]  # of each unknown in its front
    table, first_unknown, first_entry = np.zeros((len(fronts), len(FrontColumn)), dtype=np.int64), 0, 0
    in_parent: list[int] = []
    for k, ((pivots, _), each) in enumerate(zip(fronts, members, strict=True)):
        later = each[len(pivots) :]
        parent = owner[later[0]] if later else -1  # this elimination couples the later unknowns: the parent has them all
        has_constraints = pivots[0] >= coordinates  # all pivots are constraints, or none
        table[k] = len(pivots), len(each), first_unknown, first_entry, parent, len(in_parent), has_constraints
        in_parent += [index[parent][u] for u in later]
        first_unknown, first_entry = first_unknown + len(each), first_entry + len(each) ** 2
    home = np.minimum(owner[row], owner[col])  # front of a nonzero: the one that eliminates the first of its two unknowns
    nonzeros = zip(home.tolist(), row.tolist(), col.tolist(), strict=True)
    cells = [index[k][i] * len(members[k]) + index[k][j] for k, i, j in nonzeros]  # in its front, row by row
    positions = table[home, FrontColumn.ENTRIES] + np.array(cells, dtype=np.int64)
    by_position = np.argsort(positions)
    all_members = np.array([u for each in members for u in each], dtype=np.int64)
    return Fronts(table, all_members, np.array(in_parent, dtype=np.int64), slots[by_position], positions[by_position])


def _group_unknowns(row: Array, col: Array, coordinates: int, unknowns: int) -> tuple[list[list[int]], list[set[int]]]:
    """Return the groups of unknowns with the same nonzeros in the matrix, and the set of neighbouring groups of each."""
    neighbours: list[set[int]] = [set() for _ in range(unknowns)]
    for i, j in zip(row.tolist(), col.tolist(), strict=True):
        neighbours[i].add(j)
        neighbours[j].add(i)
    groups_by_key: dict[object, list[int]] = {}
    for u in range(unknowns):
        is_coordinate = u < coordinates
        if is_coordinate:  # with itself in its set: mutually coupled coordinates have equal sets, and form one group
            neighbours[u].add(u)
        else:  # without itself: constraints are not coupled with each other, but those on the same coordinates form one group
            neighbours[u].discard(u)
        groups_by_key.setdefault((is_coordinate, frozenset(neighbours[u])), []).append(u)
    groups = list(groups_by_key.values())
    group_of = {u: g for g, members in enumerate(groups) for u in members}
    adjacent = [{group_of[v] for v in neighbours[members[0]]} - {g} for g, members in enumerate(groups)]
    return groups, adjacent


def _eliminate(groups: list[list[int]], adjacent: list[set[int]], coordinates: int) -> list[tuple[list[int], list[int]]]:
    """Return pivots, and unknowns that later fronts eliminate, of a front for each group, by minimum degree."""
    size, is_constraint = [len(members) for members in groups], [members[0] >= coordinates for members in groups]
    # waiting: number of groups of coordinates in a constraint's own equation, which are eliminated before the constraint, without
    # those that become its neighbours by elimination; constraints: constraints on a group of coordinates
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
        if done[g] or known_degree != degree(g):  # an outdated entry: a group whose degree changes is pushed again below
            continue
        done[g] = True
        fronts.append((groups[g], [u for m in adjacent[g] for u in groups[m]]))
        for m in constraints[g]:
            waiting[m] -= 1
        for m in adjacent[g]:
            adjacent[m] |= adjacent[g]
            adjacent[m] -= {g, m}
        for m in adjacent[g]:
            if not waiting[m] and not done[m]:
                heappush(heap, (degree(m), m))
    return fronts
