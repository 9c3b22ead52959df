"""Levels of refinement of each solver: one level sets tolerance, longest step, contact tolerance and degree together.

The compiled solver, `Spectral`, takes steps h ~ tol^(1/4) at the tolerance tol. Its errors go as h ~ tol^(1/4) where bodies
strike, and as h^3 ~ tol^(3/4) at best: h^3 is the local error of the forces of Radau IIA with 3 stages (E. Hairer, C. Lubich,
M. Roche, Lect. Notes Math. 1409 (1989), doi 10.1007/BFb0093947). Exudyn's generalized-alpha is of second order, with steps
~ tol^(1/3). Loop closure integrates nothing: only its samples can be too few.

Runs of neighbouring degrees may agree by chance. So the degree of a strip is high enough only if the last two terms of the
polynomials in its deflection are small, by `demand.DeflectionLimits`.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import ceil, log, pi, sqrt
from typing import Any, NamedTuple

import numpy as np

from ..kinematics.exact import sample_times
from ..laws import BristleLaw
from ..mechanism import Mechanism
from ..record.run import Run
from ..scene.scene import Scene
from ..solvers import SECOND_LEVEL_STEPS, Closure, Controlled, Exudyn, Spectral, usual_tolerance
from .demand import PLACE_ERROR, DeflectionLimits
from .trajectory import TINY

FIRST = 1e-3
"""Tolerance of the compiled solver's first run, over the smallest clearance or, if there is none, the longest link. It is the
coarsest at which most random mechanisms are within a fifth of a fine run. At 1e-2 runs fail, at 1e-4 every third is wasted."""
DEGREE = 6
"""Degree of a strip's first polynomials: 2 for bending, and four more. Degree 8 costs 1.5 times as much where 6 is enough."""
FINEST = 5e-10
"""Least tolerance over the longest link: chosen. A fifth would lower the error of a double pendulum of 10 s from 6e-5 to 4e-6.
But a chaotic modal rocker with rattling pins would take eight runs instead of fewer."""
Runner = Callable[[Mechanism, float, Any], Run]
"""Function that makes one run of a mechanism for a duration [s] by a solver."""


class Orders(NamedTuple):
    """Exponents q of errors that go as tol^q. Two runs do not show q, so that it is assumed; three may show it."""

    least: float  # assumed of all signals but the following; also the least q that three runs may show
    place: float  # assumed of places if bodies neither strike nor stick nor slip
    largest: float  # the largest q that three runs may show


class Truncation(NamedTuple):
    """Last two terms of a strip's deflection, and the decay of its terms."""

    excess: float = 0.0  # the larger of the last two terms over its limit
    decay: float = 0.5  # mean ratio of successive terms; without a strip it has no effect


class Level(NamedTuple):
    """Fineness of a run."""

    tolerance: float  # relative: to clearance or longest link (`Spectral`), usual tolerance (`Exudyn`), usual step (`Closure`)
    degree: int  # of the strips' polynomials; of Exudyn, how often the elements of strips are doubled: -1 for half of them


@dataclass(frozen=True)
class Levels:
    """Levels of one solver for one mechanism and duration [s], for errors of some size."""

    mechanism: Mechanism
    duration: float
    solver: Any
    place_error: float = PLACE_ERROR  # allowed of a place, over its range; a smaller one makes the first tolerance smaller

    ratio = 8.0
    """Tolerance of a level over that of the next: two runs differ by 0.4 to 0.8 of the coarser's error, at q = 1/4 to 3/4."""
    runs_at_most = 10
    """Most runs for one result: eight levels from `FIRST` to `FINEST`, and two for runs that fail or cover a part."""
    orders = Orders(1 / 4, 1 / 3, 3 / 4)
    """Orders of errors: for 1/4 and 3/4 see the head of this file. At 1/3 the error is the difference, at the ratio 8."""
    finest = 0.0  # least tolerance of a level; 0 if only the number of runs is limited
    degrees = 1  # degrees that one level has more than the one before
    are_radau = False  # True if steps of all levels damp vibrations as Radau IIA does

    def first(self) -> Level:
        """Return the coarsest level."""
        raise NotImplementedError

    def settings(self, level: Level) -> tuple[Mechanism, Any]:
        """Return mechanism and solver of a level."""
        raise NotImplementedError

    def finer(self, level: Level, ratio: float) -> Level:
        """Return a level with the tolerance divided by a ratio, and degrees to match."""
        more = self.degrees * max(1, round(log(ratio) / log(self.ratio)))
        return Level(max(self.finest, level.tolerance / ratio), level.degree + more)

    def refinements_to_go(self, level: Level) -> float:
        """Return the number of refinements from a level to the finest tolerance, or the most runs without one."""
        return log(level.tolerance / self.finest) / log(self.ratio) if self.finest else self.runs_at_most

    def find_truncation(self, _run: Run, _limits: DeflectionLimits) -> Truncation:
        """Find the truncation of the strip with the largest excess; none where levels do not differ in the degree."""
        return Truncation()

    def raise_degree(self, level: Level, run: Run, limits: DeflectionLimits) -> Level:
        """Return the level with the degrees that the limits of deflections need, by the decay of their terms in a run."""
        truncation = self.find_truncation(run, limits)
        if not truncation.excess:
            return level
        # twice the excess, as terms decay more slowly at higher degrees: without it a third run is needed to add two degrees
        terms = log(max(1.0, 2.0 * truncation.excess)) / -log(truncation.decay)
        enough = run.solver.degree + 2 * ceil(terms / 2)  # even: a symmetric deflection has every second term alone
        most = level.degree + 8  # the decay of terms cannot be extrapolated farther
        return level._replace(degree=max(level.degree, min(most, enough)))

    @property
    def rattles(self) -> bool:
        """True if pins rattle in their bushes, a motion that is often chaotic."""
        return bool(Scene.of(self.mechanism).clearances)

    def choose_share(self, run: Run) -> float:
        """Return the share of the duration that the second run covers, after the first `run`.

        Most chaotic runs that rattle separate in an eighth. A sixteenth is less than a turn of the rattling crank-rocker, some of
        whose starts separate later. A part of a short run would cost as much as it saves.
        """
        return 1 / 8 if self.rattles and len(run.record.time) > 5000 else 1.0


class SpectralLevels(Levels):
    """Levels of the compiled solver."""

    degrees, are_radau = 2, True

    @property
    def clearance(self) -> float:
        """Smallest clearance over the longest link; 1 without."""
        scene = Scene.of(self.mechanism)
        return float(min([1.0, *(joint.gap / scene.linkage.size for joint in scene.clearances)]))

    @property
    def finest(self) -> float:  # type: ignore[override]
        """Least tolerance, over the smallest clearance or the longest link."""
        return FINEST / self.clearance

    def first(self) -> Level:
        """Return the coarsest level."""
        bristles = any(isinstance(guide.friction, BristleLaw) for guide in self.mechanism.guides)
        at_first = FIRST / 128 if bristles else FIRST  # coarser runs miss the instants at which bristles slip
        tolerance = at_first * min(1.0, self.place_error / PLACE_ERROR)
        return Level(tolerance, self.solver.degree or DEGREE)

    def settings(self, level: Level) -> tuple[Mechanism, Any]:
        """Return mechanism and solver; the second level from `FIRST` has the usual longest step and contact tolerance."""
        second_tolerance = FIRST / self.ratio
        coarseness = level.tolerance / second_tolerance
        longest = self.duration / SECOND_LEVEL_STEPS * coarseness ** (1 / 4)
        steps = Controlled(level.tolerance * self.clearance, longest, max_steps=self.solver.steps.max_steps)
        # local error of a contact's depth, over the depth. Chosen: each level has 8^(-2/3) = 1/4 of the level before, at most 0.5
        contact = min(0.5, self.solver.contact_tolerance * coarseness ** (2 / 3))
        meshed = any(link.body.meshed for link in self.mechanism.links)
        degree = min(60, level.degree) if meshed else self.solver.degree  # 60: limit of the setting
        return self.mechanism, replace(self.solver, steps=steps, degree=degree, contact_tolerance=contact)

    def find_truncation(self, run: Run, limits: DeflectionLimits) -> Truncation:
        """Find the truncation of the strip with the largest excess.

        Terms are coefficients normal to the chord times the largest value of their polynomial [m]: the integrated Legendre
        polynomial of degree k is at most sqrt(2/pi)/(k - 1/2) for large k. The decay is the ratio of a geometric series that
        begins with the largest term and ends with the last one.
        """
        found, time = Truncation(), run.record.time
        for link in (link for link in run.record.mechanism.links if link.body.meshed and link.name in run.record.links):
            motion: Any = run.record.links[link.name]
            for piece in motion.pieces:
                # each (times, 2 + terms): the places of both ends, then the coefficients of N_2, N_3, ...
                x, y = (motion.q[:, piece.dofs[axis]] for axis in (0, 1))
                chord = np.stack([x[:, 1] - x[:, 0], y[:, 1] - y[:, 0]])
                terms = np.abs(chord[0, :, None] * y[:, 2:] - chord[1, :, None] * x[:, 2:]) / np.hypot(*chord)[:, None]
                k = np.arange(2, x.shape[1])
                terms *= sqrt(2 / pi) / (k - 0.5)
                rms, peak = np.sqrt(np.trapezoid(terms**2, time, axis=0) / time[-1]), terms.max(axis=0)
                deflection = max(float(peak.max()), 1e-3 * link.body.section.thickness)  # less is practically straight
                last_rms = rms[-2:].max()
                excess = max(last_rms / limits.rms, peak[-2:].max() / (limits.peak * deflection))
                decay = (max(last_rms, TINY) / max(rms.max(), TINY)) ** (1 / max(1, len(rms) - 1))
                decay = np.clip(decay, 1e-3, 0.9)  # of a sine above 1e-3 to degree 30; at 1 no degree is enough
                found = max(found, Truncation(float(excess), float(decay)))
        return found


class ExudynLevels(Levels):
    """Levels of Exudyn: with the usual `place_error` the second has its defaults, or twice the elements of strips of one."""

    orders = Orders(1 / 3, 1 / 3, 2 / 3)
    runs_at_most = 6  # a level has twice the steps and twice the elements, and costs four times the one before

    def first(self) -> Level:
        """Return the coarsest level: half the elements, or all where a strip has one."""
        bodies: list[Any] = [link.body for link in self.mechanism.links]
        fewest = min([body.count for body in bodies if body.meshed], default=2)
        return Level(self.ratio * min(1.0, self.place_error / PLACE_ERROR), -1 if fewest > 1 else 0)

    def settings(self, level: Level) -> tuple[Mechanism, Any]:
        """Return mechanism and solver; the tolerance is relative to the usual one, and each level doubles the elements."""
        finer, count = level.tolerance ** (-1 / 3), round(-log(level.tolerance) / log(self.ratio))  # levels from the defaults
        steps = _shorten_steps(Controlled().longest(self.duration), finer)
        steps = replace(steps, tolerance=usual_tolerance(Scene.of(self.mechanism)) * level.tolerance)
        is_explicit = Scene.of(self.mechanism).is_explicit_in_exudyn  # explicit steps have no spectral radius
        # every second level has the radius 0.9, not the usual 0.7, so that runs differ where numerical damping matters
        radius = self.solver.spectral_radius if is_explicit or count % 2 == 0 else 0.9
        return _refine_mesh(self.mechanism, 2.0**level.degree), replace(self.solver, steps=steps, spectral_radius=radius)


class ClosureLevels(Levels):
    """Levels of loop closure; the second has the usual samples."""

    ratio, orders = 2.0, Orders(1.0, 1.0, 1.0)

    def first(self) -> Level:
        """Return the coarsest level: half as many samples as usual."""
        return Level(2.0, 0)

    def settings(self, level: Level) -> tuple[Mechanism, Any]:
        """Return mechanism and solver, with the usual steps of samples times the level's tolerance."""
        if level.tolerance == 1.0:
            return self.mechanism, self.solver
        each = self.duration / len(sample_times(self.mechanism, self.duration, Controlled()))
        return self.mechanism, Closure(_shorten_steps(each, 1 / level.tolerance))


LEVELS_BY_SOLVER: dict[type, type[Levels]] = {Closure: ClosureLevels, Spectral: SpectralLevels, Exudyn: ExudynLevels}
"""Class of levels by the type of the solver."""


def _shorten_steps(step: float, factor: float) -> Controlled:
    """Return steps that are shorter by a factor than a given step [s], and within a contact shorter than the usual ones."""
    resolution = max(1, min(10_000, round(Controlled().contact_resolution * factor)))  # limits of the setting
    return Controlled(max_step=step / factor, contact_resolution=resolution)


def _refine_mesh(mechanism: Mechanism, factor: float) -> Mechanism:
    """Return the mechanism with the number of elements of each strip multiplied by a factor."""
    if factor == 1:
        return mechanism
    bodies: list[Any] = [link.body for link in mechanism.links]
    finer = [replace(b, elements=max(1, min(1000, round(factor * b.count)))) if b.meshed else b for b in bodies]
    return replace(mechanism, links=[replace(link, body=body) for link, body in zip(mechanism.links, finer, strict=True)])
