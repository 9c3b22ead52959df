"""Completion in a shell, by argcomplete: of commands and names, and of the options of one command, study or file."""

from __future__ import annotations

import argparse
import contextlib
import os
from collections.abc import Callable

from buckler.studies.kit.words import program, target

NAMED = {"run": "buckler.studies.kit.options:parser_of", "sweep": "buckler.studies.sweeping.asked:parser"}
"""What makes the parser of a study or file from (subject, prog)."""


def complete(parsers: Callable[[str], tuple[argparse.ArgumentParser, object]]) -> None:
    """Answer the shell and end the process; without argcomplete, return.

    Parameters
    ----------
    parsers : callable
        Gives, first, the parser of all commands with the options of the one that is named.
    """
    line = os.environ["COMP_LINE"][: int(os.environ["COMP_POINT"])]
    command, name, *_ = [*line.split(maxsplit=3)[1:], "", ""]
    rest = line.split(maxsplit=3)[3:]
    parser, _ = parsers(command)
    if command in NAMED and name and (rest or line[-1].isspace()):  # the parser of the study or file sees its options alone
        with contextlib.suppress(ImportError, ValueError):
            parser = target(NAMED[command])(target("buckler.studies.kit.options:subject")(name), f"{program()} {command} {name}")
            words = f"{line.split()[0]} {''.join(rest)}"
            os.environ |= {"COMP_LINE": words, "COMP_POINT": str(len(words.encode()))}
    with contextlib.suppress(ImportError):
        target("argcomplete:autocomplete")(parser)
