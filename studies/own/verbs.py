"""Mechanism files of the command line: `run FILE`, `sweep FILE`; documents and tables [run]; options of all commands."""

from __future__ import annotations

import argparse
import json
import re
import sys
import tomllib
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

from buckler.mbs.declare import Declaration, Quantity, Whole, declarations
from buckler.mbs.declare.spec import Anything
from buckler.mbs.documents import document as documents
from buckler.mbs.documents.document import change
from buckler.mbs.documents.shorthand import expand, free_parameters
from buckler.mbs.mechanism import RUN, Mechanism
from buckler.mbs.process import Interrupted
from buckler.mbs.progress import TimeUpError
from buckler.mbs.sensitivity.numbers import standing
from buckler.mbs.sensitivity.reading import RunFailedError, check
from buckler.mbs.simulation import simulate
from buckler.mbs.units import parse_quantity

from ..kit.cli import Command, Parser, add_repeated
from ..kit.parameters import Cases
from ..kit.running import Study, add_options
from . import study
from .study import Parameters, digest, solver_options, target_signals

T = TypeVar("T")

FIXED = ("elements", "points", "velocities", "gravity")
"""Parts of a document whose numbers change only if they are named: whole numbers and places."""

VARIED = "the parameters of the file, or all numbers that are not zero but places"
"""Numbers that vary unless others are named, in words."""
DECLARED = declarations(Parameters)
OPTIONS = {name: about for name, about in DECLARED.items() if about.group}
"""Options of a run; a file's table [run] may have them, too."""
SETTINGS = {**OPTIONS, "solver": DECLARED["solver"]}
"""Keys of a file's table [run]."""


@contextmanager
def name_errors(path: Path) -> Iterator[None]:
    """Convert errors to a ValueError that begins with the file's name, unless it names an option."""
    try:
        yield
    except (ValueError, OSError, ImportError) as error:
        text = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        if isinstance(error, FileNotFoundError) and not path.exists():
            there = ", ".join(sorted(each.name for each in path.parent.glob("*.toml"))[:8])
            text += f"; there are: {there}" if there else "; `buckler new` writes an example"
        raise ValueError(text if text.startswith((str(path), "--")) else f"{path}: {text}") from None


def read_file(path: Path) -> tuple[dict[str, Any], dict[str, Any]]:
    """Read the document of a file, with its short forms expanded, and its table [run]."""
    document = expand(documents.read(path))
    document.pop("about", None)
    run = document.pop(RUN, {})
    if not isinstance(run, dict) or set(run) - set(SETTINGS):
        odd = sorted(set(run) - set(SETTINGS)) if isinstance(run, dict) else [str(run)]
        raise ValueError(f"{RUN}.{odd[0]}: unknown key; known: {', '.join(SETTINGS)}")
    return document, {name: SETTINGS[name].spec.read(f"{RUN}.{name}", value) for name, value in run.items()}


def read_value(text: str) -> Any:
    """Read a TOML value, or a text such as 0.3mm or Beam."""
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except ValueError:
        return text.strip()


def read_changes(document: Mapping[str, object], texts: Sequence[str]) -> dict[str, Any]:
    """Read the places and values of `--set PATH=VALUE`; each place is in the document or may be added to it."""
    found: dict[str, Any] = {}
    for text in texts:
        path, equals, value = text.partition("=")
        if not equals or not value.strip():
            raise ValueError(f"--set {text}: write PATH=VALUE, as links.coupler.body.section.thickness=0.2mm")
        found[path.strip()] = read_value(value)
        try:
            Mechanism.from_dict(change(document, {path.strip(): found[path.strip()]}))
        except ValueError as error:
            raise ValueError(f"--set {text}: {error}") from None
    return found


class Typed(Anything):
    """Any value that the file takes at a place."""

    allowed = "what the file takes there"

    def read(self, name: str, given: object) -> Any:
        """Return a TOML value, or else the text."""
        return read_value(given) if isinstance(given, str) else given


def spec(document: Mapping[str, object], path: str) -> Declaration:
    """Declare a place of a document: a number with its unit, or a word; a ValueError if there is no such place."""
    about, now, unit = standing(document, path)
    doc = about.doc if about else path
    if about and isinstance(now, int) and Whole().fits(now) and not about.unit:
        return Declaration(about.spec, doc, {}, True, None)
    number = Quantity(unit).fits(now) or (about and unit and now is None)
    return Declaration(Quantity(unit) if number else Typed(), doc, {}, True, None)


PROBED = 1e-6
"""Duration of the run that shows which signals there are [s]: a step or two of any solver."""


class File(Study):
    """Mechanism of a file."""

    module, about = study, "Simulate the mechanism of a file. Options that are not given are those of its table [run]."

    def __init__(self, path: Path) -> None:
        self.path, self.title = path, path.stem

    def declare(self, parser: Parser, taken: Collection[str] = ()) -> None:
        """Declare the options of the run, of the solver, and the changes of the file."""
        repeats = {"of", "measure"}
        add_options(
            parser, OPTIONS, {key: f"{each.doc}{'; may be repeated' * (key in repeats)}" for key, each in OPTIONS.items()}
        )
        about = "another value at a place of the file, as links.coupler.body.section.thickness=0.2mm"
        add_repeated(parser, "--set", "PATH=VALUE", about, dest="changes")
        add_options(parser, solver_options(), {name: each.doc for name, each in solver_options().items()})

    def parameters(self, options: argparse.Namespace) -> Parameters:
        """Make the parameters of one run, and try its first microsecond."""
        with name_errors(self.path):
            base, changes = self._settings(options)
            found = Parameters(**base, changes=tuple(changes.items()), report=True)
            self.probe(found)
        return found

    def cases(self, options: argparse.Namespace, taken: Collection[str]) -> tuple[Cases, dict[str, Any]]:
        """Make cases from values at places of the file."""
        with name_errors(self.path):
            base, changes = self._settings(options)
            document, places = change(json.loads(base["document"]), changes), {}
            for name in (text.partition("=")[0].strip() for text in options.vary):
                try:
                    places[name] = spec(document, name)
                except ValueError as error:
                    raise ValueError(f"--vary {name}: {error}") from None
        return Cases(lambda values: Parameters(**base, changes=tuple((changes | values).items())), places), {}

    def probe(self, parameters: Any) -> str:
        """Run a first microsecond: a ValueError if the mechanism cannot start, or has no signal of a name."""
        with name_errors(self.path):
            result = simulate(parameters.mechanism(), min(parameters.duration, PROBED))
            for name in target_signals(parameters) if result.signals else ():
                _ = result[name]
            for text in parameters.measure if result.signals else ():
                check(text, result.signals)
        return f"{self.title} {digest(parameters.document)}"

    def _settings(self, options: argparse.Namespace) -> tuple[dict[str, Any], dict[str, Any]]:
        """Return the settings of a run without its changes, and the changes; options override the file."""
        document, run = read_file(self.path)
        Mechanism.from_dict(document)
        changes = read_changes(document, options.changes)
        given = {name: value for name in solver_options() if (value := getattr(options, name)) is not None}
        if options.accuracy is not None:  # accuracy and solver on the command line replace each other in the file
            run.pop("solver", None)
        if given:
            run = {name: value for name, value in run.items() if name not in ("accuracy", "of")}
        given = {name: solver_options()[name].spec.read(f"--{name.replace('_', '-')}", text) for name, text in given.items()}
        solver, kind = dict(run.pop("solver", ())), given.pop("solver", None)
        if kind is not None:
            solver = {} if kind != solver.get("kind", kind) else solver
            solver["kind"] = kind
        solver |= given
        ours = {name: value for name in OPTIONS if (value := getattr(options, name)) is not None}
        run |= {name: OPTIONS[name].spec.read(f"--{name}", value) for name, value in ours.items()}
        return {
            **run,
            "name": self.title,
            "document": json.dumps(document, ensure_ascii=False),
            "solver": tuple(solver.items()),
        }, changes


class Opened(NamedTuple):
    """Document of a file with its changes, duration of its run [s], and its readings."""

    document: dict[str, Any]
    duration: float
    measures: tuple[str, ...]

    @property
    def mechanism(self) -> Mechanism:
        """The mechanism."""
        return Mechanism.from_dict(self.document)


def open_file(path: Path, changes: Sequence[str] = (), duration: str | None = None) -> Opened:
    """Read a file with `--set` and `--duration`; a ValueError has its name in front."""
    about = OPTIONS["duration"]
    with name_errors(path):
        document, run = read_file(path)
        seconds = run.get("duration", about.default) if duration is None else about.spec.read("--duration", duration)
        opened = Opened(change(document, read_changes(document, changes)), seconds, run.get("measure", ()))
        _ = opened.mechanism  # refused here, with the name of the file
    return opened


def file_command(
    declare: Callable[[argparse.ArgumentParser], object], answer: Callable[[argparse.Namespace, Opened], int], runs: bool = True
) -> Command:
    """Make a command on a file: FILE and --set, with `runs` also --duration, then its own options. A failed run is exit 1."""

    def declare_all(parser: argparse.ArgumentParser) -> None:
        parser.add_argument("file", metavar="FILE", type=Path, help="a mechanism, .toml or .json")
        add_repeated(parser, "--set", "PATH=VALUE", "another value at a place of the file", dest="changes")
        if runs:
            parser.add_argument("--duration", metavar="s", help="duration [s]; default that of the file, or 1 s")
        parser.add_argument("--timeout", metavar="s", help="longest time of computing [s]; a search then shows its best so far")
        declare(parser)

    def answer_all(options: argparse.Namespace) -> int:
        if options.timeout is not None:
            options.timeout = OPTIONS["timeout"].spec.read("--timeout", options.timeout)
        try:
            return answer(options, open_file(options.file, options.changes, getattr(options, "duration", None)))
        except TimeUpError as error:
            print(f"{options.file}: TIMED_OUT: --{error}, and there is no answer yet", file=sys.stderr)
            return 1
        except RunFailedError as error:
            print(f"{options.file}: {error}", file=sys.stderr)
            return 1

    return Command(declare_all, answer_all)


def ask(call: Callable[..., T], options: argparse.Namespace, *given: Any, **named: Any) -> tuple[T, int]:
    """Return the answer of a call with --timeout and 0; after Ctrl-C its best so far and the exit status for that."""
    try:
        return call(*given, **named, timeout=options.timeout, progress=True), 0
    except Interrupted as stop:
        print(f"interrupted; the best so far: {stop}", file=sys.stderr)
        return stop.result, 130


def read_range(document: Mapping[str, object], text: str, option: str = "--free") -> tuple[str, tuple[float, float]]:
    """Read a number's path and its range, PATH=LOW:HIGH, in SI."""
    path, _, ends = text.partition("=")
    if ends.count(":") != 1:
        raise ValueError(f"{option} {text}: write PATH=LOW:HIGH, as links.coupler.body.imperfection=-1mm:1mm")
    low, high = read_quantities(document, path, ends.split(":"), f"{option} {text}")
    if not low < high:
        raise ValueError(f"{option} {text}: low must be less than high")
    return path, (low, high)


def read_quantities(document: Mapping[str, object], path: str, texts: Sequence[str], place: str) -> list[float]:
    """Read values of a number of a document, in SI."""
    from buckler.mbs.sensitivity.residuals import TIME_ZERO  # with the compiler

    unit = "s" if path == TIME_ZERO else standing(document, path).unit
    try:
        return [parse_quantity(each, unit) for each in texts]
    except ValueError as error:
        raise ValueError(f"{place}: {error}") from None


def varied_numbers(file: Opened, omitted: Collection[str] = ()) -> tuple[dict[str, Any], list[str]]:
    """Return the document and the numbers that vary unless others are named: its parameters, or all but some last words."""
    if named := free_parameters(file.document):
        return file.document, named
    document = file.mechanism.to_dict()
    return document, [path for path in numbers(document) if re.sub(r"\[\d+\]", "", path).rpartition(".")[2] not in omitted]


def numbers(content: object, path: str = "") -> Iterator[str]:
    """Find the paths of all numbers of a document that are neither zero nor places."""
    if isinstance(content, Mapping):
        for key, each in content.items():
            if key not in FIXED and not (path.startswith("guides") and key == "along"):
                yield from numbers(each, f"{path}.{key}" if path else key)
    elif isinstance(content, list):
        for k, each in enumerate(content):
            yield from numbers(each, f"{path}[{k}]")
    elif isinstance(content, float) and content:
        yield path
