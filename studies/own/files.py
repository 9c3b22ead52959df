"""Files of mechanisms on the command line: `File`, for `run FILE` and `sweep FILE`, and `file_command`, for other commands.

A document is the content of a file as nested tables and lists. A path such as `links.coupler.body.section.thickness` names an
entry of it; a change gives an entry another value. The table [run] of a file has options of a run. It is no part of the document.
"""

import argparse
import json
import sys
import tomllib
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

from buckler.mbs.declare import Declaration, Quantity, Spec, declarations
from buckler.mbs.documents import document as documents
from buckler.mbs.documents.shorthand import expand, free_parameters
from buckler.mbs.mechanism import RUN, Mechanism
from buckler.mbs.process import Interrupted
from buckler.mbs.progress import TimeUpError
from buckler.mbs.sensitivity import reading
from buckler.mbs.sensitivity.numbers import find_entry
from buckler.mbs.simulation import simulate
from buckler.mbs.units import parse_quantity

from ..kit.cli import INTERRUPTED, Command, Parser, add_repeated
from ..kit.running import CaseMaker, Study, add_options
from . import study
from .study import Parameters, solver_options, target_signals

T = TypeVar("T")

VARIED_HELP = "the parameters of the file, or else its nonzero numbers but counts, places, first velocities and gravity"
"""Help text on the numbers of `varied_numbers`."""
OPTIONS = {name: about for name, about in declarations(Parameters).items() if about.group}
"""Options of a run, which may also stand in a file's table [run]. In the help they have a heading, `group`."""


@contextmanager
def name_errors(path: Path) -> Iterator[None]:
    """Convert an error to a ValueError that begins with the file's name, unless it begins with that or an option."""
    try:
        yield
    except (ValueError, OSError, ImportError) as error:
        text = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        if isinstance(error, FileNotFoundError) and not path.exists():
            others = ", ".join(sorted(each.name for each in path.parent.glob("*.toml"))[:8])
            text += f"; there are: {others}" if others else "; `buckler new` writes an example"
        raise ValueError(text if text.startswith((str(path), "--")) else f"{path}: {text}") from None


def read_file(path: Path) -> tuple[dict[str, Any], dict[str, Any]]:
    """Read the document of a file, with its short forms expanded, and its table [run]."""
    document = expand(documents.read(path))
    document.pop("about", None)  # a text for readers
    run = document.pop(RUN, {})
    known = {**OPTIONS, "solver": declarations(Parameters)["solver"]}
    unknown = sorted(run.keys() - known.keys()) if isinstance(run, dict) else [str(run)]
    if unknown:
        raise ValueError(f"{RUN}.{unknown[0]}: unknown key; known: {', '.join(known)}")
    return document, {name: known[name].spec.read(f"{RUN}.{name}", value) for name, value in run.items()}


class TomlValue(Spec):
    """Any TOML value, or a text such as 0.3mm or Beam."""

    allowed = "what the file takes there"

    def read(self, name: str, given: object) -> Any:
        """Return the TOML value that a text writes, or else the text; any other value stays."""
        if not isinstance(given, str):
            return given
        try:
            return tomllib.loads(f"value = {given}")["value"]
        except ValueError:
            return given.strip()


def read_changes(document: Mapping[str, object], texts: Sequence[str]) -> dict[str, Any]:
    """Read the changes `--set PATH=VALUE`; a ValueError if the document with one of them describes no mechanism."""
    found: dict[str, Any] = {}
    for text in texts:
        path, _, value = (part.strip() for part in text.partition("="))
        if not value:
            raise ValueError(f"--set {text}: write PATH=VALUE, as links.coupler.body.section.thickness=0.2mm")
        found[path] = TomlValue().read(path, value)
        try:
            Mechanism.from_dict(documents.change(document, {path: found[path]}))
        except ValueError as error:
            raise ValueError(f"--set {text}: {error}") from None
    return found


def declare_path(document: Mapping[str, object], path: str) -> Declaration:
    """Declare the entry at a path of a document: a count, a number with its unit, or a word; a ValueError for an unknown path."""
    declared, now, unit = find_entry(document, path)
    spec: Spec = TomlValue()
    if declared and type(now) is int and not declared.spec.unit:  # a count; with a unit, as 2 for 2 m, it is a quantity
        spec = declared.spec
    elif Quantity(unit).fits(now) or (unit and now is None):  # None: an optional number that the file does not have
        spec = Quantity(unit)
    return Declaration(spec, declared.doc if declared else path, bounds={}, required=True, default=None)


class File(Study):
    """Mechanism of a file, as a study: the module `study` has its `Parameters`, `run` and `figure`."""

    module, description = study, "Simulate the mechanism of a file. Options that are not given are those of its table [run]."

    def __init__(self, path: Path) -> None:
        self.path, self.title = path, path.stem

    def declare(self, parser: Parser, excluded: Collection[str] = ()) -> None:
        """Declare the options of the run and of the solver, and `--set`; a sweep's own options, `excluded`, have other names."""
        add_options(parser, OPTIONS)
        text = "another value of an entry of the file, as links.coupler.body.section.thickness=0.2mm"
        add_repeated(parser, "--set", "PATH=VALUE", text, dest="changes")
        add_options(parser, solver_options())

    def parameters(self, options: argparse.Namespace) -> Parameters:
        """Make the parameters of one run from the options and the file, and try its first microsecond."""
        with name_errors(self.path):
            base, changes = self._settings(options)
            parameters = Parameters(**base, changes=tuple(changes.items()), report=True)  # cases of a sweep write no report page
        self.check(parameters)
        return parameters

    def find_case_maker(self, options: argparse.Namespace, excluded: Collection[str]) -> CaseMaker:
        """Return the maker of the cases of a sweep over the paths of `--vary`. It has all other values: none is left to share."""
        with name_errors(self.path):
            base, changes = self._settings(options)
            document = documents.change(json.loads(base["document"]), changes)
            numbers = {}
            for text in options.vary:
                name = text.partition("=")[0].strip()
                try:
                    numbers[name] = declare_path(document, name)
                except ValueError as error:
                    raise ValueError(f"--vary {name}: {error}") from None
        return CaseMaker(lambda **values: Parameters(**base, changes=tuple((changes | values).items())), numbers, {})

    def check(self, parameters: Any) -> None:
        """Run a microsecond; raise an error for a wrong start or an unknown signal."""
        with name_errors(self.path):
            result = simulate(parameters.mechanism(), min(parameters.duration, 1e-6))  # one or two steps of any solver
            if result.signals:  # a failed run has none, so that no name can be looked up
                for name in target_signals(parameters):
                    _ = result[name]  # raises for an unknown name
                for text in parameters.measure:
                    reading.check_reading(text, result.signals)

    def _settings(self, options: argparse.Namespace) -> tuple[dict[str, Any], dict[str, Any]]:
        """Return the parameters of a run except its changes, and its changes; options override the file's table [run].

        `--accuracy`, or another kind of solver, replaces all settings of the file's solver. An option of the solver replaces the
        file's accuracy and `of`, the signals that the accuracy is asked of.
        """
        document, of_file = read_file(self.path)
        Mechanism.from_dict(document)
        changes = read_changes(document, options.changes)
        solver_of_file = dict(of_file.pop("solver", ()))
        run, solver = _read_options(options, OPTIONS), _read_options(options, solver_options())
        if "solver" in solver:
            solver["kind"] = solver.pop("solver")  # the option and the key in a file
        if solver:
            of_file.pop("accuracy", None)
            of_file.pop("of", None)
        kinds = {settings["kind"] for settings in (solver_of_file, solver) if "kind" in settings}
        if "accuracy" not in run and len(kinds) < 2:
            solver = solver_of_file | solver
        text = json.dumps(document, ensure_ascii=False)
        return {**of_file, **run, "name": self.title, "document": text, "solver": tuple(solver.items())}, changes


def _read_options(options: argparse.Namespace, declared: Mapping[str, Declaration]) -> dict[str, Any]:
    """Read the values of those declared options that are given."""
    given = {name: value for name in declared if (value := getattr(options, name)) is not None}
    return {name: declared[name].spec.read(f"--{name.replace('_', '-')}", value) for name, value in given.items()}


class FileContent(NamedTuple):
    """Content of a file: its document with changes, the duration of its run [s], and its readings."""

    document: dict[str, Any]
    duration: float
    measures: tuple[str, ...]

    @property
    def mechanism(self) -> Mechanism:
        """Mechanism of the document."""
        return Mechanism.from_dict(self.document)


def open_file(path: Path, changes: Sequence[str] = (), duration: str | None = None) -> FileContent:
    """Read a file, with the changes of `--set` and the duration of `--duration`; errors begin with the file's name."""
    option = OPTIONS["duration"]
    with name_errors(path):
        document, run = read_file(path)
        seconds = run.get("duration", option.default) if duration is None else option.spec.read("--duration", duration)
        content = FileContent(documents.change(document, read_changes(document, changes)), seconds, run.get("measure", ()))
        _ = content.mechanism  # raises here, so that the error names the file
    return content


def file_command(
    declare: Callable[[argparse.ArgumentParser], object], answer: Callable[[argparse.Namespace, FileContent], int],
    has_duration: bool = True, has_json: bool = False,
) -> Command:  # fmt: skip
    """Make a command on a file: its options, --set, --timeout; if wanted --duration, --json; exit status 1 if a run fails."""

    def declare_all(parser: argparse.ArgumentParser) -> None:
        """Declare the common options and the command's own."""
        parser.add_argument("file", metavar="FILE", type=Path, help="a mechanism, .toml or .json")
        add_repeated(parser, "--set", "PATH=VALUE", "another value of an entry of the file", dest="changes")
        if has_duration:
            parser.add_argument("--duration", metavar="s", help="duration [s]; default that of the file, or 1 s")
        parser.add_argument("--timeout", metavar="s", help="longest time of computing [s]; a search then shows its best so far")
        if has_json:
            parser.add_argument("--json", action="store_true", help="print JSON and nothing else")
        declare(parser)

    def answer_all(options: argparse.Namespace) -> int:
        """Read the file, call the command and return the exit status."""
        if options.timeout is not None:
            options.timeout = OPTIONS["timeout"].spec.read("--timeout", options.timeout)
        try:
            return answer(options, open_file(options.file, options.changes, getattr(options, "duration", None)))
        except TimeUpError as error:
            # The text of the error begins with "timeout = ": with hyphens before it, that is the option.
            print(f"{options.file}: TIMED_OUT: --{error}, and there is no answer yet", file=sys.stderr)
        except reading.RunFailedError as error:
            print(f"{options.file}: {error}", file=sys.stderr)
        return 1

    return Command(declare_all, answer_all)


def ask(call: Callable[..., T], options: argparse.Namespace, *arguments: Any, **named: Any) -> tuple[T, int]:
    """Call a function with `--timeout` and a progress bar; return its answer, at Ctrl-C the best so far, and the exit status."""
    try:
        return call(*arguments, **named, timeout=options.timeout, progress=True), 0
    except Interrupted as stop:
        print(f"interrupted; the best so far: {stop}", file=sys.stderr)
        return stop.result, INTERRUPTED


def read_range(document: Mapping[str, object], text: str, option: str = "--free") -> tuple[str, tuple[float, float]]:
    """Read the path and the range of a number from PATH=LOW:HIGH, in SI."""
    path, _, bounds = text.partition("=")
    if bounds.count(":") != 1:
        raise ValueError(f"{option} {text}: write PATH=LOW:HIGH, as links.coupler.body.imperfection=-1mm:1mm")
    low, high = read_quantities(document, path, bounds.split(":"), f"{option} {text}")
    if not low < high:
        raise ValueError(f"{option} {text}: low must be less than high")
    return path, (low, high)


def read_quantities(document: Mapping[str, object], path: str, texts: Sequence[str], place: str) -> list[float]:
    """Read values of the number at a path of a document, in SI; errors begin with `place`."""
    from buckler.mbs.sensitivity.residuals import TIME_ZERO  # loads the compiler, which not all commands need

    unit = "s" if path == TIME_ZERO else find_entry(document, path).unit  # TIME_ZERO: start of a fit's data, not in the file
    try:
        return [parse_quantity(each, unit) for each in texts]
    except ValueError as error:
        raise ValueError(f"{place}: {error}") from None


def varied_numbers(file: FileContent, omitted: Collection[str] = ()) -> tuple[dict[str, Any], list[str]]:
    """Return a document and the paths in it of the numbers that change where a user names none, without the `omitted` keys."""
    if named := free_parameters(file.document):
        return file.document, named
    document = file.mechanism.to_dict()  # in full, with numbers as floats
    # Numbers of elements, places, initial velocities and gravity change only if a user names them.
    return document, list(_find_numbers(document, {"elements", "points", "velocities", "gravity", *omitted}))


def _find_numbers(content: object, fixed: Collection[str], path: str = "") -> Iterator[str]:
    """Find the paths of nonzero numbers, except under the fixed keys and a guide's direction, whose length is arbitrary."""
    if isinstance(content, Mapping):
        for key, each in content.items():
            if key not in fixed and not (path.startswith("guides") and key == "along"):
                yield from _find_numbers(each, fixed, f"{path}.{key}" if path else key)
    elif isinstance(content, list):
        for k, each in enumerate(content):
            yield from _find_numbers(each, fixed, f"{path}[{k}]")
    elif isinstance(content, float) and content:
        yield path
