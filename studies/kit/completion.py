"""Completion in a shell, by argcomplete: of commands and names, and of the options of one study or file."""

from __future__ import annotations

import argparse
import contextlib
import importlib
import os

from buckler.studies.kit import registry
from buckler.studies.kit.options import study_parser
from buckler.studies.kit.running import MECHANISMS, program

PARSERS = {"run": "buckler.studies.own.command", "sweep": "buckler.studies.sweeping.asked"}
"""Where the options of a command are declared, for files; `parser(name, prog)`."""


def complete(general: argparse.ArgumentParser) -> None:
    """Answer the shell and end the process; without argcomplete, return.

    Parameters
    ----------
    general : ArgumentParser
        For everything in front of a study's or file's own options.
    """
    with contextlib.suppress(ImportError):
        import argcomplete

        argcomplete.autocomplete(_own() or general)


def _own() -> argparse.ArgumentParser | None:
    """The options of the study or file that the line names, the line cut to what they see; None before they begin."""
    line = os.environ["COMP_LINE"][: int(os.environ["COMP_POINT"])]
    words = line.split(maxsplit=3)
    if len(words) < 3 or words[1] not in PARSERS or (len(words) == 3 and not line[-1].isspace()):
        return None
    rest = f"{words[0]} {words[3] if len(words) > 3 else ''}"
    os.environ |= {"COMP_LINE": rest, "COMP_POINT": str(len(rest.encode()))}
    return options_of(words[1], words[2])


def options_of(command: str, name: str) -> argparse.ArgumentParser | None:
    """The parser of `run NAME` or `sweep NAME`; None for a name that is none."""
    prog = f"{program()} {command} {name}"
    try:
        if command == "run" and not name.endswith(MECHANISMS):
            return study_parser(registry.load(name), prog)
        found: argparse.ArgumentParser = importlib.import_module(PARSERS[command]).parser(name, prog)
        return found
    except (ValueError, ImportError):
        return None
