"""`buckler run NAME`: read the options, run the study, draw, file and print its result."""

from __future__ import annotations

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
from typing import Any

from buckler.mbs.declare import Declaration, Flag
from buckler.mbs.process import Interrupted
from buckler.mbs.record.errors import Status

from . import registry
from .cli import MECHANISMS, Parser, import_name, print_error
from .parameters import Cases, Repeated, StudyParameters, specs
from .report import Progress, StudyResult, write
from .style import Figure, house_style


def run(name: str, argv: Sequence[str], prog: str) -> int:
    """Run the study or the mechanism of the file; return the exit status."""
    try:
        found = subject(name)
        options = parser_of(found, prog).read(argv)
        parameters = found.parameters(options)
        folder = writable(Path(options.out) / found.title)
    except ValueError as error:
        return print_error(error)
    except ImportError as error:
        print(f"{name}: cannot be loaded: {error}", file=sys.stderr)
        return 1
    begin = time.perf_counter()
    with contextlib.redirect_stdout(sys.stderr) if options.json else contextlib.nullcontext():  # of the study and the engine
        result = attempt(found.module.run, parameters, options)
        wall = time.perf_counter() - begin
        result, figures = draw(found.module, result)
    return finish(found.title, result, figures, folder, options, f"in {wall:.2g} s, written to {folder}")


def attempt(run: Callable[..., StudyResult], parameters: StudyParameters, options: argparse.Namespace) -> StudyResult:
    """Run a study; an exception becomes a result with status ERROR, its traceback on stderr unless a package is missing."""
    begin = time.perf_counter()
    try:
        result = run(parameters, progress=Progress(options.quiet))
    except Interrupted as stop:  # the part that ran is filed, if the study returns it
        if not isinstance(stop.result, StudyResult):
            raise
        result = stop.result
    except Exception as error:
        if not isinstance(error, ImportError):
            traceback.print_exc()
        result = StudyResult(parameters=parameters, status="ERROR", message=f"{type(error).__name__}: {error}")
    return replace(result, work={"wall_s": time.perf_counter() - begin, **result.work})


def draw(study: ModuleType, result: StudyResult) -> tuple[StudyResult, Mapping[str, Figure]]:
    """Draw the result, if it has numbers; figures that fail leave the numbers and the status ERROR."""
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
    name: str, result: StudyResult, figures: Mapping[str, Figure], folder: Path, options: argparse.Namespace, where: str
) -> int:
    """Write and print a result and its place, the status always; return the exit status."""
    trusted = options.trust and result.status in set(Status) and Status(result.status).finished
    try:
        text = write(result, folder, figures, trusted)
    except OSError as error:
        print(f"{name}: cannot write results: {error}", file=sys.stderr)
        return 1
    if options.json:
        print(text, end="")
    elif not options.quiet:
        pages = [f"look at it: {folder / page}" for page in result.pages]
        print("\n".join([f"{result}\n\n{name}: {result.status} {where}", *pages]))
    if result.status != "OK":
        print(f"{name}: {result.status}{' (allowed)' * trusted}: {result.message}", file=sys.stderr)
    for note in () if options.quiet else result.notes:
        print(f"{name}: note: {note}", file=sys.stderr)
    return 0 if result.status == "OK" or trusted else 130 if result.status == Status.INTERRUPTED else 1


EPILOG = (
    "A bare number is in the unit shown; others are converted: 0.3mm, 12rpm, 300r/min, 68kN/m, 5ms, 210GPa, 253N.s/m. "
    "Exit status: 0 fine, 1 the run failed or is suspect, 2 wrong input."
)


class Study:
    """Study by its name or file, as `run` and `sweep` see it; a mechanism's file is one, too."""

    module: ModuleType

    def __init__(self, name: str) -> None:
        self.module = registry.load(name)
        self.title = Path(name).stem if name.endswith(".py") else name
        self.about = (self.module.__doc__ or "").strip().partition("\n\n")[0]

    def declare(self, parser: Parser, taken: Collection[str] = ()) -> None:
        """Declare an option for each parameter, except those whose names are used, in the study's groups."""
        fields = {name: about for name, about in specs(self.module.Parameters).items() if name not in taken}
        texts = {name: f"{about.doc}; default {about.show(about.default)}; {about.allowed}" for name, about in fields.items()}
        add_options(parser, fields, texts)

    def parameters(self, options: argparse.Namespace) -> StudyParameters:
        """Make the parameters of one run."""
        kind, given = self.cases(options, ())
        return kind(**given)

    def cases(self, options: argparse.Namespace, taken: Collection[str]) -> tuple[type[StudyParameters] | Cases, dict[str, Any]]:
        """Return the kind of cases of a sweep, and the parameters that all of them share."""
        names = set(specs(self.module.Parameters)) - set(taken)
        return self.module.Parameters, {name: each for name, each in vars(options).items() if name in names and each is not None}

    def probe(self, parameters: StudyParameters) -> str:
        """Check what declarations of parameters cannot; return the name for a store."""
        return self.title


def subject(name: str) -> Study:
    """Find the study or the mechanism's file of this name."""
    return import_name("own.verbs:File")(Path(name)) if name.endswith(MECHANISMS) else Study(name)


def parser_of(found: Study, prog: str, taken: Collection[str] = ()) -> Parser:
    """Make the parser of `run NAME`, or the part of `sweep NAME` that its own options leave."""
    parser = Parser(prog=prog, usage=f"{prog} [options]", description=found.about, epilog=EPILOG)
    found.declare(parser, taken)
    group = parser.add_argument_group("input and output")
    group.add_argument("--out", metavar="DIR", default="results", help="folder of the results; default results")
    group.add_argument("--json", action="store_true", help="print metrics.json and nothing else")
    suspect = "accept a run that is SUSPECT, CHAOTIC, SENSITIVE, UNSTABLE or UNSEEN: exit 0, and metrics.json records it"
    group.add_argument("--allow-suspect", action="store_true", dest="trust", help=suspect)
    group.add_argument("-q", "--quiet", action="store_true", help="print errors only")
    return parser


def add_options(parser: argparse.ArgumentParser, fields: Mapping[str, Declaration], texts: Mapping[str, str]) -> None:
    """Add an option for each declared field, in the declared groups."""
    groups: dict[str, Any] = {}
    for name, about in fields.items():
        group = groups.get(about.group) or groups.setdefault(about.group, parser.add_argument_group(about.group))
        how: dict[str, Any] = {"metavar": about.spec.metavar}
        if isinstance(about.spec, Flag):
            how = {"nargs": "?", "const": True, "metavar": "true"}
        elif isinstance(about.spec, Repeated) and about.spec.repeats:
            how |= {"action": "append", "metavar": about.spec.item.metavar}
        group.add_argument(f"--{name.replace('_', '-')}", dest=name, default=None, help=texts[name].replace("%", "%%"), **how)


def writable(folder: Path) -> Path:
    """Make the folder and check that files can be written to it, before a long run."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ValueError(f"--out: cannot write to {folder}: {error.strerror}") from None
    if not os.access(folder, os.W_OK | os.X_OK):
        raise ValueError(f"--out: cannot write to {folder}: not permitted, or a medium that is read only")
    return folder
