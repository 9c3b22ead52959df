"""A study's run on the command line: attempt it, draw it, file it, say how it ended."""

from __future__ import annotations

import contextlib
import sys
import time
import traceback
from collections.abc import Callable, Mapping
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import argparse

    from matplotlib.figure import Figure

    from buckler.studies.kit.report import StudyResult

MECHANISMS = (".toml", ".json")
"""Endings of a mechanism's file."""


def program() -> str:
    """What to call the command: as it was called."""
    return "buckler" if Path(sys.argv[0]).stem == "buckler" else "python -m studies"


def attempt(run: Callable[..., StudyResult], parameters: Any, options: argparse.Namespace) -> StudyResult:
    """Run a study; whatever it raises becomes a result with status ERROR, its traceback on stderr."""
    from buckler.studies.kit.report import Progress, StudyResult

    begin = time.perf_counter()
    with _aside(options):
        try:
            result = run(parameters, progress=Progress(options.quiet))
        except Exception as error:
            traceback.print_exc()
            result = StudyResult(parameters=parameters, status="ERROR", message=_named(error))
    return result.changed(work={"wall_s": time.perf_counter() - begin, **result.work})


def finish(name: str, study: Any, result: StudyResult, folder: Path, options: argparse.Namespace, wall: float) -> int:
    """Draw, write and print what a run found, the status always; return the exit status."""
    with _aside(options):
        result, figures = drawn(study, result)
    return told(name, result, figures, folder, options, f"in {wall:.2g} s, written to {folder}")


def told(
    name: str, result: StudyResult, figures: Mapping[str, Figure], folder: Path, options: argparse.Namespace, where: str
) -> int:
    """Write and print a result and where it is kept, the status always; return the exit status."""
    from buckler.studies.kit.report import write

    trusted = options.trust and result.status == "SUSPECT"
    try:
        text = write(result, folder, figures, trusted)
    except OSError as error:
        print(f"{name}: cannot write results: {error}", file=sys.stderr)
        return 1
    if options.json:
        print(text, end="")
    elif not options.quiet:
        more = f"{_work(result)}\n" if options.verbose else ""
        print(f"{result}\n\n{more}{name}: {result.status} {where}")
    if result.status != "OK":
        print(f"{name}: {result.status}{' (allowed)' if trusted else ''}: {result.message}", file=sys.stderr)
    return 0 if result.status == "OK" or trusted else 1


def _aside(options: argparse.Namespace) -> Any:
    """With --json, whatever the study or the engine prints must not mix with the JSON."""
    return contextlib.redirect_stdout(sys.stderr) if options.json else contextlib.nullcontext()


def _work(result: StudyResult) -> str:
    """What the run took, and what it ran on."""
    from buckler.studies.kit.versions import versions

    took = ", ".join(
        f"{name} {value:.6g}" if isinstance(value, float) else f"{name} {value}" for name, value in result.work.items()
    )
    return f"{took}\n{', '.join(f'{name} {version}' for name, version in versions().items())}"


def drawn(study: ModuleType, result: StudyResult) -> tuple[StudyResult, Mapping[str, Figure]]:
    """Draw the result, if there is anything to draw; figures that fail leave the numbers and the status ERROR."""
    from buckler.studies.kit.style import house_style

    if not (result.signals or result.metrics):
        return result, {}
    try:
        with house_style():
            figures = study.figure(result)
    except Exception as error:
        traceback.print_exc()
        return result.changed(status="ERROR", message=f"drawing the figures: {_named(error)}"), {}
    return result, figures if isinstance(figures, Mapping) else {"figure": figures}


def _named(error: Exception) -> str:
    return f"{type(error).__name__}: {error}"
