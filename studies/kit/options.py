"""Options of the command line: a study's parameters, from words and TOML files, and where its results go."""

from __future__ import annotations

import argparse
import os
import re
import sys
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from types import ModuleType
from typing import Any, NoReturn

from buckler.studies.kit import registry

EPILOG = (
    "A bare number is in the unit shown; others are converted: 0.3mm, 12rpm, 300r/min, 68kN/m, 5ms, 210GPa, 253N.s/m. "
    "Exit status: 0 fine, 1 the run failed or is suspect, 2 wrong input."
)


RENAMED = {"--trust": "--allow-suspect", "--show": "--metrics"}
"""Options that had another name."""


class Parser(argparse.ArgumentParser):
    """Raises a ValueError where argparse would end the program."""

    def error(self, message: str) -> NoReturn:
        """Hand the message on, to be printed as one line without the usage."""
        raise ValueError(message)


def wrong_input(error: ValueError) -> int:
    """Say in one line what was wrong; the exit status."""
    print(f"error: {' '.join(str(error).split())}", file=sys.stderr)
    return 2


def study_parser(study: ModuleType, prog: str, taken: Collection[str] = ()) -> argparse.ArgumentParser:
    """One option a parameter, in the groups the study declares, but for names that are taken."""
    from buckler.studies.kit.parameters import specs

    about = (study.__doc__ or "").strip().partition("\n\n")[0]
    parser = Parser(prog=prog, usage=f"{prog} [options]", description=about, epilog=EPILOG, allow_abbrev=False)
    defaults = study.Parameters()
    groups: dict[str, Any] = {}
    for name, spec in specs(study.Parameters).items():
        if name in taken:
            continue
        group = groups.get(spec.group) or groups.setdefault(spec.group, parser.add_argument_group(spec.group))
        text = f"{spec.help}; default {spec.show(getattr(defaults, name))}; {spec.allowed}"
        flag = f"--{name.replace('_', '-')}"
        group.add_argument(flag, dest=name, default=None, metavar=spec.metavar, help=text.replace("%", "%%"))
    answers(parser).add_argument("--config", metavar="FILE", help="TOML file of parameters; the command line overrides it")
    return parser


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


def noted(argv: Sequence[str], renamed: Mapping[str, str] = RENAMED) -> list[str]:
    """Words with the present names of options that had another one, each with a note; negative values made safe."""
    words = []
    for word in _joined(argv):
        name, equals, value = word.partition("=")
        if name in renamed:
            print(f"note: {name} is called {renamed[name]} now", file=sys.stderr)
            name = renamed[name]
        words.append(f"{name}{equals}{value}")
    return words


def check_words(unknown: Sequence[str], options: argparse.Namespace, extra: Collection[str] = ()) -> None:
    """Refuse the first word that is no option, with the closest one.

    Raises
    ------
    ValueError
        In one line.
    """
    if unknown:
        word = unknown[0].partition("=")[0]
        known = [f"--{name.replace('_', '-')}" for name in (*vars(options), *extra) if name not in ("trust", "changes")]
        what = "parameter" if word.startswith("-") else "argument"
        raise ValueError(f"unknown {what} '{word}'; {registry.hint(word, [*known, '--allow-suspect']) or 'see --help'}")


def read_options(
    parser: argparse.ArgumentParser, argv: Sequence[str], study: ModuleType, taken: Collection[str] = ()
) -> tuple[argparse.Namespace, dict[str, Any]]:
    """Split the words into general options and the parameters that were given, as yet unread."""
    from buckler.studies.kit.parameters import specs

    options, unknown = parser.parse_known_args(noted(argv))
    names = set(specs(study.Parameters))
    check_words(unknown, options)
    given = _read_config(Path(options.config), names) if options.config else {}
    given |= {name: value for name, value in vars(options).items() if name in names - set(taken) and value is not None}
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


def writable(folder: Path) -> Path:
    """Make the folder and try it, before a long run rather than after it."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ValueError(f"--out: cannot write to {folder}: {error.strerror}") from None
    if not os.access(folder, os.W_OK | os.X_OK):
        raise ValueError(f"--out: cannot write to {folder}: not permitted, or a medium that is read only")
    return folder
