"""Classic problems of stability by name: what the statics find, what is exact, what error they tell.

Columns under dead and following loads, a double pendulum that flutters, trusses and frames that snap, and frequencies. Exact
values are closed forms of the same theory (Reissner's strip: shear and stretching), solved apart by shooting, or published;
docs/theory-stability.md has sources.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from math import pi
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import brentq

from buckler import mbs
from buckler.elastica.vibration import beam_frequencies
from buckler.mbs import frequencies, path
from buckler.mbs.statics.answer import Path

from ..kit.parameters import StudyParameters, choices
from ..kit.published import GRAVITY
from ..kit.report import QUIET, Metric, Progress, StudyResult, Table, judged
from ..kit.style import Figure
from . import columns, frames, known
from .columns import LENGTH, STRIP, THIN, ZIEGLER
from .frames import Frame


class Found(NamedTuple):
    """A number of a case: found, exact, the error told, and the unit."""

    value: float
    exact: float
    estimated: float
    unit: str = "1"


def _found(path: Path, kind: str, exact: float, number: int = 0, unit: str = "1") -> Found:
    """One of a path's `limits`, `branchings` or `flutter` against what is exact."""
    return Found(getattr(path, kind)[number], float(exact), float(path.errors[kind][number]), unit)


def _euler(ends: str, number: int) -> Found:
    exact = columns.critical(ends, number)
    return _found(path(columns.column(ends), to=1.1 * exact), "branchings", exact, number - 1, "N")


def _thin(exact: float, **given: Any) -> Found:
    """A thin cantilever that flutters under EI/L^2 and more."""
    loaded = columns.column("cantilever", THIN, THIN.bending_stiffness / LENGTH**2, **given)
    return _found(path(loaded, to=25.0), "flutter", exact)


def _pfluger(ratio: float) -> Found:
    """A. Pflüger, Z. angew. Math. Mech. 35 (1955) 191: Beck's column with a mass at its tip."""
    return _thin(columns.flutter_with_tip(ratio), follows="strip", tip=ratio * THIN.mass_per_length * LENGTH)


def _leipholz() -> Found:
    """H. H. E. Leipholz, Z. angew. Math. Phys. 13 (1962) 581: a tangential force along the whole column, 40.05 EI/L^3."""
    unit = THIN.bending_stiffness / LENGTH**3
    made = columns.column("cantilever", THIN, 0.0)
    loaded = mbs.Mechanism(made.points, made.links, made.joints, loads=[mbs.LineLoad("strip", (-unit, 0.0), turns=True)])
    return _found(path(loaded, to=45.0), "flutter", columns.leipholz(14))


def _ziegler(damping: float) -> Found:
    """(7/2 - sqrt 2) k/l; with small equal dampers 41/28 k/l + b^2/(2 m l^3)."""
    length, stiffness, mass = ZIEGLER
    damper = damping * float(np.sqrt(mass * stiffness)) * length
    exact = 41 / 28 + damping**2 / 2 if damping else 3.5 - np.sqrt(2.0)
    return _found(path(columns.ziegler(damper, damper), load="force.B", to=2.5), "flutter", exact)


def _portal() -> Found:
    """Of three equal members on two hinges, pressed at both corners, sways where kL tan kL = 6 (Timoshenko and Gere 1961)."""
    names, points = ("left", "beam", "right"), {"A": (0, 0), "B": (0, LENGTH), "C": (LENGTH, LENGTH), "D": (LENGTH, 0)}
    members = [mbs.Link(name, ends[0], ends[1], mbs.Beam(STRIP)) for name, ends in zip(names, ("AB", "BC", "DC"), strict=True)]
    welds = [mbs.Weld("B", "left", "beam"), mbs.Weld("C", "beam", "right")]
    joints = [*welds, mbs.Revolute("A", "ground", "left"), mbs.Revolute("D", "ground", "right")]
    unit = STRIP.bending_stiffness / LENGTH**2
    found = path(mbs.Mechanism(points, members, joints, loads=[mbs.Force(p, (0, -unit)) for p in "BC"]), to=1.9)
    wave = brentq(lambda x: x * np.sin(x) - 6 * np.cos(x), 1.0, 1.5, xtol=1e-14)
    return _found(found, "branchings", wave**2)


def _truss() -> Found:
    """A mass on two inclined springs: F = 2 k (l0 - l) y/l turns where l^3 = l0."""
    height, stiffness = 0.3, 1e4
    free = float(np.hypot(1, height))
    made = mbs.Mechanism(
        points={"P": (0, height), "Q": (0, height + 0.1), "A": (-1, 0), "C": (1, 0)},
        links=[mbs.Link("block", "P", "Q", mbs.Rigid.of(mass=1.0, inertia=1e-3))],
        joints=[mbs.Slider("P", "block", "ground", along=(0, 1))],
        loads=[
            *(mbs.Spring("P", f"ground:{end}", stiffness=stiffness, free_length=free) for end in "AC"),
            mbs.Force("P", (0, -1.0)),
        ],
    )
    y = float(np.sqrt(free ** (2 / 3) - 1))
    exact = 2 * stiffness * (free - np.hypot(1, y)) * y / np.hypot(1, y)
    return _found(path(made, load="force.P", to=2 * exact), "limits", exact, unit="N")


FRAMES: dict[str, Callable[[], Frame]] = {
    "toggle": frames.toggle,
    "lee": frames.lee,
    "roorda": partial(frames.roorda, -0.01),
    "deep_arch": frames.deep_arch,
    "cosine_arch": frames.cosine_arch,
}
CROSSED = {"toggle": (2, 0), "lee": (2, 0), "roorda": (2, 0), "deep_arch": (2, 0), "cosine_arch": (2, 6)}
"""How many limits and branchings each path has."""


@cache
def _followed(name: str) -> tuple[Path, dict[str, list[float]]]:
    """Path of a frame, and its critical loads by shooting."""
    frame = FRAMES[name]()
    alone: dict[str, list[float]] = {"limit": [], "branching": []}
    for kind, load in frame.chain.critical():
        alone[kind].append(load)
    return path(frame.mechanism, to=frame.chain.to), alone


def _frame(name: str, kind: str, number: int) -> Found:
    found, alone = _followed(name)
    return _found(found, {"limit": "limits", "branching": "branchings"}[kind], alone[kind][number], number)


def _frequency(ends: str, number: int, section: mbs.Section) -> Found:
    joints = {"cantilever": [mbs.Weld("A", "ground", "s")], "clamped-clamped": [mbs.Weld(p, "ground", "s") for p in "AB"]}[ends]
    made = mbs.Mechanism({"A": (0, 0), "B": (LENGTH, 0)}, [mbs.Link("s", "A", "B", mbs.Beam(section))], joints)
    found = frequencies(made, count=number)
    exact = float(beam_frequencies(columns.member(section), ends, number)[number - 1]) / (2 * pi)
    return Found(float(found.hertz[number - 1]), exact, float(found.errors[number - 1]), "Hz")


def _near_buckling() -> Found:
    """Of a pinned column at 0.99 of its load: deflection sin kx and turn cos kx of Reissner's strip, shortened by 1 - s = P/EA.

    [GA k^2, -(GA s + P) k; sym., EI k^2 + GA s^2 + P s] - w^2 diag(rho A, rho I) is singular.
    """
    load, wave = 0.99 * columns.critical("pinned", 1), pi / LENGTH
    found = frequencies(columns.column("pinned", load=load), count=1)
    shear, short = STRIP.shear_stiffness, 1 - load / STRIP.axial_stiffness
    across, turn = shear * wave**2, STRIP.bending_stiffness * wave**2 + shear * short**2 + load * short
    mass, inertia = STRIP.mass_per_length, STRIP.inertia_per_length
    both = across * inertia + turn * mass
    whole = wave**2 * shear * (STRIP.bending_stiffness * wave**2 - load * (short + load / shear))  # the determinant of K
    square = 2 * whole / (both + np.sqrt(both**2 - 4 * whole * mass * inertia))
    return Found(float(found.hertz[0]), float(np.sqrt(square)) / (2 * pi), float(found.errors[0]), "Hz")


def _pendulum(turn: float) -> Found:
    made = mbs.Mechanism(
        {"O": (0, 0), "A": (float(np.cos(turn)), float(np.sin(turn)))}, [mbs.Link("bar", "O", "A", mbs.Rigid(STRIP))],
        [mbs.Revolute("O", "ground", "bar")], gravity=(0, -GRAVITY),
    )  # fmt: skip
    rest = mbs.equilibrium(made)
    return Found(float(rest.point("bar", "A").position[1]), -1.0, rest.error, "m")


CASES: dict[str, Callable[[], Found]] = {
    "beck": partial(_thin, 20.05095, follows="strip"),
    "reut": partial(_thin, 20.05095, through=(0.0, 0.0)),  # the adjoint: a force whose line stays (V. V. Bolotin 1963)
    "leipholz": _leipholz,
    "pfluger_0.1": partial(_pfluger, 0.1),
    "pfluger_1": partial(_pfluger, 1.0),
    "ziegler": partial(_ziegler, 0.0),
    "ziegler_damped": partial(_ziegler, 0.01),
    **{
        f"euler_{ends}_{n}": partial(_euler, ends, n)
        for ends in ("pinned", "cantilever", "propped", "clamped", "swaying", "turning")
        for n in range(1, 6)
    },
    "portal": _portal,
    "truss": _truss,
    **{
        f"{name}_{kind}_{k + 1}": partial(_frame, name, kind, k)
        for name, counts in CROSSED.items()
        for kind, count in zip(("limit", "branching"), counts, strict=True)
        for k in range(count)
    },
    "cantilever_12": partial(_frequency, "cantilever", 12, STRIP),
    "clamped_6": partial(_frequency, "clamped-clamped", 6, STRIP),
    "near_buckling": _near_buckling,
    **{f"pendulum_{n}": partial(_pendulum, turn) for n, turn in enumerate((-2.9, -0.4, 0.3, 1.5, 2.2))},
}
ALLOWED = {
    **dict.fromkeys(("beck", "reut", "pfluger_0.1", "pfluger_1", "leipholz", "ziegler", "ziegler_damped"), 1e-4),
    "portal": 1e-4,
    "near_buckling": 1e-6,
    **dict.fromkeys(("cantilever_12", "clamped_6"), 1e-7),
}  # fmt: skip
"""Relative error allowed, 1e-8 of the rest and 1e-5 of frames: 1e-4 is asked of flutter."""


@dataclass(frozen=True)
class Parameters(StudyParameters):
    """Parameters of the study."""

    cases: tuple[str, ...] = choices(tuple(CASES), tuple(CASES), "which are solved", "cases")


def run(p: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Solve the cases one after the other."""
    found = {name: CASES[name]() for name in progress(p.cases, label="cases")}
    off = {name: abs(each.value / each.exact - 1) for name, each in found.items()}
    missed = [f"{name} is {off[name]:.1e} off, allowed {allowed(name):.0e}" for name in found if not off[name] <= allowed(name)]
    metrics = {
        f"{name}.{key}": Metric(getattr(each, key), each.unit)
        for name, each in found.items() for key in ("value", "exact", "estimated")
    }  # fmt: skip
    rows = [
        [name, e.unit, f"{e.value:.10g}", f"{e.exact:.10g}", f"{off[name]:.1e}", f"{e.estimated:.1e}"]
        for name, e in found.items()
    ]
    table = Table(["case", "unit", "found", "exact", "relative error", "error told"], rows, "Stability")
    signals = known.as_signals(off, allowed)
    return StudyResult(parameters=p, **judged(missed), metrics=metrics, tables=[table], signals=signals)


def allowed(name: str) -> float:
    """Relative error allowed of a case."""
    return ALLOWED.get(name, 1e-5 if name.startswith(tuple(FRAMES)) else 1e-8)


def figure(result: StudyResult) -> Figure:
    """Error of each case as a point, what is allowed as a bar."""
    names = [name.removesuffix(".value") for name in result.metrics if name.endswith(".value")]
    return known.figure(result, names, "relative error")
