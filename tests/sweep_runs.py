"""What tests of sweeps share: the toy study as a command of its own, its processes, and what of a row must not change."""

import os
import subprocess
import sys
import time
from pathlib import Path

from buckler.studies.sweeping.after import read

ROOT = Path(__file__).resolve().parent.parent
ENVIRONMENT = os.environ | {"PYTHONPATH": os.pathsep.join([str(ROOT), str(ROOT / "tests")]), "PYTHONWARNINGS": ""}


def start(*words, **options):
    """Start `python -m studies ...` with the toy study in the registry, in a session of its own."""
    command = [sys.executable, str(ROOT / "tests" / "sweep_toy.py"), *map(str, words)]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True} | options
    return subprocess.Popen(command, env=ENVIRONMENT, start_new_session=True, **pipes)


def run(*words, timeout=120, **options):
    """Run it to its end; exit status, output and error output."""
    process = start(*words, **options)
    out, err = process.communicate(timeout=timeout)
    return process.returncode, out, err


def same(rows):
    """Rows without run time and provenance, as text, so that NaN equals NaN."""
    return [repr((r.number, r.parameters, r.status, r.message, r.metrics, r.work)) for r in rows]


def stored(path):
    """What a store holds."""
    return same(read(path)[0])


def descendants(pid):
    """Ids of all processes that come from one, itself not among them."""
    parents = {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                parents[int(entry.name)] = int((entry / "stat").read_text().rpartition(")")[2].split()[1])
            except OSError:
                continue
    found, new = set(), {pid}
    while new:
        new = {child for child, parent in parents.items() if parent in new} - found
        found |= new
    return sorted(found)


def gone(pids, within=10.0):
    """Whether all of these processes end in time."""
    end = time.monotonic() + within
    while any(_alive(pid) for pid in pids):
        if time.monotonic() > end:
            return False
        time.sleep(0.05)
    return True


def _alive(pid):
    try:
        return (Path("/proc") / str(pid) / "stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False
