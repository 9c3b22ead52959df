"""Solver of a mechanism's file: its kind and settings, as options or in the file's table [run.solver].

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
from buckler.mbs.mechanism import Mechanism
from buckler.mbs.scene.scene import Scene
from buckler.mbs.solvers import Closure, Controlled, Equal, Exudyn, Spectral

SOLVERS: dict[str, type[Exudyn | Spectral | Closure]] = {"exudyn": Exudyn, "spectral": Spectral, "closure": Closure}
RENAMED = {"count": "steps", "method": "integrator"}
"""Options of fields whose names are unclear without their class."""
GROUP = "the solver; with an accuracy it is kept, and its steps and elements are chosen"
KIND = Declaration(Choice(tuple(SOLVERS)), "default exudyn, or closure for linkages that it determines", {}, False, None, GROUP)


class Setting(NamedTuple):
    """A setting: classes that have it, its field there, its declaration."""

    homes: tuple[type, ...]
    field: str
    about: Declaration

    @property
    def solvers(self) -> list[str]:
        """Names of the solvers that have it."""
        return [name for name, kind in SOLVERS.items() if kind in self.homes]


@cache
def settings() -> dict[str, Setting]:
    """Collect every setting by its name in files; with hyphens, its option."""
    found: dict[str, Setting] = {}
    for home in (Controlled, Equal, *SOLVERS.values()):
        for field, about in declarations(home).items():
            if field != "steps":
                name = RENAMED.get(field, field)
                homes = (*found[name].homes, home) if name in found else (home,)
                found[name] = Setting(homes, field, about._replace(group=GROUP))
    return found


@cache
def options() -> dict[str, Declaration]:
    """Collect the declarations of `solver` and of every setting."""
    texts = {name: f"; of {each.solvers[0]}" if len(each.solvers) == 1 else "" for name, each in settings().items()}
    return {"solver": KIND} | {name: each.about._replace(doc=each.about.doc + texts[name]) for name, each in settings().items()}


class Settings(Spec):
    """Name of a solver, or a table of `kind` and settings, kept as pairs."""

    words = f"{' or '.join(SOLVERS)}, or a table of kind and settings"

    def read(self, name: str, given: object) -> tuple[tuple[str, Any], ...]:
        """Return the pairs; a ValueError names the setting that is unknown or out of its range."""
        content = {"kind": given} if isinstance(given, str) else dict(given) if isinstance(given, Mapping | tuple) else None
        if content is None:
            raise self.refusal(name, given)
        about = {"kind": KIND} | {key: setting.about for key, setting in settings().items()}
        for key in content:
            if key not in about:
                raise ValueError(f"{name}.{key}: unknown key; known: {', '.join(about)}")
        return tuple((key, about[key].spec.read(f"{name}.{key}", value)) for key, value in content.items())


def make_solver(given: Mapping[str, Any], mechanism: Mechanism) -> Exudyn | Spectral | Closure | None:
    """Make the solver with these settings; None without any. Without a kind it is the default of the mechanism that has them.

    A ValueError names a setting of another solver or of other steps.
    """
    if not given:
        return None
    in_closure = all({Closure, Controlled, Equal}.intersection(settings()[key].homes) for key in given if key != "kind")
    name = given.get("kind", "closure" if in_closure and Scene.of(mechanism).is_kinematic else "exudyn")
    if SOLVERS[name] is Spectral and find_spec("numba") is None:
        raise ValueError(f"solver = {name}: needs Numba: pip install 'buckler[fast]'")
    kind, steps = SOLVERS[name], Equal if "steps" in given else Controlled
    values: dict[type, dict[str, Any]] = {kind: {}, steps: {}}
    for key, value in given.items():
        if key == "kind":
            continue
        setting = settings()[key]
        home = next((home for home in setting.homes if home in values), None)
        if home is None:
            needs = "equal steps: give steps" if Equal in setting.homes else "controlled steps: leave out steps"
            other = f"{key} is a setting of {' and '.join(setting.solvers)}, not of {name}"
            raise ValueError(f"solver: {other if setting.solvers else f'{key} is for {needs}'}")
        values[home][setting.field] = value
    made = Equal(**values[Equal]) if steps is Equal else replace(kind().steps, **values[Controlled])
    return kind(steps=made, **values[kind])
