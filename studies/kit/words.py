"""Words of the command line and their errors. Nothing heavy is imported here: `--help` and `list` answer at once."""

from __future__ import annotations

import argparse
import importlib
import re
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple, NoReturn

from . import registry

MECHANISMS = (".toml", ".json")
"""Endings of a mechanism's file."""


class Command(NamedTuple):
    """A command: `declare` adds its options to a parser, `answer` takes their values and returns the exit status."""

    declare: Callable[[argparse.ArgumentParser], Any]
    answer: Callable[[argparse.Namespace], int]


class Parser(argparse.ArgumentParser):
    """Parser that raises a ValueError where argparse would end the program; no option may be shortened."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(**{"allow_abbrev": False, **settings})

    def error(self, message: str) -> NoReturn:
        """Raise the message, to be printed as one line without the usage."""
        if found := re.match(r"argument COMMAND: invalid choice: '(.*?)'", message):
            known = [name for action in self._actions for name in action.choices or ()]
            meant = registry.hint(found[1], known) or f"there are: {', '.join(known)}"
            message = f"unknown command '{found[1]}'; {meant}"
        raise ValueError(message)

    def read(self, argv: Sequence[str]) -> argparse.Namespace:
        """Parse the words; a ValueError names the first that is wrong, and the closest option to an unknown one."""
        options, unknown = self.parse_known_args(prepare(argv))
        if unknown:
            word = unknown[0].partition("=")[0]
            known = [word for action in self._actions for word in action.option_strings]
            kind = "parameter" if word.startswith("-") else "argument"
            raise ValueError(f"unknown {kind} '{word}'; {registry.hint(word, known) or 'see --help'}")
        return options


def import_name(place: str) -> Any:
    """Import `module:name` of the studies."""
    module, _, name = place.partition(":")
    return getattr(importlib.import_module(f"buckler.studies.{module}"), name)


def program() -> str:
    """Return the name under which the command line was called."""
    return "buckler" if Path(sys.argv[0]).stem == "buckler" else "python -m studies"


def print_error(error: Exception | str) -> int:
    """Print in one line what is wrong with the input; return the exit status."""
    print(f"error: {' '.join(str(error).split())}", file=sys.stderr)
    return 2


def prepare(argv: Sequence[str]) -> list[str]:
    """Join negative values to their options."""
    words: list[str] = []
    for word in argv:
        if words and re.match(r"-\.?\d", word) and words[-1].startswith("--") and "=" not in words[-1]:
            words[-1] += f"={word}"  # argparse would take the negative quantity for an option
        else:
            words.append(word)
    return words


def add_repeated(parser: argparse.ArgumentParser, name: str, metavar: str, about: str, **more: Any) -> None:
    """Add an option that may be given again."""
    parser.add_argument(name, action="append", default=[], metavar=metavar, help=f"{about}; may be repeated", **more)
