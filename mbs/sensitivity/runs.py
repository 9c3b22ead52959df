"""Runs of the compiled solver for derivatives, fits and designs, and readings of these runs."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..geometry import Array
from ..mechanism import Mechanism
from ..process import has_compiler
from ..progress import watching
from ..record.run import Run
from ..solvers import Controlled, Spectral
from ..spectral.recording import record_of
from ..spectral.run import integrate
from ..spectral.scene import DEGREE, CompiledScene
from ..validate import as_tuple
from .curve import Smooth
from .reading import RunFailedError, check_reading, compute_frequency, parse_frequency, read_number

Reading = str | Callable[[Mechanism], float]
"""Formula of a reading, or a function of the mechanism."""


class Readings(NamedTuple):
    """Values of readings with their units and errors; an error that was not estimated is 0."""

    values: Array
    units: list[str]
    errors: Array


def scale_tolerances(solver: Spectral, factor: float, degrees: int = 0) -> Spectral:
    """Return a solver with tolerances multiplied by a factor, and with `degrees` added to the degree of strips."""
    steps = replace(solver.steps, tolerance=solver.tolerance * factor) if isinstance(solver.steps, Controlled) else solver.steps
    degree = (solver.degree or DEGREE) + degrees if degrees else solver.degree
    contact_tolerance = min(1.0, solver.contact_tolerance * factor)  # relative; a solver takes at most 1
    return replace(solver, steps=steps, contact_tolerance=contact_tolerance, degree=degree)


def run(mechanism: Mechanism, duration: float, solver: Spectral, asked: str = "") -> Run:
    """Integrate; make the signals that the text `asked` names, or all; a RunFailedError says why a run fails."""
    progress = watching.get()  # of the whole call: it counts runs, and raises an exception after Ctrl-C or the time limit
    progress.check()
    progress.count += 1
    solver = replace(solver, method="implicit")  # its own choice of a method depends on the mechanism's numbers
    scene = CompiledScene.of(mechanism, solver.degree)
    out, failure, counts = integrate(scene, duration, solver, progress.time_left)
    progress.end_run(failure)
    if failure:
        raise RunFailedError(f"{failure.status}: {failure.message}")
    return Run(solver, record_of(scene, out), failure=None, work={"steps": float(counts.steps)}, asked=asked)


def read(readings: Mapping[str, Reading], mechanism: Mechanism, duration: float | None, solver: Spectral) -> Readings:
    """Compute readings, from one run if needed; a RunFailedError says that a run fails, or that a state of rest is not stable."""
    found = list[tuple[float, str, float]]()  # value, unit and error of each reading
    ended = None  # the run, once it has ended
    texts = " ".join(text for text in readings.values() if isinstance(text, str))
    for reading in readings.values():
        if callable(reading):
            found.append((float(reading(mechanism)), "", 0.0))
        elif number := parse_frequency(reading):
            value, error = compute_frequency(mechanism, number)
            found.append((value, "Hz", error))
        else:
            assert duration is not None  # `readings_of` has checked that there is one
            ended = ended or run(mechanism, duration, solver, texts)
            # by cubics, so that the reading is a smooth function of the mechanism's numbers
            value, unit = read_number(reading, ended.record.time, ended.values, ended.units, Smooth)
            found.append((value, unit, 0.0))
    values, units, errors = zip(*found, strict=True)
    return Readings(np.array(values), list(units), np.array(errors))


def needs_run(reading: Reading) -> bool:
    """Return True if a reading is read off a run; functions and frequencies are not."""
    return isinstance(reading, str) and not parse_frequency(reading)


def readings_of(of: str | Sequence[str] | Mapping[str, Reading], moving: bool) -> dict[str, Reading]:
    """Return readings by name, a text as its own name; `moving` if there is a duration; a ValueError names a wrong one."""
    if isinstance(of, Mapping):
        readings = dict(of)
    else:
        readings = {text: text for text in ([of] if isinstance(of, str) else as_tuple("of", of))}
    if not readings:
        raise ValueError("of: no reading; write for instance 'max(B.contact_force)'")
    for name, reading in readings.items():
        if not callable(reading):
            check_reading(reading)
            if not moving and needs_run(reading):
                raise ValueError(f"{name}: is read off a run; give a duration")
    return readings


def require_compiler() -> None:
    """Raise an ImportError if the compiled solver is not installed."""
    if not has_compiler():
        raise ImportError("derivatives, fits and designs need the compiled solver: pip install 'buckler[fast]'")
