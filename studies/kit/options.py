"""A study on the command line: options from its declared parameters, words and TOML files read, and where results go."""

from __future__ import annotations

import argparse
import os
import tomllib
from collections.abc import Collection, Mapping
from pathlib import Path
from types import ModuleType
from typing import Any, Protocol

from buckler.mbs.declare import Declaration, Flag
from buckler.mbs.declare.spec import Choice

from . import registry
from .parameters import Cases, Repeated, StudyParameters, specs
from .words import MECHANISMS, Parser, target

EPILOG = (
    "A bare number is in the unit shown; others are converted: 0.3mm, 12rpm, 300r/min, 68kN/m, 5ms, 210GPa, 253N.s/m. "
    "Exit status: 0 fine, 1 the run failed or is suspect, 2 wrong input."
)


class Subject(Protocol):
    """What a command line runs or sweeps: a study, or the mechanism of a file."""

    title: str
    about: str

    @property
    def module(self) -> ModuleType:
        """Has `run` and `figure`."""

    def declare(self, parser: Parser, taken: Collection[str] = ()) -> None:
        """Declare options, but for names that are taken; where some are, cases are wanted."""

    def parameters(self, options: argparse.Namespace) -> StudyParameters:
        """Those of one run; a ValueError with one line for wrong ones."""

    def cases(self, options: argparse.Namespace, taken: Collection[str]) -> tuple[type[StudyParameters] | Cases, dict[str, Any]]:
        """What makes the cases of a sweep, and what they share."""

    def probe(self, parameters: StudyParameters) -> str:
        """Find out what no parameter shows before any case runs; what a store calls the subject."""


def subject(name: str) -> Subject:
    """What the name of a file or a study stands for."""
    found: Subject = target("buckler.studies.own.command:File")(Path(name)) if name.endswith(MECHANISMS) else Study(name)
    return found


def parser_of(found: Subject, prog: str, taken: Collection[str] = ()) -> Parser:
    """The options of `run NAME`, or, with names that are taken, a part of those of `sweep NAME`."""
    parser = Parser(prog=prog, usage=f"{prog} [options]", description=found.about, epilog=EPILOG)
    found.declare(parser, taken)
    return parser


class Study:
    """A study by its name or file."""

    def __init__(self, name: str) -> None:
        self.module = registry.load(name)
        self.title = Path(name).stem if name.endswith(".py") else name
        self.about = (self.module.__doc__ or "").strip().partition("\n\n")[0]

    def declare(self, parser: Parser, taken: Collection[str] = ()) -> None:
        """One option a parameter, in the groups the study declares."""
        fields = {name: about for name, about in specs(self.module.Parameters).items() if name not in taken}
        texts = {name: f"{about.doc}; default {about.show(about.default)}; {about.allowed}" for name, about in fields.items()}
        add_options(parser, fields, texts)
        answers(parser).add_argument("--config", metavar="FILE", help="TOML file of parameters; the command line overrides it")

    def parameters(self, options: argparse.Namespace) -> StudyParameters:
        """Of one run."""
        made: StudyParameters = self.module.Parameters(**self._given(options, ()))
        return made

    def cases(self, options: argparse.Namespace, taken: Collection[str]) -> tuple[type[StudyParameters], dict[str, Any]]:
        """The study's own `Parameters`."""
        return self.module.Parameters, self._given(options, taken)

    def probe(self, _parameters: StudyParameters) -> str:
        """Its title; it checks its parameters itself."""
        return self.title

    def _given(self, options: argparse.Namespace, taken: Collection[str]) -> dict[str, Any]:
        """Parameters that were given, as yet unread."""
        names = set(specs(self.module.Parameters))
        given = _read_config(Path(options.config), names) if options.config else {}
        return given | {name: each for name, each in vars(options).items() if name in names - set(taken) and each is not None}


def add_options(parser: argparse.ArgumentParser, fields: Mapping[str, Declaration], texts: Mapping[str, str]) -> None:
    """One option a declared field, in the groups that are declared."""
    groups: dict[str, Any] = {}
    for name, about in fields.items():
        group = groups.get(about.group) or groups.setdefault(about.group, parser.add_argument_group(about.group))
        how: dict[str, Any] = {"metavar": about.spec.metavar}
        if isinstance(about.spec, Flag):
            how = {"nargs": "?", "const": True, "metavar": "true"}
        elif isinstance(about.spec, Repeated) and about.spec.repeats:
            how = {"action": "append", "metavar": about.spec.item.metavar}
        text = texts[name].replace("%", "%%")
        option = group.add_argument(f"--{name.replace('_', '-')}", dest=name, default=None, help=text, **how)
        if isinstance(about.spec, Choice):
            option.completer = lambda words=about.spec.options, **_: words


def answers(parser: argparse.ArgumentParser) -> Any:
    """Add the options that every run has: where its results go and what is printed; return their group."""
    group = parser.add_argument_group("input and output")
    group.add_argument("--out", metavar="DIR", default="results", help="where to write; default results")
    group.add_argument("--json", action="store_true", help="print metrics.json and nothing else")
    suspect = "take a SUSPECT run all the same: exit 0, and metrics.json records that its checks were overridden"
    group.add_argument("--allow-suspect", action="store_true", dest="trust", help=suspect)
    group.add_argument("-q", "--quiet", action="store_true", help="print errors only")
    group.add_argument("-v", "--verbose", action="store_true", help="also print steps, iterations and versions")
    return group


def _read_config(path: Path, names: set[str]) -> dict[str, Any]:
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


def writable(folder: Path) -> Path:
    """Make the folder and try it, before a long run rather than after it."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ValueError(f"--out: cannot write to {folder}: {error.strerror}") from None
    if not os.access(folder, os.W_OK | os.X_OK):
        raise ValueError(f"--out: cannot write to {folder}: not permitted, or a medium that is read only")
    return folder
