"""`buckler run FILE` and `buckler sweep FILE`: a mechanism of a file from the command line."""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, TypeVar

from buckler.mbs.accuracy.words import PLACES, WORDS, wanted
from buckler.mbs.documents.document import changed
from buckler.mbs.interrupts import Interrupted
from buckler.mbs.mechanism import RUN, Mechanism
from buckler.studies.kit.options import Parser, answers, check_words, noted, writable, wrong_input
from buckler.studies.own import solver as solvers
from buckler.studies.own.places import opened, set_all, spec, to_json
from buckler.studies.own.study import Family, Parameters

Made = TypeVar("Made")
DEFAULT_DURATION = 1.0
PROBED = 1e-6
"""Duration of the run that shows which signals there are, s."""
REPORTS = "reports"
"""Folder of the cases' own pages, beside the sweep's."""


def options(parser: argparse.ArgumentParser) -> None:
    """Declare the options of `run FILE` and `sweep FILE`."""
    group = parser.add_argument_group("the run")
    add = group.add_argument
    add("--duration", metavar="s", help="how long, s; default that of the file, or 1 s")
    add(
        "--accuracy",
        metavar="NUMBER",
        help="largest relative error of the motion, 1e-6 to 0.1; the settings are chosen to keep it",
    )
    add("--of", action="append", default=[], metavar="WHAT",
        help="what the accuracy is asked of: places, forces, or a signal as B.contact_force; may be repeated")  # fmt: skip
    add("--verify", action="store_true", default=None, help="run the other solver, too, and tell the difference")
    add("--ledger", action="store_true", default=None, help="keep the energy ledger and check its balance")
    add("--set", action="append", default=[], metavar="PATH=VALUE", dest="changes",
        help="another value at a place of the file, as links.coupler.body.section.thickness=0.2mm; may be repeated")  # fmt: skip
    add("--measure", action="append", default=[], metavar="FORMULA",
        help="a number to read off, as 'max(B.contact_force)'; may be repeated; default the peaks of all forces")  # fmt: skip
    about = "the solver and its settings; with an accuracy it is kept, and its steps and elements are chosen"
    add = parser.add_argument_group("the solver", about).add_argument
    add("--solver", choices=tuple(solvers.SOLVERS), help="default exudyn")
    for name, setting in solvers.settings().items():
        of = [known for known, kind in solvers.SOLVERS.items() if kind in setting.homes]
        about = setting.about.doc
        text = f"{about}{f'; of {of[0]}' if len(of) == 1 else ''}"
        unit = setting.about.spec.unit if setting.about.spec.unit not in ("", "1") else "VALUE"
        add(f"--{name.replace('_', '-')}", metavar=unit, dest=name, help=text.replace("%", "%%"))


def parser(_name: str, prog: str) -> Parser:
    """The options of `run FILE`."""
    found = Parser(prog=prog, usage=f"{prog} [options]", description="Simulate the mechanism of a file.", allow_abbrev=False)
    options(found)
    answers(found)
    return found


def run_file(path: Path, argv: Sequence[str], prog: str) -> int:
    """Simulate the mechanism of a file, print and file what came out; return the exit status."""
    from buckler.studies.kit.running import attempt, finish

    try:
        chosen, unknown = parser(path.name, prog).parse_known_args(noted(argv))
        check_words(unknown, chosen)
        base, changes = _settings(path, chosen)
        parameters = Parameters(**base, changes=tuple(changes.items()))
        probe(parameters)
        folder = writable(Path(chosen.out) / path.stem)
    except (ValueError, OSError, ImportError) as error:
        return wrong_input(_named(error, path))
    from buckler.studies.own import study

    kept: list[Any] = []

    def run(parameters: Parameters, progress: Any) -> Any:
        try:
            kept.append(study.simulated(parameters, progress))
        except Interrupted as stop:  # what there is by then is filed, as INTERRUPTED
            kept.append(stop.result)
        return study.read_off(parameters, kept[0])

    begin = time.perf_counter()
    result = attempt(run, parameters, chosen)
    status = finish(path.stem, study, result, folder, chosen, time.perf_counter() - begin)
    if kept:
        for note in () if chosen.quiet else kept[0].provenance.get("notes", ()):
            print(f"{parameters.name}: note: {note}", file=sys.stderr)
        _page(kept[0], parameters, folder, chosen)
    return status


def _page(result: Any, parameters: Parameters, folder: Path, chosen: argparse.Namespace) -> None:
    """Write the report page; a page that cannot be written takes nothing from the numbers."""
    if not hasattr(result, "write_html"):
        return
    try:
        path = result.write_html(folder / "report.html", title=parameters.name)
    except Exception as error:
        print(f"{parameters.name}: no report page: {type(error).__name__}: {error}", file=sys.stderr)
        return
    if not chosen.json and not chosen.quiet:
        print(f"see it move: {path}")


def _settings(path: Path, chosen: argparse.Namespace) -> tuple[dict[str, Any], dict[str, Any]]:
    """Everything a run is made with but its changes, and these."""
    document, run = opened(path)
    Mechanism.from_dict(document)
    changes = set_all(document, chosen.changes)
    measures = chosen.measure or run.get("measure", [])
    measures = [measures] if isinstance(measures, str) else list(measures)
    from buckler.mbs.sensitivity.reading import check

    for text in measures:
        check(str(text))
    if chosen.accuracy is not None:  # either of the two on the command line takes the place of the other in the file
        run.pop("solver", None)
    if chosen.solver or any(getattr(chosen, name) is not None for name in solvers.settings()):
        run.pop("accuracy", None), run.pop("of", None)
    duration = _quantity("duration", chosen.duration, run, "s")
    accuracy = _quantity("accuracy", chosen.accuracy, run, "1")
    of = chosen.of or run.get("of", PLACES)
    solver = _solver(chosen, run)
    ledger, verify = _switch("ledger", chosen, run), _switch("verify", chosen, run)
    return {
        "name": path.stem,
        "document": to_json(document),
        "duration": DEFAULT_DURATION if duration is None else duration,
        "accuracy": accuracy,
        "of": _of(of, accuracy),
        "ledger": ledger,
        "measures": tuple(map(str, measures)),
        "verify": verify,
        "solver": tuple(solver.items()),
    }, changes


def _of(given: Any, accuracy: float | None) -> Any:
    """What an accuracy is asked of: a word, or names of signals."""
    names = [given] if isinstance(given, str) else given
    word = names[0] if isinstance(names, list) and len(names) == 1 and names[0] in WORDS else None
    of = wanted(word or names)
    if accuracy is None and of != PLACES:
        raise ValueError("--of: without --accuracy; give both")
    return of


def _solver(chosen: argparse.Namespace, run: dict[str, Any]) -> dict[str, Any]:
    """The solver's settings: those of the file, unless another solver is asked for, and over them those of the command line."""
    found = solvers.of_file(run["solver"]) if "solver" in run else {}
    if chosen.solver and chosen.solver != found.get(solvers.KIND, chosen.solver):
        found = {}
    found |= {solvers.KIND: chosen.solver} if chosen.solver else {}
    for name in solvers.settings():
        text = getattr(chosen, name)
        if text is not None:
            found[name] = solvers.settings()[name].about.spec.read(f"--{name.replace('_', '-')}", text)
    return found


def _switch(name: str, chosen: argparse.Namespace, run: dict[str, Any]) -> bool:
    """A setting of the command line, or else of the file's [run], that is on or off."""
    option = getattr(chosen, name)
    value = run.get(name, False) if option is None else option
    if not isinstance(value, bool):
        raise ValueError(f"{RUN}.{name} = {value!r}: must be true or false")
    return value


def _quantity(name: str, option: str | None, run: dict[str, Any], unit: str) -> float | None:
    """A number of the command line, or else of the file's [run]."""
    from buckler.mbs.units import parse_quantity

    given = run.get(name) if option is None else option
    where = f"{RUN}.{name}" if option is None else f"--{name}"
    if given is None or (isinstance(given, int | float) and not isinstance(given, bool)):
        return given
    try:
        return parse_quantity(str(given), unit)
    except ValueError as error:
        raise ValueError(f"{where} = {given}: {error}") from None


def family(path: Path, chosen: argparse.Namespace) -> Family:
    """The cases `--vary` may ask for."""
    base, changes = _settings(path, chosen)
    document = changed(json.loads(base["document"]), changes)
    names = [text.partition("=")[0].strip() for text in chosen.vary]
    places = {}
    for name in names:
        try:
            places[name] = spec(document, name)
        except ValueError as error:
            raise ValueError(f"--vary {name}: {error}") from None
    reports = str(writable(Path(chosen.out) / f"{path.stem}-sweep" / REPORTS).resolve()) if chosen.reports else ""
    return Family({**base, "changes": tuple(changes.items()), "reports": reports}, places)


def probe(parameters: Parameters) -> None:
    """Run a first microsecond: what cannot start, and names of signals that there are not, are refused before any case runs."""
    from buckler.mbs.sensitivity.reading import check
    from buckler.mbs.simulation import simulate

    asked = () if isinstance(parameters.of, str) else parameters.of
    result = simulate(parameters.mechanism(), min(parameters.duration, PROBED))
    for name in asked if result.signals else ():
        _ = result[name]
    for text in parameters.measures if result.signals else ():
        check(text, result.signals)


def named(path: Path, function: Callable[..., Made], *arguments: Any) -> Made:
    """Call a function; a ValueError it raises gets the file's name in front."""
    try:
        return function(*arguments)
    except ValueError as error:
        raise _named(error, path) from None


def _named(error: Exception, path: Path) -> ValueError:
    """What was wrong, with the file's name in front."""
    said = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
    ours = said.startswith((str(path), "--", "duration", "accuracy", "unknown parameter", "unknown argument", "argument"))
    return ValueError(said if ours else f"{path}: {said}")
