"""With which steps and elements to begin when an accuracy is asked for: measured once, so that the first try mostly serves."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil, hypot, log2, pi, sqrt, tan
from typing import Any

from buckler.mbs.elements.clearance import clearances
from buckler.mbs.elements.drive import Ramp
from buckler.mbs.elements.element import kinks_of
from buckler.mbs.kinematics.inertias import axial_period
from buckler.mbs.kinematics.linkage import turning_speed
from buckler.mbs.mechanism import Mechanism
from buckler.mbs.solvers.choice import is_loose
from buckler.mbs.solvers.exudyn import Exudyn
from buckler.mbs.solvers.steps import Controlled, Equal

PHASE, STRIKING_PHASE = 0.95, 6.5
"""Steps of the coarsest run for an accuracy of 1e-3, a radian of the first bending vibration: of fourth order in the accuracy."""
TURN, STRIKING_TURN, RIGID_TURN = 52, 350, 100
"""The same, a turn of the drive at least: without and with stops, struts or friction, and of rigid links, which cost little."""
FEWEST = 32
"""Steps of the coarsest run at least."""
MESH, STRIKING_MESH = 4, 10
"""Cable elements for an accuracy of 1e-3, where nothing strikes and where something does: of fourth order in the accuracy."""
SAMPLE, SAMPLES, AXIAL_SAMPLES = 0.3, 200, 8
"""Times recorded: as far apart, in rad of the fastest vibration that is resolved, and so many at least; and so many of each axial
period, over which forces are averaged, as the steps allow."""
LONG = 400.0
"""Phase of the first bending vibration, rad, from which its numerical damping matters more than that of axial waves."""
RADIUS, LONG_RADIUS = 0.75, 0.9
"""Spectral radius at infinite frequency, below and beyond that phase; 1 leaves the axial waves to Newton's method."""
LONGEST = 1.3
"""Steps, times the frequency, rad, up to which the fitted density follows them."""
RESIDUAL, RESIDUAL_FREE, ROUND_OFF = 1e-3, 1e-6, 1e-14
"""Newton's tolerance: of the accuracy, over the motion's forces, with a drive and without one, where what each step leaves adds
up, the same in runs of all steps, and their differences do not tell it; what round-off leaves, over axial stiffness and elements.
"""
REUSED = 6e-3
"""Turn of the drive a step, rad, below which Newton's Jacobian serves for many."""
AXIAL = 0.15
"""Error of leaving out axial vibration, over the square of the ratio of the first bending frequency to the axial one."""
AXIAL_PHASE, LONGEST_AXIAL = 2.0, 1e4
"""Steps of the coarsest run a radian of axial vibration where that is resolved, and its phase, rad, up to which it is."""
SHORTEST, MOST = 1e-4, 20
"""Shortest step, of the longest, and most steps, of as many as with the longest: beyond them a run is not worth its time."""
CONTACT_RESOLUTION = 24
"""Steps of the coarsest run for half an oscillation of a striking mass, for an accuracy of 1e-3."""
LOOSE = 1e-3
"""Tolerance of the coarsest run where something strikes: it catches impacts only, the longest step decides elsewhere."""


PLAY, PLAY_ORDER, PLAY_FINEST = (0.5, 2e-3), (1.0, 1.4), 1e-9
"""Tolerance with clearance for an accuracy of 1: explicit (see `solvers.choice.is_loose`), implicit; the power of the accuracy it
goes by; the least."""
PLAY_STEPS, PLAY_RADIUS = 200, 0.9
"""Steps at least, in all, with clearance, and the spectral radius of implicit ones."""


@dataclass(frozen=True)
class Plan:
    """What a scene is, for the choice of its settings.

    Attributes
    ----------
    mechanism : Mechanism
    duration, asked : float
        s, 1.
    """

    mechanism: Mechanism
    duration: float
    asked: float

    @property
    def play(self) -> bool:
        """Whether joints have clearance."""
        return bool(clearances(self.mechanism))

    @cached_property
    def smooth(self) -> bool:
        """Whether nothing in the scene has a kink: no stop, no clearance, no strut, no friction, no table in a drive or load.

        Equal steps do not end at the points of a table; at the end of one ramp they do (`_aligned`).
        """
        m = self.mechanism
        struts = any(link.body.massless for link in m.links)
        kinked = kinks_of(m, self.duration) and not (len(m.drives) == 1 and isinstance(m.drives[0].motion, Ramp))
        return not (self.play or m.stops or struts or kinked or any(guide.friction for guide in m.guides))

    @property
    def meshed(self) -> bool:
        """Whether a link leaves its elements to us."""
        return any(link.body.meshed_freely for link in self.mechanism.links)

    @cached_property
    def frequency(self) -> float:
        """Largest first bending frequency of a flexible link, or the pendulum's, rad/s."""
        m = self.mechanism
        bending = [link.body.first_frequency(m.length(link.name)) for link in m.links]
        shortest = min(m.length(link.name) for link in m.links)
        return max([(hypot(*m.gravity) / shortest) ** 0.5, *bending])

    @property
    def phase(self) -> float:
        """Of the first bending vibration over the run, rad."""
        return self.duration * self.frequency

    @cached_property
    def speed(self) -> float:
        """Largest speed of a turning drive, rad/s; 0 without one."""
        return turning_speed(self.mechanism, self.duration)

    @property
    def finer(self) -> float:
        """Factor on steps and elements, of fourth order, for another accuracy than 1e-3."""
        return (1e-3 / self.asked) ** 0.25

    def steps(self) -> int:
        """Steps of the coarsest run."""
        phase, turn = (PHASE, TURN) if self.smooth else (STRIKING_PHASE, STRIKING_TURN)
        if self.smooth and not any(link.body.flexible for link in self.mechanism.links):
            turn = RIGID_TURN
        turns = self.speed * self.duration / (2 * pi)
        axial = AXIAL_PHASE * self.axial[1] if self.resolved else 0.0
        oscillation = self.phase * max(phase * self.finer, 1 / LONGEST)
        return self._aligned(ceil(max(FEWEST, oscillation, turn * turns * max(1.0, self.finer), axial)))

    @property
    def kinked(self) -> bool:
        """Whether the drive's acceleration may jump: every other motion than one at constant speed."""
        times = [k * self.duration / 10 for k in range(11)]
        return any(len({drive.motion.speed(t) for t in times}) > 1 for drive in self.mechanism.drives)

    def _aligned(self, least: int) -> int:
        """As many steps, or up to half as many more, so that a ramp ends at the end of one: its kink spoils a power series."""
        motion = self.mechanism.drives[0].motion if self.mechanism.drives else None
        if not isinstance(motion, Ramp) or motion.duration >= self.duration or not self.kinked:
            return least
        share = motion.duration / self.duration
        return min(range(least, least + least // 2 + 1), key=lambda n: (round(abs(share * n - round(share * n)), 9), n))

    @cached_property
    def axial(self) -> tuple[float, float]:
        """Error of a smooth motion that leaves out axial vibration, and the phase of that over the run, rad."""
        m = self.mechanism
        mass = sum(guide.mass for guide in m.guides) or self._mass()
        found = [(0.0, 0.0)]
        for link in m.links if self.smooth else ():
            if link.body.meshed:
                section, length = link.body.section, m.length(link.name)
                frequency = sqrt(section.axial_stiffness / (length * mass))
                found.append((AXIAL * (section.first_frequency(length) / frequency) ** 2, frequency * self.duration))
        return max(found)

    @property
    def resolved(self) -> bool:
        """Whether steps resolve axial vibration, which they need not where its effect is below the accuracy."""
        error, phase = self.axial
        return error > self.asked / 2 and phase < LONGEST_AXIAL

    def mesh(self) -> int:
        """Cable elements of a link, even."""
        if self.smooth:
            return max(MESH, 2 * round(MESH * self.finer / 2))
        return max(STRIKING_MESH, 2 * round(STRIKING_MESH * self.finer / 2))

    def model(self, steps: int, mesh: int) -> Mechanism:
        """The mechanism for so many steps, with so many elements in the links that leave them to us.

        In a smooth scene of equal steps the links' density is fitted to the step: see `fitted`.
        """
        links = []
        for link in self.mechanism.links:
            body: Any = link.body
            if body.meshed:
                frequency = body.first_frequency(self.mechanism.length(link.name))
                factor = fitted(frequency * self.duration / steps, self.radius)
                if body.meshed_freely:
                    body = replace(body, elements=min(1000, round(mesh * body.worth.like_cables)))
                    factor /= body.stiffening**2
                if self.smooth:
                    material = replace(body.section.material, density=body.section.material.density / factor)
                    body = replace(body, section=replace(body.section, material=material))
            links.append(replace(link, body=body))
        return replace(self.mechanism, links=links)

    @property
    def radius(self) -> float:
        """Spectral radius of generalized-alpha."""
        return LONG_RADIUS if self.phase > LONG or self.resolved else RADIUS

    def solver(self, steps: int, mesh: int, refined: float) -> Exudyn:
        """Settings for so many steps; `refined` is how many times more they are than those of the first coarsest run."""
        if self.smooth:
            phase = self.axial[1] if self.resolved else self.phase
            mean = axial_period(self.mechanism) / (AXIAL_SAMPLES * self.duration) or 1.0
            apart = min(SAMPLE / max(phase, SAMPLE), 1 / SAMPLES, mean) * steps
            seldom = 2 ** max(0, int(log2(apart)))  # of steps doubled and doubled again, the last one is recorded too
            return Exudyn(
                Equal(steps, seldom),
                spectral_radius=self.radius,
                newton_absolute=self._residual(mesh),
                reuse_jacobian=self.speed * self.duration / steps < REUSED,
            )
        return Exudyn(
            Controlled(
                tolerance=LOOSE / refined**2,
                max_step=self.duration / steps,
                min_step=SHORTEST * self.duration / steps,
                max_steps=MOST * steps,
                contact_resolution=ceil(CONTACT_RESOLUTION * refined * max(1.0, self.finer)),
            ),
            spectral_radius=self.radius,
            newton_absolute=self._residual(mesh),
        )

    def thinned(self, share: float) -> Mechanism:
        """The mechanism with this share of their elements in the links that leave them to us."""
        links = []
        for link in self.mechanism.links:
            body: Any = link.body
            if body.meshed_freely:
                body = replace(body, elements=max(1, int(share * body.count)))
            links.append(replace(link, body=body))
        return replace(self.mechanism, links=links)

    def with_play(self, finer: float) -> Exudyn:
        """Settings with clearance, for a tolerance so many times finer than that of the first run."""
        implicit = not is_loose(self.mechanism)
        tolerance = PLAY[implicit] * self.asked ** PLAY_ORDER[implicit] / finer
        longest = self.duration / (PLAY_STEPS * max(finer, 1.0) ** (1 / 3))
        return Exudyn(Controlled(max(PLAY_FINEST, tolerance), longest), spectral_radius=PLAY_RADIUS)

    def _mass(self) -> float:
        """Of sliders and links, kg."""
        m = self.mechanism
        links = [link.mass(m.length(link.name)) for link in m.links if not link.body.massless]
        return sum(links) + sum(guide.mass for guide in m.guides)

    def _residual(self, mesh: int) -> float | None:
        """Newton's absolute tolerance, N, by the forces of the motion, which may be a ten-millionth of the axial stiffness."""
        m, mass = self.mechanism, self._mass()
        size = max(m.length(link.name) for link in m.links)
        sections = [(link.body.section, m.length(link.name)) for link in m.links if link.body.meshed]
        forces = [mass * (size * self.speed**2 + hypot(*m.gravity))]
        if not self.smooth:
            forces += [section.euler_load(length) for section, length in sections]
        if not max(forces) > 0:
            return None
        stiff = max([section.axial_stiffness for section, _ in sections], default=0.0)
        return max(1e-10, ROUND_OFF * mesh * stiff, (RESIDUAL if self.speed else RESIDUAL_FREE) * self.asked * max(forces))


def fitted(step: float, radius: float) -> float:
    """Factor by which a link's density is divided to give its first mode the right frequency in steps of omega h = `step`.

    Generalized-alpha of spectral radius rho gives a mode of omega the frequency 2 atan(omega h/2)/h, the trapezoidal rule's,
    less 3/8 (delta omega h)^2 of itself, delta = (1 - rho)/(1 + rho); a long vibration drifts out of phase. The factor undoes
    that, and tends to 1 with the square of the step, so that extrapolation to no step at all removes its effect.
    """
    x, delta = min(step, LONGEST), (1 - radius) / (1 + radius)
    return (2 * tan(x / 2) / x) ** 2 * (1 + 0.75 * (delta * x) ** 2)
