"""What the words of `buckler sweep NAME --vary ...` ask for: the options, and what can be wrong with them."""

from __future__ import annotations

import argparse
import os
import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from buckler.studies.kit import registry
from buckler.studies.kit.options import Parser, answers, check_words, noted, read_options, study_parser, writable
from buckler.studies.kit.parameters import specs
from buckler.studies.kit.running import MECHANISMS, program
from buckler.studies.sweeping.executors import Dask, Here, Local, Workers
from buckler.studies.sweeping.sweep import Part
from buckler.studies.sweeping.vary import METHODS, Plan, Sampling, parse, plan

if TYPE_CHECKING:
    from types import ModuleType

OPTIONS = (
    "vary", "samples", "method", "draw", "repeat", "workers", "scheduler", "scheduler_file", "part", "store", "signals", "retry",
    "metrics",
)  # fmt: skip
"""A parameter of the study with one of these names is given by --config or --vary."""


class Asked(NamedTuple):
    """What the command line asks for."""

    study: ModuleType
    options: argparse.Namespace
    plan: Plan
    units: Mapping[str, str]
    stored_as: str
    """What the store calls it."""
    folder: Path
    store: Path
    workers: Workers
    part: Part | None
    alone: str
    """The command that runs one case, but for what varies."""


def parser(name: str, prog: str) -> argparse.ArgumentParser:
    """The options of `sweep NAME`, a study or a file."""
    if name.endswith(MECHANISMS):
        from buckler.studies.own import command

        found = Parser(prog=prog, usage=f"{prog} [options]", description="Sweep a mechanism of a file.", allow_abbrev=False)
        command.options(found)
        answers(found)
        _add_options(found, seeded=False)
        about = "also write each case's report page; the sweep's page links to it"
        found.add_argument("--reports", action="store_true", help=about)
        return found
    study = registry.load(name)
    options = study_parser(study, prog, OPTIONS)
    _add_options(options, seeded="seed" in specs(study.Parameters))
    return options


def read_file(path: Path, argv: Sequence[str], prog: str) -> Asked:
    """The same for the mechanism of a file: places of the file vary in place of a study's parameters."""
    from buckler.studies.own import command, study

    options, unknown = parser(path.name, prog).parse_known_args(noted(argv))
    check_words(unknown, options)
    if not options.vary:
        raise ValueError("nothing varies: give --vary PATH=VALUES; see --help")
    family = command.named(path, command.family, path, options)
    base = family()
    found = _plan(family, {}, options)
    command.probe(base)
    units = {place: spec.unit for place, spec in family.specs().items()}
    alone = f"{program()} {shlex.join(['run', str(path), *shared(argv)])}"
    return _asked(study, options, found, units, f"{path.stem} {study.digest(base.document)}", path.stem, alone)


def read(name: str, argv: Sequence[str], prog: str) -> Asked:
    """Everything that can be wrong with the words, before anything runs."""
    study = registry.load(name)
    options, given = read_options(parser(name, prog), argv, study, OPTIONS)
    units = {key: spec.unit for key, spec in specs(study.Parameters).items()}
    title = Path(name).stem if name.endswith(".py") else name
    alone = f"{program()} {shlex.join(['run', name, *shared(argv)])}"
    return _asked(study, options, _plan(study.Parameters, given, options), units, title, title, alone)


def shared(argv: Sequence[str]) -> list[str]:
    """The words that a single run takes, too."""
    kept: list[str] = []
    drop = False
    for word in argv:
        if word.startswith("-"):
            name = word.partition("=")[0].lstrip("-").replace("-", "_")
            drop = name in (*OPTIONS, "seed", "out", "json", "q", "quiet", "v", "verbose", "allow_suspect", "trust", "reports")
        kept += [] if drop else [word]
    return kept


def _plan(kind: Any, given: Mapping[str, Any], options: argparse.Namespace) -> Plan:
    """The cases that the options ask for."""
    varied = [parse(text, kind) for text in options.vary]
    sampling = None
    if options.samples is not None:
        sampling = Sampling(options.samples, options.method or METHODS[0], options.draw or 0)
    elif options.method is not None or options.draw is not None:
        raise ValueError(f"--{'method' if options.method else 'draw'}: only with --samples")
    if not varied and options.repeat == 1:
        raise ValueError("nothing varies: give --vary or --repeat; see --help")
    return plan(kind, given, varied, sampling, options.repeat)


def _asked(
    study: ModuleType, options: argparse.Namespace, found: Plan, units: Mapping[str, str], stored_as: str, title: str, alone: str
) -> Asked:
    """Where it runs and where it is kept."""
    if options.scheduler and options.scheduler_file:
        raise ValueError("--scheduler: give it or --scheduler-file")
    cluster = Path(options.scheduler_file) if options.scheduler_file else options.scheduler
    if cluster and options.workers is not None:
        raise ValueError("--workers: the cluster has its own; give it or --scheduler")
    if cluster:
        where: Workers = Dask(cluster)
    elif options.workers == 0:
        where = Here()
    else:
        count = (os.cpu_count() or 1) if options.workers is None else options.workers
        where = Local(min(count, len(found.cases)), study.__name__)
    folder = writable(Path(options.out) / f"{title}-sweep")
    part = _part(options)
    usual = f"part-{part.number}-of-{part.of}.sqlite" if part else "cases.sqlite"
    store = Path(options.store) if options.store else folder / usual
    if not store.parent.is_dir():
        raise ValueError(f"--store {store}: no such folder")
    return Asked(study, options, found, units, stored_as, folder, store, where, part, alone)


def _part(options: argparse.Namespace) -> Part | None:
    """Which part of the cases to run."""
    try:
        return Part.read(options.part) if options.part else None
    except ValueError as error:
        raise ValueError(f"--part {error}") from None


def _add_options(parser: argparse.ArgumentParser, seeded: bool) -> None:
    group = parser.add_argument_group("sweep")
    add = group.add_argument
    add("--vary", action="append", default=[], metavar="NAME=VALUES", help="START:STOP:COUNT, :log behind it, or A,B,C; "
        "START:STOP is sampled; several are combined each with each")  # fmt: skip
    add("--samples", type=int, metavar="N", help="how many samples of the ranges without a count")
    add("--method", choices=METHODS, help="how they are drawn; default sobol, best with a power of two")
    names = ("--draw",) if seeded else ("--seed", "--draw")
    add(*names, type=int, metavar="N", dest="draw", help="another number gives other samples; default 0")
    add("--repeat", type=int, default=1, metavar="N", help="run each case with N seeds; the table has mean and standard error")
    add("--workers", type=int, metavar="N", help="processes on this machine, 0 for none but this; default its cores")
    add("--scheduler", metavar="ADDRESS", help="run on a Dask cluster instead, such as tcp://127.0.0.1:8786")
    add("--scheduler-file", metavar="FILE", help="the same, by the file that `dask scheduler --scheduler-file` writes")
    add("--part", metavar="I/N", help="run every N-th case only, from the I-th on, in a store of its own: for array jobs; then "
        "`merge` the stores")  # fmt: skip
    add("--store", metavar="FILE", help="where cases are kept; default DIR/NAME-sweep/cases.sqlite")
    add("--signals", action="store_true", help="keep the signals of each case in the store")
    add("--retry", action="store_true", help="run cases again that the store holds as failed")
    add("--metrics", default="", metavar="METRIC,...", help="metrics of the table and the figures; default the first four")
