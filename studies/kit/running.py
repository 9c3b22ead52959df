"""`buckler run NAME`: read the options, run the study, draw its figures, write and print its result."""

import argparse
import contextlib
import os
import sys
import time
import traceback
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

from buckler.mbs.declare import Declaration, Flag, declarations
from buckler.mbs.process import Interrupted
from buckler.mbs.record.errors import Status

from . import registry
from .cli import INTERRUPTED, Parser, import_name
from .parameters import Repeated, StudyParameters
from .report import Progress, StudyResult, write
from .style import Figure, house_style


def run(name: str, argv: Sequence[str], prog: str) -> int:
    """Run a study, or the mechanism of a file, with these arguments; return the exit status."""
    study = find_study(name)
    options = make_parser(study, prog).read(argv)
    parameters = study.parameters(options)
    folder = make_folder(Path(options.out) / study.title)
    with contextlib.redirect_stdout(sys.stderr) if options.json else contextlib.nullcontext():  # stdout is for the JSON alone
        result, figures = draw(study.module, attempt(study.module.run, parameters, options))
    return finish(study.title, result, figures, folder, options, f"in {result.work['wall_s']:.2g} s, written to {folder}")


def attempt(run: Callable[..., StudyResult], parameters: StudyParameters, options: argparse.Namespace) -> StudyResult:
    """Run a study; an exception gives a result with status ERROR, and a traceback on stderr unless a package is missing."""
    begin = time.perf_counter()
    try:
        result = run(parameters, progress=Progress(options.quiet))
    except Interrupted as stop:  # a study may attach what it has finished: that is written
        if not isinstance(stop.result, StudyResult):
            raise
        result = stop.result
    except Exception as error:
        if not isinstance(error, ImportError):
            traceback.print_exc()
        result = StudyResult(parameters=parameters, status="ERROR", message=f"{type(error).__name__}: {error}")
    return replace(result, work={"wall_s": time.perf_counter() - begin, **result.work})


def draw(study: ModuleType, result: StudyResult) -> tuple[StudyResult, Mapping[str, Figure]]:
    """Draw the figures of a result that has numbers; where drawing fails the numbers remain, with status ERROR."""
    if not (result.signals or result.metrics):
        return result, {}
    try:
        with house_style():
            figures = study.figure(result)
    except Exception as error:
        traceback.print_exc()
        return replace(result, status="ERROR", message=f"drawing the figures: {type(error).__name__}: {error}"), {}
    return result, figures if isinstance(figures, Mapping) else {"figure": figures}


def finish(
    name: str, result: StudyResult, figures: Mapping[str, Figure], folder: Path, options: argparse.Namespace, ending: str
) -> int:
    """Write and print a result, then its status and `ending`; a status that is not OK is printed even where `quiet` is set."""
    has_ended = result.status in set(Status) and Status(result.status).finished  # to its end, though its numbers may be doubtful
    is_allowed = options.allow and has_ended
    try:
        text = write(result, folder, figures, is_allowed)
    except OSError as error:
        print(f"{name}: cannot write results: {error}", file=sys.stderr)
        return 1
    if options.json:
        print(text, end="")
    elif not options.quiet:
        pages = [f"look at it: {folder / page}" for page in result.pages]
        print("\n".join([f"{result}\n\n{name}: {result.status} {ending}", *pages]))
    if result.status != "OK":
        print(f"{name}: {result.status}{' (allowed)' * is_allowed}: {result.message}", file=sys.stderr)
    for note in () if options.quiet else result.notes:
        print(f"{name}: note: {note}", file=sys.stderr)
    if result.status == Status.INTERRUPTED:
        return INTERRUPTED
    return 0 if result.status == "OK" or is_allowed else 1


class CaseMaker(NamedTuple):
    """Maker of the parameters of the cases of a sweep."""

    make: Callable[..., StudyParameters]  # takes values by name
    known: Mapping[str, Declaration]  # of the values that it takes
    shared: Mapping[str, Any]  # values that are the same in all cases


class Study:
    """Study by its name or file, as `run` and `sweep` use it; its subclass in `own.files` makes a study of a mechanism's file."""

    module: ModuleType

    def __init__(self, name: str) -> None:
        self.module = registry.load(name)
        self.title = Path(name).stem if name.endswith(".py") else name
        self.description = (self.module.__doc__ or "").strip().partition("\n\n")[0]

    def declare(self, parser: Parser, excluded: Collection[str] = ()) -> None:
        """Declare an option for each parameter that is not excluded, in the study's groups."""
        fields = {}
        for name, about in declarations(self.module.Parameters).items():
            if name not in excluded:
                fields[name] = about._replace(doc=f"{about.doc}; default {about.show(about.default)}; {about.allowed}")
        add_options(parser, fields)

    def parameters(self, options: argparse.Namespace) -> StudyParameters:
        """Make the parameters of one run from the values of the options."""
        make_case, _, values = self.find_case_maker(options, ())
        return make_case(**values)

    def find_case_maker(self, options: argparse.Namespace, excluded: Collection[str]) -> CaseMaker:
        """Return the maker of cases, the runs of a sweep. The given options that are not excluded are shared values."""
        known = declarations(self.module.Parameters)
        given = {name: each for name, each in vars(options).items() if each is not None}
        shared = {name: each for name, each in given.items() if name in known and name not in excluded}
        return CaseMaker(self.module.Parameters, known, shared)

    def check(self, parameters: StudyParameters) -> None:
        """Raise an error if no run is possible with these parameters; a study in Python checks them when they are made."""


def find_study(name: str) -> Study:
    """Find a study by its name or file, or make one of a mechanism's file."""
    return import_name("own.files:File")(Path(name)) if name.endswith((".toml", ".json")) else Study(name)


def make_parser(study: Study, prog: str, excluded: Collection[str] = ()) -> Parser:
    """Make the parser of `run NAME` or `sweep NAME`; `sweep` excludes parameters with the names of its own options."""
    epilog = "A bare number is in the unit shown; others are converted: 0.3mm, 12rpm, 300r/min, 68kN/m, 5ms, 210GPa, 253N.s/m. "
    epilog += "Exit status: 0 fine, 1 the run failed or is suspect, 2 wrong input, 130 Ctrl-C."
    parser = Parser(prog=prog, usage=f"{prog} [options]", description=study.description, epilog=epilog)
    study.declare(parser, excluded)
    group = parser.add_argument_group("input and output")
    group.add_argument("--out", metavar="DIR", default="results", help="folder of the results; default results")
    group.add_argument("--json", action="store_true", help="print metrics.json and nothing else")
    suspect = "accept a run that is SUSPECT, CHAOTIC, SENSITIVE, UNSTABLE or UNSEEN: exit 0, and metrics.json records it"
    group.add_argument("--allow-suspect", action="store_true", dest="allow", help=suspect)
    group.add_argument("-q", "--quiet", action="store_true", help="print errors only")
    return parser


def add_options(parser: argparse.ArgumentParser, fields: Mapping[str, Declaration]) -> None:
    """Add an option for each declared field, under the heading of its group."""
    groups: dict[str, Any] = {}
    for name, about in fields.items():
        group = groups.get(about.group) or groups.setdefault(about.group, parser.add_argument_group(about.group))
        settings: dict[str, Any] = {"metavar": about.spec.metavar, "help": about.doc.replace("%", "%%")}
        if isinstance(about.spec, Flag):
            settings |= {"nargs": "?", "const": True, "metavar": "true"}
        elif isinstance(about.spec, Repeated) and about.spec.repeats:
            settings |= {"action": "append", "metavar": about.spec.item.metavar, "help": settings["help"] + "; may be repeated"}
        group.add_argument(f"--{name.replace('_', '-')}", dest=name, default=None, **settings)


def make_folder(folder: Path) -> Path:
    """Make the folder of the results, and check before a long run that files can be written to it."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ValueError(f"--out: cannot write to {folder}: {error.strerror}") from None
    if not os.access(folder, os.W_OK | os.X_OK):
        raise ValueError(f"--out: cannot write to {folder}: not permitted, or a medium that is read only")
    return folder
