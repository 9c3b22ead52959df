"""Runs of the compiled solver for derivatives, fits and designs; a run that ends early raises an exception."""

from __future__ import annotations

from collections.abc import Callable
from contextvars import ContextVar
from dataclasses import replace

from ..mechanism import Mechanism
from ..process import compiler
from ..record.errors import Status
from ..record.run import Run
from ..solvers import Controlled, Spectral
from ..spectral.recording import record_of
from ..spectral.run import integrate
from ..spectral.scene import CompiledScene
from .reading import RunFailedError

before_run: ContextVar[Callable[[], object]] = ContextVar("before_run", default=lambda: None)
"""Function that is called before each run; a command counts and shows the runs with it."""


def finer(solver: Spectral, times: float, degrees: int = 0) -> Spectral:
    """Divide the tolerances of a solver, and raise the degree of its strips."""
    steps = replace(solver.steps, tolerance=solver.tolerance / times) if isinstance(solver.steps, Controlled) else solver.steps
    degree = solver.degree + degrees if solver.degree else None
    return replace(solver, steps=steps, contact_tolerance=min(1.0, solver.contact_tolerance / times), degree=degree)


def run(mechanism: Mechanism, duration: float, solver: Spectral, asked: str = "") -> Run:
    """Integrate implicitly; the run has the signals that the text `asked` names, or all.

    Raises
    ------
    RunFailedError
    """
    before_run.get()()
    solver = replace(solver, method="implicit")
    scene = CompiledScene.of(mechanism, solver.degree)
    out, failure, counts = integrate(scene, duration, solver)
    if failure and failure[0] == Status.INTERRUPTED:
        raise KeyboardInterrupt
    if failure:
        raise RunFailedError(f"{failure[0]}: {failure[1]}")
    return Run(solver, record_of(scene, out), None, {"steps": float(counts.steps)}, asked=asked)


def needs_compiler() -> None:
    """Refuse to start without the compiled solver.

    Raises
    ------
    ImportError
    """
    if not compiler():
        raise ImportError("derivatives, fits and designs need the compiled solver: pip install 'buckler[fast]'")
