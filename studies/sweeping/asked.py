"""What the words of `buckler sweep NAME --vary ...` ask for: the options, and what can be wrong with them."""

from __future__ import annotations

import argparse
import os
import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from buckler.studies.kit.options import Study, Subject, parser_of, subject, writable
from buckler.studies.kit.parameters import Cases, StudyParameters, specs
from buckler.studies.kit.words import Parser, program
from buckler.studies.sweeping.executors import Dask, Here, Local, Workers
from buckler.studies.sweeping.sweep import Part
from buckler.studies.sweeping.vary import METHODS, Plan, Sampling, parse, plan

OPTIONS = (
    "vary", "samples", "method", "draw", "repeat", "workers", "scheduler", "scheduler_file", "part", "store", "signals", "retry",
    "metrics",
)  # fmt: skip
"""A parameter of the study with one of these names is given by --config or --vary."""


class Asked(NamedTuple):
    """What the command line asks for."""

    subject: Subject
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
    places: bool
    """Whether places of a file vary."""


def parser(found: Subject, prog: str) -> Parser:
    """The options of `sweep NAME`, a study or a file."""
    options = parser_of(found, prog, OPTIONS)
    _add_options(options, seeded=isinstance(found, Study) and "seed" in specs(found.module.Parameters))
    return options


def read(name: str, argv: Sequence[str], prog: str) -> Asked:
    """Everything that can be wrong with the words, before anything runs."""
    found = subject(name)
    options = parser(found, prog).read(argv)
    kind, given = found.cases(options, OPTIONS)
    chosen = _plan(kind, given, options)
    alone = f"{program()} {shlex.join(['run', name, *shared(argv)])}"
    stored_as = found.probe(chosen.cases[0])
    folder = writable(Path(options.out) / f"{found.title}-sweep")
    part = _part(options)
    store = Path(options.store or folder / (f"part-{part.number}-of-{part.of}.sqlite" if part else "cases.sqlite"))
    if not store.parent.is_dir():
        raise ValueError(f"--store {store}: no such folder")
    units = {key: about.unit for key, about in specs(kind).items()}
    where = _where(options, found.module.__name__, len(chosen.cases))
    return Asked(found, options, chosen, units, stored_as, folder, store, where, part, alone, isinstance(kind, Cases))


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


def _plan(kind: type[StudyParameters] | Cases, given: Mapping[str, object], options: argparse.Namespace) -> Plan:
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


def _where(options: argparse.Namespace, module: str, count: int) -> Workers:
    """Where the cases run."""
    if options.scheduler and options.scheduler_file:
        raise ValueError("--scheduler: give it or --scheduler-file")
    cluster = Path(options.scheduler_file) if options.scheduler_file else options.scheduler
    if cluster and options.workers is not None:
        raise ValueError("--workers: the cluster has its own; give it or --scheduler")
    if cluster:
        return Dask(cluster)
    if options.workers == 0:
        return Here()
    return Local(min((os.cpu_count() or 1) if options.workers is None else options.workers, count), module)


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
