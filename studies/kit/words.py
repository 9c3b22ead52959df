"""Words of the command line and what is wrong with them. Nothing heavy is imported here: `--help` and `list` answer at once."""

from __future__ import annotations

import argparse
import importlib
import re
import sys
from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple, NoReturn

from . import registry

MECHANISMS = (".toml", ".json")
"""Endings of a mechanism's file."""
RENAMED = {"--trust": "--allow-suspect", "--show": "--metrics"}
"""Options that had another name."""


class Command(NamedTuple):
    """A command: what declares its options, and what answers them with the exit status."""

    declare: Callable[[argparse.ArgumentParser], Any]
    answer: Callable[[argparse.Namespace], int]


class Parser(argparse.ArgumentParser):
    """Raises a ValueError where argparse would end the program; no option may be shortened."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(**{"allow_abbrev": False, **settings})

    def error(self, message: str) -> NoReturn:
        """Hand the message on, to be printed as one line without the usage."""
        raise ValueError(message)

    def read(self, argv: Sequence[str]) -> argparse.Namespace:
        """Options of the words.

        Raises
        ------
        ValueError
            In one line, for the first word that is wrong; for one that is no option with the closest one.
        """
        options, unknown = self.parse_known_args(noted(argv))
        if unknown:
            word = unknown[0].partition("=")[0]
            known = [word for action in self._actions for word in action.option_strings]
            what = "parameter" if word.startswith("-") else "argument"
            raise ValueError(f"unknown {what} '{word}'; {registry.hint(word, known) or 'see --help'}")
        return options


def target(place: str) -> Any:
    """What `module:name` names."""
    module, _, name = place.partition(":")
    return getattr(importlib.import_module(module), name)


def program() -> str:
    """What to call the command: as it was called."""
    return "buckler" if Path(sys.argv[0]).stem == "buckler" else "python -m studies"


def wrong_input(error: Exception) -> int:
    """Say in one line what was wrong; the exit status."""
    print(f"error: {' '.join(str(error).split())}", file=sys.stderr)
    return 2


def noted(argv: Sequence[str], renamed: Mapping[str, str] = RENAMED) -> list[str]:
    """Words with the present names of options that had another one, each with a note; negative values made safe."""
    words: list[str] = []
    for word in argv:
        if words and re.match(r"-\.?\d", word) and words[-1].startswith("--") and "=" not in words[-1]:
            words[-1] += f"={word}"  # argparse would take the negative quantity for an option
            continue
        name, equals, value = word.partition("=")
        if name in renamed:
            print(f"note: {name} is called {renamed[name]} now", file=sys.stderr)
            name = renamed[name]
        words.append(f"{name}{equals}{value}")
    return words


def repeated(add: Callable[..., object], names: Collection[str], metavar: str, about: str, **more: object) -> None:
    """Declare an option that may be given again."""
    add(*names, action="append", default=[], metavar=metavar, help=f"{about}; may be repeated", **more)
