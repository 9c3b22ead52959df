"""Error-controlled steps for the engine's implicit integrator, small at contact onset and large in smooth motion.

The engine adapts its step to Newton failures only. Two callbacks in each step do the rest. After Newton's iteration, the local
error of the positions decides about the step: eta = h^2 |a_{n+1} - a_n| / 12, the difference of the Newmark update from the next
term of its Taylor series (Zienkiewicz and Xie 1991, doi 10.1002/eqe.4290200907). After a step, it gives the next step size.
"""

from __future__ import annotations

from typing import Any

import exudyn as exu
import numpy as np

from ..elements.stop import GRAZE
from ..geometry import Array
from ..laws import contact_time
from ..solvers import MIN_STEP, Controlled, Exudyn, position_error, subdivide
from . import System
from .forces import StopContact, StrutSpring
from .recording import Recorder
from .scene import EngineScene

LIGHTEST = 1e-6
"""Least mass, kg, in the estimate of a contact's duration, as of a point without mass."""
FORCE_ERROR = 1e-3
"""Local error allowed in a step of the force of a lasting contact, relative to the force."""
OVERSHOT = 1e3
"""Error of a long step that ends inside a stop, in units of the limit: large enough to shrink it fivefold."""
FIRST_STEP = 1e-3
"""First step of a run, over the longest."""
LANDING = 1.5
"""Distance of a kink, over the step, below which the step ends at the kink: no short step is left over."""
STRIKING = 0.2
"""Change of the depth in the duration of an impact, over the depth, above which a contact is an impact and not at rest."""


class StepControl(Recorder):
    """The callbacks of an implicit run with controlled steps: accept or reject a step, record it, choose the next."""

    def __init__(
        self,
        scene: EngineScene,
        solver: Exudyn,
        steps: Controlled,
        duration: float,
        engine: exu.MainSolverImplicitSecondOrder,
        *limits: Any,
    ) -> None:
        super().__init__(scene, solver, duration, *limits)
        self.engine = engine
        scene.system.SetPostNewtonUserFunction(self.after_newton)
        self.weights = _position_weights(scene)
        self.limit = position_error(scene.source, steps.tolerance)
        self.max_step = steps.longest(duration)
        stops = [_StopWatch(contact, steps) for contact in self.stops]
        struts = [_StrutWatch(scene, name, spring, steps, self.limit) for name, spring in scene.struts.items()]
        self.watched: list[_StopWatch | _StrutWatch] = [*stops, *struts]
        self.kinks = [*subdivide(scene.source.kinks(duration), self.max_step, Controlled().longest(duration)), np.inf]
        self.accelerations: Array | None = None
        self.candidate: Array | None = None
        self.error = self.tried = 0.0

    def before_step(self, _system: System, _time: float) -> bool:
        """Renew the Jacobian of a step that is repeated with a smaller size; engine's callback if Jacobians are kept."""
        h = self.engine.it.currentStepSize
        if h < self.tried:
            self.engine.conv.jacobianUpdateRequested = True
        self.tried = h
        return True

    def after_newton(self, _system: System, _time: float) -> list[float]:
        """Return [error, recommended step] as the engine's callback; a large error with a smaller step rejects this one."""
        self.candidate = self.data.GetODE2Coordinates_tt() * self.weights
        h = self.engine.it.currentStepSize
        if self.accelerations is None:
            return [0.0, -1.0]
        errors = h * h / 12 * np.abs(self.candidate - self.accelerations)
        q = self.data.GetODE2Coordinates()
        self.error = max([float(errors.max(initial=0.0)) / self.limit, *(w.excess(h, errors, q) for w in self.watched)])
        if self.error <= 2 or h <= MIN_STEP:
            return [0.0, -1.0]
        self.rejected += 1
        return [1e300, max(MIN_STEP, h * _factor(self.error))]

    def next_step(self, q: Array, q_t: Array) -> None:
        """Set the size of the next step from the error of this one, the contacts ahead and the next kink."""
        h = self.engine.it.currentStepSize
        if self.accelerations is None:  # no error is known at the start
            self.accelerations = self.data.GetODE2Coordinates_tt() * self.weights
            self.engine.it.currentStepSize = max(MIN_STEP, FIRST_STEP * self.max_step)
            return
        self.accelerations = self.candidate
        step = min(self.max_step, h * _factor(self.error))
        for watched in self.watched:
            step = min(step, watched.step_limit(q, q_t, step))
        time_to_kink = self._time_to_kink()
        landing = time_to_kink < LANDING * step
        if landing:
            step = time_to_kink
        if landing or not 0.8 * h < step < 1.25 * h or step > self.max_step:
            self.engine.it.currentStepSize = max(MIN_STEP, step)
            self.engine.conv.jacobianUpdateRequested = True  # it depends on the step size

    def _time_to_kink(self) -> float:
        """Return the time to the next kink of a drive or load, s."""
        now = self.record.time[-1]
        if now >= self.kinks[0] - MIN_STEP:
            self.kinks.pop(0)
        return self.kinks[0] - now


class _StopWatch:
    """Step control of one stop: before the onset, in an impact, and in a lasting contact."""

    def __init__(self, contact: StopContact, steps: Controlled) -> None:
        self.contact, self.resolution = contact, steps.contact_resolution
        self.mass, self.shortest = max(contact.mass, LIGHTEST), 0.0
        self.contact.share = GRAZE * min(1.0, Controlled().contact_resolution / self.resolution)

    def step_limit(self, q: Array, q_t: Array, step: float) -> float:
        """Limit a step: short before the onset, resolving the impact, not limited in a contact at rest."""
        depth, speed = self.contact.state(q, q_t)
        gap = -depth
        if not self.contact.touching and not 0 < gap < speed * step:
            return step
        duration = contact_time(self.contact.stop.law, self.mass, self.contact.onset)
        if not self.contact.touching:
            return _landing(gap, speed, duration / self.resolution, step)
        self.shortest = duration / self.resolution
        if abs(speed) * duration > STRIKING * abs(gap):
            return min(step, self.shortest)
        return min(step, max(self.shortest, _landing(-gap, -speed, self.shortest, step)))  # also before a slow release

    def excess(self, h: float, errors: Array, q: Array) -> float:
        """Return the error of the force of a lasting contact, over its limit; a large one if a long step ended in contact."""
        if not self.contact.touching and self.contact.state(q, q)[0] > 0:
            duration = contact_time(self.contact.stop.law, self.mass, self.contact.onset)
            return OVERSHOT if h > 2 * duration / self.resolution else 0.0
        if self.contact.pressing == 0 or h <= self.shortest:
            return 0.0
        stiffness = self.contact.stop.law.stiffness  # order of magnitude only, for exponents beyond 1
        return stiffness * errors[self.contact.columns].sum() / (FORCE_ERROR * self.contact.pressing)


class _StrutWatch:
    """Step control of one strut, whose force law has a kink and a stiff side where the strut becomes straight."""

    def __init__(self, scene: EngineScene, name: str, spring: StrutSpring, steps: Controlled, limit: float) -> None:
        self.spring, self.limit, self.resolution = spring, limit, steps.contact_resolution
        link = scene.mechanism.link(name)
        masses = [guide.mass for guide in scene.mechanism.guides if guide.point in link.points]
        self.accepted = 0.0
        self.half_period = np.pi * np.sqrt(max(min(masses, default=0.1), LIGHTEST) / spring.rigidity)

    def step_limit(self, _places: Array, _q_t: Array, step: float) -> float:
        """Limit a step: short before the kink when straightening, resolving the axial vibration of a straight strut."""
        self.accepted = self.spring.elongation
        gap, speed = self.spring.kink - self.spring.elongation, self.spring.rate
        resolved = self.half_period / self.resolution
        if gap > 0:
            return _landing(gap, speed, resolved, step)
        vibrates = abs(speed) * self.half_period > self.limit
        return min(step, resolved) if vibrates else step

    def excess(self, h: float, _errors: Array, _places: Array) -> float:
        """Return the change of a straight strut's force in the step, over the Euler load: tiny displacements matter there."""
        before, now = self.accepted, self.spring.elongation
        if h <= self.half_period / self.resolution or min(before, now) < self.spring.kink:
            return 0.0
        return abs(now - before) / -self.spring.kink


def _landing(gap: float, speed: float, shortest: float, step: float) -> float:
    """Limit a step towards a gap that closes at a speed: 0.9 of the way, until one of the shortest steps ends just past it.

    A long step that ends in contact would apply the first contact force over its whole length.
    """
    if speed <= 0:
        return step
    time = gap / speed
    return min(step, 0.9 * time if time > shortest else time + 0.1 * shortest)


def _factor(error: float) -> float:
    """Return the factor of the step for a third-order local error, over its limit: 0.8 error^(-1/3), within 0.2 to 2."""
    return min(2.0, max(0.2, 0.8 * max(error, 1e-300) ** (-1 / 3)))


def _position_weights(scene: EngineScene) -> Array:
    """Return the weights of coordinates in the error norm, m: places 1, rigid angles half the length, beam angles 0."""
    weights = np.zeros(scene.system.systemData.ODE2Size())
    for placed in scene.placed.values():
        weights[placed.columns()] = placed.weights()
    return weights
