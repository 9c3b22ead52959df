"""What a stop remembers of its contacts: how fast each was approached."""

from __future__ import annotations

from dataclasses import dataclass

from buckler.mbs.elements.stop import Stop

SLOWEST_ONSET = 1e-4
"""Approach speed, m/s, below which dissipative laws no longer scale with it: a contact at rest has no impact speed."""
GRAZE = 0.05
"""Share of the fastest approach so far that slower ones are taken for: after the last tiny rebound of a slider coming to rest,
a law that divides by the approach speed would else let a slow release pull. Runs that resolve contacts more finely than usual
take as much less of it, so that what it does is in the difference of two runs."""


@dataclass
class Striking:
    """Running state of a stop's contacts, from accepted step to accepted step.

    Attributes
    ----------
    onset : float
        Approach speed when the present contact began, m/s, or a share of the fastest one so far.
    fastest : float
        Fastest approach so far that ended in contact, m/s.
    share : float
        Of that, what slower ones are taken for.
    """

    stop: Stop
    onset: float = SLOWEST_ONSET
    fastest: float = SLOWEST_ONSET
    share: float = GRAZE

    def force(self, depth: float, rate: float) -> float:
        """Contact force, N, never negative."""
        return self.stop.law.force(depth, rate, self.onset) if depth > 0 else 0.0

    def accept(self, depth: float, rate: float) -> bool:
        """Take over the state at the end of a step; true in contact."""
        touching = depth > 0
        if touching:
            self.fastest = max(self.fastest, self.onset)
        else:
            self.onset = max(rate, SLOWEST_ONSET, self.share * self.fastest)
        return touching
