"""What runs in a worker process: one case at a time, whatever it raises becomes a row."""

from __future__ import annotations

import hashlib
import importlib
import io
import os
import signal
import socket
import threading
import time
import traceback
from datetime import UTC, datetime
from functools import cache
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..kit.parameters import StudyParameters
from ..kit.versions import versions
from .rows import Row

_ONE = threading.Lock()
"""The engine is not made for threads, and a Dask worker may have several."""


class Job(NamedTuple):
    """One case to be run."""

    number: int
    module: str
    """Where the study's `run` is, importable in the worker."""
    parameters: StudyParameters
    signals: bool
    """Whether to bring the signals back."""


def begin(leash: Connection) -> None:
    """Start of a worker process: Ctrl-C is its parent's business, and when its parent is gone so is it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_follow, args=(leash,), daemon=True).start()


def _follow(leash: Connection) -> None:
    """End the process once the other end of the pipe is closed, by the sweep or by the death of its process."""
    try:
        leash.poll(None)
    finally:
        os._exit(1)


@cache
def stamp(module: str) -> dict[str, Any]:
    """Load the study; what this process runs on."""
    importlib.import_module(module)
    return {"versions": versions(), "sources": sources(), "host": socket.gethostname()}


@cache
def sources() -> str:
    """A hash of Buckler's own source files, which needs no git."""
    root = Path(__file__).resolve().parents[2]
    digest = hashlib.sha256()
    for path in sorted(path for package in ("elastica", "mbs", "studies") for path in (root / package).rglob("*.py")):
        digest.update(path.relative_to(root).as_posix().encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()[:16]


def run_case(job: Job) -> Row:
    """Run one case; never raises."""
    with _ONE:
        origin, start = stamp(job.module), time.perf_counter()
        study: Any = importlib.import_module(job.module)
        found: dict[str, Any] = {}
        try:
            result = study.run(job.parameters)
            found = {"status": result.status, "message": result.message, "metrics": dict(result.metrics)}
            found["work"] = dict(result.work)
            if job.signals:
                file = io.BytesIO()
                np.savez_compressed(file, **result.signals)
                found["signals"] = file.getvalue()
        except (Exception, SystemExit) as error:
            found = {"status": "ERROR", "message": _where(error)}
        wall = time.perf_counter() - start
    ended = datetime.now(UTC).isoformat(timespec="seconds")
    return Row(job.number, {}, wall_s=wall, provenance={**origin, "ended": ended}, **found)


def _where(error: BaseException) -> str:
    """The error and the line it came from."""
    place = traceback.extract_tb(error.__traceback__)[-1]
    return f"{type(error).__name__}: {' '.join(str(error).split())} ({Path(place.filename).name}:{place.lineno})"
