"""The command line: `buckler list`, `new`, `show`, `run`, `sweep`, `sensitivity`, `merge`, `export`, `schema`, `evidence`.

Exit status: 0 fine, or suspect and allowed; 1 the run failed or is suspect; 2 wrong input; 130 interrupted. Nothing
heavy is imported before a study or a file is known by name, so that `list` and `--help` answer at once.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from buckler.studies.kit import registry
from buckler.studies.kit.options import Parser, read_options, study_parser, writable, wrong_input
from buckler.studies.kit.running import MECHANISMS, attempt, finish, program
from buckler.studies.own.statics import declare as declare_statics

if TYPE_CHECKING:
    import argparse


TURNING = {
    "sensitivity": "what the numbers of a file's mechanism do to what is read off it",
    "fit": "fit numbers of a file's mechanism to measured data",
    "explore": "turn numbers of a file's mechanism by sliders in a page on this machine",
    "optimise": "choose numbers of a file's mechanism so that a reading is least and others as wanted",
}
"""Commands that turn numbers of a mechanism, and what they do."""


def main(study: str | None = None, argv: Sequence[str] | None = None) -> int:
    """Run the command line.

    Parameters
    ----------
    study : str, optional
        The study to run with `argv` as its options; without it `argv` starts with a command. A study that is run as a
        script names itself here and is imported once more under its real name: the copy called `__main__` only defines.
    argv : sequence of str, optional
        `sys.argv[1:]` if not given.

    Returns
    -------
    status : int
        The exit status.
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
        return run_study(study, words, f"python -m {registry.entry(study).module}")
    if words[:1] == ["run"] and len(words) > 1 and not words[1].startswith("-"):
        prog = f"{program()} run {words[1]}"
        if words[1].endswith(MECHANISMS):
            from buckler.studies.own.command import run_file

            return run_file(Path(words[1]), words[2:], prog)
        return run_study(words[1], words[2:], prog)
    if words[:1] == ["sweep"] and len(words) > 1 and not words[1].startswith("-"):
        from buckler.studies.sweeping.command import sweep_study

        return sweep_study(words[1], words[2:])
    if words[:1] and words[0] in TURNING:
        from buckler.studies.own.explore import COMMANDS

        return COMMANDS[words[0]](words[1:], f"{program()} {words[0]}")
    parser = _parser()
    if "_ARGCOMPLETE" in os.environ:
        from buckler.studies.kit.completion import complete

        complete(parser)
    if words[:1] == ["--version"]:
        return _version()
    try:
        options = parser.parse_args(words)
        status: int = options.answer(options)
    except ValueError as error:
        return wrong_input(error)
    except BrokenPipeError:
        raise
    except OSError as error:
        return wrong_input(ValueError(f"{error.filename}: {error.strerror}"))
    return status


def _parser() -> argparse.ArgumentParser:
    """Every command, with what completes its words."""
    parser = Parser(prog=program(), description="Planar mechanisms that buckle, rattle and strike: run files and studies.")
    parser.add_argument("--version", action="store_true", help="print the versions of Buckler and of what it runs on")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    new = commands.add_parser("new", help="write an example file of a mechanism, to start from")
    new.add_argument("name", metavar="NAME", help="the example; `new list` names them").completer = _examples  # type: ignore[attr-defined]
    new.add_argument("--out", metavar="FILE", type=Path, help="where to; default NAME.toml")
    new.set_defaults(answer=_new)
    show = commands.add_parser("show", help="draw the mechanism of a file and tell what it is made of")
    show.add_argument("file", metavar="FILE", type=Path, help="a mechanism, .toml or .json")
    show.add_argument("--out", metavar="FILE", type=Path, help="the drawing; default FILE.png beside it")
    show.set_defaults(answer=_show)
    declare_statics(commands)
    for name, does in (("run", "run a file of a mechanism, or a study"), ("sweep", "run a file or a study for many parameters")):
        command = commands.add_parser(name, help=f"{does}; `{name} NAME --help` tells its options")
        command.add_argument(
            "name", metavar="NAME", help="FILE.toml, FILE.json, STUDY.py or a study of the list"
        ).completer = _names  # type: ignore[attr-defined]
    for name, does in TURNING.items():
        commands.add_parser(name, help=f"{does}; `{name} --help` tells its options")
    listed = commands.add_parser("list", help="name every study, one a line")
    listed.add_argument("--json", action="store_true", help="as JSON")
    listed.set_defaults(answer=_list)
    export = commands.add_parser("export", help="write what a sweep has stored as CSV or Parquet")
    export.add_argument("store", metavar="FILE", type=Path, help="a sweep's store")
    export.add_argument("--out", metavar="FILE", type=Path, required=True, help="FILE.csv or FILE.parquet")
    export.add_argument("--signals", metavar="DIR", type=Path, help="also write each case's signals there, as npz")
    export.set_defaults(answer=lambda options: _export(options.store, options.out, options.signals))
    merge = commands.add_parser("merge", help="put the stores of a sweep's parts together; refuses contradictions")
    merge.add_argument("parts", metavar="FILE", nargs="+", type=Path, help="stores that `sweep ... --part I/N` has written")
    merge.add_argument("--out", metavar="FILE", type=Path, required=True, help="where to; if it is there, it takes what it lacks")
    merge.set_defaults(answer=_merge)
    schema = commands.add_parser("schema", help="print the JSON schema of mechanism files, for editors")
    schema.set_defaults(answer=_schema)
    beforehand = commands.add_parser("compile", help="compile the solver for this machine, so that no run waits for it")
    beforehand.set_defaults(answer=_compile, json=False)
    _add_evidence(commands)
    return parser


def _add_evidence(commands: Any) -> None:
    backed = commands.add_parser("evidence", help="run again what the documents quote, or check that it still holds")
    backed.add_argument("--quick", action="store_true", help="items of a few seconds alone")
    backed.add_argument("--only", metavar="NAME", action="append", help="this item; may be given again")
    backed.add_argument("--check", action="store_true", help="write nothing; exit 1 with the numbers that differ")
    backed.add_argument("--data", metavar="DIR", type=Path, help="measurements that are not part of Buckler")
    backed.add_argument("--out", metavar="DIR", type=Path, default=Path("results"), help="where runs are kept; default results")
    backed.add_argument("-q", "--quiet", action="store_true", help="print what differs and nothing else")
    backed.set_defaults(answer=_evidence, json=False)


def _evidence(options: argparse.Namespace) -> int:
    """Run, keep or check what the documents quote."""
    from buckler.studies.evidence.command import evidence
    from buckler.studies.evidence.items import ITEMS

    for name in options.only or ():
        if name not in ITEMS:
            raise ValueError(f"--only = {name}: must be one of {', '.join(ITEMS)}")
    return evidence(options)


def _compile(_options: argparse.Namespace) -> int:
    """Compile what runs need."""
    from buckler.mbs.spectral.beforehand import compile_all

    try:
        spent = compile_all()
    except ModuleNotFoundError as error:
        raise ValueError(str(error)) from None
    print(f"compiled in {spent:.0f} s; it is kept for later runs" if spent else "all is compiled already")
    return 0


def _version() -> int:
    """Print the versions."""
    from buckler.studies.kit.versions import versions

    print(", ".join(f"{name} {version or 'of a checkout'}" for name, version in versions().items()))
    return 0


def _names(prefix: str = "", **_: Any) -> list[str]:
    """What may stand behind `run`: studies, and files here."""
    files = [str(path) for ending in (*MECHANISMS, ".py") for path in Path().glob(f"*{ending}")]
    return [name for name in [*registry.STUDIES, *files] if name.startswith(prefix)]


def _examples(**_: Any) -> list[str]:
    return [path.stem for path in EXAMPLES.glob("*.toml")]


EXAMPLES = Path(__file__).resolve().parents[1] / "own" / "examples"


def _list(options: argparse.Namespace) -> int:
    """Name the studies."""
    studies = registry.everything()
    if options.json:
        import json

        print(json.dumps([{"name": name, **entry._asdict()} for name, entry in studies.items()], indent=2))
        return 0
    width = max(map(len, studies))
    for name, entry in studies.items():
        print(f"{name:{width}}  {entry.summary}")
    return 0


def _new(options: argparse.Namespace) -> int:
    """Write an example file; never over another."""
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


def _show(options: argparse.Namespace) -> int:
    """Draw a mechanism and tell what it is made of."""
    from buckler.studies.own.show import show

    print(show(options.file, options.out))
    return 0


def _schema(options: argparse.Namespace) -> int:
    """Print the schema of mechanism files."""
    import json

    from buckler.mbs.schema import schema

    print(json.dumps(schema(), indent=2, ensure_ascii=False))
    return 0


def _export(store: Path, out: Path, signals: Path | None) -> int:
    """Write a store as a table; say what it holds."""
    from buckler.studies.sweeping import export

    rows, units = export.read(store)
    try:
        export.write(export.columns(rows, units), out)
        count = export.write_signals(store, signals) if signals else 0
    except OSError as error:
        print(f"cannot write {error.filename or out}: {error.strerror}", file=sys.stderr)
        return 1
    print(f"{len(rows)} cases written to {out}" + (f", the signals of {count} to {signals}" if signals else ""))
    return 0


def _merge(options: argparse.Namespace) -> int:
    """Put stores together."""
    from buckler.studies.sweeping.merge import merge

    found = merge(options.parts, options.out)
    left = f"; {found.cases - found.ended} have not ended" if found.cases > found.ended else ""
    print(f"{len(options.parts)} stores, {found.cases} cases, merged into {options.out}{left}")
    return 0


def run_study(name: str, argv: Sequence[str], prog: str) -> int:
    """Read the options, run the study, print and file what it found; return the exit status."""
    try:
        study = registry.load(name)
        options, given = read_options(study_parser(study, prog), argv, study)
        parameters = study.Parameters(**given)
        name = Path(name).stem if name.endswith(".py") else name
        folder = writable(Path(options.out) / name)
    except ValueError as error:
        return wrong_input(error)
    except ImportError as error:
        print(f"{name}: cannot be loaded: {error}", file=sys.stderr)
        return 1
    begin = time.perf_counter()
    result = attempt(study.run, parameters, options)
    return finish(name, study, result, folder, options, time.perf_counter() - begin)
