"""Couplings of bodies that need not meet: a linear form of their places and turns, and its one effort."""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar

from ..geometry import Array
from .element import GROUND, Element, Parts, place
from .references import known_link, refers, takes_moments


class Coupling(Element):
    """A kind of coupling."""

    title: ClassVar[str] = "{kind:lower} of '{first}' and '{second}'"
    label: ClassVar[str] = "{kind:lower}.{first:body}-{second:body}"
    first: str
    second: str
    carrier: str = GROUND

    def turning(self) -> Iterator[str]:
        """Yield the references 'link:point' of what turns by it."""
        yield from (self.first, self.second)

    def check(self, mechanism: Parts) -> None:
        """Two bodies, each with its point, that can take a moment; the carrier another one."""
        carrier = self.carrier
        if carrier != GROUND:
            known_link(mechanism, carrier, self.where)
        for at in self.turning():
            if not place(at).body:
                raise ValueError(f"{self.where}: '{at}': name link and point, such as 'wheel:A'")
            refers(mechanism, at, self.where)
        bodies = [place(at).body for at in self.turning()]
        if bodies and len({carrier, *bodies}) != 1 + len(bodies):
            raise ValueError(f"{self.where}: two different bodies are needed, and another carrier")
        takes_moments(mechanism, (carrier, *bodies), self.where)

    def reactions(self, multipliers: Array) -> dict[str, Array]:
        """Return the effort of its row, as on its first body."""
        return {"effort": multipliers}
