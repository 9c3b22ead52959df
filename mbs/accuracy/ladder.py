"""The ladder of each solver: settings that go finer, rung by rung, in time and in space apart.

A rung in time divides the tolerance, and the longest step goes with it, so that two runs never share one. A rung in space adds
two degrees to a strip's polynomials, or doubles its elements. The modes of `Modal` are the user's model.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from ..elements.clearance import clearances
from ..functions import own_functions
from ..kinematics.determined import answered
from ..kinematics.exact import sample_times
from ..mechanism import Mechanism
from ..process import compiler
from ..record.run import Run
from ..solvers import COARSEST, Closure, Controlled, Exudyn, Spectral, is_loose, usual_tolerance
from .goal import PLACE

STRICTER = 8.0
"""Ratio of the tolerances of two rungs in time, and of the errors of two in space at least."""
ORDER = 4
"""Of the local error that the compiled solver controls: steps go by this root of the tolerance. Radau IIA of three stages is of
fifth order in places, and of third in forces: E. Hairer, C. Lubich, M. Roche, Lect. Notes Math. 1409 (1989), doi
10.1007/BFb0093947. Exudyn's method is of second order, its local error of third."""
GAIN = STRICTER ** ((ORDER - 1) / ORDER)
"""What a rung in time makes of the errors that go down most slowly."""
TOLERANCE = 1e-4
"""The compiled solver's first tolerance for an error of `PLACE`."""
DEGREE = 6
"""Degree of a strip's first polynomials: whole bending within and four more."""
RADII = (Exudyn().spectral_radius, 0.9)
"""Spectral radius of Exudyn's rungs by turns: what damping takes differs from rung to rung, and so is seen."""
Runner = Callable[[Mechanism, float, Any], Run]


@dataclass(frozen=True)
class Ladder:
    """A mechanism, a run's length, s, the error for which it begins, and the solver whose settings go finer."""

    mechanism: Mechanism
    duration: float
    level: float
    solver: Any

    @property
    def in_space(self) -> bool:
        """Whether finer rungs in space exist: whether there is a strip."""
        return any(link.body.meshed for link in self.mechanism.links)

    def made(self, time: int, space: int, run: Runner) -> Run:
        """The run of a rung."""
        raise NotImplementedError


class SpectralLadder(Ladder):
    """Of the compiled solver: tolerance and longest step; the degree of strips."""

    def made(self, time: int, space: int, run: Runner) -> Run:
        """See `Ladder`."""
        share, rung = (self.level / PLACE) ** (ORDER / (ORDER + 1)), STRICTER**-time
        stricter = min(1.0, min(1.0, share) * rung)  # than the coarsest: of each rung, so that two runs share nothing
        longest = self.duration / COARSEST * stricter ** (1 / ORDER)
        size = max(self.mechanism.length(link.name) for link in self.mechanism.links)
        clearance = min([1.0, *(joint.gap / size for joint in clearances(self.mechanism))])
        steps = Controlled(TOLERANCE * share * rung * clearance, longest, max_steps=self.solver.steps.max_steps)
        contact = self.solver.contact_tolerance * stricter
        degree = (self.solver.degree or DEGREE) + 2 * space if self.in_space else self.solver.degree
        settings = replace(self.solver, steps=steps, degree=degree, contact_tolerance=contact)
        return run(self.mechanism, self.duration, settings)


class ExudynLadder(Ladder):
    """Of Exudyn: tolerance, longest step, damping; elements of strips."""

    def made(self, time: int, space: int, run: Runner) -> Run:
        """See `Ladder`."""
        share, settings = min(1.0, self.level / PLACE) / STRICTER**time, self.solver
        if share < 1:
            steps = _finer(share ** (-1 / 3), Controlled().longest(self.duration))
            steps = replace(steps, tolerance=usual_tolerance(self.mechanism) * share)
            loose = is_loose(self.mechanism)
            settings = replace(settings, steps=steps, **({} if loose else {"spectral_radius": RADII[time % 2]}))
        return run(_meshed(self.mechanism, 2**space), self.duration, settings)


class ClosureLadder(Ladder):
    """Of loop closure: only the samples can be too few."""

    def made(self, time: int, space: int, run: Runner) -> Run:
        """See `Ladder`."""
        each = self.duration / len(sample_times(self.mechanism, self.duration, Controlled()))
        return run(self.mechanism, self.duration, Closure(_finer(2**time, each)) if time else Closure())


def _finer(times: float, step: float) -> Controlled:
    """Steps so many times finer than a step, s, and than those a contact takes usually."""
    return Controlled(max_step=step / times, contact_resolution=min(10_000, round(Controlled().contact_resolution * times)))


def _meshed(mechanism: Mechanism, times: int) -> Mechanism:
    """The mechanism with so many times its elements."""
    bodies: list[Any] = [link.body for link in mechanism.links]
    finer = [replace(body, elements=min(1000, times * body.count)) if body.meshed else body for body in bodies]
    links = [replace(link, body=body) for link, body in zip(mechanism.links, finer, strict=True)]
    return replace(mechanism, links=links) if times > 1 else mechanism


def ladder_of(mechanism: Mechanism, duration: float, level: float, solver: object) -> Ladder:
    """The ladder of a solver, for errors of about a level."""
    kinds: dict[type, type[Ladder]] = {Closure: ClosureLadder, Spectral: SpectralLadder, Exudyn: ExudynLadder}
    return kinds[type(solver)](mechanism, duration, level, solver)


def suited(mechanism: Mechanism) -> Closure | Exudyn | Spectral:
    """The solver of a ladder that names none: loop closure where constraints alone decide the motion, the compiled solver, or
    Exudyn for what that cannot take.
    """
    if answered(mechanism):
        return Closure()
    return Spectral() if compilable(mechanism) else Exudyn()


def compilable(mechanism: Mechanism) -> bool:
    """Whether the compiled solver is there, takes a mechanism, and has no function in Python to compile."""
    if own_functions(mechanism) or not compiler():
        return False
    from ..spectral.run import takes  # loads the compiled solver

    return takes(mechanism)
