"""Runs that share their steps, so that their differences are derivatives and not the noise of step control.

One run chooses the steps; the others end theirs at the same times, and where their own contacts begin: internal numerical
differentiation (H. G. Bock, Recent advances in parameter identification techniques for O.D.E., in: Numerical treatment of inverse
problems in differential and integral equations, Birkhäuser 1983, 95-121, doi 10.1007/978-1-4684-7324-7_7).
"""

from __future__ import annotations

from collections.abc import Callable
from contextvars import ContextVar
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from ..geometry import Array
from ..mechanism import Mechanism
from ..process import compiler
from ..record.errors import Status
from ..record.run import Run
from ..solvers import Controlled, Spectral

if TYPE_CHECKING:
    from ..spectral.scene import Scene
    from ..spectral.tape import Tape

TIGHT = Spectral(steps=Controlled(tolerance=1e-7), contact_tolerance=1e-3)
"""What chooses the steps, where nothing else is said: in contacts derivatives err far more than values do, as what a step errs by
depends on where in it a contact lets go."""
FINE = 1e-9
"""Local error, in the sense of the solver, within which runs of given steps locate the beginning of a contact."""
MOST = 20
"""Steps that a run may take, rejected ones too, for each that is given."""
TAPED = 50_000
"""Steps, the first ones, whose factors are kept."""
DEGREES = 4
"""Of a strip's polynomials, how many more a finer run has."""


looked: ContextVar[Callable[[], object]] = ContextVar("looked", default=lambda: None)
"""Is called before each run, as by a command that shows how many there were."""


class RunFailedError(RuntimeError):
    """A run that a derivative, a fit or a design needs did not end."""


@dataclass(frozen=True)
class Steps:
    """Steps that several runs share.

    Attributes
    ----------
    duration : float
        s.
    ends : array, shape (steps,)
        Times at which they end, s, but for beginnings of contacts.
    solver : Spectral
    tapes : list of Tape
        What the first of the runs leaves for the others.
    """

    duration: float
    ends: Array
    solver: Spectral
    tapes: list[Tape] = field(default_factory=list)

    @classmethod
    def of(cls, mechanism: Mechanism, duration: float, solver: Spectral | None = None, most: int | None = None) -> Steps:
        """Those that a run of a mechanism takes by itself, `most` of them at most.

        Raises
        ------
        RunFailedError
        """
        return cls.chosen(mechanism, duration, solver, most)[0]

    @classmethod
    def chosen(
        cls, mechanism: Mechanism, duration: float, solver: Spectral | None = None, most: int | None = None, asked: str = ""
    ) -> tuple[Steps, Run]:
        """The same, and the run itself, with the signals that a text names, or all."""
        from ..spectral.scene import Scene  # loads the compiler
        from ..spectral.tape import ends_of, tape_for

        solver = replace(solver or TIGHT, method="implicit")
        if most and isinstance(solver.steps, Controlled):
            solver = replace(solver, steps=replace(solver.steps, max_steps=min(most, solver.steps.max_steps)))
        scene = Scene.of(mechanism, solver.degree)
        tape = tape_for(scene, TAPED)
        run = _run(scene, duration, solver, asked, tape)
        ends = ends_of(tape, run.record.time)
        return cls(duration, ends, replace(solver, steps=Controlled(tolerance=FINE, max_steps=MOST * len(ends))), [tape]), run

    def coarser(self, degree: int) -> Steps:
        """Steps twice as long, of strips with polynomials of this degree."""
        ends = np.append(self.ends[1:-1:2], self.duration)
        return Steps(self.duration, ends, replace(self.solver, degree=degree))

    def finer(self, degree: int) -> Steps:
        """Steps half as long, of strips with polynomials of higher degree than this one."""
        middle = self.ends - 0.5 * np.diff(self.ends, prepend=0.0)
        solver = replace(self.solver, degree=degree + DEGREES)
        return Steps(self.duration, np.sort([*middle, *self.ends]), solver)

    def run(self, mechanism: Mechanism, duration: float | None = None, asked: str = "") -> Run:
        """Run a mechanism; over another duration the steps are stretched. It has the signals that a text names, or all.

        Raises
        ------
        RunFailedError
        """
        from ..spectral.scene import Scene
        from ..spectral.tape import tape_for

        duration, scene = self.duration if duration is None else duration, Scene.of(mechanism, self.solver.degree)
        if not self.tapes:
            self.tapes.append(tape_for(scene, TAPED))
        return _run(scene, duration, self.solver, asked, self.tapes[0], self.ends * (duration / self.duration))


def _run(scene: Scene, duration: float, solver: Spectral, asked: str, tape: Tape, ends: Array | None = None) -> Run:
    """Integrate a scene, by itself or on given steps."""
    from ..spectral.recording import record_of
    from ..spectral.run import integrate

    looked.get()()
    out, failure, counts = integrate(scene, duration, solver, ends=ends, tape=tape)
    if failure and failure[0] == Status.INTERRUPTED:
        raise KeyboardInterrupt
    if failure:
        raise RunFailedError(f"{failure[0]}: {failure[1]}")
    return Run(solver, record_of(scene, out), None, {"onsets": float(counts.onsets)}, asked=asked)


def needs_compiler() -> None:
    """Refuse to start without the compiled solver.

    Raises
    ------
    ImportError
    """
    if not compiler():
        raise ImportError("derivatives, fits and designs need the compiled solver: pip install 'buckler[fast]'")
