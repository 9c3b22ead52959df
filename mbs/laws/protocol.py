"""Protocol of normal contact laws."""

from typing import Protocol, runtime_checkable

from .pieces import Reals


@runtime_checkable
class NormalLaw(Protocol):
    """Normal contact law of a stop or a clearance joint. Any object with these members will do.

    Methods take floats or arrays that broadcast, and return the same.
    """

    @property
    def stiffness(self) -> float:
        """K in K d^n [N/m^n]."""

    @property
    def exponent(self) -> float:
        """The power n in K d^n [1]."""

    def force(self, depth: Reals, rate: Reals, onset: Reals) -> Reals:
        """Contact force [N] >= 0, and 0 where depth <= 0."""

    def elastic(self, depth: Reals) -> Reals:
        """Return the part of the force that gives its work back [N]."""

    def potential(self, depth: Reals) -> Reals:
        """Energy held by that part, the integral of ``elastic`` from 0 to depth [J]."""
