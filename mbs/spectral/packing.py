"""A builder's lists, packed into the kernel's tables, and the sparsity pattern of a mechanism's matrices.

Matrices are sums of blocks, of constraints, forces, strips, modes and masses. A slot is a nonzero of the sum: one for each pair
of unknowns that are in a block together.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..geometry import Array
from .builder import Builder, ConstraintRow, ForceRow
from .tables import ForceKind, MeasureKind, StatefulData, StripKind, Tables


class Block(NamedTuple):
    """A small matrix: its unknowns, and its parts that may be nonzero, as ranges of rows and columns; all by default."""

    unknowns: Sequence[int] | Array
    parts: Sequence[tuple[slice, slice]] = ((slice(None), slice(None)),)


def _slots_of(blocks: Sequence[Block], unknowns: int) -> tuple[Array, ...]:
    """First five of `Tables`: blocks, members, slots, row, col. What is never filled has the slot after the last."""
    table = np.zeros((len(blocks), 3), dtype=np.int64)
    members: list[Array] = [np.empty(0, dtype=np.int64)]
    pairs: list[Array] = [np.empty(0, dtype=np.int64)]
    member, slot = 0, 0
    for number, block in enumerate(blocks):
        at = np.asarray(block.unknowns, dtype=np.int64)
        table[number] = member, len(at), slot
        pair = at[:, None] * unknowns + at
        filled = np.zeros(pair.shape, dtype=bool)
        for rows, columns in block.parts:
            filled[rows, columns] = True
        members.append(at)
        pairs.append(np.where(filled, pair, -1).ravel())
        member, slot = member + len(at), slot + len(at) ** 2
    found, slots = np.unique(np.concatenate(pairs), return_inverse=True)
    if len(found) and found[0] < 0:
        found, slots = found[1:], np.where(slots == 0, len(found) - 1, slots - 1)
    return table, np.concatenate(members), slots, *np.divmod(found, max(unknowns, 1))


def _blocks(builder: Builder) -> list[Block]:
    """Blocks of constraints, forces, strips, modal links, masses, in this order."""
    n = len(builder.q)
    rows = [_row_block(builder, row, n + r) for r, row in enumerate(builder.rows)]
    forces = [
        Block([*_places(builder, a), *_of_force(builder, force, b), *([n + force.row] if force.row >= 0 else [])])
        for force in builder.forces
        for a, b in [builder.measures[force.a][1:] if force.kind < ForceKind.JOURNAL else (force.a, force.b)]
    ]
    strips = [
        Block(builder.places[at : at + (3 if kind == StripKind.REISSNER else 2) * m]) for kind, m, _, at, _ in builder.strips
    ]
    modal = [Block(range(o, o + 3 + m)) for o, m, _ in builder.modal]
    return [*rows, *forces, *strips, *modal, *(Block(at) for at, _ in builder.masses)]


def _of_force(builder: Builder, force: ForceRow, marker: int) -> list[int]:
    """Coordinates of a force's second marker; of a force with states those of the markers of all."""
    count = int(force.numbers[StatefulData.STATES]) if force.kind == ForceKind.STATEFUL else 1
    return [place for each in range(marker, marker + count) for place in _places(builder, each)]


def _row_block(builder: Builder, row: ConstraintRow, unknown: int) -> Block:
    """Block of a constraint: its gradient, and second derivatives, which couple both markers if a direction turns."""
    unknowns: list[int] = []
    parts: list[tuple[slice, slice]] = []
    for number in row.measures:
        kind, a, b = builder.measures[number]
        begin, middle = len(unknowns), len(unknowns) + len(_places(builder, a))
        unknowns += [*_places(builder, a), *_places(builder, b)]
        whole, one, other = slice(begin, len(unknowns)), slice(begin, middle), slice(middle, len(unknowns))
        parts += [(whole, whole)] if kind in (MeasureKind.TURNING, MeasureKind.DISTANCE) else [(one, one), (other, other)]
    every, last = slice(0, len(unknowns)), slice(len(unknowns), None)
    return Block([*unknowns, unknown], (*parts, (every, last), (last, every)))


def _places(builder: Builder, marker: int) -> list[int]:
    """Coordinates that move a marker."""
    _, _, _, first, count, *_ = builder.markers[marker]
    return builder.places[first : first + count]


def pack(builder: Builder) -> Tables:
    """Pack all into tables; values of rows that are None are left 0 for the scene to fill."""
    n = len(builder.q)
    weight = np.zeros(n)
    for at, amount in builder.weights:
        np.add.at(weight, at, amount)
    blocks = _blocks(builder)
    table, members, slots, row, col = _slots_of(blocks, n + len(builder.rows))
    mass = np.zeros(len(row) + 1)
    for (_, count, first), (_, block) in zip(table[len(blocks) - len(builder.masses) :], builder.masses, strict=True):
        np.add.at(mass, slots[first : first + count**2], np.ravel(block))
    heavy = np.flatnonzero(mass)
    forces = [
        (f.kind, f.a, f.b, f.law, f.friction, f.row, builder.add_numbers([*f.numbers, *[0.0] * (8 - len(f.numbers))]))
        for f in builder.forces
    ]
    return Tables(
        *(table, members, slots, row, col),
        mass=mass,
        mass_first=np.searchsorted(row[heavy], np.arange(n + 1)),
        mass_col=col[heavy],
        mass_value=mass[heavy],
        weight=weight,
        modal=_whole(builder.modal, 3),
        strips=_whole(builder.strips, 5),
        markers=_whole(builder.markers, 7),
        places=np.array(builder.places, dtype=np.int64),
        measures=_whole(builder.measures, 3),
        directions=_real(builder.directions, 3),
        rows=_whole([(r.measure, r.motion, r.count) for r in builder.rows], 3),
        values=np.array([r.value or 0.0 for r in builder.rows], dtype=float),
        motions=_whole(builder.motions, 3),
        ramps=_real(builder.ramps, 3),
        forces=_whole(forces, 7),
        factors=np.ones(len(forces) + 1),
        time_factor=np.ones(1),
        elastic=_whole(builder.elastic, 7),
        laws=_whole(builder.laws, 4),
        law_numbers=_real(builder.law_numbers, 8),
        edges=np.empty((0, 2)),
        data=np.array(builder.data, dtype=float),
    )


def _whole(rows: Sequence[Sequence[float]], columns: int) -> Array:
    return np.array(rows, dtype=np.int64).reshape(-1, columns)


def _real(rows: Sequence[Sequence[float]], columns: int) -> Array:
    return np.array(rows, dtype=float).reshape(-1, columns)
