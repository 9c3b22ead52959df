"""A throw-away copy of the tree in which faults are planted, and tests that run in processes forked from this one."""

from __future__ import annotations

import importlib
import os
import shutil
import signal
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
HEAVY = ("exudyn", "numba", "scipy.optimize", "scipy.integrate", "matplotlib.pyplot", "pytest", "hypothesis", "mpmath")
LEFT_OUT = shutil.ignore_patterns(".git", ".venv", "results", "made", "*cache")

OUT_OF_TIME = "out of time"


class Tree:
    """A copy of the tree, with the times of its files and what Numba has compiled of them."""

    def __init__(self, place: Path) -> None:
        self.root = place / "tree"
        shutil.copytree(ROOT, self.root, symlinks=True, ignore=LEFT_OUT)
        links = self.root / "build" / "path" / "buckler"
        links.mkdir(parents=True, exist_ok=True)
        for room in ("mbs", "elastica", "studies"):
            (links / room).unlink(missing_ok=True)
            (links / room).symlink_to(f"../../../{room}")
        os.environ |= {
            "PYTHONPATH": str(links.parent),
            "EXUDYN_NO_USER_SETTINGS": "1",
            "MPLBACKEND": "Agg",
            "OMP_NUM_THREADS": "1",
        }
        sys.dont_write_bytecode = True
        for name in HEAVY:
            importlib.import_module(name)

    @contextmanager
    def planted(self, file: str, text: bytes) -> Iterator[None]:
        """Have a file say this for a while."""
        path = self.root / file
        old, state = path.read_bytes(), path.stat()
        path.write_bytes(text)
        try:
            yield
        finally:
            path.write_bytes(old)
            os.utime(path, ns=(state.st_atime_ns, state.st_mtime_ns))

    def seen(self, tests: Sequence[str], limit: float, *options: str) -> str:
        """What the tests make of the tree: the first that fails, '' if none does, or `OUT_OF_TIME`.

        They end with the first failure, or as the options say.
        """
        log = self.root / "log.txt"
        child = os.fork()
        if not child:
            self._run([*tests, "-q", "--no-header", "--tb=no", "-p", "no:cacheprovider", *(options or ("-x",))], log)
        begin = time.monotonic()
        while not os.waitpid(child, os.WNOHANG)[0]:
            if time.monotonic() - begin > limit:
                os.killpg(child, signal.SIGKILL)
                os.waitpid(child, 0)
                return OUT_OF_TIME
            time.sleep(0.05)
        told = log.read_text(errors="replace")
        first = next((line for line in told.splitlines() if line.startswith(("FAILED", "ERROR"))), "")
        if first.startswith("ERROR: not found"):  # a test whose name tells what was changed, or that is gone
            whole = list(dict.fromkeys(test.partition("[")[0] for test in tests))
            if whole == list(tests):
                raise LookupError(f"{first}: `python tests/mutations callers` is out of date")
            return self.seen(whole, limit, *options)
        return first or ("" if " passed" in told else told.strip()[-200:] or "no test ran")

    def _run(self, arguments: Sequence[str], log: Path) -> None:
        os.setpgrp()
        os.chdir(self.root)
        out = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(out, 1)
        os.dup2(out, 2)
        own = [str(self.root / "tests"), str(self.root / "tests" / "support")]
        sys.path[:] = [os.environ["PYTHONPATH"], *own, *(p for p in sys.path if not p.startswith(str(ROOT)))]
        import pytest

        code = 99
        try:
            code = int(pytest.main(list(arguments)))
        finally:
            sys.stdout.flush()
            os._exit(code)


@contextmanager
def copied() -> Iterator[Tree]:
    """A copy that is gone afterwards."""
    with tempfile.TemporaryDirectory(prefix="mutations-", dir="/dev/shm" if Path("/dev/shm").exists() else None) as place:
        yield Tree(Path(place))
