"""A mechanism of a file, or of Python, as a study: what runs, what is read off, what is drawn."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import isfinite, nan
from pathlib import Path
from typing import TYPE_CHECKING, Any

from buckler.mbs.accuracy.words import PLACES, spoken, wanted
from buckler.mbs.documents.document import changed
from buckler.mbs.mechanism import Mechanism
from buckler.mbs.sensitivity.doubt import doubt
from buckler.mbs.sensitivity.reading import measure
from buckler.mbs.units import labelled
from buckler.mbs.validate import number, positive
from buckler.studies.kit.parameters import Parameter, StudyParameters
from buckler.studies.kit.report import QUIET, Metric, Progress, StudyResult
from buckler.studies.own.solver import solver
from buckler.studies.sweeping.rows import report_name

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from buckler.mbs.record.result import Result

PEAKS = ("contact_force", "normal_force", "force", "torque", "current", "fx", "fy", "axial_force", "compression", "deflection",
         "end_shortening", "penetration")  # fmt: skip
"""Signals whose largest size is told where no measure is asked for: last part of their names."""
MOST_DRAWN = 6


@dataclass(frozen=True)
class Parameters(StudyParameters):
    """What one run of a mechanism is made with.

    Parameters
    ----------
    name : str
        What to call it.
    document : str
        The mechanism as JSON, before any change.
    duration : float
        s.
    accuracy : float, optional
        Largest relative error of what `of` names.
    of : str or sequence of str
        "places", "forces", or signals' names; see `buckler.mbs.simulate`.
    ledger : bool
        Whether to keep the energy ledger.
    verify : bool
        Whether to run the other solver, too.
    measures : sequence of str
        What to read off; see `measure`.
    changes : sequence of (str, value)
        Places in the document with the values they have instead.
    solver : sequence of (str, value)
        The solver's kind and settings; see `solver`.
    reports : str
        Folder for the run's report page, '' for none; it changes no number, and no store keeps it.

    Raises
    ------
    ValueError
        In one line, if the changed document describes no mechanism.
    """

    name: str
    document: str = field(repr=False)
    duration: float
    accuracy: float | None = None
    of: str | Sequence[str] = PLACES
    ledger: bool = False
    measures: Sequence[str] = ()
    changes: Sequence[tuple[str, Any]] = ()
    verify: bool = False
    solver: Sequence[tuple[str, Any]] = ()
    reports: str = ""

    def __post_init__(self) -> None:
        positive("duration", self.duration, "s")
        if self.accuracy is not None:
            number("accuracy", self.accuracy, 1e-6, 0.1, "1")
        object.__setattr__(self, "of", wanted(self.of))
        solver(dict(self.solver), self.mechanism())  # refuses wrong settings before any run

    def __getattr__(self, path: str) -> Any:
        """The value at a changed place."""
        if not path.startswith("_"):
            for place, value in self.changes:
                if place == path:
                    return value
        raise AttributeError(path)

    def mechanism(self) -> Mechanism:
        """The mechanism with its changes."""
        return Mechanism.from_dict(changed(json.loads(self.document), dict(self.changes)))

    def plain(self) -> dict[str, Any]:
        """What a store and a file keep of it: the mechanism by a hash of its document."""
        run: dict[str, Any] = {"duration": self.duration, "accuracy": self.accuracy, "ledger": self.ledger}
        run |= {"measures": list(self.measures)}
        run |= {"verify": True} if self.verify else {}
        run |= {"solver": dict(self.solver)} if self.solver else {}
        run |= {} if self.of == PLACES else {"of": spoken(self.of)}
        return {"mechanism": f"{self.name} {digest(self.document)}", **run, **dict(self.changes)}


def digest(document: str) -> str:
    """The first twelve digits of a document's SHA-256."""
    return hashlib.sha256(document.encode()).hexdigest()[:12]


@dataclass(frozen=True)
class Family:
    """Makes the cases of a sweep: a mechanism and the places that may change.

    Called with values by place, as a study's `Parameters` is with its parameters.
    """

    base: Mapping[str, Any]
    """Everything but the changes."""
    places: Mapping[str, Parameter]

    def specs(self) -> Mapping[str, Parameter]:
        """What each place may be."""
        return self.places

    def __call__(self, **values: Any) -> Parameters:
        """Make a case."""
        fixed = dict(self.base.get("changes", ()))
        return Parameters(**{**self.base, "changes": tuple((fixed | values).items())})


def run(parameters: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Simulate, read the numbers off, and write the report page if one is asked for."""
    result = simulated(parameters, progress)
    if parameters.reports:
        result.write_html(Path(parameters.reports) / report_name(parameters.plain()), title=parameters.name)
    return read_off(parameters, result)


def simulated(parameters: Parameters, progress: Progress = QUIET) -> Result:
    """Simulate the mechanism."""
    from buckler.mbs.simulation import simulate

    p, mechanism = parameters, parameters.mechanism()
    chosen = solver(dict(p.solver), mechanism)
    with progress.of_runs(p.name) as shown:
        return simulate(
            mechanism, p.duration, p.accuracy, of=p.of, solver=chosen, ledger=p.ledger, verify=p.verify, progress=shown
        )


def read_off(parameters: Parameters, result: Result) -> StudyResult:
    """Metrics and signals of a result; a failed one keeps its signals only."""
    ended = result.status in ("OK", "SUSPECT")
    return StudyResult(
        parameters=parameters,
        status=str(result.status),
        message=result.message,
        metrics=_metrics(parameters, result) if ended else {},
        signals={"time": result.time, **result.signals},
        work=result.work,
        units=result.units,
    )


def _metrics(parameters: Parameters, result: Result) -> dict[str, Metric]:
    texts = parameters.measures or peaks(result)
    found = {}
    for text in texts:
        value, unit = measure(text, result.time, result.signals, result.units)
        off = doubt(text, result) / abs(value) if value else nan
        found[text] = Metric(value, unit, error=off if isfinite(off) else None)
    if parameters.accuracy is not None:
        found["relative error"] = Metric(result.error.motion, "1")
        found |= {f"relative error of {name}": Metric(result.error[name], "1") for name in _asked(parameters)}
    if parameters.verify:
        found["difference from the other solver"] = Metric(result.verified, "1")
    if parameters.ledger:
        found["energy balance"] = Metric(result.energy_balance, "1")
    return found


def _asked(parameters: Parameters) -> tuple[str, ...]:
    """The signals an accuracy was asked of by name."""
    return () if isinstance(parameters.of, str) else tuple(parameters.of)


def peaks(result: Result) -> list[str]:
    """Measures for everybody: the largest size of forces, torques and deflections; of means where a ringing is not followed."""
    names = [name for name in result.signals if name.rpartition(".")[2] in PEAKS]
    return [f"max(abs({name}{'.mean' if name in result.error.unresolved else ''}))" for name in names]


def figure(result: StudyResult) -> dict[str, Figure]:
    """Draw the signals that the measures name over time."""
    from buckler.studies.kit.style import subplots

    names = [name for name in result.signals if name != "time" and any(name in text for text in result.metrics)][:MOST_DRAWN]
    if not names:
        return {}
    drawn, axes = subplots(len(names), 1, height=25.0 + 32.0 * len(names), sharex=True, squeeze=False)
    for name, ax in zip(names, axes[:, 0], strict=True):
        ax.plot(result.signals["time"], result.signals[name])
        ax.set_ylabel(labelled(name, result.units.get(name, "")))
    axes[-1, 0].set_xlabel("time [s]")
    return {"signals": drawn}
