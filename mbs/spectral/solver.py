"""Settings of the compiled solver."""

from __future__ import annotations

from dataclasses import dataclass

from buckler.mbs.validate import number, positive, whole


@dataclass(frozen=True)
class Spectral:
    """The compiled solver: spectral strips, joints as constraints; every default can stay.

    Parameters
    ----------
    tolerance : float
        Local error allowed a step, relative to the mechanism's size: its longest link, and a radian.
    degree : int, optional
        Of the strips' polynomials; 8 by default.
    max_step : float, optional
        Longest step, s; a 100th of the duration by default.
    spectral_radius : float
        Of generalized-alpha at infinite frequency, in (0, 1]: smaller damps unresolved axial waves faster.
    contact_tolerance : float
        Local error allowed of the depth of a contact, relative to it.
    max_steps : int
        A run that takes more ends as TOO_MANY_STEPS.
    uniform_steps : int, optional
        Take this many equal steps (and those that contacts cut) instead of controlled ones.
    record_every : int
        Record one step in so many, and those at which a contact closes or opens.
    method : str
        'implicit', 'explicit', or 'chosen' from the scene: explicit for rigid links that hang together by joints with clearance.
    """

    tolerance: float = 1e-6
    degree: int | None = None
    max_step: float | None = None
    spectral_radius: float = 0.9
    contact_tolerance: float = 1e-2
    max_steps: int = 5_000_000
    uniform_steps: int | None = None
    record_every: int = 1
    method: str = "chosen"

    def __post_init__(self) -> None:
        number("tolerance", self.tolerance, 0.0, 0.1, "1", open_low=True)
        number("contact_tolerance", self.contact_tolerance, 0.0, 1.0, "1", open_low=True)
        number("spectral_radius", self.spectral_radius, 0.0, 1.0, "1", open_low=True)
        if self.degree is not None:
            whole("degree", self.degree, 2, 60)
        if self.max_step is not None:
            positive("max_step", self.max_step, "s")
        whole("max_steps", self.max_steps, 1, 10**9)
        if self.uniform_steps is not None:
            whole("uniform_steps", self.uniform_steps, 1, 10**9)
        whole("record_every", self.record_every, 1, 10**9)
        if self.method not in ("chosen", "implicit", "explicit"):
            raise ValueError(f"method = {self.method!r}: must be 'chosen', 'implicit' or 'explicit'")
