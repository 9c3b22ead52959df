"""The command line: `buckler list`, `new`, `show`, `run`, `sweep`, `sensitivity`, `schema`.

Exit status: 0 fine, or suspect and allowed; 1 the run failed or is suspect; 2 wrong input; 130 interrupted. Nothing
heavy is imported before a command is known by name, so that `list` and `--help` answer at once.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import sys
from collections.abc import Sequence
from pathlib import Path

from . import registry
from .words import MECHANISMS, Command, Parser, program, target, wrong_input

STUDIES = "buckler.studies"
"""The package of all places."""
NAMED = {
    "run": ("kit.running:run", "kit.options:parser_of"),
    "sweep": ("sweeping.command:sweep_study", "sweeping.command:parser"),
}
"""Commands whose options depend on the name that follows them: what answers (name, words, prog), and what makes the parser of a
study or file from (subject, prog)."""
COMMANDS: dict[str, tuple[str, str]] = {
    "new": ("write an example file of a mechanism, to start from", "kit.cli:new"),
    "show": ("draw the mechanism of a file and tell what it is made of", "own.show:showing"),
    "equilibrium": ("find where the mechanism of a file rests, and whether that is stable", "own.statics:equilibrium"),
    "path": (
        "follow its equilibria as a load grows, a drive moves or a number changes: limits, branchings, flutter",
        "own.statics:path",
    ),
    "frequencies": ("natural frequencies about its equilibrium, with damping and errors", "own.statics:frequencies"),
    "periodic": (
        "find a motion that repeats itself after a period, its multipliers and whether it is stable",
        "own.statics:periodic",
    ),
    "response": (
        "follow it over its frequency, a load or a number, around folds, and find where its period doubles",
        "own.statics:response",
    ),
    "run": ("run a file of a mechanism, or a study; `run NAME --help` tells its options", ""),
    "sweep": ("run a file or a study for many parameters; `sweep NAME --help` tells its options", ""),
    "sensitivity": ("what the numbers of a file's mechanism do to what is read off it", "own.turning:sensitivity"),
    "fit": ("fit numbers of a file's mechanism to measured data", "own.turning:fit"),
    "explore": ("turn numbers of a file's mechanism by sliders in a page on this machine", "own.explore:explore"),
    "optimise": ("choose numbers of a file's mechanism so that a reading is least and others as wanted", "own.turning:optimise"),
    "list": ("name every study, one a line", "kit.cli:listing"),
    "schema": ("print the JSON schema of mechanism files, for editors", "own.show:schemas"),
    "compile": ("compile the solver for this machine, so that no run waits for it", "own.show:compiling"),
}
"""What each command does, and where its `Command` is; '' for those in `NAMED`."""


def main(study: str | None = None, argv: Sequence[str] | None = None) -> int:
    """Run the command line.

    Parameters
    ----------
    study : the study to run with `argv` as its options; without it `argv` starts with a command. A study that is run as a
        script names itself here and is imported once more under its real name: the copy called `__main__` only defines.
    argv : `sys.argv[1:]` if not given

    Returns
    -------
    status : the exit status
    """
    words = list(sys.argv[1:] if argv is None else argv)
    if argv is None and words[:1] == ["show"]:  # all of this process: loading a compiler takes longer than interpreting
        os.environ.setdefault("NUMBA_DISABLE_JIT", "1")
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
        return int(target(f"{STUDIES}.{NAMED['run'][0]}")(study, words, f"python -m {registry.entry(study).module}"))
    if "_ARGCOMPLETE" in os.environ:
        _complete()
    name, *rest = words or [""]
    try:
        if name in NAMED and rest and not rest[0].startswith("-"):
            return int(target(f"{STUDIES}.{NAMED[name][0]}")(rest[0], rest[1:], f"{program()} {name} {rest[0]}"))
        if name == "--version":
            return _version()
        general, mine = _parsers(name)
        if mine is None:
            general.parse_args(words)
            return 0
        return int(target(f"{STUDIES}.{COMMANDS[name][1]}").answer(mine.read(rest)))
    except BrokenPipeError:
        raise
    except OSError as error:
        return wrong_input(ValueError(f"{error.filename}: {error.strerror}" if error.filename else str(error)))
    except (ValueError, OverflowError, ImportError) as error:
        return wrong_input(error)


def _parsers(chosen: str) -> tuple[Parser, Parser | None]:
    """The parser of all commands, with the options of the chosen one; and the chosen one's, if it needs no name of a study."""
    general = Parser(prog=program(), description="Planar mechanisms that buckle, rattle and strike: run files and studies.")
    general.add_argument("--version", action="store_true", help="print the versions of Buckler and of what it runs on")
    commands, mine = general.add_subparsers(dest="command", required=True, metavar="COMMAND"), None
    for name, (does, place) in COMMANDS.items():
        command: Parser = commands.add_parser(name, help=does, description=f"{does[0].upper()}{does[1:]}.")
        if name in NAMED:
            about = "FILE.toml, FILE.json, STUDY.py or a study of the list"
            command.add_argument("name", metavar="NAME", help=about).completer = _names  # type: ignore[attr-defined]
        elif name == chosen:
            target(f"{STUDIES}.{place}").declare(command)
            mine = command
    return general, mine


def _complete() -> None:
    """Answer the shell, by argcomplete, and end the process; without it, return."""
    line = os.environ["COMP_LINE"][: int(os.environ["COMP_POINT"])]
    command, name, *_ = [*line.split(maxsplit=3)[1:], "", ""]
    rest = line.split(maxsplit=3)[3:]
    parser, _ = _parsers(command)
    if command in NAMED and name and (rest or line[-1].isspace()):  # the parser of the study or file sees its options alone
        with contextlib.suppress(ImportError, ValueError):
            found = target(f"{STUDIES}.kit.options:subject")(name)
            parser = target(f"{STUDIES}.{NAMED[command][1]}")(found, f"{program()} {command} {name}")
            words = f"{line.split()[0]} {''.join(rest)}"
            os.environ |= {"COMP_LINE": words, "COMP_POINT": str(len(words.encode()))}
    with contextlib.suppress(ImportError):
        target("argcomplete:autocomplete")(parser)


def _names(prefix: str = "", **_: object) -> list[str]:
    """What may stand behind `run`: studies, and files here."""
    files = [str(path) for ending in (*MECHANISMS, ".py") for path in Path().glob(f"*{ending}")]
    return [name for name in [*registry.STUDIES, *files] if name.startswith(prefix)]


def _version() -> int:
    """Print the versions."""
    versions = target("buckler.studies.kit.versions:versions")()
    print(", ".join(f"{name} {version or 'of a checkout'}" for name, version in versions.items()))
    return 0


# --- list, new --------------------------------------------------------------------------------------------------------


def _list(options: argparse.Namespace) -> int:
    """Name the studies."""
    studies = registry.everything()
    if options.json:
        print(json.dumps([{"name": name, **entry._asdict()} for name, entry in studies.items()], indent=2))
        return 0
    width = max(map(len, studies))
    for name, entry in studies.items():
        print(f"{name:{width}}  {entry.summary}")
    return 0


EXAMPLES = Path(__file__).resolve().parents[1] / "own" / "examples"


def _examples(**_: object) -> dict[str, Path]:
    """Files by their names."""
    return {path.stem: path for path in sorted(EXAMPLES.glob("*.toml"))}


def _declare_new(parser: argparse.ArgumentParser) -> None:
    about = "the example; `new list` names them"
    parser.add_argument("name", metavar="NAME", help=about).completer = _examples  # type: ignore[attr-defined]
    parser.add_argument("--out", metavar="FILE", type=Path, help="where to; default NAME.toml")


def _new(options: argparse.Namespace) -> int:
    """Write an example file; never over another."""
    examples = _examples()
    if options.name == "list":
        for name, path in examples.items():
            print(f"{name:15} {path.read_text(encoding='utf-8').partition(chr(10))[0].lstrip('# ')}")
        return 0
    if options.name not in examples:
        hint = registry.hint(options.name, examples)
        raise ValueError(f"unknown example '{options.name}'; {hint + ' ' if hint else ''}there are: {', '.join(examples)}")
    out = options.out or Path(f"{options.name}.toml")
    try:
        with out.open("x", encoding="utf-8") as file:
            file.write(examples[options.name].read_text(encoding="utf-8"))
    except FileExistsError:
        raise ValueError(f"{out} is there already; name another with --out") from None
    print(f"written to {out}; now: {program()} show {out}, {program()} run {out}")
    return 0


listing = Command(lambda parser: parser.add_argument("--json", action="store_true", help="as JSON"), _list)
new = Command(_declare_new, _new)
