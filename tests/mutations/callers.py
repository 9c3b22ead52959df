"""Which test calls which function, and how long it takes: a plugin of pytest that writes it to the file CALLERS names."""

from __future__ import annotations

import json
import os
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from types import CodeType, FrameType
from typing import Any

import pytest

ROOT = str(Path.cwd() / "mbs") + os.sep
_codes: dict[int, CodeType] = {}
_now: set[int] = set()
_shared: dict[str, set[int]] = {}
_found: dict[str, dict[str, Any]] = {}


def _trace(frame: FrameType, _event: str, _argument: Any) -> None:
    code = frame.f_code
    key = id(code)
    if key not in _now:
        _now.add(key)
        _codes.setdefault(key, code)


def _named(keys: set[int]) -> list[str]:
    """Functions of `mbs` as 'file function'; what is defined in a function is its own."""
    found = set()
    for key in keys:
        code = _codes[key]
        path = os.path.realpath(code.co_filename)
        if path.startswith(ROOT):
            found.add(f"mbs/{path.removeprefix(ROOT)} {code.co_qualname.split('.<locals>')[0]}")
    return sorted(found)


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Iterator[None]:
    """Watch a test; what its module's fixtures call counts for all tests of the file."""
    _now.clear()
    sys.settrace(_trace)
    threading.settrace(_trace)
    yield
    sys.settrace(None)
    threading.settrace(None)  # type: ignore[arg-type]
    _found.setdefault(item.nodeid, {"time": 0.0, "passed": False})["calls"] = _named(_now)


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_setup(item: pytest.Item) -> Iterator[None]:
    """Take down what fixtures call."""
    yield
    _shared.setdefault(item.nodeid.split("::")[0], set()).update(_now)


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """Take down times and whether it passed."""
    row = _found.setdefault(report.nodeid, {"time": 0.0, "passed": False})
    row["time"] += report.duration
    if report.when == "call":
        row["passed"] = report.passed


def pytest_sessionfinish() -> None:
    """Write."""
    shared = {file: _named(keys) for file, keys in _shared.items()}
    for test, row in _found.items():
        row["calls"] = sorted({*row.get("calls", ()), *shared.get(test.split("::")[0], ())})
    path = Path(os.environ["CALLERS"])
    old = json.loads(path.read_text()) if path.exists() else {}
    kept = {test: row for test, row in old.items() if test.split("::")[0] not in shared}  # tests may be gone
    path.write_text(json.dumps(kept | {test: row for test, row in _found.items() if row["passed"]}))
