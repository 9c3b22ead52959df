"""The solver Exudyn as a value: its settings, each with the kind of steps it makes sense for. It imports no engine."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil
from typing import ClassVar

import numpy as np

from buckler.mbs.elements.element import Array
from buckler.mbs.validate import number, one_of, positive, whole


@dataclass(frozen=True)
class Controlled:
    """Steps whose size follows the local error.

    Parameters
    ----------
    tolerance : float, optional
        Local position error allowed a step, relative to the mechanism's size: its longest link, or a tenth of the smallest
        clearance. By default 1e-5, with clearance 1e-3.
    max_step : float, optional
        Largest step, s; a 200th of the duration by default.
    min_step : float
        Smallest step, s.
    contact_resolution : int
        Steps at least taken for half an oscillation of the guided mass on its stop.
    max_steps : int
        A run that takes more ends as TOO_MANY_STEPS.

    Notes
    -----
    Without a tolerance, a mechanism whose motion constraints alone decide takes equal steps, 400 a turn of its drive.
    """

    tolerance: float | None = None
    max_step: float | None = None
    min_step: float = 1e-9
    contact_resolution: int = 40
    max_steps: int = 1_000_000

    adaptive: ClassVar[bool] = True
    record_every: ClassVar[int] = 1

    def __post_init__(self) -> None:
        if self.tolerance is not None:
            positive("tolerance", self.tolerance, "1")
        positive("min_step", self.min_step, "s")
        if self.max_step is not None:
            positive("max_step", self.max_step, "s")
        whole("contact_resolution", self.contact_resolution, 1, 10_000)
        whole("max_steps", self.max_steps, 1, 10**9)

    def longest(self, duration: float) -> float:
        """Longest step of a run, s."""
        return self.max_step or duration / 200

    def number(self, duration: float) -> int:
        """Steps of a run at least."""
        return max(1, ceil(duration / self.longest(duration)))

    def coarser_than(self, usual: float) -> bool:
        """Whether steps may be longer than those of the default settings, whose tolerance is `usual`."""
        return (self.tolerance or usual) > usual or self.min_step > Controlled().min_step

    def halved(self, taken: Array, usual: float, divisor: float) -> Controlled:
        """Steps half as long as those that were taken, s, and no longer than the default ones; `divisor` of the tolerance."""
        default = Controlled()
        return replace(
            self,
            tolerance=min((self.tolerance or usual) / divisor, usual),
            max_step=float(np.max(taken)) / 2,
            min_step=min(self.min_step / 2, default.min_step),
            contact_resolution=max(2 * self.contact_resolution, default.contact_resolution),
        )


@dataclass(frozen=True)
class Equal:
    """Steps of one size.

    Parameters
    ----------
    count : int
        Steps of the run.
    record_every : int
        Record one step in so many.
    """

    count: int
    record_every: int = 1

    adaptive: ClassVar[bool] = False
    tolerance: ClassVar[None] = None
    min_step: ClassVar[float] = Controlled.min_step
    max_steps: ClassVar[int] = 10**9

    def __post_init__(self) -> None:
        whole("count", self.count, 1, 10**9)
        whole("record_every", self.record_every, 1, 10**9)

    def longest(self, duration: float) -> float:
        """Step of a run, s."""
        return duration / self.count

    def number(self, _duration: float) -> int:
        """Steps of a run."""
        return self.count

    def coarser_than(self, _usual: float) -> bool:
        """Whether steps may be longer than those of the default settings: nothing limits them."""
        return True

    def halved(self, taken: Array, _usual: float, _divisor: float) -> Equal:
        """Two steps for each that was taken, whether it was recorded or not."""
        return Equal(2 * self.record_every * len(taken))


@dataclass(frozen=True)
class Exudyn:
    """The solver Exudyn: generalized-alpha, or an explicit method where rigid links hang together by clearance joints only.

    Parameters
    ----------
    steps : Controlled or Equal
        How long steps are.
    spectral_radius : float
        Of generalized-alpha at infinite frequency, in [0, 1): a smaller one damps unresolved axial waves faster. At 1
        nothing is damped and most runs diverge.
    newton_relative, newton_absolute : float, optional
        Newton's tolerances on the residual, against its first value and in N; either suffices. By default the absolute one
        decides and is chosen from the scene, 5e-12 of the largest axial stiffness: ten times what round-off leaves. A relative
        one stops too early, as a large step's first residual is large.
    reuse_jacobian : bool
        Keep Newton's Jacobian from step to step as long as it serves and the step size stays. With clearance in joints,
        controlled steps always do.

    Raises
    ------
    ValueError
        If a value is out of its range or `steps` is no kind of steps.
    """

    steps: Controlled | Equal = Controlled()
    spectral_radius: float = 0.7
    newton_relative: float = 1e-10
    newton_absolute: float | None = None
    reuse_jacobian: bool = False

    def __post_init__(self) -> None:
        one_of("steps", self.steps, (Controlled, Equal))
        number("spectral_radius", self.spectral_radius, 0.0, 1.0, "1", open_high=True)
        positive("newton_relative", self.newton_relative, "1")
        if self.newton_absolute is not None:
            positive("newton_absolute", self.newton_absolute, "N")
        one_of("reuse_jacobian", self.reuse_jacobian, (bool,))
