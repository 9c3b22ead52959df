"""The ladder of each solver: settings that go finer, rung by rung, in time and in space apart.

A rung in time divides the tolerance by 8: steps of a method of fifth order shrink by a third, those of second order by half. A
rung in space adds two degrees to a strip's polynomials, or doubles its elements. The longest step goes with the rung, so that two
runs never share one. Rigid links have no space; the modes of `Modal` are the user's model, and `Closure` integrates nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Protocol

from buckler.mbs.compiler import compiler
from buckler.mbs.elements.clearance import clearances
from buckler.mbs.functions import own_functions
from buckler.mbs.kinematics.determined import answered
from buckler.mbs.kinematics.exact import sample_times
from buckler.mbs.mechanism import Mechanism
from buckler.mbs.record.run import Run
from buckler.mbs.solvers.choice import is_loose, usual_tolerance
from buckler.mbs.solvers.closure import Closure
from buckler.mbs.solvers.exudyn import Exudyn
from buckler.mbs.solvers.spectral import Spectral
from buckler.mbs.solvers.steps import COARSEST, Controlled

STRICTER = 8.0
"""Ratio of the tolerances of two rungs."""
TOLERANCE, POWER, PLAIN = 1e-4, 0.8, 1e-3
"""The compiled solver's first tolerance for an error of `PLAIN`; it goes by this power of the error: Radau IIA of three stages
controls a local error of fourth order, so that a global one is a step better."""
ORDER = 5
"""Order by which its longest step goes with the tolerance."""
DEGREE = 6
"""Degree of a strip's first polynomials: whole bending within and four more."""
RADII = (Exudyn().spectral_radius, 0.9)
"""Spectral radius of Exudyn's rungs by turns: what damping takes differs from rung to rung, and so is seen."""
TINIEST = 1e-13
"""No tolerance below: what is left is rounding."""
Runner = Callable[[Mechanism, float, Any], Run]


class Ladder(Protocol):
    """Settings rung by rung."""

    @property
    def in_space(self) -> bool:
        """Whether finer rungs in space exist."""

    @property
    def refines_space(self) -> bool:
        """Whether what is delivered may be finer in space: not where a user named the elements."""

    def made(self, time: int, space: int, run: Runner) -> Run:
        """The run of a rung."""


@dataclass(frozen=True)
class Integrated:
    """A mechanism, a run's length, s, the error for which it begins, and the solver whose settings go finer."""

    mechanism: Mechanism
    duration: float
    level: float
    solver: Any

    @property
    def in_space(self) -> bool:
        """Whether there is a strip."""
        return any(link.body.meshed for link in self.mechanism.links)


class SpectralLadder(Integrated):
    """Of the compiled solver: tolerance and longest step; the degree of strips."""

    refines_space: ClassVar[bool] = True

    @property
    def play(self) -> float:
        """The smallest clearance over the longest link, of which the tolerance is a part; 1 without clearance."""
        size = max(self.mechanism.length(link.name) for link in self.mechanism.links)
        return min([1.0, *(joint.gap / size for joint in clearances(self.mechanism))])

    def made(self, time: int, space: int, run: Runner) -> Run:
        """See `Ladder`."""
        share = (self.level / PLAIN) ** POWER / STRICTER**time
        longest = self.duration / COARSEST * min(1.0, share ** (1 / ORDER))
        most = self.solver.steps.max_steps
        steps = Controlled(tolerance=max(TINIEST, TOLERANCE * share * self.play), max_step=longest, max_steps=most)
        contact = self.solver.contact_tolerance * min(1.0, share)
        degree = (self.solver.degree or DEGREE) + 2 * space if self.in_space else self.solver.degree
        settings = replace(self.solver, steps=steps, degree=degree, contact_tolerance=contact)
        return run(self.mechanism, self.duration, settings)


class ExudynLadder(Integrated):
    """Of Exudyn: tolerance, longest step, damping; elements of strips."""

    @property
    def refines_space(self) -> bool:
        """Whether no strip names its elements."""
        return all(link.body.meshed_freely for link in self.mechanism.links if link.body.meshed)

    def made(self, time: int, space: int, run: Runner) -> Run:
        """See `Ladder`."""
        if not time and self.level >= PLAIN:
            return run(_meshed(self.mechanism, 2**space), self.duration, self.solver)
        share = min(1.0, self.level / PLAIN) / STRICTER**time
        usual = Controlled()
        half = 2.0**time / min(1.0, self.level / PLAIN) ** 0.5
        steps = replace(
            usual,
            tolerance=max(TINIEST, usual_tolerance(self.mechanism) * share),
            max_step=self.duration / (200 * half),
            contact_resolution=min(10_000, round(usual.contact_resolution * half)),
        )
        damped = self.solver if is_loose(self.mechanism) else replace(self.solver, spectral_radius=RADII[time % 2])
        return run(_meshed(self.mechanism, 2**space), self.duration, replace(damped, steps=steps))


@dataclass(frozen=True)
class ClosureLadder:
    """Of loop closure: only the samples can be too few."""

    mechanism: Mechanism
    duration: float
    in_space: ClassVar[bool] = False
    refines_space: ClassVar[bool] = False

    def made(self, time: int, _space: int, run: Runner) -> Run:
        """See `Ladder`."""
        if not time:
            return run(self.mechanism, self.duration, Closure())
        samples = len(sample_times(self.mechanism, self.duration, Controlled()))
        each = min(10_000, Controlled().contact_resolution * 2**time)
        finer = Controlled(max_step=self.duration / (samples * 2**time), contact_resolution=each)
        return run(self.mechanism, self.duration, Closure(finer))


def _meshed(mechanism: Mechanism, times: int) -> Mechanism:
    """The mechanism with so many times its elements."""
    if times == 1:
        return mechanism
    links = []
    for link in mechanism.links:
        body: Any = link.body
        finer = replace(body, elements=min(1000, times * body.count)) if body.meshed else body
        links.append(replace(link, body=finer))
    return replace(mechanism, links=links)


def ladder_of(mechanism: Mechanism, duration: float, level: float, solver: object) -> Ladder:
    """The ladder of a solver, for errors of about a level."""
    if isinstance(solver, Closure):
        return ClosureLadder(mechanism, duration)
    if isinstance(solver, Spectral):
        return SpectralLadder(mechanism, duration, level, solver)
    return ExudynLadder(mechanism, duration, level, solver)


def suited(mechanism: Mechanism) -> Closure | Exudyn | Spectral:
    """The solver of a ladder that names none.

    Loop closure where constraints alone decide the motion. Exudyn where a strip names its elements, as the answer is that of
    these, where a function in Python would have to be compiled, and for what the compiled solver does not take. Else that one.
    """
    if answered(mechanism):
        return Closure()
    named = any(link.body.meshed and not link.body.meshed_freely for link in mechanism.links)
    return Exudyn() if named or not compilable(mechanism) else Spectral()


def compilable(mechanism: Mechanism) -> bool:
    """Whether the compiled solver is there, takes a mechanism, and has no function in Python to compile."""
    if own_functions(mechanism) or not compiler():
        return False
    from buckler.mbs.spectral.run import takes  # loads the compiled solver

    return takes(mechanism)
