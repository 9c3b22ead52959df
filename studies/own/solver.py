"""The solver of a mechanism's file: its kind and settings, as options or in the file's table [run.solver].

The settings are the fields of `Exudyn`, `Spectral`, `Closure` and their kinds of steps, as these declare them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from importlib.util import find_spec
from typing import Any, NamedTuple

from buckler.mbs.declare import Declaration, declarations
from buckler.mbs.kinematics.determined import answered
from buckler.mbs.mechanism import Mechanism
from buckler.mbs.solvers.closure import Closure
from buckler.mbs.solvers.exudyn import Exudyn
from buckler.mbs.solvers.spectral import Spectral
from buckler.mbs.solvers.steps import Controlled, Equal

SOLVERS: dict[str, type[Exudyn | Spectral | Closure]] = {"exudyn": Exudyn, "spectral": Spectral, "closure": Closure}
KIND = "kind"
RENAMED = {"count": "steps", "method": "integrator"}
"""Settings whose names say too little apart from their types."""


class Setting(NamedTuple):
    """A setting: the types that have it, its name there, and what they say of it."""

    homes: tuple[type, ...]
    field: str
    about: Declaration


@cache
def settings() -> dict[str, Setting]:
    """Every setting by its name in files; with hyphens, its option."""
    found: dict[str, Setting] = {}
    for home in (Controlled, Equal, *SOLVERS.values()):
        for field, about in declarations(home).items():
            if field != "steps":
                name = RENAMED.get(field, field)
                homes = (*found[name].homes, home) if name in found else (home,)
                found[name] = Setting(homes, field, about)
    return found


def solver(given: Mapping[str, Any], mechanism: Mechanism) -> Exudyn | Spectral | Closure | None:
    """The solver that is asked for; None where nothing is said of it.

    Where settings are given and no kind, it is what runs the mechanism by default and has these settings.

    Raises
    ------
    ValueError
        If a setting belongs to another solver or to other steps, or is out of its range.
    """
    if not given:
        return None
    usual = "closure" if answered(mechanism) and all(_settles(Closure, key) for key in given) else "exudyn"
    name = given.get(KIND, usual)
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


def _settles(kind: type, key: str) -> bool:
    """Whether a setting is one of a solver's, or of its steps."""
    homes = settings()[key].homes
    return kind in homes or Controlled in homes or Equal in homes


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
        found[key] = value if key == KIND else settings()[key].about.spec.read(f"run.solver.{key}", value)
    return found
