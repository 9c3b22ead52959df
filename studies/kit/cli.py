"""Command line: `buckler COMMAND ...`, or an option such as `buckler --version`.

Exit status: 0 the run is fine, or suspect and allowed; 1 it failed or is suspect; 2 wrong input; 130 interrupted; 141 the
reader of the output has ended. The module of a command is imported only when it is called: `list` and `--help` start at once.
"""

import argparse
import importlib
import json
import os
import re
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple, NoReturn

from . import registry

COMMANDS: dict[str, tuple[str, str]] = {
    "list": ("name every study, one a line", "kit.cli:listing"),
    "new": ("write an example file of a mechanism, to start from", "kit.cli:new"),
    "show": ("draw the mechanism of a file and list its parts, masses, mobility and frequencies", "own.statics:show"),
    "run": ("run a file of a mechanism, or a study; `run NAME --help` lists its options", "kit.running:run"),
    "sweep": ("run a file or a study for many parameters; `sweep NAME --help` lists its options", "sweeping.command:sweep_study"),
    "equilibrium": ("find where the mechanism of a file rests, and whether that is stable", "own.statics:equilibrium"),
    "path": ("follow equilibria as a load, a drive or a number changes: limits, branchings, flutter", "own.statics:path"),
    "frequencies": ("find natural frequencies about an equilibrium, with damping and errors", "own.statics:frequencies"),
    "periodic": ("find a periodic motion, its multipliers and whether it is stable", "own.statics:periodic"),
    "response": ("follow a periodic motion over frequency, load or number, past folds and doublings", "own.statics:response"),
    "sensitivity": ("compute derivatives of readings by numbers of a file's mechanism", "own.numbers:sensitivity"),
    "fit": ("fit numbers of a file's mechanism to measured data", "own.numbers:fit"),
    "optimise": ("choose numbers of a file's mechanism: least reading, others within bounds", "own.numbers:optimise"),
    "ensemble": ("run a file many times, with other numbers and starts: means, intervals, maps", "own.numbers:ensemble"),
    "explore": ("change numbers of a file's mechanism by sliders in a page on this machine", "own.explore:explore"),
}
"""Help of each command, and `module:name` of its `Command`. Those in `BY_NAME` have a function (name, arguments, program)."""
BY_NAME = ("run", "sweep")
"""Commands whose options depend on the study or file that their first argument names."""
INTERRUPTED = 130
"""Exit status after Ctrl-C, by convention of shells: 128 and the number of the signal."""
OPTIONS = {
    "--version": ("print the versions of Buckler and of its dependencies", "kit.versions:print_versions"),
    "--schema": ("print the JSON schema of mechanism files, for editors", "own.statics:print_schema"),
    "--compile": ("compile the solver for this machine, so that no run waits for it", "own.statics:compile_solver"),
}
"""Options in place of a command: help of each, and `module:name` of its function."""
EXAMPLES = Path(__file__).resolve().parents[1] / "own" / "examples"
"""Folder of the files that `new` copies."""


class Command(NamedTuple):
    """Command: `declare` adds its options to a parser, `answer` runs it with their values and returns the exit status."""

    declare: Callable[[argparse.ArgumentParser], Any]
    answer: Callable[[argparse.Namespace], int]


class Parser(argparse.ArgumentParser):
    """Parser that raises a ValueError where argparse would end the program, and takes no shortened options."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(**{"allow_abbrev": False, **settings})

    def error(self, message: str) -> NoReturn:
        """Raise a ValueError with the message, which is printed as one line without the usage."""
        if found := re.match(r"argument COMMAND: invalid choice: '(.*?)'", message):
            known = [name for action in self._actions for name in action.choices or ()]
            meant = registry.hint(found[1], known) or f"there are: {', '.join(known)}"
            message = f"unknown command '{found[1]}'; {meant}"
        raise ValueError(message)

    def read(self, argv: Sequence[str]) -> argparse.Namespace:
        """Parse the arguments; a ValueError names the first wrong one, and the option closest to an unknown one."""
        words: list[str] = []
        for word in argv:
            if words and re.match(r"-\.?\d", word) and words[-1].startswith("--") and "=" not in words[-1]:
                words[-1] += f"={word}"  # argparse would read a negative quantity, -3mm, as an option
            else:
                words.append(word)
        options, unknown = self.parse_known_args(words)
        if unknown:
            word = unknown[0].partition("=")[0]
            known = [option for action in self._actions for option in action.option_strings]
            kind = "option" if word.startswith("-") else "argument"
            raise ValueError(f"unknown {kind} '{word}'; {registry.hint(word, known) or 'see --help'}")
        return options


def main(study: str | None = None, argv: Sequence[str] | None = None) -> int:
    """Run the command line `argv`, by default that of the process; return the exit status.

    The file of a study calls this with the name of its study when Python runs it as a script: all arguments are its options. The
    study is then imported again by its module name, because classes of the module `__main__` cannot be pickled.
    """
    words = list(sys.argv[1:] if argv is None else argv)
    if argv is None and words[:1] == ["show"]:  # loading the compiler takes longer than interpreting the little that `show` needs
        os.environ.setdefault("NUMBA_DISABLE_JIT", "1")
    try:
        if study is None:
            status = _dispatch(words)
        else:
            status = int(import_name(COMMANDS["run"][1])(study, words, f"python -m {registry.entry(study).module}"))
        sys.stdout.flush()
        return status
    except (ValueError, OverflowError, ImportError) as error:
        return print_error(error)
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:  # the reader of the output has gone, as `head` does
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # nothing may be printed at exit
        return 141
    except OSError as error:
        return print_error(f"{error.filename}: {error.strerror}" if error.filename else error)


def _dispatch(words: Sequence[str]) -> int:
    """Call the command that the first argument names, and return its exit status."""
    name, *rest = words or [""]
    if name in OPTIONS and not rest:
        return int(import_name(OPTIONS[name][1])())
    if name in BY_NAME and rest and not rest[0].startswith("-"):
        return int(import_name(COMMANDS[name][1])(rest[0], rest[1:], f"{program()} {name} {rest[0]}"))
    # the words are now: none, an unknown command, `run` or `sweep` without a NAME, `--help`, or an option with arguments
    if name not in COMMANDS or name in BY_NAME:
        _parser().parse_args(words)  # prints the help and ends the program, or raises an error, but accepts `--version list`
        raise ValueError(f"{name}: takes no further arguments")
    command: Command = import_name(COMMANDS[name][1])
    parser = Parser(prog=f"{program()} {name}", description=f"{COMMANDS[name][0].capitalize()}.")
    command.declare(parser)
    return command.answer(parser.read(rest))


def _parser() -> Parser:
    parser = Parser(prog=program(), description="Planar mechanisms that buckle, rattle and strike: run files and studies.")
    for option, (text, _) in OPTIONS.items():
        parser.add_argument(option, action="store_true", help=text)
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for name, (text, _) in COMMANDS.items():
        command = commands.add_parser(name, help=text, description=f"{text[0].upper()}{text[1:]}.")
        if name in BY_NAME:
            command.add_argument("name", metavar="NAME", help="FILE.toml, FILE.json, STUDY.py or a study of the list")
    return parser


def import_name(place: str) -> Any:
    """Import the object `module:name` of the package of studies."""
    module, _, name = place.partition(":")
    return getattr(importlib.import_module(f"buckler.studies.{module}"), name)


def program() -> str:
    """Return the command that was called: the script, or the package `studies` in the root of the repository."""
    return "buckler" if Path(sys.argv[0]).stem == "buckler" else "python -m studies"


def print_error(error: Exception | str) -> int:
    """Print an error of the input in one line on stderr; return the exit status 2."""
    print(f"error: {' '.join(str(error).split())}", file=sys.stderr)
    return 2


def add_repeated(parser: argparse.ArgumentParser, name: str, metavar: str, about: str, **more: Any) -> None:
    """Add an option that may be repeated; its value is the list of what was given."""
    parser.add_argument(name, action="append", default=[], metavar=metavar, help=f"{about}; may be repeated", **more)


def _list(options: argparse.Namespace) -> int:
    studies = registry.find_studies()
    if options.json:
        print(json.dumps([{"name": name, **entry._asdict()} for name, entry in studies.items()], indent=2))
        return 0
    width = max(map(len, studies))
    for name, entry in studies.items():
        print(f"{name:{width}}  {entry.summary}")
    return 0


def _declare_new(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("name", metavar="NAME", help="the example; `new list` names them")
    parser.add_argument("--out", metavar="FILE", type=Path, help="file to write; default NAME.toml")


def _new(options: argparse.Namespace) -> int:
    """Write an example to a new file, or list the examples."""
    examples = {path.stem: path for path in sorted(EXAMPLES.glob("*.toml"))}
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
