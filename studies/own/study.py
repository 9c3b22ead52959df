"""A mechanism of a file, or of Python, as a study: what runs, what is read off, what is drawn."""

from __future__ import annotations

import hashlib
import json
import re
import sys
from collections.abc import Mapping, Sequence
from math import isfinite, isnan, nan
from typing import TYPE_CHECKING, Any

from buckler.mbs.accuracy.words import COARSEST, FINEST, PLACES, WORDS, spoken, wanted
from buckler.mbs.declare import Flag, Name, Quantity, declared, field
from buckler.mbs.declare.spec import Anything, Text
from buckler.mbs.documents.document import changed
from buckler.mbs.mechanism import Mechanism
from buckler.mbs.process import Interrupted
from buckler.mbs.sensitivity.doubt import doubt
from buckler.mbs.sensitivity.reading import check, measure
from buckler.mbs.simulation import simulate
from buckler.mbs.units import labelled
from buckler.mbs.view.report import page

from ..kit.parameters import Repeated, StudyParameters
from ..kit.report import QUIET, Metric, Progress, StudyResult
from ..kit.style import Figure, subplots
from .solver import Settings, solver

if TYPE_CHECKING:
    from buckler.mbs.record.result import Result

PEAKS = ("contact_force", "normal_force", "force", "torque", "current", "fx", "fy", "axial_force", "compression", "deflection",
         "end_shortening", "penetration")  # fmt: skip
"""Signals whose largest size is told where no measure is asked for: last part of their names."""
MOST_DRAWN = 6
GROUP = "the run"
"""Of fields that a file's table [run] may hold, too."""


class _Of(Repeated):
    """What an accuracy is asked of: one word, or signals."""

    def read(self, name: str, given: object) -> Any:
        """Return one of `WORDS`, or names."""
        found = super().read(name, given)
        return wanted(found[0] if len(found) == 1 and found[0] in WORDS else found)


@declared
class Parameters(StudyParameters):
    """What one run of a mechanism is made with.

    Raises
    ------
    ValueError
        In one line, if the changed document describes no mechanism.
    """

    name: str = field(Name(), "what to call it")
    document: str = field(Text(), "the mechanism as JSON, before any change")
    duration: float = field(Quantity("s", 0, open_low=True), "how long; default 1 s", default=1.0, group=GROUP)
    accuracy: float | None = field(
        Quantity("1", FINEST, COARSEST),
        "largest relative error of the motion, 1e-6 to 0.1; the settings are chosen to keep it", default=None, group=GROUP,
    )  # fmt: skip
    of: str | Sequence[str] = field(
        _Of(Name()), "what the accuracy is asked of: places, forces, or a signal as B.contact_force", default=PLACES, group=GROUP
    )
    verify: bool = field(Flag(), "run the other solver, too, and tell the difference", default=False, group=GROUP)
    ledger: bool = field(Flag(), "keep the energy ledger and check its balance", default=False, group=GROUP)
    measure: Sequence[str] = field(
        Repeated(Text()), "a number to read off, as 'max(B.contact_force)'; default the peaks of all forces", default=(),
        group=GROUP,
    )  # fmt: skip
    solver: Sequence[tuple[str, Any]] = field(Settings(), "kind and settings of the solver", default=())
    changes: Sequence[tuple[str, Any]] = field(Anything(), "places in the document with the values they have instead", default=())
    report: bool = field(Flag(), "write the report page; no store keeps this", default=False)

    def check(self) -> None:
        """Wrong settings and measures are refused before any run."""
        if self.accuracy is None and self.of != PLACES:
            raise ValueError("of: without an accuracy; give both")
        for text in self.measure:
            check(text)
        solver(dict(self.solver), self.mechanism())

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
        run |= {"measures": list(self.measure)}
        run |= {"verify": True} if self.verify else {}
        run |= {"solver": dict(self.solver)} if self.solver else {}
        run |= {} if self.of == PLACES else {"of": spoken(self.of)}
        return {"mechanism": f"{self.name} {digest(self.document)}", **run, **dict(self.changes)}


def digest(document: str) -> str:
    """The first twelve digits of a document's SHA-256."""
    return hashlib.sha256(document.encode()).hexdigest()[:12]


def run(p: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Simulate, read the numbers off, and make the report page if one is asked for; of an interrupted run what there is."""
    mechanism = p.mechanism()
    chosen = solver(dict(p.solver), mechanism)
    try:
        with progress.of_runs(p.name) as shown:
            return read_off(p, simulate(
                mechanism, p.duration, p.accuracy, of=p.of, solver=chosen, ledger=p.ledger, verify=p.verify, progress=shown
            ))  # fmt: skip
    except Interrupted as stop:
        raise Interrupted(read_off(p, stop.result)) from None


def read_off(parameters: Parameters, result: Result) -> StudyResult:
    """Metrics and signals of a result; a failed one keeps its signals only."""
    metrics = _metrics(parameters, result) if result.status in ("OK", "SUSPECT") else {}
    valueless = [name for name in parameters.measure if name in metrics and isnan(metrics[name].value)]
    return StudyResult(
        parameters=parameters,
        status=str(result.status),
        message=result.message,
        metrics=metrics,
        signals={"time": result.time, **result.signals},
        work=result.work,
        units=result.units,
        pages=_page(parameters, result),
        notes=[*result.provenance.get("notes", ()), *(f"{name}: has no value in this run" for name in valueless)],
    )


def _page(parameters: Parameters, result: Result) -> Mapping[str, str]:
    """Make the report page, if it is asked for; one that fails takes nothing from the numbers."""
    try:
        return {"report.html": page(result, parameters.name)} if parameters.report else {}
    except Exception as error:
        print(f"{parameters.name}: no report page: {type(error).__name__}: {error}", file=sys.stderr)
    return {}


def _metrics(parameters: Parameters, result: Result) -> dict[str, Metric]:
    found = {}
    for text in parameters.measure or peaks(result):
        value, unit = measure(text, result.time, result.signals, result.units)
        off = doubt(text, result) / abs(value) if value else nan
        found[text] = Metric(value, unit, error=off if isfinite(off) else None)
    if parameters.accuracy is not None:
        found["relative error"] = Metric(result.error.motion, "1")
        found |= {f"relative error of {name}": Metric(result.error[name], "1") for name in asked(parameters)}
    if parameters.verify:
        found["difference from the other solver"] = Metric(result.verified, "1")
    if parameters.ledger:
        found["energy balance"] = Metric(result.energy_balance, "1")
    return found


def asked(parameters: Parameters) -> tuple[str, ...]:
    """The signals an accuracy was asked of by name."""
    return () if isinstance(parameters.of, str) else tuple(parameters.of)


def peaks(result: Result) -> list[str]:
    """Measures for everybody: the largest size of forces, torques and deflections; of means where a ringing is not followed."""
    names = [name for name in result.signals if name.rpartition(".")[2] in PEAKS]
    return [f"max(abs({name}{'.mean' if name in result.error.unresolved else ''}))" for name in names]


def figure(result: StudyResult) -> dict[str, Figure]:
    """Draw the signals that the measures name over time."""
    whole = {name: re.compile(rf"(?<![\w.]){re.escape(name)}(?![\w.])") for name in result.signals if name != "time"}
    names = [name for name, pattern in whole.items() if any(map(pattern.search, result.metrics))][:MOST_DRAWN]
    if not names:
        return {}
    drawn, axes = subplots(len(names), 1, height=25.0 + 32.0 * len(names), sharex=True, squeeze=False)
    for name, ax in zip(names, axes[:, 0], strict=True):
        ax.plot(result.signals["time"], result.signals[name])
        ax.set_ylabel(labelled(name, result.units.get(name, "")))
    axes[-1, 0].set_xlabel("time [s]")
    drawn.align_ylabels()
    return {"signals": drawn}
