"""Completion in a shell, by argcomplete: of commands and names, and of the options of one command, study or file."""

from __future__ import annotations

import argparse
import contextlib
import os
from collections.abc import Callable

from buckler.studies.kit.words import program, target

NAMED = {"run": "buckler.studies.kit.options:parser_of", "sweep": "buckler.studies.sweeping.asked:parser"}
"""What makes the parser of a study or file from (subject, prog)."""


def complete(general: argparse.ArgumentParser, command: Callable[[str], argparse.ArgumentParser]) -> None:
    """Answer the shell and end the process; without argcomplete, return.

    Parameters
    ----------
    general : ArgumentParser
        For commands and names.
    command : callable
        The parser of a command by its name.
    """
    with contextlib.suppress(ImportError):
        argcomplete = target("argcomplete:autocomplete")
        argcomplete(_own(command) or general)


def _own(command: Callable[[str], argparse.ArgumentParser]) -> argparse.ArgumentParser | None:
    """The parser of what the line names, the line cut to what it sees; None before that has its options."""
    line = os.environ["COMP_LINE"][: int(os.environ["COMP_POINT"])]
    words = line.split()
    named = len(words) > 1 and words[1] in NAMED
    first = 3 if named else 2
    if len(words) < first or (len(words) == first and not line[-1].isspace()):
        return None
    parts = line.split(maxsplit=first)
    rest = f"{words[0]} {parts[first] if len(parts) > first else ''}"
    try:
        if named:
            found = target("buckler.studies.kit.options:subject")(words[2])
            made: argparse.ArgumentParser = target(NAMED[words[1]])(found, f"{program()} {words[1]} {words[2]}")
        else:
            made = command(words[1])
    except (ValueError, ImportError, KeyError):
        return None
    os.environ |= {"COMP_LINE": rest, "COMP_POINT": str(len(rest.encode()))}
    return made
