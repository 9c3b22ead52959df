"""Mechanism of a file, or of Python, as a study: the parameters of a run, its solver, its readings and its figure.

A setting of a solver, such as its tolerance, is a field of the solver's class or of the class of its steps. In a file settings
stand in the table `solver`, on the command line each is an option.
"""

import hashlib
import json
import re
import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache
from importlib.util import find_spec
from math import isnan
from typing import Any, NamedTuple

from buckler.mbs import Closure, Controlled, Equal, Exudyn, Mechanism, Result, Spectral, simulate
from buckler.mbs.accuracy.demand import key_of
from buckler.mbs.accuracy.words import COARSEST, FINEST, PLACES, WORDS, read_signals, write_signals
from buckler.mbs.declare import Declaration, Flag, Name, Quantity, Spec, declarations, declared, field
from buckler.mbs.declare.spec import Choice, Text
from buckler.mbs.documents.document import change
from buckler.mbs.process import Interrupted
from buckler.mbs.scene.scene import Scene
from buckler.mbs.sensitivity.reading import check_reading
from buckler.mbs.sensitivity.reading_errors import list_readings
from buckler.mbs.units import label_with_unit
from buckler.mbs.view.report import page

from ..kit.parameters import Repeated, StudyParameters
from ..kit.report import QUIET, Metric, Progress, StudyResult
from ..kit.style import Figure, subplots

GROUP = "the run"
"""Heading, in the help, of the options that a file's table [run] may also have."""
SOLVERS: dict[str, type[Exudyn | Spectral | Closure]] = {"exudyn": Exudyn, "spectral": Spectral, "closure": Closure}  # by name
SOLVER_GROUP = "the solver; with an accuracy a run keeps its kind, and chooses its steps and the elements of strips"
"""Heading, in the help, of the solver's options."""
SOLVER_NAME = Declaration(
    Choice(tuple(SOLVERS)),
    "exudyn, spectral (compiled) or closure. By default it is chosen, and the error is estimated; if only settings below are "
    "given, it is closure where constraints determine the motion, else exudyn",
    bounds={}, required=False, default=None, group=SOLVER_GROUP,
)  # fmt: skip
"""Declaration of the solver's name: of the option `solver`, and of the key `kind` in the table `solver`."""


class SolverSetting(NamedTuple):
    """Setting of a solver: the class of solvers or steps that has it, the name of its field, its declaration."""

    owner: type
    field: str
    about: Declaration


@cache
def settings() -> dict[str, SolverSetting]:
    """Collect the settings of all solvers and steps by their names in files, all unique; options have hyphens for underscores."""
    found: dict[str, SolverSetting] = {}
    for owner in (Controlled, Equal, *SOLVERS.values()):
        ending = "".join(f"; of {name}" for name, kind in SOLVERS.items() if kind is owner)  # one solver, or none for steps
        for key, about in declarations(owner).items():
            if key != "steps":  # this field of a solver is a `Controlled` or `Equal`, whose own fields are collected
                name = {"count": "steps", "method": "integrator"}.get(key, key)  # clear without its class, as `Equal.count`
                found[name] = SolverSetting(owner, key, about._replace(group=SOLVER_GROUP, doc=about.doc + ending))
    return found


def solver_options() -> dict[str, Declaration]:
    """Return the declarations of the option `solver` and of all settings."""
    return {"solver": SOLVER_NAME} | {name: setting.about for name, setting in settings().items()}


class Settings(Spec):
    """Name of a solver, or a table of `kind` and settings; `read` turns either into pairs of key and value."""

    words = f"{' or '.join(SOLVERS)}, or a table of kind and settings"

    def read(self, name: str, given: object) -> tuple[tuple[str, Any], ...]:
        """Return the pairs; a ValueError names the setting that is unknown or out of its range."""
        if not isinstance(given, str | Mapping | tuple):  # a tuple has been read before
            raise self.refusal(name, given)
        content = {"kind": given} if isinstance(given, str) else dict(given)
        about = {"kind": SOLVER_NAME} | {key: setting.about for key, setting in settings().items()}
        if unknown := [key for key in content if key not in about]:
            raise ValueError(f"{name}.{unknown[0]}: unknown key; known: {', '.join(about)}")
        return tuple((key, about[key].spec.read(f"{name}.{key}", value)) for key, value in content.items())


def make_solver(given: Mapping[str, Any], mechanism: Mechanism) -> Exudyn | Spectral | Closure | None:
    """Make the solver with these settings, or return None without any.

    Without a kind it is `Closure` if that has all settings and solves the mechanism, else `Exudyn`.
    """
    if not given:
        return None
    rest = {key: value for key, value in given.items() if key != "kind"}
    suits_closure = all(settings()[key].owner in (Controlled, Equal) for key in rest)  # it has no settings but its steps
    name = given.get("kind", "closure" if suits_closure and Scene.of(mechanism).is_kinematic else "exudyn")
    kind, steps = SOLVERS[name], Equal if "steps" in given else Controlled
    if kind is Spectral and find_spec("numba") is None:
        raise ValueError(f"solver = {name}: needs Numba: pip install 'buckler[fast]'")
    values: dict[type, dict[str, Any]] = {kind: {}, steps: {}}
    for key, value in rest.items():
        owner, field_name, _ = settings()[key]
        if owner is Controlled and steps is Equal:
            raise ValueError(f"solver: {key} is for controlled steps: leave out steps")
        if owner not in values:  # another solver; `Equal` is in `values` whenever `steps`, its only setting, is given
            of = next(each for each, other in SOLVERS.items() if other is owner)
            raise ValueError(f"solver: {key} is a setting of {of}, not of {name}")
        values[owner][field_name] = value
    # Each solver has defaults of its own for controlled steps; equal steps have none.
    chosen = Equal(**values[Equal]) if steps is Equal else replace(kind().steps, **values[Controlled])
    return kind(steps=chosen, **values[kind])


class _Target(Repeated):
    """Target of an accuracy: one of `WORDS`, or names of signals."""

    def read(self, name: str, given: object) -> Any:
        """Return the word, or the names of signals."""
        texts = super().read(name, given)
        is_word = len(texts) == 1 and texts[0] in WORDS
        return read_signals(texts[0] if is_word else texts)


@declared
class Parameters(StudyParameters):
    """Mechanism and settings of one run; a ValueError if the document with its changes describes no mechanism."""

    name: str = field(Name(), "name of the mechanism")
    document: str = field(Text(), "the mechanism as JSON, before any change")
    duration: float = field(Quantity("s", 0, open_low=True), "duration; default 1 s", default=1.0, group=GROUP)
    accuracy: float | None = field(
        Quantity("1", FINEST, COARSEST),
        "largest relative error of the motion, 1e-6 to 0.1; the settings are chosen to meet it", default=None, group=GROUP,
    )  # fmt: skip
    of: str | Sequence[str] = field(
        _Target(Name()), "target of the accuracy: places, forces, or a signal as B.contact_force", default=PLACES, group=GROUP
    )
    verify: bool = field(
        Flag(), "run the compiled solver beside Exudyn, or the reverse, and report the difference", default=False, group=GROUP
    )
    ledger: bool = field(Flag(), "compute the energy ledger and check its balance", default=False, group=GROUP)
    measure: Sequence[str] = field(
        Repeated(Text()), "a reading, as 'max(B.contact_force)'; default the peaks of all forces", default=(), group=GROUP
    )
    solver: Sequence[tuple[str, Any]] = field(Settings(), "kind and settings of the solver", default=())
    changes: Sequence[tuple[str, Any]] = field(Spec(), "paths in the document with their new values", default=())
    timeout: float | None = field(
        Quantity("s", 0, open_low=True), "longest time of computing; then the best so far is the result, TIMED_OUT",
        default=None, group=GROUP,
    )  # fmt: skip
    report: bool = field(Flag(), "write the report page; not part of the stored parameters", default=False)

    def agree(self) -> None:
        """Check settings and readings before any run."""
        if self.accuracy is None and self.of != PLACES:
            raise ValueError("of: without an accuracy; give both")
        for text in self.measure:
            check_reading(text)
        make_solver(dict(self.solver), self.mechanism())

    def mechanism(self) -> Mechanism:
        """Make the mechanism with its changes."""
        return Mechanism.from_dict(change(json.loads(self.document), dict(self.changes)))

    def plain(self) -> dict[str, Any]:
        """Return the parameters as files keep them: name and hash of the mechanism's document, settings, changes."""
        digest = hashlib.sha256(self.document.encode()).hexdigest()[:12]
        found: dict[str, Any] = {"mechanism": f"{self.name} {digest}", "duration": self.duration}
        found |= {"accuracy": self.accuracy, "ledger": self.ledger, "measures": list(self.measure)}
        if self.verify:
            found["verify"] = True
        if self.solver:
            found["solver"] = dict(self.solver)
        if self.of != PLACES:
            found["of"] = write_signals(self.of)
        return found | dict(self.changes)


def run(p: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Simulate and compute the readings; an interrupted run gives those of the time that was simulated."""
    mechanism = p.mechanism()
    solver = make_solver(dict(p.solver), mechanism)
    try:
        return summarise(p, simulate(
            mechanism, p.duration, p.accuracy, of=p.of, solver=solver, ledger=p.ledger, verify=p.verify, timeout=p.timeout,
            progress=progress.forecast(p.name),
        ))  # fmt: skip
    except Interrupted as stop:
        raise Interrupted(summarise(p, stop.result)) from None


def summarise(parameters: Parameters, result: Result) -> StudyResult:
    """Return metrics, signals and page of a run; a run that failed may have no metrics."""
    metrics = _metrics(parameters, result)
    empty = [name for name in parameters.measure if name in metrics and isnan(metrics[name].value)]
    return StudyResult(
        parameters=parameters, status=str(result.status), message=result.message, metrics=metrics,
        signals={"time": result.time, **result.signals}, work=result.work, units=result.units,
        pages=_page(parameters, result) if parameters.report else {},
        notes=[*result.provenance.get("notes", ()), *(f"{name}: has no value in this run" for name in empty)],
    )  # fmt: skip


def _page(parameters: Parameters, result: Result) -> Mapping[str, str]:
    """Make the report page; if that fails, print the reason and return no page, so that the numbers are kept."""
    try:
        return {"report.html": page(result, parameters.name, parameters.measure)}
    except Exception as error:
        print(f"{parameters.name}: no report page: {type(error).__name__}: {error}", file=sys.stderr)
        return {}


def _metrics(parameters: Parameters, result: Result) -> dict[str, Metric]:
    """Compute the readings with errors, the error of the motion, the difference from the other solver, the energy balance."""
    found = {}
    for each in list_readings(result, parameters.measure):
        relative, absolute = (None if isnan(x) else x for x in (each.relative, each.error))
        # if the value is zero, only the absolute error can be known
        found[each.name] = Metric(each.value, each.unit, error=relative, absolute=absolute if relative is None else None)
    if not result.status.finished:
        return found
    if parameters.accuracy is not None:
        found["relative error of the motion"] = Metric(result.error.motion, "1")
        found |= {f"relative error of {name}": Metric(result.error[key_of(name)], "1") for name in target_signals(parameters)}
    if parameters.verify:
        found["difference from the other solver"] = Metric(result.verified, "1")
    if parameters.ledger:
        found["energy balance"] = Metric(result.energy_balance, "1")
    return found


def target_signals(parameters: Parameters) -> tuple[str, ...]:
    """List the signals whose accuracy is requested by name."""
    return () if isinstance(parameters.of, str) else tuple(parameters.of)


def figure(result: StudyResult) -> dict[str, Figure]:
    """Draw over time the signals whose whole names occur in the readings."""
    patterns = {name: re.compile(rf"(?<![\w.]){re.escape(name)}(?![\w.])") for name in result.signals if name != "time"}
    names = [name for name, pattern in patterns.items() if any(map(pattern.search, result.metrics))]
    names = names[:6]  # with more the panels are too flat
    if not names:
        return {}
    height = 25.0 + 32.0 * len(names)  # [mm]; margins, and a panel for each signal
    drawn, axes = subplots(len(names), 1, height=height, sharex=True, squeeze=False)
    for name, ax in zip(names, axes[:, 0], strict=True):
        ax.plot(result.signals["time"], result.signals[name])
        ax.set_title(label_with_unit(name, result.units.get(name, "")), loc="left")  # as a label of the axis it may be too long
    axes[-1, 0].set_xlabel("time [s]")
    return {"signals": drawn}
