"""Settings of the three solvers: steps, tolerances and their defaults. An import loads no engine."""

from collections.abc import Sequence
from itertools import pairwise
from math import ceil
from typing import ClassVar

import numpy as np

from .declare import Declared, Quantity, choice, declared, field, part, quantity, whole
from .scene.scene import Scene

MIN_STEP = 1e-9
"""Smallest step of Exudyn [s]: a million times the rounding of a time of some seconds."""
SECOND_LEVEL_STEPS = 40
"""Least number of steps of the compiled solver at the second level of a refinement: chosen. The first level has 8 times the
tolerance tol and so 40/8^(1/4) = 24, as steps go as tol^(1/4). It has an effect only where error control takes longer steps."""


class Setting(Declared):
    """Base of solvers and their steps: no part of a mechanism, so that files of mechanisms cannot contain them."""

    in_files = False


@declared
class Controlled(Setting):
    """Steps adapted to the local error; equal ones, 400 in a turn of the drive, if constraints alone determine the motion.

    >>> Spectral(Controlled(tolerance=1e-7)).steps.tolerance
    1e-07
    """

    tolerance: float | None = quantity(
        "1", above=0, default=None,
        doc="local error of positions allowed a step, relative to the longest link or, if that is less, a tenth of the smallest "
        "clearance; by default 1e-5, with clearance 1e-3, with stiffly damped clearance 3e-5; for `Spectral` 1e-6",
    )  # fmt: skip
    max_step: float | None = quantity("s", above=0, doc="by default a 200th of the duration, for `Spectral` a 50th", default=None)
    contact_resolution: int = whole(1, 10_000, doc="least steps in half an oscillation of a block on a stop or strut", default=40)
    max_steps: int = whole(1, 10**9, doc="a run that takes more ends as TOO_MANY_STEPS", default=1_000_000)

    adaptive: ClassVar[bool] = True

    def longest(self, duration: float, least_count: int = 200) -> float:
        """Return the longest step of a run [s], by default with this least number of steps."""
        return self.max_step or duration / least_count


@declared
class Equal(Setting):
    """Steps of one size.

    >>> Exudyn(Equal(1000)).steps.count
    1000
    """

    count: int = whole(1, 10**9, doc="steps of the run")

    adaptive: ClassVar[bool] = False
    tolerance: ClassVar[None] = None
    max_steps: ClassVar[int] = 10**9

    def longest(self, duration: float, _least_count: int = 0) -> float:
        """Return the step of a run [s]."""
        return duration / self.count


def subdivide(kinks: Sequence[float], longest: float, default_longest: float) -> list[float]:
    """Add times between kinks that are closer to each other than the longest step of a run; return all times, sorted [s].

    Solvers end steps on these times. Between two such kinks one step may be too long, though the longest step allows it. A finer
    run takes `default_longest / longest` steps there, rounded up. So the difference of two runs shows the error of such steps.
    """
    parts = max(1, ceil(default_longest / longest - 1e-9))  # 1e-9: the ratio of steps is rounded
    added = (np.linspace(a, b, parts + 1)[:-1] for a, b in pairwise(kinks) if b - a < longest)
    return sorted({*kinks, *(float(t) for piece in added for t in piece)})


@declared
class Closure(Setting):
    """Loop closure and inverse dynamics, for linkages whose motion is determined by joints and drives; nothing is integrated.

    >>> Closure(Equal(500)).steps.count
    500
    """

    steps: Controlled | Equal = part(
        Controlled, Equal, default_factory=Controlled,
        doc="times at which the motion is sampled: 400 in each turn of the drive, more near dead centres, and both sides of each "
        "kink of a drive or load, at most `max_step` apart and at most `max_steps` of them; or equal steps; a tolerance has no "
        "effect, as the only error is rounding",
    )  # fmt: skip


@declared
class Exudyn(Setting):
    """The solver Exudyn: generalized-alpha, or an explicit method if all joints of rigid links have clearance.

    >>> Exudyn(spectral_radius=0.9).newton_absolute is None
    True
    """

    steps: Controlled | Equal = part(Controlled, Equal, doc="length of the steps", default_factory=Controlled)
    spectral_radius: float = field(
        Quantity("1", 0.0, 1.0, open_high=True),
        "of generalized-alpha at infinite frequency: a smaller one damps unresolved axial waves faster; at 1 most runs diverge",
        default=0.7,
    )
    newton_absolute: float | None = quantity(
        "N", above=0, default=None,
        doc="Newton's absolute tolerance of the residual, in addition to 1e-10 of its first value; by default 5e-12 of the "
        "largest axial stiffness, ten times the rounding error of an axial force, or 1e-8 N if that is more",
    )  # fmt: skip


TOLERANCE = 1e-6
"""Default tolerance of the compiled solver, see `Spectral.steps`."""


@declared
class Spectral(Setting):
    """The compiled solver: spectral strips, joints as constraints; the defaults suit most mechanisms.

    >>> Spectral(degree=8).contact_tolerance
    0.01
    """

    steps: Controlled | Equal = part(
        Controlled, Equal, default_factory=lambda: Controlled(tolerance=TOLERANCE),
        doc="length of the steps; the tolerance, 1e-6 by default, is the local error allowed in a step, relative to the longest "
        "link or a radian; a deformation may have 100 times this error, relative to the largest deformation so far; the longest "
        "step is by default a 50th of the duration; steps end where contacts begin, equal steps, too",
    )  # fmt: skip
    degree: int | None = whole(2, 60, doc="degree of the strips' polynomials; 8 by default", default=None)
    contact_tolerance: float = quantity("1", above=0, high=1, doc="local error allowed of a depth, relative to it", default=1e-2)
    method: str = choice(
        "chosen", "implicit", "explicit", default="chosen",
        doc="'chosen' from the scene: explicit if all joints of rigid links have clearance",
    )  # fmt: skip

    @property
    def tolerance(self) -> float:
        """Local error allowed in a step, relative as described in `steps`; with equal steps it scales contact limits alone."""
        return self.steps.tolerance or TOLERANCE

    def longest(self, duration: float) -> float:
        """Return the longest step of a run [s]; the other solvers have another default, see `Controlled.longest`."""
        return self.steps.longest(duration, 50)


def usual_tolerance(scene: Scene) -> float:
    """Return the default tolerance of Exudyn for a scene, see `Controlled`."""
    if not scene.clearances:
        return 1e-5
    return 3e-5 if scene.is_stiffly_damped else 1e-3  # there peaks of impacts are a quarter too small at 1e-3, 2 % at 3e-5


def position_error(scene: Scene, tolerance: float | None) -> float:
    """Return the local error of places that Exudyn allows a step [m], from a tolerance or the default one."""
    return (tolerance or usual_tolerance(scene)) * min([scene.linkage.size, *(0.1 * joint.gap for joint in scene.clearances)])
