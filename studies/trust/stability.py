"""Classic problems of stability by name: what the statics find, what is exact, what error they tell.

Columns under dead and following loads, a double pendulum that flutters, trusses and frames that snap, and frequencies. Exact
values are closed forms of the same theory (Reissner's strip: shear and stretching) or published; docs/theory-stability.md has
sources.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from math import pi
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import brentq

from buckler.elastica.member import Member
from buckler.elastica.vibration import beam_frequencies
from buckler.mbs import (
    Beam,
    Force,
    Guide,
    Link,
    Material,
    Mechanism,
    Revolute,
    Rigid,
    Section,
    Slider,
    Spring,
    TorsionSpring,
    Weld,
    equilibrium,
    frequencies,
    path,
)  # fmt: skip
from buckler.studies.kit.parameters import StudyParameters, choices
from buckler.studies.kit.report import QUIET, Metric, Progress, StudyResult, Table
from buckler.studies.kit.style import Figure, subplots

LENGTH, STRIP, THIN = 0.5, Section(0.02, 0.001), Section(0.02, 0.0002)


class Found(NamedTuple):
    """A number of a case: found, exact, the error told, and the unit."""

    value: float
    exact: float
    estimated: float
    unit: str = "1"


def column(ends: str, section: Section = STRIP, load: float = 1.0, follows: str | None = None, mass: float = 0.0) -> Mechanism:
    """A straight strip along x pressed at its far end; ends 'pinned', 'cantilever', 'propped' or 'clamped'."""
    joints: list[Any] = [(Revolute if ends == "pinned" else Weld)("A", "ground", "strip")]
    joints += [Slider("B", "strip", "ground", along=(1, 0))] if ends == "clamped" else []
    guides = [Guide("B", "strip")] if ends in ("pinned", "propped") else []
    return Mechanism(
        {"A": (0, 0), "B": (LENGTH, 0)}, [Link("strip", "A", "B", Beam(section))], joints, guides,
        loads=[Force("B", (-load, 0), follows=follows)],
    )  # fmt: skip


def critical(ends: str, number: int) -> float:
    """Critical load of Reissner's strip, N: P m = EI k^2 with m = 1 - P/EA + P/GA.

    kL = n pi of pins, (n - 1/2) pi of a cantilever; tan kL = kL (1 - P/EA)/m with one end clamped, the other pinned. Between
    clamps kL/2 = n pi and that of kL/2 take turns.
    """
    bend, axial, shear = STRIP.bending_stiffness, STRIP.axial_stiffness, STRIP.shear_stiffness
    parts = 2 if ends == "clamped" else 1
    tangent = ends == "propped" or (ends == "clamped" and number % 2 == 0)
    wave = {"pinned": number, "cantilever": number - 0.5, "propped": number, "clamped": (number + 1) // 2}[ends] * pi

    def missing(load: float) -> float:
        softened = 1.0 - load / axial + load / shear
        turn = float(np.sqrt(load * softened / bend)) * LENGTH / parts
        return float(np.sin(turn) - turn * np.cos(turn) * (1.0 - load / axial) / softened) if tangent else turn - wave

    low, high = (wave, wave + pi / 2) if tangent else (0.9 * wave, 1.1 * wave)
    return float(brentq(missing, *(bend * (parts * each / LENGTH) ** 2 for each in (low, high)), xtol=1e-13, rtol=1e-14))


def _euler(ends: str, number: int) -> Found:
    exact = critical(ends, number)
    found = path(column(ends), to=1.1 * exact)
    return Found(found.branchings[number - 1], exact, float(found.errors["branchings"][number - 1]), "N")


def _beck() -> Found:
    unit = THIN.bending_stiffness / LENGTH**2
    found = path(column("cantilever", THIN, unit, follows="strip"), to=25.0)
    return Found(found.flutter[0], 20.05095, float(found.errors["flutter"][0]))


def _ziegler(damping: float) -> Found:
    """Two massless bars, masses 2 m and m at their ends: (7/2 - sqrt 2) k/l; with small dampers 41/28 k/l + b^2/(2 m l^3)."""
    length, stiffness, mass = 0.4, 3.0, 0.7
    bars = [
        Link(name, start, end, Rigid.of(mass=m, inertia=1e-12, centre=(length, 0)))
        for name, start, end, m in (("a", "O", "A", 2 * mass), ("b", "A", "B", mass))
    ]
    damper = damping * float(np.sqrt(mass * stiffness)) * length
    made = Mechanism(
        {"O": (0, 0), "A": (length, 0), "B": (2 * length, 0)}, bars, [Revolute("O", "ground", "a"), Revolute("A", "a", "b")],
        loads=[
            TorsionSpring("ground", "a", stiffness=stiffness, damping=damper),
            TorsionSpring("a", "b", stiffness=stiffness, damping=damper),
            Force("B", (-stiffness / length, 0), follows="b"),
        ],
    )  # fmt: skip
    found = path(made, load="force.B", to=2.5)
    exact = 41 / 28 + damping**2 / 2 if damping else 3.5 - np.sqrt(2.0)
    return Found(found.flutter[0], float(exact), float(found.errors["flutter"][0]))


def _truss() -> Found:
    """A mass on two inclined springs: F = 2 k (l0 - l) y/l turns where l^3 = l0."""
    height, stiffness = 0.3, 1e4
    free = float(np.hypot(1, height))
    made = Mechanism(
        points={"P": (0, height), "Q": (0, height + 0.1), "A": (-1, 0), "C": (1, 0)},
        links=[Link("block", "P", "Q", Rigid.of(mass=1.0, inertia=1e-3))],
        joints=[Slider("P", "block", "ground", along=(0, 1))],
        loads=[*(Spring("P", f"ground:{end}", stiffness=stiffness, free_length=free) for end in "AC"), Force("P", (0, -1.0))],
    )
    y = float(np.sqrt(free ** (2 / 3) - 1))
    exact = 2 * stiffness * (free - np.hypot(1, y)) * y / np.hypot(1, y)
    found = path(made, load="force.P", to=2 * exact)
    return Found(found.limits[0], float(exact), float(found.errors["limits"][0]), "N")


def _lee(number: int) -> Found:
    """S. L. Lee, F. S. Manuel, E. C. Rossow, J. Eng. Mech. Div. 94 (1968) 527: a hinged frame of two bars of 1.2 m."""
    section = Section(0.03, 0.02, Material(72e9, 2700.0, 0.3))
    made = Mechanism(
        {"A": (0, 0), "B": (0, 1.2), "P": (0.24, 1.2), "C": (1.2, 1.2)},
        [Link("post", "A", "B", Beam(section)), Link("beam", "B", "C", Beam(section), carries={"P": 0.2})],
        [Revolute("A", "ground", "post"), Weld("B", "post", "beam"), Revolute("C", "ground", "beam")],
        loads=[Force("P", (0, -1000.0))],
    )  # fmt: skip
    found = path(made, load="force.P", to=25.0)
    return Found(found.limits[number], (18.55, -9.39)[number], float(found.errors["limits"][number]), "kN")


def _frequency(ends: str, number: int, section: Section) -> Found:
    member = Member(
        LENGTH, section.bending_stiffness, section.mass_per_length, section.shear_stiffness, section.inertia_per_length,
        section.axial_stiffness,
    )  # fmt: skip
    joints = {"cantilever": [Weld("A", "ground", "s")], "clamped-clamped": [Weld(p, "ground", "s") for p in "AB"]}[ends]
    made = Mechanism({"A": (0, 0), "B": (LENGTH, 0)}, [Link("s", "A", "B", Beam(section))], joints)
    found = frequencies(made, count=number)
    exact = float(beam_frequencies(member, ends, number)[number - 1]) / (2 * pi)
    return Found(float(found.hertz[number - 1]), exact, float(found.errors[number - 1]), "Hz")


def _near_buckling() -> Found:
    """Of a pinned column at 0.99 of its load without shear and rotary inertia: f1 sqrt(1 - P/P_cr), to their order."""
    load = 0.99 * critical("pinned", 1)
    found = frequencies(column("pinned", load=load), count=1)
    wave = pi / LENGTH
    square = wave**2 * (
        STRIP.bending_stiffness * wave**2 - load * (1 - load / STRIP.axial_stiffness + load / STRIP.shear_stiffness)
    )
    return Found(float(found.hertz[0]), float(np.sqrt(square / STRIP.mass_per_length)) / (2 * pi), float(found.errors[0]), "Hz")


def _pendulum(turn: float) -> Found:
    made = Mechanism(
        {"O": (0, 0), "A": (float(np.cos(turn)), float(np.sin(turn)))}, [Link("bar", "O", "A", Rigid(STRIP))],
        [Revolute("O", "ground", "bar")], gravity=(0, -9.81),
    )  # fmt: skip
    rest = equilibrium(made)
    return Found(float(rest.point("bar", "A").position[1]), -1.0, rest.error, "m")


CASES: dict[str, Callable[[], Found]] = {
    "beck": _beck,
    "ziegler": partial(_ziegler, 0.0),
    "ziegler_damped": partial(_ziegler, 0.01),
    **{
        f"euler_{ends}_{n}": partial(_euler, ends, n)
        for ends in ("pinned", "cantilever", "propped", "clamped")
        for n in range(1, 6)
    },
    "truss": _truss,
    "lee_upper": partial(_lee, 0),
    "lee_lower": partial(_lee, 1),
    "cantilever_12": partial(_frequency, "cantilever", 12, STRIP),
    "clamped_6": partial(_frequency, "clamped-clamped", 6, STRIP),
    "near_buckling": _near_buckling,
    **{f"pendulum_{n}": partial(_pendulum, turn) for n, turn in enumerate((-2.9, -0.4, 0.3, 1.5, 2.2))},
}
ALLOWED = {"beck": 1e-4, "ziegler": 1e-4, "ziegler_damped": 1e-4, "lee_upper": 1e-3, "lee_lower": 1e-3, "near_buckling": 1e-4,
           "cantilever_12": 1e-7, "clamped_6": 1e-7}  # fmt: skip
"""Relative error allowed, 1e-8 of the rest: 1e-4 is asked of flutter, 1e-3 what the digits published allow."""


@dataclass(frozen=True)
class Parameters(StudyParameters):
    """Parameters of the study."""

    cases: tuple[str, ...] = choices(tuple(CASES), tuple(CASES), "which are solved", "cases")


def run(parameters: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Solve the cases one after the other."""
    found = {name: CASES[name]() for name in progress(parameters.cases, label="cases")}
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
    return StudyResult(
        parameters=parameters, status="SUSPECT" if missed else "OK", message="; ".join(missed), metrics=metrics, tables=[table],
        signals={"error": np.array(list(off.values())), "allowed": np.array([allowed(name) for name in found])},
    )  # fmt: skip


def allowed(name: str) -> float:
    """Relative error allowed of a case."""
    return ALLOWED.get(name, 1e-8)


def figure(result: StudyResult) -> Figure:
    """Error of each case as a point, what is allowed as a bar."""
    names = [name.removesuffix(".value") for name in result.metrics if name.endswith(".value")]
    fig, ax = subplots(height=10 * len(names) + 25)
    places = np.arange(len(names))
    ax.semilogx(np.maximum(result.signals["error"], 1e-16), places, "o", label="found")
    ax.semilogx(result.signals["allowed"], places, "|", color="C3", markersize=12, markeredgewidth=2, label="allowed")
    ax.set_yticks(places, names)
    ax.invert_yaxis()
    ax.set(xlabel="relative error")
    ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
    return fig
