"""Options of `run` and `sweep`: one for each declared parameter of a study or a file; each reads words and values alike."""

from __future__ import annotations

import argparse
import os
from collections.abc import Collection, Mapping
from pathlib import Path
from types import ModuleType
from typing import Any, Protocol

from buckler.mbs.declare import Declaration, Flag

from . import registry
from .parameters import Cases, Repeated, StudyParameters, specs
from .words import MECHANISMS, Parser, import_name

EPILOG = (
    "A bare number is in the unit shown; others are converted: 0.3mm, 12rpm, 300r/min, 68kN/m, 5ms, 210GPa, 253N.s/m. "
    "Exit status: 0 fine, 1 the run failed or is suspect, 2 wrong input."
)


class Subject(Protocol):
    """Study or mechanism of a file, as `run` and `sweep` see it.

    `cases` gives the kind of cases of a sweep and what they share; `probe` tries the first and names the subject in a store.
    """

    title: str
    about: str

    @property
    def module(self) -> ModuleType:
        """Module with `run` and `figure`."""

    def declare(self, parser: Parser, taken: Collection[str] = ()) -> None:
        """Declare all options but those whose names are taken."""

    def parameters(self, options: argparse.Namespace) -> StudyParameters:
        """Make the parameters of one run."""

    def cases(self, options: argparse.Namespace, taken: Collection[str]) -> tuple[type[StudyParameters] | Cases, dict[str, Any]]:
        """Return the kind of cases and the parameters that all of them share."""

    def probe(self, parameters: StudyParameters) -> str:
        """Try what no parameter shows; return the name for a store."""


def subject(name: str) -> Subject:
    """Find the study or the mechanism's file of this name."""
    found: Subject = import_name("own.command:File")(Path(name)) if name.endswith(MECHANISMS) else Study(name)
    return found


def parser_of(found: Subject, prog: str, taken: Collection[str] = ()) -> Parser:
    """Make the parser of `run NAME`, or the part of `sweep NAME` that its own options leave."""
    parser = Parser(prog=prog, usage=f"{prog} [options]", description=found.about, epilog=EPILOG)
    found.declare(parser, taken)
    return parser


class Study:
    """Study by its name or file."""

    def __init__(self, name: str) -> None:
        self.module = registry.load(name)
        self.title = Path(name).stem if name.endswith(".py") else name
        self.about = (self.module.__doc__ or "").strip().partition("\n\n")[0]

    def declare(self, parser: Parser, taken: Collection[str] = ()) -> None:
        """Declare one option a parameter, in the groups that the study declares."""
        fields = {name: about for name, about in specs(self.module.Parameters).items() if name not in taken}
        texts = {name: f"{about.doc}; default {about.show(about.default)}; {about.allowed}" for name, about in fields.items()}
        add_options(parser, fields, texts)
        add_output(parser)

    def parameters(self, options: argparse.Namespace) -> StudyParameters:
        """Make the parameters of one run."""
        made: StudyParameters = self.module.Parameters(**self._collect(options, ()))
        return made

    def cases(self, options: argparse.Namespace, taken: Collection[str]) -> tuple[type[StudyParameters], dict[str, Any]]:
        """Return the study's own `Parameters`."""
        return self.module.Parameters, self._collect(options, taken)

    def probe(self, _parameters: StudyParameters) -> str:
        """Return the title; the study checks its parameters itself."""
        return self.title

    def _collect(self, options: argparse.Namespace, taken: Collection[str]) -> dict[str, object]:
        names = set(specs(self.module.Parameters)) - set(taken)
        return {name: each for name, each in vars(options).items() if name in names and each is not None}


def add_options(parser: argparse.ArgumentParser, fields: Mapping[str, Declaration], texts: Mapping[str, str]) -> None:
    """Add one option a declared field, in the groups that are declared."""
    groups: dict[str, Any] = {}
    for name, about in fields.items():
        group = groups.get(about.group) or groups.setdefault(about.group, parser.add_argument_group(about.group))
        how: dict[str, Any] = {"metavar": about.spec.metavar}
        if isinstance(about.spec, Flag):
            how = {"nargs": "?", "const": True, "metavar": "true"}
        elif isinstance(about.spec, Repeated) and about.spec.repeats:
            how |= {"action": "append", "metavar": about.spec.item.metavar}
        group.add_argument(f"--{name.replace('_', '-')}", dest=name, default=None, help=texts[name].replace("%", "%%"), **how)


def add_output(parser: argparse.ArgumentParser) -> None:
    """Add the options that every run has: where its results go, and what is printed."""
    group = parser.add_argument_group("input and output")
    group.add_argument("--out", metavar="DIR", default="results", help="folder of the results; default results")
    group.add_argument("--json", action="store_true", help="print metrics.json and nothing else")
    suspect = "accept a run that is SUSPECT, CHAOTIC, SENSITIVE, UNSTABLE or UNSEEN: exit 0, and metrics.json records it"
    group.add_argument("--allow-suspect", action="store_true", dest="trust", help=suspect)
    group.add_argument("-q", "--quiet", action="store_true", help="print errors only")


def writable(folder: Path) -> Path:
    """Make the folder and check that it takes files, before a long run."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ValueError(f"--out: cannot write to {folder}: {error.strerror}") from None
    if not os.access(folder, os.W_OK | os.X_OK):
        raise ValueError(f"--out: cannot write to {folder}: not permitted, or a medium that is read only")
    return folder
