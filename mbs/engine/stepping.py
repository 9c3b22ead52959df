"""Error-controlled steps for the engine's implicit integrator, small at contact onset and large in smooth motion.

The engine itself makes a step smaller only if Newton's method fails. Two callbacks control the error. The first, after Newton's
method, accepts or rejects the step by the local error of the positions. The error is h^2 |a_{n+1} - a_n| / 12, with the step h
and the accelerations a. It is the difference between a Newmark step with beta = 1/4 and one with accelerations linear in time,
beta = 1/6 (Zienkiewicz and Xie 1991, doi 10.1002/eqe.4290200907). The second, after an accepted step, sets the size of the next.
"""

from typing import cast

import numpy as np

from ..elements.stop import GRAZE
from ..geometry import Array
from ..laws import contact_time
from ..process import Progress
from ..solvers import MIN_STEP, Controlled, Exudyn, position_error, subdivide
from . import System
from .forces import StopContact, StrutSpring
from .recording import Recorder
from .scene import EngineScene

LIGHTEST = 1e-6
"""Least mass [kg] in estimates of durations, for points and blocks without mass: chosen."""


class StepControl(Recorder):
    """Callbacks of an implicit run with controlled steps: a `Recorder` that also accepts or rejects steps and sets their size."""

    def __init__(
        self, scene: EngineScene, solver: Exudyn, duration: float, timeout: float | None, progress: Progress | None
    ) -> None:
        super().__init__(scene, solver, duration, timeout, progress)
        steps = cast(Controlled, solver.steps)
        scene.system.SetPostNewtonUserFunction(self.after_newton)
        self.scales = np.zeros(self.data.ODE2Size())  # displacement [m] per unit of each coordinate
        for placed in scene.placed.values():
            self.scales[placed.columns()] = placed.scales
        self.limit = position_error(scene.source, steps.tolerance)
        self.max_step = steps.longest(duration)
        stops = [_StopSteps(contact, steps) for contact in self.stops]
        struts = [_StrutSteps(scene, name, spring, steps, self.limit) for name, spring in scene.struts.items()]
        self.controls: list[_StopSteps | _StrutSteps] = [*stops, *struts]
        # steps end at kinks; a run finer than the default one also divides intervals between kinks shorter than its steps
        default_longest = Controlled().longest(duration)
        self.kinks = [*subdivide(scene.source.kinks(duration), self.max_step, default_longest), np.inf]
        self.accelerations: Array | None = None
        self.new_accelerations: Array | None = None
        self.error = self.last_trial = 0.0  # of the last trial step: its largest error over the limit, and its size [s]

    def before_step(self, _system: System, _time: float) -> bool:
        """Request a new Jacobian if a step is repeated with a smaller size; registered only if Jacobians are kept over steps."""
        h = self.engine.it.currentStepSize
        if h < self.last_trial:
            self.engine.conv.jacobianUpdateRequested = True
        self.last_trial = h
        return True

    def after_newton(self, _system: System, _time: float) -> list[float]:
        """Return [error, recommended step] as the engine's callback: [0, -1] accepts the step, a large error rejects it."""
        self.new_accelerations = self.data.GetODE2Coordinates_tt() * self.scales
        h = self.engine.it.currentStepSize
        if self.accelerations is None:
            return [0.0, -1.0]
        errors = h * h / 12 * np.abs(self.new_accelerations - self.accelerations)
        q = self.data.GetODE2Coordinates()
        excesses = [control.excess(h, errors, q) for control in self.controls]
        self.error = max([float(errors.max(initial=0.0)) / self.limit, *excesses])
        if self.error <= 2 or h <= MIN_STEP:  # below 2 the next step, made shorter, is better than a repetition
            return [0.0, -1.0]
        self.rejected += 1
        return [1e300, max(MIN_STEP, h * _compute_factor(self.error))]

    def next_step(self, q: Array, q_t: Array) -> None:
        """Set the size of the next step from the error of this one, the contacts ahead and the next kink."""
        h = self.engine.it.currentStepSize
        if self.accelerations is None:  # no error is known at the start: the first step is chosen small
            self.accelerations = self.data.GetODE2Coordinates_tt() * self.scales
            self.engine.it.currentStepSize = max(MIN_STEP, 1e-3 * self.max_step)
            return
        self.accelerations = self.new_accelerations
        step = min(self.max_step, h * _compute_factor(self.error))
        for control in self.controls:
            step = min(step, control.step_limit(q, q_t, step))
        now = self.time[-1]
        if now >= self.kinks[0] - MIN_STEP:
            self.kinks.pop(0)
        time_to_kink = self.kinks[0] - now
        # a step is stretched to a kink so that no short one remains; at 1.5, an error of 0.8^3 1.5^3 = 1.7 is still accepted
        ends_at_kink = time_to_kink < 1.5 * step
        if ends_at_kink:
            step = time_to_kink
        is_about_equal = 0.8 * h < step < 1.25 * h  # then the size of the step is kept, and with it the Jacobian
        if ends_at_kink or not is_about_equal:
            self.engine.it.currentStepSize = max(MIN_STEP, step)
            self.engine.conv.jacobianUpdateRequested = True


class _StopSteps:
    """Limits of steps by a stop: before the onset, in an impact (`shortest` [s]), and in a lasting contact."""

    def __init__(self, contact: StopContact, steps: Controlled) -> None:
        self.contact, self.resolution = contact, steps.contact_resolution
        self.mass, self.shortest = max(contact.mass, LIGHTEST), 0.0
        # the contact law assumes at least this share of the stop's fastest approach speed so far; it is smaller in finer runs, so
        # that the difference of two runs shows the effect of `GRAZE`
        self.contact.share = GRAZE * min(1.0, Controlled().contact_resolution / self.resolution)

    def _impact_duration(self) -> float:
        """Estimate the duration [s] of the present impact, or of one at the present speed of approach."""
        return contact_time(self.contact.stop.law, self.mass, self.contact.onset_speed)

    def step_limit(self, q: Array, q_t: Array, step: float) -> float:
        """Return the limit of a step [s]: `shortest` in an impact, short before a contact closes or slowly opens, else `step`."""
        depth, speed = self.contact.state(q, q_t)  # the speed is positive towards the face
        duration = self._impact_duration()
        if not self.contact.is_touching:
            closes = 0 < -depth < speed * step
            return _limit_approach(-depth, speed, duration / self.resolution, step) if closes else step
        self.shortest = duration / self.resolution
        if abs(speed) * duration > 0.2 * depth:  # chosen: then the depth changes fast
            return min(step, self.shortest)
        time_limit = _limit_approach(depth, -speed, self.shortest, step)  # before the depth becomes 0
        return min(step, max(self.shortest, time_limit))

    def excess(self, h: float, errors: Array, q: Array) -> float:
        """Return the error of the force in a lasting contact over its limit; a large one if a long step ends in contact."""
        depth, _ = self.contact.state(q, np.zeros_like(q))
        if not self.contact.is_touching and depth > 0:
            shortest = self._impact_duration() / self.resolution
            is_long = h > 2 * shortest  # `_limit_approach` plans 1.1 of it at most to close a gap
            return 1e3 if is_long else 0.0  # 1e3 makes the next trial five times shorter
        if self.contact.last_force == 0 or h <= self.shortest:
            return 0.0
        stiffness = self.contact.stop.law.stiffness  # [N/m^n] for a depth in m: exact for n = 1, else a rough estimate
        limit = 1e-3 * self.contact.last_force  # local error allowed in the force: chosen
        return stiffness * errors[self.contact.columns].sum() / limit


class _StrutSteps:
    """Limits of steps by a strut, whose force law has a kink and becomes stiff where the strut becomes straight."""

    def __init__(self, scene: EngineScene, name: str, spring: StrutSpring, steps: Controlled, limit: float) -> None:
        self.spring, self.limit, self.resolution = spring, limit, steps.contact_resolution
        link = scene.mechanism.link(name)
        masses = [guide.mass for guide in scene.mechanism.guides if guide.point in link.points]  # of the blocks at its ends
        self.accepted = 0.0  # elongation after the last accepted step [m]
        mass = max(min(masses, default=0.1), LIGHTEST)  # 0.1 kg without a block: chosen
        self.half_period = np.pi * np.sqrt(mass / spring.rigidity)  # of the axial vibration [s]; rigidity E A/L [N/m]

    def step_limit(self, _places: Array, _q_t: Array, step: float) -> float:
        """Return the limit of a step [s]: short before the strut becomes straight, then to resolve its axial vibration."""
        self.accepted = self.spring.elongation  # the last step has just been accepted
        gap, speed = self.spring.kink - self.spring.elongation, self.spring.rate
        shortest = self.half_period / self.resolution
        if gap > 0:
            return _limit_approach(gap, speed, shortest, step)
        vibrates = abs(speed) * self.half_period > self.limit
        return min(step, shortest) if vibrates else step

    def excess(self, h: float, _errors: Array, _places: Array) -> float:
        """Return the change of a straight strut's force in the step, over its limit, chosen as the Euler load."""
        before, after = self.accepted, self.spring.elongation
        if h <= self.half_period / self.resolution or min(before, after) < self.spring.kink:
            return 0.0
        return abs(after - before) / -self.spring.kink  # force in proportion to elongation, the Euler load at `kink` < 0


def _limit_approach(gap: float, speed: float, shortest: float, step: float) -> float:
    """Limit a step before a gap [m] that closes at a speed [m/s]: long steps end before it closes, a short one closes it.

    A long step that ends in contact would apply the first contact force over its whole length. Margins of 0.1 make sure that the
    gap stays open, or closes.
    """
    if speed <= 0:
        return step
    time = gap / speed
    return min(step, 0.9 * time if time > shortest else time + 0.1 * shortest)


def _compute_factor(error: float) -> float:
    """Return the factor of the next step for a local error of third order: 0.8 error^(-1/3), from 0.2 to 2."""
    return min(2.0, max(0.2, 0.8 * max(error, 1e-300) ** (-1 / 3)))
