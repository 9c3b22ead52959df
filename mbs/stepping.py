"""Error-controlled steps for the engine's implicit integrator, small at contact onset and large where nothing happens.

The engine adapts its step to Newton failures only. Here its two callbacks a step do the rest: after Newton, the local error
of the positions, eta = h^2 |a_{n+1} - a_n| / 12 (the difference of the Newmark update and the next term of its Taylor series;
Zienkiewicz and Xie 1991, doi 10.1002/eqe.4290200907), decides whether the step stands; after a step, it sets the next size.
"""

from __future__ import annotations

from dataclasses import dataclass
from time import perf_counter
from typing import Any

import numpy as np

from mbs.joints import StopContact, StrutSpring
from mbs.laws import contact_time
from mbs.mechanism import Guide, Rigid
from mbs.result import Status
from mbs.scene import Scene
from mbs.validate import number, positive, whole

Array = np.ndarray[Any, Any]
LIGHTEST = 1e-6
"""Mass, kg, that stands in for none where a contact's duration is estimated."""
FORCE_ERROR = 1e-3
"""Local error allowed a step of the force of a lasting contact, relative to it."""
STRIKING = 0.2
"""A contact moves fast if, at its speed, it would cross this share of its depth in the time an impact lasts."""


@dataclass(frozen=True)
class Solver:
    """Settings of the time integration; every default can stay.

    Parameters
    ----------
    tolerance : float
        Local position error allowed a step, relative to the mechanism's size (its longest link).
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
    """

    tolerance: float = 1e-5
    max_step: float | None = None
    min_step: float = 1e-9
    contact_resolution: int = 40
    spectral_radius: float = 0.7
    newton_relative: float = 1e-10
    newton_absolute: float | None = None
    max_steps: int = 1_000_000
    uniform_steps: int | None = None

    def __post_init__(self) -> None:
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


@dataclass
class Record:
    """What the accepted steps left behind, row by row."""

    time: list[float]
    q: list[Array]
    q_t: list[Array]
    multipliers: list[Array]
    contact: list[list[float]]


class StepControl:
    """The callbacks of one run: accept or reject a step, record it, choose the next."""

    def __init__(self, scene: Scene, solver: Solver, duration: float, engine: Any, timeout: float | None, progress: Any) -> None:
        self.solver, self.engine, self.duration = solver, engine, duration
        self.data = scene.system.systemData
        self.weights = _position_weights(scene)
        self.limit = solver.tolerance * max(scene.mechanism.length(link.name) for link in scene.mechanism.links)
        self.max_step = solver.max_step or duration / 200
        self.contacts = [_WatchedStop(scene, point, contact, solver) for point, contact in scene.stops.items()]
        struts = [_WatchedStrut(scene, name, spring, solver, self.limit) for name, spring in scene.struts.items()]
        self.watched: list[_WatchedStop | _WatchedStrut] = [*self.contacts, *struts]
        self.record = Record([], [], [], [], [])
        self.rejected = 0
        self.accelerations: Array | None = None
        self.candidate: Array | None = None
        self.error = 0.0
        self.deadline = perf_counter() + timeout if timeout else None
        self.progress = progress
        self.failure: tuple[Status, str] | None = None

    def after_newton(self, _system: Any, _t: float) -> list[float]:
        """Engine callback: [error, recommended step]; a large error with a smaller step rejects this one."""
        self.candidate = self.data.GetODE2Coordinates_tt() * self.weights
        h = self.engine.it.currentStepSize
        if self.accelerations is None:
            return [0.0, -1.0]
        errors = h * h / 12 * np.abs(self.candidate - self.accelerations)
        self.error = max([float(errors.max(initial=0.0)) / self.limit, *(w.excess(h, errors) for w in self.watched)])
        if self.error <= 2 or h <= self.solver.min_step:
            return [0.0, -1.0]
        self.rejected += 1
        return [1e300, max(self.solver.min_step, h * _factor(self.error))]

    def after_step(self, _system: Any, t: float) -> bool:
        """Engine callback: record the step and set the next size; False ends the run."""
        q, q_t = self.data.GetODE2Coordinates(), self.data.GetODE2Coordinates_t()
        record = self.record
        record.time.append(t)
        record.q.append(q)
        record.q_t.append(q_t)
        record.multipliers.append(self.data.GetAECoordinates())
        record.contact.append([stop.accept(q, q_t) for stop in self.contacts])
        if self.progress is not None:
            self.progress(t / self.duration)
        if self.solver.uniform_steps is None:
            self._next_step(q, q_t)
        return self._may_go_on(t)

    def _next_step(self, q: Array, q_t: Array) -> None:
        h = self.engine.it.currentStepSize
        if self.accelerations is None:  # the start: nothing is known yet
            self.accelerations = self.data.GetODE2Coordinates_tt() * self.weights
            self.engine.it.currentStepSize = max(self.solver.min_step, 1e-3 * self.max_step)
            return
        self.accelerations = self.candidate
        wanted = min(self.max_step, h * _factor(self.error))
        for watched in self.watched:
            wanted = min(wanted, watched.step_limit(q, q_t, wanted))
        if not 0.8 * h < wanted < 1.25 * h or wanted > self.max_step:
            self.engine.it.currentStepSize = max(self.solver.min_step, wanted)

    def _may_go_on(self, t: float) -> bool:
        count = len(self.record.time)
        if count > self.solver.max_steps:
            self.failure = (Status.TOO_MANY_STEPS, f"more than max_steps = {self.solver.max_steps} steps by t = {t:.6g} s")
        elif self.deadline and count % 16 == 0 and perf_counter() > self.deadline:
            self.failure = (Status.TIMED_OUT, f"out of time at t = {t:.6g} s of {self.duration:.6g} s after {count} steps")
        elif not np.isfinite(self.record.q[-1][-1]):
            self.failure = (Status.NOT_FINITE, f"coordinates are not finite at t = {t:.6g} s")
        return self.failure is None


class _WatchedStop:
    """One stop under watch: its force and how large the next step may be."""

    def __init__(self, scene: Scene, point: str, contact: StopContact, solver: Solver) -> None:
        self.contact, self.resolution = contact, solver.contact_resolution
        self.column = int(scene.placed[point].columns(scene.system)[0, 0])
        self.mass = max(scene.mechanism.guide(point).mass, LIGHTEST)
        self.touching = False
        self.force = self.shortest = 0.0

    def accept(self, q: Array, q_t: Array) -> float:
        """Take over an accepted step; the contact force, N."""
        travel, speed = float(q[self.column]), float(q_t[self.column])
        self.touching = self.contact.accept(travel, speed)
        self.force = self.contact.force(travel, speed) if self.touching else 0.0
        return self.force

    def step_limit(self, q: Array, q_t: Array, wanted: float) -> float:
        """Land just inside on onset; resolve the impact; leave a resting contact alone."""
        speed = self.contact.side * float(q_t[self.column])
        gap = -float(self.contact.depth(q[self.column]))
        if not self.touching and not 0 < gap < speed * wanted:
            return wanted
        lasts = contact_time(self.contact.stop.law, self.mass, self.contact.onset)
        if not self.touching:
            return _landing(gap, speed, 0.1 * lasts / self.resolution, wanted)
        self.shortest = lasts / self.resolution
        if abs(speed) * lasts > STRIKING * abs(gap):
            return min(wanted, self.shortest)
        return min(wanted, max(self.shortest, _landing(-gap, -speed, 0.0, wanted)))  # a slow release, too, ends on a step

    def excess(self, h: float, errors: Array) -> float:
        """Error of the force of a contact that lasts, in units of its limit: a small position error on a stiff stop."""
        if self.force == 0 or h <= self.shortest:
            return 0.0
        stiffness = self.contact.stop.law.stiffness  # order of magnitude only, for exponents beyond 1
        return stiffness * errors[self.column] / (FORCE_ERROR * self.force)


class _WatchedStrut:
    """One strut under watch: where it snaps taut, the force law has a kink and a stiff side."""

    def __init__(self, scene: Scene, name: str, spring: StrutSpring, solver: Solver, limit: float) -> None:
        self.spring, self.limit, self.resolution = spring, limit, solver.contact_resolution
        link = scene.mechanism.link(name)
        masses = [guide.mass for guide in scene.mechanism.guides if guide.point in link.points]
        self.accepted = 0.0
        self.half_period = np.pi * np.sqrt(max(min(masses, default=0.1), LIGHTEST) / spring.rigidity)

    def step_limit(self, _q: Array, _q_t: Array, wanted: float) -> float:
        """Land at the kink when straightening; resolve the ringing of a strut that snapped taut."""
        self.accepted = self.spring.elongation
        gap, speed = self.spring.kink - self.spring.elongation, self.spring.rate
        resolved = self.half_period / self.resolution
        if gap > 0:
            return _landing(gap, speed, 0.1 * resolved, wanted)
        ringing = abs(speed) * self.half_period > self.limit
        return min(wanted, resolved) if ringing else wanted

    def excess(self, h: float, _errors: Array) -> float:
        """Jump of a straight strut's force over the step, in Euler loads: a position error no one sees is a force here."""
        before, now = self.accepted, self.spring.elongation
        if h <= self.half_period / self.resolution or min(before, now) < self.spring.kink:
            return 0.0
        return abs(now - before) / -self.spring.kink


def _landing(gap: float, speed: float, past: float, wanted: float) -> float:
    """Step that ends just past a gap closing at this speed."""
    return gap / speed + past if speed > 0 and gap < speed * wanted else wanted


def _factor(error: float) -> float:
    """Change of the step that brings a third-order local error, in units of its limit, to 1 with a margin: 0.2 to 2."""
    return min(2.0, max(0.2, 0.8 * max(error, 1e-300) ** (-1 / 3)))


def _position_weights(scene: Scene) -> Array:
    """Weight of each coordinate in the error norm, m: positions 1, rigid rotations half the link, beam rotations 0."""
    weights = np.zeros(scene.system.systemData.ODE2Size())
    for placed in scene.placed.values():
        columns = placed.columns(scene.system)
        if isinstance(placed.body, Guide):
            weights[columns] = 1.0
            continue
        weights[columns[:, :2]] = 1.0
        if isinstance(placed.body, Rigid):
            weights[columns[:, 2]] = scene.mechanism.length(placed.name) / 2
    return weights
