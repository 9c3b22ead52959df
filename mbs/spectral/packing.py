"""Packing of a builder's lists into the kernel's tables, with the sparsity pattern of a mechanism's matrices.

Unknowns are the n coordinates and r multipliers. A matrix is the sum of blocks: small matrices of constraints, forces, strips,
modal links and masses. A slot is a nonzero of the sum: a pair of unknowns that a block couples. All matrices have the same slots.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..geometry import Array
from ..laws.table import CODES, NUMBERS
from . import tables
from .builder import Builder, ConstraintRow
from .tables import ForceKind, MeasureKind, StatefulData, StripKind, Tables


class Block(NamedTuple):
    """Small matrix of a few unknowns."""

    unknowns: Sequence[int] | Array
    parts: Sequence[tuple[slice, slice]] = ((slice(None), slice(None)),)  # rows and columns that may be nonzero; all by default


def _number_slots(blocks: Sequence[Block], unknowns: int) -> dict[str, Array]:
    """Number the slots, and one place more for all entries that are always zero; return the first five fields of `Tables`."""
    unknowns_of_blocks = [np.asarray(block.unknowns, dtype=np.int64) for block in blocks]
    widths = np.array([len(own) for own in unknowns_of_blocks], dtype=np.int64)
    table = np.column_stack([np.cumsum(widths) - widths, widths, np.cumsum(widths**2) - widths**2])  # columns of `BlockColumn`
    pairs = [np.empty(0, dtype=np.int64)]  # row and column of each entry as one integer
    always_zero = unknowns**2  # larger than all pairs
    for own, block in zip(unknowns_of_blocks, blocks, strict=True):
        pair = own[:, None] * unknowns + own
        filled = np.zeros(pair.shape, dtype=bool)
        for rows, columns in block.parts:
            filled[rows, columns] = True
        pairs.append(np.where(filled, pair, always_zero).ravel())
    found, slots = np.unique(np.concatenate(pairs), return_inverse=True)  # pairs[i] is found[slots[i]]
    row, col = np.divmod(found[found < always_zero], max(unknowns, 1))
    block_unknowns = np.concatenate([np.empty(0, dtype=np.int64), *unknowns_of_blocks])
    return {"blocks": table, "block_unknowns": block_unknowns, "slots": slots, "row": row, "col": col}


def _list_blocks(builder: Builder) -> list[Block]:
    """List the blocks of constraints, forces, strips, modal links, masses, in this order, with their unknowns."""
    n = len(builder.q)
    rows = [_build_row_block(builder, row, n + r) for r, row in enumerate(builder.rows)]
    forces = []
    for force in builder.forces:
        if force.kind < ForceKind.JOURNAL:  # along a measure, as all kinds before this one
            markers = [builder.measures[force.a].a, builder.measures[force.a].b]
        elif force.kind == ForceKind.STATEFUL:  # at marker a; each state is the spin of a marker of its own, from b on
            markers = [force.a, *range(force.b, force.b + int(builder.data[force.numbers + StatefulData.STATES]))]
        else:
            markers = [force.a, force.b]
        unknowns = [dof for marker in markers for dof in _list_dofs(builder, marker)]
        if force.row >= 0:  # friction: the multiplier of the constraint whose reaction is its normal force
            unknowns.append(n + force.row)
        forces.append(Block(unknowns))
    strips = []
    for kind, functions, _, first, *_ in builder.strips:  # `StripColumn`; `functions`: basis functions of each field
        fields = 3 if kind == StripKind.REISSNER else 2  # x, y and, with shear, the angle
        strips.append(Block(builder.dofs[first : first + fields * functions]))
    modal = [Block(range(first, first + 3 + modes)) for first, modes, _ in builder.modal]  # x, y, angle of the frame, then modes
    return [*rows, *forces, *strips, *modal, *(Block(dofs) for dofs, _ in builder.masses)]


def _build_row_block(builder: Builder, row: ConstraintRow, multiplier: int) -> Block:
    """Build the block of a constraint: its gradient, and second derivatives, which couple both markers if the direction turns."""
    unknowns: list[int] = []
    parts: list[tuple[slice, slice]] = []
    for number in row.measures:
        measure = builder.measures[number]
        of_marker_a = _list_dofs(builder, measure.a)
        begin, middle = len(unknowns), len(unknowns) + len(of_marker_a)
        unknowns += [*of_marker_a, *_list_dofs(builder, measure.b)]
        both, of_a, of_b = slice(begin, len(unknowns)), slice(begin, middle), slice(middle, len(unknowns))
        parts += [(both, both)] if measure.kind in (MeasureKind.TURNING, MeasureKind.DISTANCE) else [(of_a, of_a), (of_b, of_b)]
    coordinates, last = slice(0, len(unknowns)), slice(len(unknowns), None)
    return Block([*unknowns, multiplier], (*parts, (coordinates, last), (last, coordinates)))


def _list_dofs(builder: Builder, marker: int) -> list[int]:
    row = builder.markers[marker]
    return builder.dofs[row.first : row.first + row.dof_count]


def pack(builder: Builder) -> Tables:
    """Pack a builder's lists into tables."""
    n = len(builder.q)
    weight = np.zeros(n)
    for dofs, amounts in builder.weights:
        np.add.at(weight, dofs, amounts)
    blocks = _list_blocks(builder)
    pattern = _number_slots(blocks, n + len(builder.rows))
    first_mass = len(blocks) - len(builder.masses)  # blocks of masses are the last
    mass = np.zeros(len(pattern["row"]) + 1)
    for (_, width, entries), (_, block) in zip(pattern["blocks"][first_mass:], builder.masses, strict=True):
        np.add.at(mass, pattern["slots"][entries : entries + width**2], np.ravel(block))
    nonzero = np.flatnonzero(mass)
    return Tables(
        **pattern,
        mass=mass,
        mass_first=np.searchsorted(pattern["row"][nonzero], np.arange(n + 1)),  # compressed rows, as slots are sorted by row
        mass_col=pattern["col"][nonzero],
        mass_value=mass[nonzero],
        weight=weight,
        modal=_build_table(builder.modal, len(tables.Modal)),
        strips=_build_table(builder.strips, len(tables.StripColumn)),
        markers=_build_table(builder.markers, len(tables.Markers)),
        dofs=np.array(builder.dofs, dtype=np.int64),
        measures=_build_table([(m.kind, m.a, m.b) for m in builder.measures], len(tables.Measures)),
        measure_numbers=_build_table([(*m.direction, m.factor) for m in builder.measures], len(tables.MeasureNumber), float),
        rows=_build_table([(r.measures.start, r.motion, len(r.measures)) for r in builder.rows], len(tables.RowColumn)),
        # a value of None is that at t = 0, which `CompiledScene.of` computes from these tables
        values=np.array([r.value or 0.0 for r in builder.rows], dtype=float),
        forces=_build_table([columns for _name, *columns in builder.forces], len(tables.Forces)),
        factors=np.ones(len(builder.forces) + 1),  # of each force, the last of gravity; statics varies them
        time_factor=np.ones(1),  # of the time in functions of time; statics varies it
        elastic=_build_table(builder.elastic, len(tables.Elastic)),
        laws=_build_table(builder.laws, CODES),
        law_numbers=_build_table(builder.law_numbers, NUMBERS, float),
        edges=np.empty((0, 2)),  # force, value of its measure at a jump or kink; an implicit run adds those that are known
        data=np.array(builder.data, dtype=float),
    )


def _build_table(rows: Sequence[Sequence[float]], columns: int, kind: type = np.int64) -> Array:
    return np.array(rows, dtype=kind).reshape(-1, columns)
