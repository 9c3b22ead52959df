"""The solver of a mechanism's file: its kind and settings, as options or in the file's table [run.solver].

The settings are the fields of `Exudyn`, `Spectral` and their kinds of steps; unit, range and help are those of their docstrings.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from importlib.util import find_spec
from typing import Any, NamedTuple

from buckler.mbs.engine.settings import Controlled, Equal, Exudyn
from buckler.mbs.files.declared import Declared, declared
from buckler.mbs.spectral.solver import Spectral
from buckler.mbs.units import parse_quantity

SOLVERS: dict[str, type[Exudyn | Spectral]] = {"exudyn": Exudyn, "spectral": Spectral}
KIND = "kind"
RENAMED = {"count": "steps", "method": "integrator"}
"""Settings whose names say too little apart from their types."""


class Setting(NamedTuple):
    """A setting: the types that have it, its name there, and what they say of it."""

    homes: tuple[type, ...]
    field: str
    about: Declared


@cache
def settings() -> dict[str, Setting]:
    """Every setting by its name in files; with hyphens, its option."""
    found: dict[str, Setting] = {}
    for home in (Controlled, Equal, *SOLVERS.values()):
        for field, about in declared(home).items():
            if field != "steps":
                name = RENAMED.get(field, field)
                homes = (*found[name].homes, home) if name in found else (home,)
                found[name] = Setting(homes, field, about)
    return found


def read(name: str, given: object) -> Any:
    """The value of a setting from a text or a value of a file.

    Raises
    ------
    ValueError
        If it is no such value; its range is checked by the solver.
    """
    about = settings()[name].about
    whole = about.hint is int or (about.hint is not bool and not about.unit and about.hint is not str)
    if not isinstance(given, str) or about.hint is str:
        return given
    if about.hint is bool:
        if given not in ("true", "false"):
            raise ValueError("must be true or false")
        return given == "true"
    if not whole:
        return parse_quantity(given, about.unit or "1")
    try:
        return int(given)
    except ValueError:
        raise ValueError("must be a whole number") from None


def solver(given: Mapping[str, Any]) -> Exudyn | Spectral | None:
    """The solver that is asked for; None where nothing is said of it.

    Raises
    ------
    ValueError
        If a setting belongs to another solver or to other steps, or is out of its range.
    """
    if not given:
        return None
    name = given.get(KIND, "exudyn")
    if name not in SOLVERS:
        raise ValueError(f"solver = {name}: must be one of {', '.join(SOLVERS)}")
    if SOLVERS[name] is Spectral and find_spec("numba") is None:
        raise ValueError(f"solver = {name}: needs Numba: pip install 'buckler[fast]'")
    kind, steps = SOLVERS[name], Equal if "steps" in given else Controlled
    mine: dict[type, dict[str, Any]] = {kind: {}, steps: {}}
    for key, value in given.items():
        if key == KIND:
            continue
        setting = settings()[key]
        home = next((home for home in setting.homes if home in mine), None)
        if home is None:
            there = " and ".join(known for known, each in SOLVERS.items() if each in setting.homes)
            if there:
                raise ValueError(f"solver: {key} is a setting of {there}, not of {name}")
            needs = "equal steps: give steps" if Equal in setting.homes else "controlled steps: leave out steps"
            raise ValueError(f"solver: {key} is for {needs}")
        mine[home][setting.field] = value
    made = Equal(**mine[Equal]) if steps is Equal else replace(kind().steps, **mine[Controlled])
    return kind(steps=made, **mine[kind])


def of_file(content: object) -> dict[str, Any]:
    """The settings in a file's [run]: a solver's name, or a table of `kind` and settings.

    Raises
    ------
    ValueError
        In one line that names the place.
    """
    if isinstance(content, str):
        content = {KIND: content}
    if not isinstance(content, Mapping):
        raise ValueError(f"run.solver = {content!r}: must be {' or '.join(SOLVERS)}, or a table of kind and settings")
    found = {}
    for key, value in content.items():
        if key != KIND and key not in settings():
            raise ValueError(f"run.solver.{key}: unknown key; known: {', '.join([KIND, *settings()])}")
        try:
            found[key] = value if key == KIND else read(key, value)
        except ValueError as error:
            raise ValueError(f"run.solver.{key} = {value}: {error}") from None
    return found
