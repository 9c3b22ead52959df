"""Runs that share their steps, so that their differences are derivatives and not the noise of step control.

One run chooses the steps; the others end theirs at the same times, and where their own contacts begin: internal numerical
differentiation (H. G. Bock, Recent advances in parameter identification techniques for O.D.E., in: Numerical treatment of inverse
problems in differential and integral equations, Birkhäuser 1983, 95-121, doi 10.1007/978-1-4684-7324-7_7).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from buckler.mbs.compiler import compiler
from buckler.mbs.mechanism import Mechanism
from buckler.mbs.record.run import Run
from buckler.mbs.solvers.spectral import Spectral
from buckler.mbs.solvers.steps import Controlled

Array = np.ndarray[Any, Any]
TIGHT = 1e-7
"""Local error allowed of the run that chooses the steps."""
FINE = 1e-7
"""Local error, in the sense of the solver, within which runs of given steps locate the beginning of a contact."""
MOST = 20
"""Steps that a run may take, rejected ones too, for each that is given."""
DEGREES = 4
"""Of a strip's polynomials, how many more a finer run has."""


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
        Times at which they end, s.
    solver : Spectral
    """

    duration: float
    ends: Array
    solver: Spectral

    @classmethod
    def of(cls, mechanism: Mechanism, duration: float, solver: Spectral | None = None) -> Steps:
        """Those that a run of a mechanism takes by itself.

        Raises
        ------
        RunFailedError
        """
        from buckler.mbs.spectral.run import once

        solver = replace(solver or Spectral(steps=Controlled(tolerance=TIGHT)), method="implicit")
        run = once(mechanism, duration, solver, every=2)
        _check(run)
        time = np.unique(run.record.time)
        ends = np.unique(np.concatenate([time, 0.5 * (time[1:] + time[:-1])]))[1:]
        return cls(duration, ends, replace(solver, steps=Controlled(tolerance=FINE, max_steps=MOST * len(ends))))

    def finer(self, degree: int) -> Steps:
        """Steps half as long, of strips with polynomials of higher degree than this one."""
        middle = self.ends - 0.5 * np.diff(self.ends, prepend=0.0)
        return replace(self, ends=np.sort([*middle, *self.ends]), solver=replace(self.solver, degree=degree + DEGREES))

    def run(self, mechanism: Mechanism, duration: float | None = None) -> Run:
        """Run a mechanism; over another duration the steps are stretched.

        Raises
        ------
        RunFailedError
        """
        from buckler.mbs.spectral.run import once

        duration = self.duration if duration is None else duration
        found = once(mechanism, duration, self.solver, ends=self.ends * (duration / self.duration))
        _check(found)
        return found


def _check(run: Run) -> None:
    if run.failure:
        raise RunFailedError(f"{run.failure[0]}: {run.failure[1]}")


def needs_compiler() -> None:
    """Refuse to start without the compiled solver.

    Raises
    ------
    ImportError
    """
    if not compiler():
        raise ImportError("derivatives, fits and designs need the compiled solver: pip install 'buckler[fast]'")
