"""Settings of the time integration, for those who want another than the one chosen from the scene."""

from __future__ import annotations

from dataclasses import dataclass

from buckler.mbs.validate import number, positive, whole


@dataclass(frozen=True)
class Solver:
    """Settings of the time integration; every default can stay.

    Parameters
    ----------
    tolerance : float, optional
        Local position error allowed a step, relative to the mechanism's size: its longest link, or a tenth of the smallest
        play. By default 1e-5, with play 1e-3.
    max_step : float, optional
        Largest step, s; a 200th of the duration by default.
    min_step : float
        Smallest step, s.
    contact_resolution : int
        Steps at least taken for half an oscillation of the guided mass on its stop.
    spectral_radius : float
        Of generalized-alpha at infinite frequency, in [0, 1]: smaller damps unresolved axial waves faster.
    newton_relative, newton_absolute : float, optional
        Newton's tolerances on the residual, against its first value and in N; either suffices. By default the absolute one
        decides and is chosen from the scene, 5e-12 of the largest axial stiffness: ten times what round-off leaves. A relative
        one stops too early, as a large step's first residual is large.
    max_steps : int
        A run that takes more ends as TOO_MANY_STEPS.
    uniform_steps : int, optional
        Take this many equal steps instead of controlled ones.
    record_every : int
        Of equal steps, record one in so many.
    reuse_jacobian : bool
        Keep Newton's Jacobian from step to step as long as it serves and the step size stays. With play in joints,
        controlled steps always do.
    """

    tolerance: float | None = None
    max_step: float | None = None
    min_step: float = 1e-9
    contact_resolution: int = 40
    spectral_radius: float = 0.7
    newton_relative: float = 1e-10
    newton_absolute: float | None = None
    max_steps: int = 1_000_000
    uniform_steps: int | None = None
    record_every: int = 1
    reuse_jacobian: bool = False

    def __post_init__(self) -> None:
        if self.tolerance is not None:
            positive("tolerance", self.tolerance, "1")
        positive("min_step", self.min_step, "s")
        if self.max_step is not None:
            positive("max_step", self.max_step, "s")
        whole("contact_resolution", self.contact_resolution, 1, 10_000)
        number("spectral_radius", self.spectral_radius, 0.0, 1.0, "1")
        positive("newton_relative", self.newton_relative, "1")
        if self.newton_absolute is not None:
            positive("newton_absolute", self.newton_absolute, "N")
        whole("max_steps", self.max_steps, 1, 10**9)
        if self.uniform_steps is not None:
            whole("uniform_steps", self.uniform_steps, 1, 10**9)
        whole("record_every", self.record_every, 1, 10**9)
        if self.record_every > 1 and self.uniform_steps is None:
            raise ValueError(f"record_every = {self.record_every}: needs uniform_steps")
