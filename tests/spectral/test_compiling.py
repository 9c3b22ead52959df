"""Compiled functions are announced once, and kept as long as what they are made of stays."""

from __future__ import annotations

import pytest

pytest.importorskip("numba")

import numba
from numba.core import event

from buckler.mbs.spectral import compiling
from buckler.mbs.spectral.announce import TEXT, Announcer


def made_up(name: str):
    """A function as if it stood in that module, compiled anew."""

    def function(x):
        return x + 1.0

    function.__module__ = name
    return numba.njit(function)


def test_compilation_is_announced_once_and_only_the_solvers(capsys) -> None:
    announcer = Announcer()
    event.register("numba:compile", announcer)
    try:
        made_up("somebody.else")(1.0)
        assert not announcer.told
        made_up("buckler.mbs.spectral.made_up")(1.0)
        assert announcer.told and TEXT in capsys.readouterr().err
        made_up("buckler.mbs.spectral.made_up")(1.0)
        assert TEXT not in capsys.readouterr().err
    finally:
        event.unregister("numba:compile", announcer)


def test_a_stamp_is_of_the_file_and_of_what_it_imports() -> None:
    stamps = {name: set(compiling._stamp(name)) for name in compiling.COMPILED}
    assert stamps["kernel"] < stamps["radau"] < stamps["implicit"]
    assert stamps["markers"] < stamps["explicit"]
    assert not stamps["implicit"] <= stamps["explicit"]


def test_drafts_called_by_a_compiled_function_give_what_python_gives() -> None:
    @compiling.aside
    def cube(x):
        return x * x * x

    @compiling.close
    def half(x):
        return 0.5 * cube(x)

    @compiling.inner
    def both(x):
        return half(x) + cube(x)

    @numba.njit
    def root(x):
        return both(x) + half(x)

    assert root(2.0) == 16.0
    assert cube.overloads[(numba.float64,)].library.get_pointer_to_function("any") == 0
