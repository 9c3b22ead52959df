"""Settings of the compiled solver."""

from __future__ import annotations

from buckler.mbs.declare import Declared, choice, declared, part, quantity, whole
from buckler.mbs.solvers.steps import Controlled, Equal

TOLERANCE = 1e-6
LONGEST = 50
"""A longest step that is not given is this part of the duration."""


@declared
class Spectral(Declared):
    """The compiled solver: spectral strips, joints as constraints; every default can stay."""

    in_files = False

    steps: Controlled | Equal = part(
        Controlled, Equal, default_factory=lambda: Controlled(tolerance=TOLERANCE),
        doc="how long steps are; the tolerance, 1e-6 by default, is the local error allowed a step, relative to the longest link "
        "and a radian, and of the inner motion of strips and modes to 100 times their largest deformation so far; a longest step "
        "that is not given is a 50th of the duration; contacts cut equal steps, too",
    )  # fmt: skip
    degree: int | None = whole(2, 60, doc="of the strips' polynomials; 8 by default", default=None)
    contact_tolerance: float = quantity(
        "1", above=0, high=1, doc="local error allowed of the depth of a contact, relative to it", default=1e-2
    )
    method: str = choice(
        "chosen", "implicit", "explicit", default="chosen",
        doc="'chosen' from the scene: explicit for rigid links that hang together by joints with clearance",
    )  # fmt: skip

    @property
    def tolerance(self) -> float:
        """Local error allowed a step."""
        return self.steps.tolerance or TOLERANCE

    @property
    def count(self) -> int | None:
        """Number of equal steps; None where they are controlled."""
        return None if self.steps.adaptive else self.steps.number(1.0)

    def longest(self, duration: float) -> float:
        """Longest step of a run, s."""
        if isinstance(self.steps, Equal):
            return duration / self.steps.count
        return self.steps.max_step or duration / LONGEST
