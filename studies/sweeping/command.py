"""`buckler sweep NAME --vary ...`: the command line around `buckler.studies.sweeping.sweep`."""

from __future__ import annotations

import contextlib
import logging
import shlex
import signal
import sys
import time
from collections.abc import Iterator, Sequence

from buckler.studies.kit.report import Progress
from buckler.studies.kit.words import wrong_input
from buckler.studies.sweeping.asked import read
from buckler.studies.sweeping.executors import SweepError
from buckler.studies.sweeping.outcome import report, report_part
from buckler.studies.sweeping.sweep import sweep


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
                asked.subject.module,
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
    finish = report_part if asked.part else report
    return finish(asked.subject.title, asked, rows, time.perf_counter() - begin)


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
