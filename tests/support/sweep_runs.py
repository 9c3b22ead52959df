"""Helpers of the tests of sweeps: the toy study as a command of its own, its processes, comparable rows."""

import os
import subprocess
import sys
import time
from pathlib import Path

from buckler.studies.sweeping.sweep import read

ROOT = Path(__file__).resolve().parents[2]
ENVIRONMENT = os.environ | {"PYTHONPATH": os.pathsep.join([str(ROOT), str(ROOT / "tests" / "support")]), "PYTHONWARNINGS": ""}


def start(*words, **options):
    """Start `python -m studies ...` with the toy study in the registry, in a session of its own."""
    command = [sys.executable, str(ROOT / "tests" / "support" / "sweep_toy.py"), *map(str, words)]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True} | options
    return subprocess.Popen(command, env=ENVIRONMENT, start_new_session=True, **pipes)


def run(*words, **options):
    """Run it to its end; exit status, output and error output."""
    process = start(*words, **options)
    out, err = process.communicate()
    return process.returncode, out, err


def after(count, act):
    """Progress that calls a function when so many items have ended."""

    def progress(items, total=None, label=""):
        for k, item in enumerate(items, 1):
            yield item
            if k == count:
                act()

    return progress


def interrupt():
    raise KeyboardInterrupt


def same(rows):
    """Write rows without run time and provenance as text, so that NaN equals NaN."""
    return [repr((r.number, r.parameters, r.status, r.message, r.metrics, r.work)) for r in rows]


def stored(path):
    return same(read(path)[0])


def descendants(pid):
    """List the ids of all descendants of a process."""
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


def gone(pids, within=60.0):
    """Wait for the end of all of these processes; False if one is still there."""
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
