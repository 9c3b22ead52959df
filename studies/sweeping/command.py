"""`buckler sweep NAME --vary ...`: options, the run, its table, figures and files."""

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
from concurrent.futures import Executor
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from ..kit.cli import print_error
from ..kit.parameters import specs
from ..kit.report import Metric, Progress, StudyResult
from ..kit.running import Study, find_study, finish, make_folder, make_parser
from ..kit.style import house_style
from .store import Row
from .sweep import Part, SweepError, sweep
from .table import Plan, choose, figures, parse, plan, points, table, to_csv

OPTIONS = ("vary", "workers", "scheduler_file", "part", "store", "retry", "metrics")
"""Names of options: a parameter of the study with one of them is given by --vary."""
PATIENCE = 60.0
"""Time to wait for the scheduler's file and for a first worker [s]: jobs of a cluster start one after the other."""


class _Sweep(NamedTuple):
    """Sweep requested on the command line; `stored_as` is the name of the study in the store."""

    study: Study
    options: argparse.Namespace
    plan: Plan
    units: Mapping[str, str]
    stored_as: str
    folder: Path
    store: Path
    part: Part | None


def sweep_study(name: str, argv: Sequence[str], prog: str) -> int:
    """Read the options, run the cases, print and file the results; return the exit status."""
    try:
        asked = _read(name, argv, prog)
    except ValueError as error:
        return print_error(error)
    except ImportError as error:
        print(f"{name}: cannot be loaded: {error}", file=sys.stderr)
        return 1
    options, begin = asked.options, time.perf_counter()
    again = f"what has ended is in {asked.store}; the same command resumes:\n  {prog} {shlex.join(argv)}"
    workers = (os.cpu_count() or 1) if options.workers is None else options.workers
    try:
        with contextlib.ExitStack() as ending:  # SIGTERM, by which a batch system ends a job, is taken as Ctrl-C
            ending.callback(signal.signal, signal.SIGTERM, signal.signal(signal.SIGTERM, signal.default_int_handler))
            executor = ending.enter_context(_dask(options.scheduler_file))
            rows = sweep(
                asked.study.module, asked.plan.cases, workers=workers, executor=executor, store=asked.store,
                retry=options.retry, progress=Progress(options.quiet), name=asked.stored_as, units=asked.units, part=asked.part,
            )  # fmt: skip
    except KeyboardInterrupt:
        print(f"interrupted; {again}", file=sys.stderr)
        return 130
    except SweepError as error:
        print(f"{name}: {error}\n{again}", file=sys.stderr)
        return 1
    except ValueError as error:
        return print_error(error)
    return _report(asked, rows, time.perf_counter() - begin)


@contextlib.contextmanager
def _dask(scheduler_file: str | None) -> Iterator[Executor | None]:
    """Connect to the Dask cluster whose scheduler has written the file; without one there is no executor."""
    if not scheduler_file:
        yield None
        return
    try:
        import distributed  # an extra
    except ImportError as error:
        raise SweepError(f"a Dask cluster needs `pip install 'buckler[cluster]'`: {error}") from None
    for name in ("distributed.client", "distributed.core", "distributed.comm", "tornado.application"):
        logging.getLogger(name).setLevel(logging.CRITICAL + 1)  # pages of traceback for what is one line here
    try:
        client: Any = distributed.Client(scheduler_file=scheduler_file, timeout=PATIENCE)
    except (OSError, ValueError) as error:
        raise SweepError(f"no Dask scheduler by {scheduler_file}: {' '.join(str(error).split())[:200]}") from None
    with client:
        try:
            client.wait_for_workers(1, timeout=PATIENCE)
        except TimeoutError:
            words = f"dask worker --scheduler-file {scheduler_file}"
            raise SweepError(f"the Dask cluster has no workers; start some with `{words}`") from None
        yield client.get_executor(pure=False)  # pure: an equal call would get an earlier result


def _read(name: str, argv: Sequence[str], prog: str) -> _Sweep:
    """Read the options; everything that can be wrong with them is found before anything runs."""
    found = find_study(name)
    parser = make_parser(found, prog, OPTIONS)
    add = parser.add_argument_group("sweep").add_argument
    add("--vary", action="append", default=[], metavar="NAME=VALUES", help="START:STOP:COUNT, :log behind it, or A,B,C; "
        "several are combined each with each")  # fmt: skip
    add("--workers", type=int, metavar="N", help="processes of this machine, 0 for none but this; default its cores")
    add("--scheduler-file", metavar="FILE", help="run on the Dask cluster of `dask scheduler --scheduler-file FILE`")
    add("--part", metavar="I/N", help="run every N-th case only, from the I-th on, in a store of its own: for array jobs; the "
        "same sweep without --part takes all parts together")  # fmt: skip
    add("--store", metavar="FILE", help="file that keeps the cases; default DIR/NAME-sweep/cases.sqlite")
    add("--retry", action="store_true", help="run cases again that the store holds as failed")
    add("--metrics", default="", metavar="METRIC,...", help="metrics of the table and the figures; default the first four")
    options = parser.read(argv)
    if options.scheduler_file and options.workers is not None:
        raise ValueError("--workers: the cluster has its own; give it or --scheduler-file")
    kind, given = found.cases(options, OPTIONS)
    if not options.vary:
        raise ValueError("nothing varies: give --vary; see --help")
    chosen = plan(kind, given, [parse(text, kind) for text in options.vary])
    stored_as = found.probe(chosen.cases[0])
    folder = make_folder(Path(options.out) / f"{found.title}-sweep")
    part = Part.read(options.part) if options.part else None
    store = Path(options.store or folder / "cases.sqlite")
    if not store.parent.is_dir():
        raise ValueError(f"--store {store}: no such folder")
    units = {key: about.unit for key, about in specs(kind).items()}
    return _Sweep(found, options, chosen, units, stored_as, folder, store, part)


def _report(asked: _Sweep, rows: Sequence[Row], wall: float) -> int:
    """Print the table and write the files, except for a part of a sweep."""
    options, name = asked.options, asked.study.title
    counts, versions = Counter(row.status for row in rows), len({row.provenance["sources"] for row in rows})
    numbers = {"cases": len(rows), "suspect": counts["SUSPECT"], "failed": len(rows) - counts["OK"] - counts["SUSPECT"]}
    wrong = next((row for row in rows if row.status != "OK"), None)
    ends = ", ".join(f"{n} {status}" for status, n in counts.items() if status != "OK")
    result = StudyResult(
        parameters=asked.plan.cases[0],
        status="FAILED" if numbers["failed"] else "SUSPECT" if wrong else "OK",
        message=f"{ends} of {len(rows)} cases; the first is case {wrong.number}: {wrong.message}" if wrong else "",
        metrics={key: Metric(float(n), "1") for key, n in numbers.items()},
        work={"wall_s": wall, "vary": options.vary, "store": str(asked.store)},
        notes=[f"cases come from {versions} versions of Buckler's source files; --store names a new file"] * (versions > 1),
    )
    if asked.part:
        where = f"part {asked.part.number} of {asked.part.of}, {len(rows)} cases in {asked.part.store(asked.store)}"
        return finish(name, result, {}, make_folder(asked.folder / f"part-{asked.part.number}"), options, where)
    found = points(asked.plan, rows)
    try:
        shown = choose(found, [word.strip() for word in options.metrics.split(",") if word.strip()])
    except ValueError as error:
        return print_error(error)
    pages = {"cases.csv": to_csv(rows, asked.units)}
    result = replace(result, tables=[table(asked.plan, found, shown, asked.units)], pages=pages)
    with house_style():
        drawn = figures(asked.plan, found, shown, asked.units)
    return finish(
        name, result, drawn, asked.folder, options, f"in {wall:.2g} s, written to {asked.folder}, cases in {asked.store}"
    )
