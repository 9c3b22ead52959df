"""Settings of the compiled solver."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from buckler.mbs.engine.settings import Controlled, Equal
from buckler.mbs.validate import number, one_of, short, whole

TOLERANCE = 1e-6
LONGEST = 50
"""A longest step that is not given is this part of the duration."""


@dataclass(frozen=True)
class Spectral:
    """The compiled solver: spectral strips, joints as constraints; every default can stay.

    Parameters
    ----------
    steps : Controlled or Equal
        How long steps are. The tolerance, 1e-6 by default, is the local error allowed a step, relative to the longest link and
        a radian, and of the inner motion of strips and modes to 100 times their largest deformation so far. A longest step that
        is not given is a 50th of the duration; contacts cut equal steps, too.
    degree : int, optional
        Of the strips' polynomials; 8 by default.
    contact_tolerance : float
        Local error allowed of the depth of a contact, relative to it.
    method : str
        'implicit', 'explicit', or 'chosen' from the scene: explicit for rigid links that hang together by joints with clearance.
    """

    steps: Controlled | Equal = Controlled(tolerance=1e-6)  # noqa: RUF009 - a frozen value
    degree: int | None = None
    contact_tolerance: float = 1e-2
    method: str = "chosen"

    def __post_init__(self) -> None:
        one_of("steps", self.steps, (Controlled, Equal))
        number("contact_tolerance", self.contact_tolerance, 0.0, 1.0, "1", open_low=True)
        if self.degree is not None:
            whole("degree", self.degree, 2, 60)
        if self.method not in ("chosen", "implicit", "explicit"):
            raise ValueError(f"method = {short(self.method)}: must be 'chosen', 'implicit' or 'explicit'")

    @property
    def tolerance(self) -> float:
        """Local error allowed a step."""
        return self.steps.tolerance or TOLERANCE

    @property
    def count(self) -> int | None:
        """Number of equal steps; None where they are controlled."""
        return None if self.steps.adaptive else self.steps.number(1.0)

    def finer(self, taken: Any) -> Spectral:
        """The same with steps half as long."""
        if isinstance(self.steps, Equal):
            return replace(self, steps=Equal(2 * self.steps.record_every * (len(taken) - 1)))
        return replace(self, steps=replace(self.steps, tolerance=self.tolerance / 16))

    def longest(self, duration: float) -> float:
        """Longest step of a run, s."""
        if isinstance(self.steps, Equal):
            return duration / self.steps.count
        return self.steps.max_step or duration / LONGEST
