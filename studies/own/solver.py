"""The solver of a mechanism's file: its kind and settings, as options or in the file's table [run.solver].

The settings are the fields of `Exudyn`, `Spectral`, `Closure` and their kinds of steps, as these declare them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from importlib.util import find_spec
from typing import Any, NamedTuple

from buckler.mbs.declare import Declaration, Spec, declarations
from buckler.mbs.declare.spec import Choice
from buckler.mbs.kinematics.determined import answered
from buckler.mbs.mechanism import Mechanism
from buckler.mbs.solvers import Closure, Controlled, Equal, Exudyn, Spectral

SOLVERS: dict[str, type[Exudyn | Spectral | Closure]] = {"exudyn": Exudyn, "spectral": Spectral, "closure": Closure}
KIND = "kind"
RENAMED = {"count": "steps", "method": "integrator"}
"""Settings whose names say too little apart from their types."""
GROUP = "the solver; with an accuracy it is kept, and its steps and elements are chosen"
CHOICE = Declaration(Choice(tuple(SOLVERS)), "default exudyn, or closure where that answers", {}, False, None, GROUP)


class Setting(NamedTuple):
    """A setting: the types that have it, its name there, and what they say of it."""

    homes: tuple[type, ...]
    field: str
    about: Declaration

    @property
    def kinds(self) -> list[str]:
        """Solvers that have it."""
        return [known for known, each in SOLVERS.items() if each in self.homes]


@cache
def settings() -> dict[str, Setting]:
    """Every setting by its name in files; with hyphens, its option."""
    found: dict[str, Setting] = {}
    for home in (Controlled, Equal, *SOLVERS.values()):
        for field, about in declarations(home).items():
            if field != "steps":
                name = RENAMED.get(field, field)
                homes = (*found[name].homes, home) if name in found else (home,)
                found[name] = Setting(homes, field, about._replace(group=GROUP))
    return found


class Settings(Spec):
    """A solver's name, or a table of `kind` and settings, kept as pairs."""

    words = f"{' or '.join(SOLVERS)}, or a table of kind and settings"

    def read(self, name: str, given: object) -> tuple[tuple[str, Any], ...]:
        """Return the pairs; a ValueError names the setting that is unknown or out of its range."""
        content = {KIND: given} if isinstance(given, str) else dict(given) if isinstance(given, Mapping | tuple) else None
        if content is None:
            raise self.refused(name, given)
        for key in content:
            if key != KIND and key not in settings():
                raise ValueError(f"{name}.{key}: unknown key; known: {', '.join([KIND, *settings()])}")
        about = {KIND: CHOICE} | {key: setting.about for key, setting in settings().items()}
        return tuple((key, about[key].spec.read(f"{name}.{key}", value)) for key, value in content.items())


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
            if setting.kinds:
                raise ValueError(f"solver: {key} is a setting of {' and '.join(setting.kinds)}, not of {name}")
            needs = "equal steps: give steps" if Equal in setting.homes else "controlled steps: leave out steps"
            raise ValueError(f"solver: {key} is for {needs}")
        mine[home][setting.field] = value
    made = Equal(**mine[Equal]) if steps is Equal else replace(kind().steps, **mine[Controlled])
    return kind(steps=made, **mine[kind])


def _settles(kind: type, key: str) -> bool:
    """Whether a setting is one of a solver's, or of its steps."""
    homes = settings()[key].homes
    return kind in homes or Controlled in homes or Equal in homes
