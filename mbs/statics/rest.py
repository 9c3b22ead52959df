"""Equilibrium of a mechanism under its loads, with stability and error."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry import Array
from ..mechanism import Mechanism
from ..process import one_thread
from ..spectral import tables as k
from ..spectral.scene import CompiledScene, Place
from ..validate import number
from .answer import HIGHEST, PLACES, RISE, Answer, Ending, check, list_omissions, reactions
from .problem import Problem, Rest, StaticsError, distance_between, has_strips, loads_of, moving, places
from .settling import RunsAwayError, SlackError, check_ropes, find

FRICTION = "friction may hold it elsewhere"


@dataclass(frozen=True)
class Equilibrium(Answer):
    """Equilibrium of a mechanism.

    Attributes
    ----------
    status : Ending
        OK where forces balance and no small motion grows, UNSTABLE where one does.
    message : str
    scene : CompiledScene
    q : array, shape (n,)
        Coordinates.
    multipliers : array, shape (r,)
        Of the constraints, in the order of `scene.row_names`, N or N m: -G^T lambda is the force they exert. See `reaction`.
    load : float
        Factor of the loads.
    stable : bool
        True if no small motion grows, by the spectrum of the whole tangent.
    growth : float
        Largest rate at which a small motion grows, 1/s; 0 if none does.
    neutral : tuple of str
        Links that a small motion moves without resistance: the equilibrium is one of many.
    error : float
        Error of positions over the longest link, and of angles [rad]: change by a higher degree of the strips, and last step.
    """

    scene: CompiledScene
    q: Array
    multipliers: Array
    load: float
    stable: bool
    growth: float
    neutral: tuple[str, ...]
    error: float

    def point(self, link: str, point: str) -> Place:
        """Return the place of a point of a link."""
        return places(self.scene, self.q, link, point)

    def reaction(self, name: str) -> Array:
        """Return force or torque of a constraint [N or N m], with the signs of the signals of a run; see `reactions`."""
        return reactions(self.scene, self.multipliers[None], name)[0]

    def rows(self) -> list[tuple[str, str]]:
        """Return rows of the table: stability, error, and places of points."""
        out = [("stable", "yes" if self.stable else f"no, grows at {self.growth:.4g} 1/s"), ("error", f"{self.error:.1e}")]
        for link in self.scene.mechanism.links:
            if not link.body.massless:
                for point in link.points:
                    at = self.point(link.name, point)
                    out.append((f"{link.name}:{point}", f"{at.position[0]:.9g} m, {at.position[1]:.9g} m, {at.angle:.9g} rad"))
        return out


@one_thread()
def equilibrium(mechanism: Mechanism, load: float = 1.0, *, degree: int | None = None) -> Equilibrium:
    """Find the equilibrium of a mechanism with its drives held at t = 0 and its loads multiplied by `load`.

    Loads grow from zero, from the stress-free start. Where the mechanism is free, or that branch ends, pseudo-transient
    continuation leads to a stable equilibrium.

    Parameters
    ----------
    mechanism : Mechanism
    load : float
        Factor of all forces, torques and gravity; springs, contacts and strips keep theirs.
    degree : int, optional
        Degree of the strips; by default it is raised until the error is below 1e-8 of the longest link.

    Returns
    -------
    Equilibrium
        Its status tells whether forces balance, and whether the state is stable.

    Raises
    ------
    ValueError
        If an argument is invalid.
    """
    check(mechanism, degree)
    number("load", load, -np.inf, np.inf, "1")
    scene = CompiledScene.of(mechanism, degree)
    problem = Problem(scene, loads_of(scene))
    try:
        return _answer(problem, *find(problem, load), degree is not None)
    except StaticsError as error:
        return _make_failure(problem, error, load)
    finally:
        problem.set(1.0)


def _refine(problem: Problem, rest: Rest, fixed: bool) -> tuple[Problem, Rest, float]:
    """Raise the degree, unless `fixed`, until the error is small."""
    error, before = 0.0, np.inf
    while has_strips(problem.scene):
        finer, guess = problem.refine(rest, RISE)
        try:
            new = finer.newton(guess)
        except StaticsError:
            return problem, rest, np.inf
        error = distance_between(finer.scene, guess.q, new.q)
        if fixed:
            break
        problem, rest = finer, new
        if error <= PLACES or error > 0.5 * before or problem.scene.degree > HIGHEST:
            break
        before = error
    return problem, rest, error


def _answer(problem: Problem, rest: Rest, message: str, fixed: bool) -> Equilibrium:
    """Make the result: equilibrium with error and stability."""
    problem, rest, error = _refine(problem, rest, fixed)
    check_ropes(problem, rest)
    error = max(error, problem.step(rest)[1])
    spectrum = problem.spectrum(rest)
    neutral = tuple(moving(problem.scene, rest.q, np.real(shape)) for shape in spectrum.shapes[:, spectrum.neutral].T)
    growth = float(spectrum.growth.max(initial=0.0))
    status = Ending.INACCURATE if error >= 1e-4 else Ending.UNSTABLE if growth else Ending.OK
    said = [message] if message else []
    if neutral:
        said.append(f"one of many: nothing holds {', '.join(dict.fromkeys(map(repr, neutral)))}")
    if growth > 0.0:
        said.append(f"unstable: a small motion grows at {growth:.4g} 1/s")
    if status is Ending.INACCURATE:
        hint = "; give a higher degree, or points along the strip" if has_strips(problem.scene) else ""
        said.append(f"its error is {error:.1e} of the longest link{hint}")
    problem.set(1.0)
    said += list_omissions(problem.scene.mechanism, FRICTION)
    return Equilibrium(
        status, "; ".join(said), problem.scene, rest.q, rest.multipliers, rest.parameter, growth == 0.0, growth, neutral, error
    )  # fmt: skip


def _make_failure(problem: Problem, error: Exception, load: float) -> Equilibrium:
    """Make the result of a search that failed."""
    scene = problem.scene
    contacts = [
        name for name, force in zip(scene.force_names, scene.tables.forces, strict=True) if force[0] in (k.CONTACT, k.JOURNAL)
    ]
    status, message = Ending.NOT_REACHED, str(error)
    if isinstance(error, RunsAwayError):
        status = Ending.OPEN_CONTACT if contacts else Ending.FREE_MOTION
        message += f"; open: {', '.join(contacts)}" if contacts else ""
    elif isinstance(error, SlackError):
        status = Ending.SLACK
    message = "; ".join([message, *list_omissions(scene.mechanism, FRICTION)])
    nowhere = np.full(scene.size, np.nan), np.full(len(scene.row_names), np.nan)
    return Equilibrium(status, message, scene, *nowhere, load, False, float("nan"), (), float("inf"))
