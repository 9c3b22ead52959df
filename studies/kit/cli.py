"""The command line: `buckler list`, `run NAME`, `sweep NAME`, `export FILE`; `python -m studies` is the same from a checkout.

Exit status: 0 fine, or suspect and trusted; 1 the run failed or is suspect; 2 wrong input; 130 interrupted. Nothing
heavy is imported before a study is known by name, so that `list` answers at once.
"""

from __future__ import annotations

import contextlib
import os
import sys
import time
import traceback
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

from buckler.studies.kit import registry
from buckler.studies.kit.options import Parser, read_options, study_parser, writable, wrong_input

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from buckler.studies.kit.parameters import StudyParameters
    from buckler.studies.kit.report import Progress, StudyResult


def main(study: str | None = None, argv: Sequence[str] | None = None) -> int:
    """Run the command line.

    Parameters
    ----------
    study : str, optional
        The study to run with `argv` as its options; without it `argv` starts with a command. A study that is run as a
        script names itself here and is imported once more under its real name: the copy called `__main__` only defines.
    argv : sequence of str, optional
        `sys.argv[1:]` if not given.

    Returns
    -------
    status : int
        The exit status.
    """
    words = list(sys.argv[1:] if argv is None else argv)
    try:
        status = _dispatch(study, words)
        sys.stdout.flush()
        return status
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        return 130
    except BrokenPipeError:  # whoever read what is printed has gone, as `head` does
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # nor is anything left to be printed at exit
        return 141


def _dispatch(study: str | None, words: list[str]) -> int:
    if study is not None:
        return run_study(study, words, f"python -m {registry.entry(study).module}")
    if words[:1] == ["run"] and len(words) > 1 and not words[1].startswith("-"):
        return run_study(words[1], words[2:], f"python -m studies run {words[1]}")
    if words[:1] == ["sweep"] and len(words) > 1 and not words[1].startswith("-"):
        from buckler.studies.sweeping.command import sweep_study

        return sweep_study(words[1], words[2:])
    parser = Parser(prog="python -m studies", description="Run Buckler's studies.")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    commands.add_parser("list", help="name every study, one a line")
    run = commands.add_parser("run", help="run a study; `run NAME --help` tells its parameters")
    run.add_argument("name", metavar="NAME", help="a study, followed by its parameters")
    sweep = commands.add_parser("sweep", help="run a study for many parameters; `sweep NAME --help` tells how")
    sweep.add_argument("name", metavar="NAME", help="a study, followed by what varies and its parameters")
    export = commands.add_parser("export", help="write what a sweep has stored as CSV or Parquet")
    export.add_argument("store", metavar="FILE", type=Path, help="a sweep's store")
    export.add_argument("--out", metavar="FILE", type=Path, required=True, help="FILE.csv or FILE.parquet")
    export.add_argument("--signals", metavar="DIR", type=Path, help="also write each case's signals there, as npz")
    try:
        options = parser.parse_args(words)
    except ValueError as error:
        return wrong_input(error)
    if options.command == "export":
        return _export(options.store, options.out, options.signals)
    width = max(map(len, registry.STUDIES))
    for name, entry in registry.STUDIES.items():
        print(f"{name:{width}}  {entry.summary}")
    return 0


def _export(store: Path, out: Path, signals: Path | None) -> int:
    """Write a store as a table; say what it holds."""
    from buckler.studies.sweeping import export

    try:
        rows, units = export.read(store)
        export.write(export.columns(rows, units), out)
        count = export.write_signals(store, signals) if signals else 0
    except ValueError as error:
        return wrong_input(error)
    except OSError as error:
        print(f"cannot write {error.filename or out}: {error.strerror}", file=sys.stderr)
        return 1
    print(f"{len(rows)} cases written to {out}" + (f", the signals of {count} to {signals}" if signals else ""))
    return 0


def run_study(name: str, argv: Sequence[str], prog: str) -> int:
    """Read the options, run the study, print and file what it found; return the exit status."""
    try:
        study = registry.load(name)
        options, given = read_options(study_parser(study, prog), argv, study)
        parameters = study.Parameters(**given)
        folder = writable(Path(options.out) / name)
    except ValueError as error:
        return wrong_input(error)
    except ImportError as error:
        print(f"{name}: cannot be loaded: {error}", file=sys.stderr)
        return 1
    from buckler.studies.kit.report import Progress, write

    # With --json, whatever the study or the engine prints must not mix with the JSON.
    with contextlib.redirect_stdout(sys.stderr) if options.json else contextlib.nullcontext():
        result = _attempt(study, parameters, Progress())
        result, figures = _draw(study, result)
    trusted = options.trust and result.status == "SUSPECT"
    try:
        text = write(result, folder, figures, trusted)
    except OSError as error:
        print(f"{name}: cannot write results: {error}", file=sys.stderr)
        return 1
    print(text if options.json else f"{result}\n\nwritten to {folder}", end="" if options.json else "\n")
    if result.status != "OK":
        print(f"{name}: {result.status}{' (trusted)' if trusted else ''}: {result.message}", file=sys.stderr)
    return 0 if result.status == "OK" or trusted else 1


# --- the run ----------------------------------------------------------------------------------------------------------


def _attempt(study: ModuleType, parameters: StudyParameters, progress: Progress) -> StudyResult:
    """Run the study; whatever it raises becomes a result with status ERROR, its traceback on stderr."""
    from buckler.studies.kit.report import StudyResult

    begin = time.perf_counter()
    try:
        result = study.run(parameters, progress=progress)
    except Exception as error:
        traceback.print_exc()
        result = StudyResult(parameters=parameters, status="ERROR", message=_named(error))
    return replace(result, work={"wall_s": time.perf_counter() - begin, **result.work})


def _draw(study: ModuleType, result: StudyResult) -> tuple[StudyResult, Mapping[str, Figure]]:
    """Draw the result, if there is anything to draw; figures that fail leave the numbers and the status ERROR."""
    from buckler.studies.kit.style import house_style

    if not (result.signals or result.metrics):
        return result, {}
    try:
        with house_style():
            figures = study.figure(result)
    except Exception as error:
        traceback.print_exc()
        return replace(result, status="ERROR", message=f"drawing the figures: {_named(error)}"), {}
    return result, figures if isinstance(figures, Mapping) else {"figure": figures}


def _named(error: Exception) -> str:
    return f"{type(error).__name__}: {error}"
