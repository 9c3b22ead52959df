"""`python -m studies sweep NAME --vary ...`: the command line around `buckler.studies.sweeping.sweep`."""

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
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from buckler.studies.kit import registry
from buckler.studies.kit.options import Parser, answers, check_words, noted, read_options, study_parser, writable, wrong_input
from buckler.studies.kit.parameters import specs
from buckler.studies.kit.report import Metric, Progress, StudyResult, write
from buckler.studies.kit.running import MECHANISMS, program
from buckler.studies.kit.style import house_style
from buckler.studies.sweeping.executors import Dask, Here, Local, SweepError, Workers
from buckler.studies.sweeping.figure import figures
from buckler.studies.sweeping.report import Heading, summary, worst, write_page
from buckler.studies.sweeping.rows import Row
from buckler.studies.sweeping.sweep import Part, sweep
from buckler.studies.sweeping.table import Point, choose, points, table
from buckler.studies.sweeping.vary import METHODS, Plan, Sampling, parse, plan

if TYPE_CHECKING:
    from types import ModuleType

OPTIONS = (
    "vary", "samples", "method", "draw", "repeat", "workers", "scheduler", "scheduler_file", "part", "store", "signals", "retry",
    "metrics",
)  # fmt: skip
"""A parameter of the study with one of these names is given by --config or --vary."""


class _Asked(NamedTuple):
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


def sweep_study(name: str, argv: Sequence[str]) -> int:
    """Read the options, run the cases, print and file what they give; return the exit status."""
    prog = f"{program()} sweep {name}"
    try:
        asked = _read_file(Path(name), argv, prog) if name.endswith(MECHANISMS) else _read(name, argv, prog)
    except OSError as error:
        return wrong_input(ValueError(f"{error.filename or name}: {error.strerror}"))
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
                asked.study,
                asked.plan.cases,
                workers=asked.workers,
                store=asked.store,
                signals=options.signals,
                retry=options.retry,
                progress=Progress(options.quiet),
                name=asked.stored_as,
                units=asked.units,
                part=asked.part,
            )
    except KeyboardInterrupt:
        print(f"interrupted; {again}", file=sys.stderr)
        return 130
    except SweepError as error:
        print(f"{name}: {error}\n{again}", file=sys.stderr)
        return 1
    except ValueError as error:
        return wrong_input(error)
    title, wall = Path(name).stem if name.endswith((".py", *MECHANISMS)) else name, time.perf_counter() - begin
    return _report_part(title, asked, rows, wall) if asked.part else _report(title, asked, rows, wall)


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


def _read_file(path: Path, argv: Sequence[str], prog: str) -> _Asked:
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


def _read(name: str, argv: Sequence[str], prog: str) -> _Asked:
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
) -> _Asked:
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
    return _Asked(study, options, found, units, stored_as, folder, store, where, part, alone)


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

    def interrupt(*_: Any) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGTERM, interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


# --- what it found ----------------------------------------------------------------------------------------------------


def _report(name: str, asked: _Asked, rows: Sequence[Row], wall: float) -> int:
    """Print the table and write the files."""
    options, found = asked.options, points(asked.plan, rows)
    try:
        shown = choose(found, [word.strip() for word in options.metrics.split(",") if word.strip()])
    except ValueError as error:
        return wrong_input(error)
    units = asked.units
    counts = Counter(row.status for row in rows)
    failed = {status: n for status, n in counts.items() if status not in ("OK", "SUSPECT")}
    status = worst(rows)
    numbers = {"cases": len(rows), "suspect": counts["SUSPECT"], "failed": sum(failed.values())}
    result = StudyResult(
        parameters=asked.plan.cases[0],
        status=status,
        message=_message(rows, counts),
        metrics={key: Metric(float(n), "1") for key, n in numbers.items()},
        signals=_arrays(asked.plan, found, shown),
        work={"wall_s": wall, "vary": options.vary, "repeat": options.repeat, "store": str(asked.store)},
        tables=[table(asked.plan, found, shown, units)],
    )
    trusted = options.trust and status == "SUSPECT"
    try:
        with house_style():
            drawn = figures(asked.plan, found, shown, dict(units))
        text = write(result, asked.folder, drawn, trusted)
        page = write_page(asked.folder / "report.html", _heading(name, asked, result, found), asked.plan, found, units)
    except OSError as error:
        print(f"{name}: cannot write results: {error}", file=sys.stderr)
        return 1
    if options.json:
        print(text, end="")
    elif not options.quiet:
        print(f"{result}\n\n{name}: {status} in {wall:.2g} s, written to {asked.folder}, cases in {asked.store}")
        print(f"look at it: {page}")
    if status != "OK":
        print(f"{name}: {status}{' (allowed)' if trusted else ''}: {result.message}", file=sys.stderr)
    return 0 if status == "OK" or trusted else 1


def _heading(name: str, asked: _Asked, result: StudyResult, found: Sequence[Point]) -> Heading:
    """What the page says of the sweep as a whole."""
    facts = [("varied", text) for text in asked.options.vary] + [("store", str(asked.store)), ("workers", asked.workers.where)]
    told = summary(found, result.work["wall_s"])
    places = "changes" in asked.study.Parameters.__dataclass_fields__
    return Heading(name, result.status, told, asked.alone, places, facts, asked.folder / "reports")


def _report_part(name: str, asked: _Asked, rows: Sequence[Row], wall: float) -> int:
    """Say how a part ended, and what to do with it; tables and figures are made of all parts."""
    counts = Counter(row.status for row in rows)
    bad = len(rows) - counts["OK"] - (counts["SUSPECT"] if asked.options.trust else 0)
    part, folder = asked.part, asked.folder
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
