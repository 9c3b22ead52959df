"""`buckler sweep NAME --vary ...`: read the options, run the cases, write their table, figures and files."""

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

from ..kit.cli import INTERRUPTED
from ..kit.parameters import StudyParameters
from ..kit.report import Metric, Progress, StudyResult
from ..kit.running import Study, find_study, finish, make_folder, make_parser
from ..kit.style import house_style
from .store import Row
from .sweep import Part, SweepError, sweep
from .table import Axis, choose, figures, make_cases, parse, points, table, to_csv

OPTIONS = ("vary", "workers", "scheduler_file", "part", "store", "retry", "metrics")
"""Names of the options of a sweep. A parameter of the study with such a name has no option of its own; --vary can set it."""


class _Sweep(NamedTuple):
    """Sweep requested on the command line."""

    study: Study
    options: argparse.Namespace
    axes: Sequence[Axis]
    cases: Sequence[StudyParameters]
    units: Mapping[str, str]
    folder: Path
    store: Path
    part: Part | None


def sweep_study(name: str, argv: Sequence[str], prog: str) -> int:
    """Read the options, run the cases, print and write the results; return the exit status."""
    request = _read(name, argv, prog)
    options, begin = request.options, time.perf_counter()
    again = f"what has ended is in {request.store}; the same command resumes:\n  {prog} {shlex.join(argv)}"
    workers = (os.cpu_count() or 1) if options.workers is None else options.workers
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # by which a batch system ends a job: it interrupts like Ctrl-C
    try:
        with _dask(options.scheduler_file) if options.scheduler_file else contextlib.nullcontext() as executor:
            rows = sweep(
                request.study.module, request.cases, workers=workers, executor=executor, store=request.store,
                retry=options.retry, progress=Progress(options.quiet), name=request.study.title, units=request.units,
                part=request.part,
            )  # fmt: skip
    except KeyboardInterrupt:
        print(f"interrupted; {again}", file=sys.stderr)
        return INTERRUPTED
    except SweepError as error:
        print(f"{name}: {error}\n{again}", file=sys.stderr)
        return 1
    return _report(request, rows, time.perf_counter() - begin)


@contextlib.contextmanager
def _dask(scheduler_file: str) -> Iterator[Executor]:
    """Connect to the Dask cluster whose scheduler wrote this file, and yield its executor."""
    try:
        import distributed  # an extra
    except ImportError as error:
        raise SweepError(f"a Dask cluster needs `pip install 'buckler[cluster]'`: {error}") from None
    for name in ("distributed.client", "distributed.core", "distributed.comm", "tornado.application"):
        logging.getLogger(name).setLevel(logging.CRITICAL + 1)  # the errors below say in one line what Dask logs with tracebacks
    patience = 60.0  # [s], for the scheduler's file and for a first worker: jobs of a cluster start one after another
    try:
        client: Any = distributed.Client(scheduler_file=scheduler_file, timeout=patience)
    except (OSError, ValueError) as error:
        raise SweepError(f"no Dask scheduler by {scheduler_file}: {' '.join(str(error).split())[:200]}") from None
    with client:
        try:
            client.wait_for_workers(1, timeout=patience)
        except TimeoutError:
            advice = f"start some with `dask worker --scheduler-file {scheduler_file}`"
            raise SweepError(f"the Dask cluster has no workers; {advice}") from None
        yield client.get_executor(pure=False)  # with pure=True Dask returns an earlier result for an equal call


def _read(name: str, argv: Sequence[str], prog: str) -> _Sweep:
    """Read the options and check them before any case runs."""
    study = find_study(name)
    parser = make_parser(study, prog, OPTIONS)
    add = parser.add_argument_group("sweep").add_argument
    add("--vary", action="append", default=[], metavar="NAME=VALUES", help="START:STOP:COUNT, START:STOP:COUNT:log or A,B,C; "
        "several are combined each with each")  # fmt: skip
    add("--workers", type=int, metavar="N", help="worker processes, 0: the cases run in this process; default one for each core")
    add("--scheduler-file", metavar="FILE", help="run on the Dask cluster of `dask scheduler --scheduler-file FILE`")
    add("--part", metavar="I/N", help="run every N-th case only, from the I-th on, in a store of its own: for array jobs; the "
        "same sweep without --part then reads the stores of all parts")  # fmt: skip
    add("--store", metavar="FILE", help="file that keeps the cases; default DIR/NAME-sweep/cases.sqlite")
    add("--retry", action="store_true", help="run cases again that the store holds as failed")
    add("--metrics", default="", metavar="METRIC,...", help="metrics of the table and the figures; default the first four")
    options = parser.read(argv)
    if options.scheduler_file and options.workers is not None:
        raise ValueError("--workers: the cluster has its own; give it or --scheduler-file")
    maker = study.find_case_maker(options, OPTIONS)  # it makes parameters of a case, and knows the numbers that may vary
    if not options.vary:
        raise ValueError("nothing varies: give --vary; see --help")
    axes = [parse(text, maker.known) for text in options.vary]
    cases = make_cases(maker, axes)
    study.check(cases[0])  # an error of a later case is in its row
    folder = make_folder(Path(options.out) / f"{study.title}-sweep")
    part = Part.read(options.part) if options.part else None
    store = Path(options.store or folder / "cases.sqlite")
    if not store.parent.is_dir():
        raise ValueError(f"--store {store}: no such folder")
    units = {key: about.spec.unit for key, about in maker.known.items()}
    return _Sweep(study, options, axes, cases, units, folder, store, part)


def _report(request: _Sweep, rows: Sequence[Row], wall: float) -> int:
    """Print the table and write the files of a sweep; for a part, only the number of its cases by status."""
    options, name = request.options, request.study.title
    counts = Counter(row.status for row in rows)
    version_count = len({row.provenance["sources"] for row in rows})  # "sources": a hash of Buckler's source files
    note = f"cases come from {version_count} versions of Buckler's source files; to begin anew, name a new file by --store"
    numbers = {"cases": len(rows), "suspect": counts["SUSPECT"], "failed": len(rows) - counts["OK"] - counts["SUSPECT"]}
    first = next((row for row in rows if row.status != "OK"), None)
    others = ", ".join(f"{n} {status}" for status, n in counts.items() if status != "OK")
    result = StudyResult(
        parameters=request.cases[0], status="FAILED" if numbers["failed"] else "SUSPECT" if first else "OK",
        message=f"{others} of {len(rows)} cases; the first is case {first.number}: {first.message}" if first else "",
        metrics={key: Metric(float(n), "1") for key, n in numbers.items()},  # "1": without unit
        work={"wall_s": wall, "vary": options.vary, "store": str(request.store)},
        notes=[note] * (version_count > 1),
    )  # fmt: skip
    if request.part:
        ending = f"part {request.part.number} of {request.part.of}, {len(rows)} cases in {request.part.store(request.store)}"
        return finish(name, result, {}, make_folder(request.folder / f"part-{request.part.number}"), options, ending)
    design_points = points(request.axes, rows)  # combinations of the varied values, with their metrics
    shown = choose(design_points, [word.strip() for word in options.metrics.split(",") if word.strip()])
    pages = {"cases.csv": to_csv(rows, request.units)}
    result = replace(result, tables=[table(request.axes, design_points, shown)], pages=pages)
    with house_style():
        drawn = figures(request.axes, design_points, shown)
    ending = f"in {wall:.2g} s, written to {request.folder}, cases in {request.store}"
    return finish(name, result, drawn, request.folder, options, ending)
