"""`buckler sweep NAME --vary ...`: what the words ask for and what can be wrong with them, the run, and what is told of it."""

from __future__ import annotations

import argparse
import contextlib
import logging
import os
import shlex
import signal
import sys
import time
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..kit.options import Study, Subject, parser_of, subject, writable
from ..kit.parameters import Cases, StudyParameters, specs
from ..kit.report import Metric, Progress, StudyResult
from ..kit.running import told
from ..kit.style import house_style
from ..kit.words import Parser, program, wrong_input
from .executors import Dask, Here, Local, SweepError, Workers
from .report import Heading, page, summary, worst
from .rows import Row
from .sweep import Part, sweep
from .table import Point, choose, points, table
from .vary import METHODS, Plan, Sampling, parse, plan

OPTIONS = (
    "vary", "samples", "method", "draw", "repeat", "workers", "scheduler", "scheduler_file", "part", "store", "signals", "retry",
    "metrics",
)  # fmt: skip
"""A parameter of the study with one of these names is given by --config or --vary."""


class Asked(NamedTuple):
    """What the command line asks for.

    `stored_as` is what the store calls the subject, `alone` the command that runs one case but for what varies; `places`
    tells whether places of a file vary.
    """

    subject: Subject
    options: argparse.Namespace
    plan: Plan
    units: Mapping[str, str]
    stored_as: str
    folder: Path
    store: Path
    workers: Workers
    part: Part | None
    alone: str
    places: bool


def sweep_study(name: str, argv: Sequence[str], prog: str) -> int:
    """Read the options, run the cases, print and file what they give; return the exit status."""
    try:
        asked = read(name, argv, prog)
    except ValueError as error:
        return wrong_input(error)
    except ImportError as error:
        print(f"{name}: cannot be loaded: {error}", file=sys.stderr)
        return 1
    options, begin = asked.options, time.perf_counter()
    again = f"the same command resumes:\n  {prog} {shlex.join(argv)}"
    try:
        with _told(options.quiet), _ended_like_interrupted():
            rows = sweep(
                asked.subject.module, asked.plan.cases, workers=asked.workers, store=asked.store, signals=options.signals,
                retry=options.retry, progress=Progress(options.quiet), name=asked.stored_as, units=asked.units, part=asked.part,
            )  # fmt: skip
    except KeyboardInterrupt:
        print(f"interrupted; {again}", file=sys.stderr)
        return 130
    except SweepError as error:
        print(f"{name}: {error}\n{again}", file=sys.stderr)
        return 1
    except ValueError as error:
        return wrong_input(error)
    return (_report_part if asked.part else _report)(asked, rows, time.perf_counter() - begin)


@contextlib.contextmanager
def _told(quiet: bool) -> Iterator[None]:
    """Show on stderr what the sweep says of itself."""
    handler, log = logging.StreamHandler(sys.stderr), logging.getLogger("buckler.studies.sweeping.sweep")
    before = log.level, log.propagate
    log.addHandler(handler)
    log.setLevel(logging.WARNING if quiet else logging.INFO)
    log.propagate = False
    try:
        yield
    finally:
        log.removeHandler(handler)
        log.level, log.propagate = before


@contextlib.contextmanager
def _ended_like_interrupted() -> Iterator[None]:
    """Take SIGTERM, by which a batch system ends a job, for Ctrl-C."""

    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGTERM, interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


# --- what is asked for ------------------------------------------------------------------------------------------------


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
    try:
        part = Part.read(options.part) if options.part else None
    except ValueError as error:
        raise ValueError(f"--part {error}") from None
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


# --- what is told of it -----------------------------------------------------------------------------------------------


def _report(asked: Asked, rows: Sequence[Row], wall: float) -> int:
    """Print the table and write the files."""
    from .figure import figures  # loads Matplotlib, which help and completion do without

    options, units, chosen, name = asked.options, asked.units, asked.plan, asked.subject.title
    found = points(chosen, rows)
    try:
        shown = choose(found, [word.strip() for word in options.metrics.split(",") if word.strip()])
    except ValueError as error:
        return wrong_input(error)
    counts = Counter(row.status for row in rows)
    numbers = {"cases": len(rows), "suspect": counts["SUSPECT"], "failed": len(rows) - counts["OK"] - counts["SUSPECT"]}
    facts = [("varied", text) for text in options.vary] + [("store", str(asked.store)), ("workers", asked.workers.where)]
    ended, reports = worst(rows), asked.folder / "reports"
    heading = Heading(name, ended, summary(found, wall), asked.alone, asked.places, facts, reports)
    result = StudyResult(
        parameters=chosen.cases[0],
        status=ended,
        message=_message(rows, counts),
        metrics={key: Metric(float(n), "1") for key, n in numbers.items()},
        signals=_arrays(chosen, found, shown),
        work={"wall_s": wall, "vary": options.vary, "repeat": options.repeat, "store": str(asked.store)},
        tables=[table(chosen, found, shown, units)],
        pages={"report.html": page(heading, chosen, found, units, asked.folder)},
    )
    with house_style():
        drawn = figures(chosen, found, shown, dict(units))
    where = f"in {wall:.2g} s, written to {asked.folder}, cases in {asked.store}"
    return told(name, result, drawn, asked.folder, options, where)


def _report_part(asked: Asked, rows: Sequence[Row], wall: float) -> int:
    """Say how a part ended, and what to do with it; tables and figures are made of all parts."""
    counts = Counter(row.status for row in rows)
    bad = len(rows) - counts["OK"] - (counts["SUSPECT"] if asked.options.trust else 0)
    part, folder, name = asked.part, asked.folder, asked.subject.title
    if part and not asked.options.quiet:
        ends = ", ".join(f"{n} {status}" for status, n in counts.items())
        print(f"{name}: part {part.number} of {part.of}, {len(rows)} cases ({ends}) in {wall:.2g} s, in {asked.store}")
        words = f"{folder / f'part-*-of-{part.of}.sqlite'} --out {folder / 'cases.sqlite'}"
        print(f"with all parts: {program()} merge {words}, then the same sweep without --part")
    if bad:
        print(f"{name}: {_message(rows, counts)}", file=sys.stderr)
    return 1 if bad else 0


def _message(rows: Sequence[Row], counts: Counter[str]) -> str:
    """How many ended how, and the first of them."""
    first = next((row for row in rows if row.status != "OK"), None)
    if first is None:
        return ""
    ends = ", ".join(f"{n} {status}" for status, n in counts.items() if status != "OK")
    return f"{ends} of {len(rows)} cases; the first is case {first.number}: {first.message}"


def _arrays(chosen: Plan, found: Sequence[Point], shown: dict[str, str]) -> dict[str, np.ndarray]:
    """What the figures show: values of each varied parameter, means and standard errors; one entry a point."""
    arrays = {name: np.array([point.values[i] for point in found]) for i, name in enumerate(chosen.names)}
    for name in shown:
        means = [point.mean(name) for point in found]
        arrays |= {f"{name}.mean": np.array([m.value for m in means]), f"{name}.error": np.array([m.error for m in means])}
    return arrays
