"""The command line: `python -m studies list`, `python -m studies run NAME`, `python -m studies.slider_crank`.

Exit status: 0 fine, 1 the run failed or is suspect, 2 wrong input, 130 interrupted. Nothing heavy is imported before a
study is known by name, so that `list` answers at once.
"""

from __future__ import annotations

import argparse
import contextlib
import re
import sys
import tempfile
import time
import traceback
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any, NoReturn

from studies import registry

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from studies.parameters import StudyParameters
    from studies.report import Progress, StudyResult

EPILOG = (
    "A bare number is in the unit shown; others are converted: 0.3mm, 12rpm, 300r/min, 68kN/m, 5ms, 210GPa, 253N.s/m. "
    "Exit status: 0 fine, 1 the run failed or is suspect, 2 wrong input."
)


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        """Hand the message on, to be printed as one line without the usage."""
        raise ValueError(message)


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
        if study is not None:
            return run_study(study, words, f"python -m {registry.entry(study).module}")
        if words[:1] == ["run"] and len(words) > 1 and not words[1].startswith("-"):
            return run_study(words[1], words[2:], f"python -m studies run {words[1]}")
        return _list_or_help(words)
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        return 130


def _list_or_help(words: list[str]) -> int:
    parser = _Parser(prog="python -m studies", description="Run Buckler's studies.")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    commands.add_parser("list", help="name every study, one a line")
    run = commands.add_parser("run", help="run a study; `run NAME --help` tells its parameters")
    run.add_argument("name", metavar="NAME", help="a study, followed by its parameters")
    try:
        options = parser.parse_args(words)
    except ValueError as error:
        return _wrong_input(error)
    if options.command == "run":
        return run_study(options.name, [], f"python -m studies run {options.name}")
    width = max(map(len, registry.STUDIES))
    for name, entry in registry.STUDIES.items():
        print(f"{name:{width}}  {entry.summary}")
    return 0


def run_study(name: str, argv: Sequence[str], prog: str) -> int:
    """Read the options, run the study, print and file what it found; return the exit status."""
    try:
        study = registry.load(name)
        options, given = _read_options(_study_parser(study, prog), argv)
        parameters = study.Parameters(**given)
        folder = _writable(Path(options.out) / name)
    except ValueError as error:
        return _wrong_input(error)
    except ImportError as error:
        print(f"{name}: cannot be loaded: {error}", file=sys.stderr)
        return 1
    from studies.report import Progress, write

    # With --json, whatever the study or the engine prints must not mix with the JSON.
    with contextlib.redirect_stdout(sys.stderr) if options.json else contextlib.nullcontext():
        result = _attempt(study, parameters, Progress())
        result, figures = _draw(study, result)
    try:
        text = write(result, folder, figures)
    except OSError as error:
        print(f"{name}: cannot write results: {error}", file=sys.stderr)
        return 1
    print(text if options.json else f"{result}\n\nwritten to {folder}", end="" if options.json else "\n")
    if result.status != "OK":
        print(f"{name}: {result.status}: {result.message}", file=sys.stderr)
    return 0 if result.status == "OK" else 1


def _wrong_input(error: ValueError) -> int:
    print(f"error: {' '.join(str(error).split())}", file=sys.stderr)
    return 2


# --- options ----------------------------------------------------------------------------------------------------------


def _study_parser(study: ModuleType, prog: str) -> argparse.ArgumentParser:
    """One option a parameter, in the groups the study declares."""
    from studies.parameters import specs

    about = (study.__doc__ or "").strip().partition("\n\n")[0]
    parser = _Parser(prog=prog, usage=f"{prog} [options]", description=about, epilog=EPILOG, allow_abbrev=False)
    defaults = study.Parameters()
    groups: dict[str, Any] = {}
    for name, spec in specs(study.Parameters).items():
        group = groups.get(spec.group) or groups.setdefault(spec.group, parser.add_argument_group(spec.group))
        text = f"{spec.help}; default {spec.show(getattr(defaults, name))}; {spec.allowed}"
        flag = f"--{name.replace('_', '-')}"
        group.add_argument(flag, dest=name, default=None, metavar=spec.metavar, help=text.replace("%", "%%"))
    general = parser.add_argument_group("input and output")
    general.add_argument("--config", metavar="FILE", help="TOML file of parameters; the command line overrides it")
    general.add_argument("--out", metavar="DIR", default="results", help="where to write; default results")
    general.add_argument("--json", action="store_true", help="print metrics.json and nothing else")
    return parser


def _read_options(parser: argparse.ArgumentParser, argv: Sequence[str]) -> tuple[argparse.Namespace, dict[str, Any]]:
    """Split the words into general options and the parameters that were given, as yet unread."""
    options, unknown = parser.parse_known_args(_joined(argv))
    names = set(vars(options)) - {"config", "out", "json"}
    if unknown:
        word = unknown[0].partition("=")[0]
        known = [f"--{name.replace('_', '-')}" for name in vars(options)]
        what = "parameter" if word.startswith("-") else "argument"
        raise ValueError(f"unknown {what} '{word}'; {registry.hint(word, known) or 'see --help'}")
    given = _read_config(Path(options.config), names) if options.config else {}
    given |= {name: value for name, value in vars(options).items() if name in names and value is not None}
    return options, given


def _joined(argv: Sequence[str]) -> list[str]:
    """Write `--angle -5deg` as `--angle=-5deg`; argparse would take the negative quantity for an option."""
    words: list[str] = []
    for word in argv:
        if words and words[-1].startswith("--") and "=" not in words[-1] and re.match(r"-\.?\d", word):
            words[-1] += f"={word}"
        else:
            words.append(word)
    return words


def _read_config(path: Path, names: set[str]) -> dict[str, Any]:
    import tomllib

    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ValueError(f"--config {path}: {error.strerror}") from None
    except ValueError as error:
        raise ValueError(f"--config {path}: no valid TOML: {error}") from None
    given = {name.replace("-", "_"): value for name, value in content.items()}
    for name in given:
        if name not in names:
            raise ValueError(f"--config {path}: unknown parameter '{name}'; {registry.hint(name, names) or 'see --help'}")
    return given


def _writable(folder: Path) -> Path:
    """Make the folder and try it, before a long run rather than after it."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
    except OSError as error:
        raise ValueError(f"--out: cannot write to {folder}: {error.strerror}") from None
    return folder


# --- the run ----------------------------------------------------------------------------------------------------------


def _attempt(study: ModuleType, parameters: StudyParameters, progress: Progress) -> StudyResult:
    """Run the study; whatever it raises becomes a result with status ERROR, its traceback on stderr."""
    from studies.report import StudyResult

    begin = time.perf_counter()
    try:
        result = study.run(parameters, progress=progress)
    except Exception as error:
        traceback.print_exc()
        result = StudyResult(parameters=parameters, status="ERROR", message=_named(error))
    return replace(result, work={"wall_s": time.perf_counter() - begin, **result.work})


def _draw(study: ModuleType, result: StudyResult) -> tuple[StudyResult, Mapping[str, Figure]]:
    """Draw the result, if there is anything to draw; figures that fail leave the numbers and the status ERROR."""
    from studies.style import house_style

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
