"""Ideal pins."""

from __future__ import annotations

from collections.abc import Iterator

from ..declare import declared, names
from ..geometry import Array
from .element import Parts, Recorded
from .joint import Joint
from .rows import Row, meets
from .signal import Kind, Signal, vector


@declared
class Revolute(Joint):
    """An ideal pin at a point between two links, or a link and 'ground'.

    Examples
    --------
    >>> Revolute("O", "ground", "crank").key
    'O.ground-crank'
    """

    point: str = names(doc="where they meet")
    first: str = names(doc="a link or 'ground'")
    second: str = names(doc="a link or 'ground'")

    def rows(self, mechanism: Parts) -> Iterator[Row]:
        """Yield that the point of one body stays on that of the other."""
        return meets(self.point, self.first, self.second)

    def reactions(self, multipliers: Array) -> dict[str, Array]:
        """Return the force on the second body."""
        return {"force": -multipliers}

    def signals(self, name: str, record: Recorded) -> Iterator[Signal]:
        """Yield the force on the second body, N; none where a strut is pinned, as it acts on its neighbour directly."""
        force = record.channel(name, "force")
        if force.size:
            yield from vector(f"{name}.f", force, "N", Kind.REACTION, name)
