"""Where the entries of a mechanism's matrices stand: a sum of small matrices, of constraints, forces, strips, modes and masses.

Each is a block: the unknowns it is about, coordinates and then multipliers. Its entries go to slots, one for each pair of
unknowns that meet anywhere. Mass, damping and stiffness, and the constraints' rows and columns, share them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from buckler.mbs.geometry import Array


class Block(NamedTuple):
    """A small matrix: its unknowns, and which parts of it may be filled, as ranges of rows and columns; all by default."""

    unknowns: Sequence[int] | Array
    parts: Sequence[tuple[slice, slice]] = ((slice(None), slice(None)),)


class Sparsity(NamedTuple):
    """Slots of all blocks.

    Attributes
    ----------
    blocks : array of int, shape (blocks, 3)
        Where its unknowns begin and how many, where its slots begin, row by row.
    members : array of int
        Unknowns.
    slots : array of int
        What is never filled has the one after the last.
    row, col : array of int, shape (slots,)
    """

    blocks: Array
    members: Array
    slots: Array
    row: Array
    col: Array

    def add(self, block: int, entries: Array, values: Array) -> None:
        """Add a block's entries, (count, count), to values (slots + 1,)."""
        _, count, first = self.blocks[block]
        np.add.at(values, self.slots[first : first + count**2], np.ravel(entries))


def sparsity_of(blocks: Sequence[Block], unknowns: int) -> Sparsity:
    """Slots for blocks."""
    table = np.zeros((len(blocks), 3), dtype=np.int64)
    members: list[Array] = [np.empty(0, dtype=np.int64)]
    pairs: list[Array] = [np.empty(0, dtype=np.int64)]
    member, slot = 0, 0
    for k, block in enumerate(blocks):
        at = np.asarray(block.unknowns, dtype=np.int64)
        table[k] = member, len(at), slot
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
    return Sparsity(table, np.concatenate(members), slots, *np.divmod(found, max(unknowns, 1)))
