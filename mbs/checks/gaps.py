"""Gaps of joints, guides and couplings along a run: all their constraints, whether a solver kept them or not."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..elements.element import GROUND
from ..geometry import Array
from ..record.record import Record
from ..record.result import Result
from ..record.run import Run
from ..scene.linkage import Linkage
from ..scene.scene import Scene
from .check import check

GAP = 1e-5
"""Largest gap, over the longest link, or rad: a hundred times what the coarsest steps leave, a hundredth of what one sees."""


def _rigid_rows(linkage: Linkage, record: Record) -> tuple[list[int], list[int]]:
    """Rigid links that were recorded, and lasting rows that hold these and the ground alone, without those of drives."""
    rigid = [i for i, link in enumerate(linkage.mechanism.links) if not link.body.flexible and link.name in record.links]
    among = {GROUND, *(linkage.mechanism.links[i].name for i in rigid)}
    rows = [(k, linkage.named_rows[k][1]) for k in linkage.lasting]
    return rigid, [k for k, row in rows if row.motion is None and row.bodies <= among]


def gaps(linkage: Linkage, record: Record) -> tuple[list[str], Array]:
    """Element of each row between rigid links, and how far it is from being met, m or rad, shape (times, rows)."""
    rigid, rows = _rigid_rows(linkage, record)
    q = np.repeat(linkage.reference[None], len(record.time), axis=0)
    for i in rigid:
        link = linkage.mechanism.links[i]
        q[:, i, :2] = record.links[link.name].point(link.start)[0]
        q[:, i, 2] += record.links[link.name].turn()[0]
    return [linkage.names[k] for k in rows], linkage.system(q, np.zeros_like(q))[0][:, rows]


def _none(run: Run, _result: Result) -> str:
    """Say that no constraint holds rigid links."""
    return "" if _rigid_rows(Scene.of(run.record.mechanism).linkage, run.record)[1] else "no constraint between rigid links"


@check("CONSTRAINTS", _none)
def together(run: Run, _result: Result) -> Iterator[str]:
    """Check that all constraints hold all along."""
    linkage = Scene.of(run.record.mechanism).linkage
    names, off = gaps(linkage, run.record)
    k, row = np.unravel_index(int(np.argmax(np.abs(off))), off.shape)
    gap = float(np.abs(off[k, row]))
    if gap > GAP * max(1.0, linkage.size):
        yield f"'{names[row]}' is apart by {gap:.3g} m (or rad) at t = {run.record.time[k]:.4g} s"
