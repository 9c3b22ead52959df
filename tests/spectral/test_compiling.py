"""Compiled functions are announced once, and kept as long as what they are made of stays."""

from __future__ import annotations

import ast
import importlib
from enum import IntEnum
from pathlib import Path
from typing import NamedTuple

import pytest

pytest.importorskip("numba")

import numba
import numpy as np
from numba.core import event

from buckler.mbs import Equal, Rigid, Section, Spectral, Status, slider_crank
from buckler.mbs.spectral import compiling, implicit, run
from buckler.mbs.spectral.beforehand import compile_all
from buckler.mbs.spectral.compiling import ANNOUNCEMENT, Announcer
from buckler.mbs.spectral.run import once


def made_up(name: str):
    """A function as if it stood in that module, compiled anew."""

    def function(x):
        return x + 1.0

    function.__module__ = name
    return numba.njit(function)


def test_a_change_of_a_constant_compiles_its_functions_again() -> None:
    """Files from which compiled functions have constants or names of columns count as theirs; those of types alone do not."""
    files = set(compiling.list_compiled_files())
    for path in files:
        module = importlib.import_module(f"buckler.mbs.spectral.{path.stem}") if path.parent.name == "spectral" else None
        for names in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if module is None or not isinstance(names, ast.ImportFrom) or names.level != 1 or names.module is None:
                continue
            values = [getattr(module, alias.name) for alias in names.names]
            is_constant = [isinstance(x, int | float) or (isinstance(x, type) and issubclass(x, IntEnum)) for x in values]
            assert not any(is_constant) or path.with_name(f"{names.module}.py") in files, (path.name, names.module)


def test_compilation_is_announced_once_and_only_the_solvers(capsys) -> None:
    announcer = Announcer()
    event.register("numba:compile", announcer)
    try:
        made_up("somebody.else")(1.0)
        assert not announcer.progress.count
        made_up("buckler.mbs.spectral.made_up")(1.0)
        assert announcer.progress.count and ANNOUNCEMENT in capsys.readouterr().err
        made_up("buckler.mbs.spectral.made_up")(1.0)
        assert ANNOUNCEMENT not in capsys.readouterr().err
    finally:
        event.unregister("numba:compile", announcer)


def test_a_run_may_take_longer_than_its_timeout_by_what_is_compiled(monkeypatch: pytest.MonkeyPatch) -> None:
    m = slider_crank(Rigid(Section(0.030, 2e-3)), law=None, mass=0.3, speed=1.25)
    once(m, 0.1, Spectral())
    clock = iter([0.0, 0.0] + [1e3] * 100)  # as if a thousand seconds went by
    monkeypatch.setattr(run, "working_time", lambda: next(clock))
    assert once(m, 0.1, Spectral(Equal(5000)), timeout=10.0).failure.status is Status.TIMED_OUT  # type: ignore[index]
    monkeypatch.setattr(run, "working_time", lambda: 0.0)  # all of it spent compiling
    assert once(m, 0.1, Spectral(Equal(5000)), timeout=10.0).failure is None


@pytest.mark.slow
def test_all_is_compiled_beforehand() -> None:
    compile_all()
    assert compile_all() == 0.0


def test_machine_code_is_kept_under_the_sum_of_all_files_with_compiled_functions() -> None:
    once(slider_crank(Rigid(Section(0.030, 2e-3)), law=None, mass=0.3, speed=1.25), 0.1, Spectral())
    kept = Path(implicit.run_implicit.stats.cache_path).glob(f"implicit.run_implicit_{compiling.STAMP}-*.nbi")  # type: ignore[attr-defined]
    assert len(list(kept)) == 1


def test_references_are_read_where_they_lie() -> None:
    class Pair(NamedTuple):
        first: np.ndarray
        second: np.ndarray

    class Whole(NamedTuple):
        pair: Pair
        last: np.ndarray

    @compiling.kernel_function
    def used(x, row):
        x.pair.second[row, 1] = x.last.size + x.pair.first[2]
        return x.pair.second[row].size + x.pair.second.shape[0]

    @numba.njit
    def door(x, row):
        return used(compiling.by_reference(x), row)

    x = Whole(Pair(np.array([1, 2, 3]), np.zeros((4, 2))), np.zeros(5))
    assert door(x, 3) == 2 + 4
    assert x.pair.second.tolist() == [[0, 0], [0, 0], [0, 0], [0, 8]]


def test_intermediate_code_called_by_a_compiled_function_gives_what_python_gives() -> None:
    @compiling.kernel_function
    def cube(x):
        return x * x * x

    @compiling.inline
    def half(x):
        return 0.5 * cube(x)

    @compiling.kernel_function
    def both(x):
        return half(x) + cube(x)

    @numba.njit
    def root(x):
        return both(x) + half(x)

    assert root(2.0) == 16.0
    assert cube.overloads[(numba.float64,)].library.get_pointer_to_function("any") == 0


def test_a_constant_argument_is_no_reason_to_compile_anew():
    @compiling.kernel_function
    def scaled(x, k):
        return k * x

    @numba.njit
    def called(x, k):
        return scaled(x, 2) + scaled(x, 3) + scaled(x, k)

    assert called(1.0, 4) == 9.0 and len(scaled.signatures) == 1
