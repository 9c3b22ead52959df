"""What is asked of every link's body, with the answer of most; a kind that differs says so itself."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, ClassVar

from buckler.mbs.declare import Declared
from buckler.mbs.elements.element import Energy, Recorded, Signal


class Body(Declared):
    """What a link is made of.

    Attributes
    ----------
    flexible : bool
        Whether its ends can move against each other.
    meshed : bool
        Whether it is a strip of finite elements; see `buckler.mbs.elements.beam`.
    massless : bool
        Whether it is a spring between its neighbours; its force has kinks.
    turns : bool
        Whether its points have an angle, so that a torque can act there.
    carrying : tuple of str
        How it can carry points besides its ends: at a "fraction" of its length, at a "place" in the plane.
    linear : bool
        Whether its deformation is taken for small: modes of a solid.
    round_off : float
        What round-off leaves of its internal force, of its axial stiffness.
    """

    section: Any
    flexible: ClassVar[bool] = True
    meshed: ClassVar[bool] = False
    massless: ClassVar[bool] = False
    turns: ClassVar[bool] = True
    linear: ClassVar[bool] = False
    carrying: ClassVar[tuple[str, ...]] = ()
    round_off: ClassVar[float] = 0.0

    @property
    def meshed_freely(self) -> bool:
        """Whether it leaves its number of elements to the accuracy asked of a run."""
        return False

    def inertia(self, length: float) -> tuple[float, float, tuple[float, float]]:
        """Mass, kg, inertia about the centre of mass, kg m^2, and that centre, m, of the undeformed link."""
        return self.section.bar(length)

    def along(self, chord: float, fraction: float) -> tuple[float, float]:
        """Place at a fraction of the stress-free length, m, in the link's frame, for a distance of its ends, m."""
        return chord * fraction, 0.0

    def signals(self, link: Any, record: Recorded) -> Iterator[Signal]:
        """Yield those besides the link's."""
        yield from ()

    def energies(self, link: Any, record: Recorded) -> Iterator[Energy]:
        """Yield those besides the link's."""
        yield from ()
