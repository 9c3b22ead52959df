"""`buckler run NAME`: read the options, run the study, draw, file and print its result."""

from __future__ import annotations

import argparse
import contextlib
import sys
import time
import traceback
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import ModuleType

from buckler.mbs.process import Interrupted
from buckler.mbs.record.errors import Status

from .files import write
from .options import parser_of, subject, writable
from .parameters import StudyParameters
from .report import Progress, StudyResult
from .style import Figure, house_style
from .words import print_error

INTERRUPTED = 130
"""Exit status of what Ctrl-C has ended, as in shells."""


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
    with _only_json(options):
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
    return result.replace(work={"wall_s": time.perf_counter() - begin, **result.work})


def draw(study: ModuleType, result: StudyResult) -> tuple[StudyResult, Mapping[str, Figure]]:
    """Draw the result, if it has numbers; figures that fail leave the numbers and the status ERROR."""
    if not (result.signals or result.metrics):
        return result, {}
    try:
        with house_style():
            figures = study.figure(result)
    except Exception as error:
        traceback.print_exc()
        return result.replace(status="ERROR", message=f"drawing the figures: {type(error).__name__}: {error}"), {}
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
    return 0 if result.status == "OK" or trusted else INTERRUPTED if result.status == Status.INTERRUPTED else 1


def _only_json(options: argparse.Namespace) -> contextlib.AbstractContextManager[object]:
    """Redirect output of the study and the engine to stderr if --json is given."""
    return contextlib.redirect_stdout(sys.stderr) if options.json else contextlib.nullcontext()
