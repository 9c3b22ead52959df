"""What couples the motions of bodies that need not meet: a linear form of their places and turns, and its one effort."""

from __future__ import annotations

from collections.abc import Iterator

from buckler.mbs.elements.element import (
    GROUND,
    Array,
    Element,
    Parts,
    Place,
    holder,
    known,
    place,
    refers,
    takes_moments,
)
from buckler.mbs.elements.rows import FIXED


class Coupling(Element):
    """A kind of coupling."""

    first: str
    second: str

    @property
    def where(self) -> str:
        """Its kind and its ends."""
        return f"{type(self).__name__.lower()} of '{self.first}' and '{self.second}'"

    @property
    def key(self) -> str:
        """'gear.sun-planet'."""
        ends = "-".join(at.partition(":")[0] for at in (self.first, self.second))
        return f"{type(self).__name__.lower()}.{ends}"

    def turning(self) -> Iterator[str]:
        """Yield the references 'link:point' of what turns by it."""
        yield from (self.first, self.second)

    def check(self, mechanism: Parts) -> None:
        """Two bodies, each with its point, that can take a moment; the carrier another one."""
        carrier = getattr(self, "carrier", GROUND)
        if carrier != GROUND:
            known("link", carrier, {link.name for link in mechanism.links}, self.where)
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


def carried_by(mechanism: Parts, carrier: str, point: str = "") -> Place:
    """Place of a carrier, at a point or at its own start."""
    if carrier == GROUND:
        return Place(GROUND, point) if point else FIXED
    return Place(carrier, point or mechanism.link(carrier).start)


def held_place(mechanism: Parts, at: str, where: str) -> Place:
    """Place of a point as part of the link, or the ground, that holds it.

    Raises
    ------
    ValueError
        If a guide's block holds it alone, under a strut.
    """
    body, point = holder(mechanism, at), place(at).point
    if body != GROUND and body not in {link.name for link in mechanism.links}:
        raise ValueError(f"{where}: '{at}' is the end of a strut on a guide's block; name a link with mass")
    return Place(body, point)
