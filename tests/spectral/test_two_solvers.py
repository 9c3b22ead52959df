"""The compiled solver against Exudyn, kind by kind: places, forces and energies of the same mechanism."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

pytest.importorskip("numba")

from spectral_scenes import DAMPED, STOP, play

from buckler.mbs import simulate
from buckler.mbs.elements import (
    Beam,
    Cable,
    Force,
    GuideFriction,
    Link,
    Mass,
    Modal,
    Motor,
    Ramp,
    Revolute,
    Rigid,
    Section,
    Slot,
    Spring,
    Stop,
    Strut,
    Torque,
    TorsionSpring,
    Weld,
)  # fmt: skip
from buckler.mbs.elements.modal import Box
from buckler.mbs.laws import AdamsFriction, Coulomb, Impact, KelvinVoigt, LuGre
from buckler.mbs.library import crank_rocker, slider_crank
from buckler.mbs.mechanism import Mechanism
from buckler.mbs.solvers import Controlled, Equal, Exudyn, Spectral

BAR = Section(0.02, 0.005)
LOADED = Mechanism(
    points={"O": (0.0, 0.0), "A": (0.1, 0.0), "P": (0.2, 0.1)},
    links=[Link("crank", "O", "A", Rigid(BAR))],
    joints=[Revolute("O", "ground", "crank")],
    masses=[Mass("A", 0.1, 1e-4)],
    loads=[
        Spring("A", "ground:P", stiffness=40.0, damping=0.2, free_length=0.05),
        Spring("A", "ground:O", stiffness=0.0, free_length=0.1, law=lambda x, v: 3.0 * x + 0.1 * v),
        TorsionSpring("ground", "crank", stiffness=0.05, damping=1e-3, free_angle=0.3),
        Torque("crank", lambda t, angle, speed: 0.05 - 1e-3 * speed + 0.01 * angle * t),
        Force("A", (0.0, 0.5), follows="crank"),
        Force("A", (0.2, 0.0)),
        Motor("crank", voltage=6.0, resistance=2.0, constant=0.05, inertia=1e-5, gear=3.0, friction=1e-3, dead_band=0.5),
    ],
    velocities={"crank": 2.0},
    gravity=(0.0, -9.81),
)
WELDED = Mechanism(
    points={"O": (0.0, 0.0), "A": (0.2, 0.0), "B": (0.3, 0.1), "S": (0.1, 0.1)},
    links=[
        Link("beam", "O", "A", Beam(Section(0.02, 0.002))),
        Link("arm", "A", "B", Rigid(BAR)),
        Link("bob", "S", "B", Rigid(BAR)),
    ],
    joints=[Weld("O", "ground", "beam"), Weld("A", "beam", "arm"), Slot("B", "bob", "arm", along=(1.0, 1.0))],
    loads=[Spring("S", "ground:S", stiffness=500.0), Force("B", (0.0, -2.0))],
    gravity=(0.0, -9.81),
)
LAW = Impact(1e8, 1e3, 1e-4)
CASES: dict[str, tuple[Any, float, dict[str, float], dict[str, Any]]] = {
    "beam": (slider_crank(Beam(DAMPED), law=None, mass=0.3, speed=6.0), 0.5, {"B.x": 1e-6, "coupler.deflection": 2e-3}, {}),
    "cable": (
        slider_crank(Cable(DAMPED, imperfection=1e-4), law=None, mass=0.3, speed=6.0, friction=GuideFriction(0.5)), 0.5,
        {"B.x": 1e-5, "coupler.deflection": 2e-3}, {},
    ),
    "strut on a stop": (slider_crank(Strut(Section(0.03, 3e-4)), law=STOP, mass=0.3, speed=6.0), 0.5, {"B.x": 1e-3}, {}),
    "modal": (crank_rocker(Modal(BAR, mesh=Box((8, 1, 1))), speed=30.0), 0.02, {"B.x": 1e-6, "rocker.deflection": 0.05}, {}),
    "ramp": (crank_rocker(Rigid(BAR), speed=Ramp(0.0, 30.0, 0.05)), 0.1, {"B.x": 1e-5, "rocker.vx": 1e-4}, {}),
    "clearance": (
        crank_rocker(Rigid(BAR), speed=30.0, play=play(LAW, AdamsFriction(0.3, 0.2)), with_play="B"), 0.01,
        {"rocker.x": 1e-4, "B.normal_force": 0.03}, {},
    ),
    "clearance, implicit": (
        crank_rocker(Rigid(BAR), speed=30.0, play=play(LAW, AdamsFriction(0.3, 0.2)), with_play="B"), 0.01,
        {"rocker.x": 1e-4, "B.normal_force": 0.05}, {"method": "implicit", "contact_tolerance": 1e-3},
    ),
    "loads and masses": (LOADED, 0.5, {"A.x": 1e-4, "motor.crank.current": 1e-3, "torsion.ground-crank.torque": 1e-3}, {}),
    "welds and a slot": (WELDED, 0.1, {"B.y": 2e-3, "S.x": 2e-3}, {}),
    "bristles": (
        crank_rocker(Rigid(BAR), speed=30.0, play=play(LAW, LuGre(0.3, 0.2, 0.01)), with_play="B"), 0.01,
        {"rocker.x": 1e-4, "B.normal_force": 0.03}, {},
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_both_solvers_agree(name: str) -> None:
    mechanism, duration, bounds, settings = CASES[name]
    compiled = simulate(mechanism, duration, solver=Spectral(Controlled(tolerance=3e-9), **settings), ledger=True)
    engine = simulate(mechanism, duration, solver=Exudyn(Equal(4000)))
    assert set(compiled.signals) == set(engine.signals)
    assert compiled.units == engine.units
    times = np.linspace(0.0, duration, 501)
    for signal, bound in bounds.items():
        ours, theirs = (CubicSpline(r.time, r.signals[signal])(np.clip(times, 0, r.time[-1])) for r in (compiled, engine))
        scale = np.sqrt(np.mean((theirs - theirs.mean()) ** 2))
        assert np.sqrt(np.mean((ours - theirs) ** 2)) < bound * scale, signal
    assert compiled.energy_balance < 1e-3


def test_strips_on_a_stop_agree() -> None:
    """A thin strip buckles against the stop: the work of the published slider-crank."""
    strip = Beam(Section(0.03, 3e-4).damped(0.02, 0.31), imperfection=3e-4)
    mechanism = slider_crank(strip, law=STOP, mass=0.3, speed=6.0)
    compiled = simulate(mechanism, 0.5, solver=Spectral(Controlled(tolerance=1e-7)), ledger=True)
    engine = simulate(mechanism, 0.5, solver=Exudyn(Equal(8000)))
    ours, theirs = (r.mean("B.contact_force") for r in (compiled, engine))
    assert theirs > 1.0
    assert ours == pytest.approx(theirs, rel=1e-2)
    assert compiled.energy_balance < 1e-3


@pytest.mark.parametrize("kind", [Beam, Cable])
def test_a_strip_struck_in_its_middle_starts_alike(kind):
    """Pinned at both ends it must give way: both solvers give it the same shape of velocities, and the one that was asked for."""
    mechanism = Mechanism(
        points={"A": (0, 0), "B": (0.3, 0.1)},
        links=[Link("rod", "A", "B", kind(Section(0.02, 0.002)), carries={"M": 0.4})],
        joints=[Revolute("A", "ground", "rod"), Revolute("B", "ground", "rod")],
        masses=[Mass("M", 0.05)],
        velocities={"M": (-0.1, 0.3)},
    )
    runs = [
        simulate(mechanism, 1e-3, solver=solver, ledger=True) for solver in (Exudyn(Controlled(1e-8)), Spectral(Controlled(1e-8)))
    ]
    for run in runs:
        assert (run["M.vx"][0], run["M.vy"][0]) == pytest.approx((-0.1, 0.3), abs=1e-9)
    assert runs[0].energy["kinetic"][0] == pytest.approx(runs[1].energy["kinetic"][0], rel=2e-2)  # the engine's mesh is coarse


def _let_go(friction: Any) -> Mechanism:
    """A slider-crank that a torque turns, its block heavy on its line."""
    made = slider_crank(Rigid(BAR), law=None, mass=0.3, speed=1.0)
    guide = replace(made.guides[0], friction=friction)
    return replace(made, drives=[], guides=[guide], velocities={"crank": 8.0}, loads=[Torque("crank", 0.3)], gravity=(0.0, -9.81))


def test_friction_of_the_guides_own_reaction_is_that_of_the_engine() -> None:
    mechanism, times = _let_go(Coulomb(0.3, 0.05)), np.linspace(0.05, 0.4, 401)
    compiled = simulate(mechanism, 0.4, solver=Spectral(Controlled(tolerance=1e-8)), ledger=True)
    engine = simulate(mechanism, 0.4, solver=Exudyn(Equal(8000)))
    free = simulate(_let_go(None), 0.4, solver=Spectral(Controlled(tolerance=1e-8)))
    for signal, bound in {"B.x": 1e-4, "B.friction_force": 2e-2, "B.guide_force": 1e-2}.items():
        ours, theirs = (np.interp(times, r.time, r.signals[signal]) for r in (compiled, engine))
        assert np.sqrt(np.mean((ours - theirs) ** 2)) < bound * np.std(theirs), signal
    assert np.abs(compiled.at("B.x", times) - free.at("B.x", times)).max() > 1e-2  # or the friction went unseen
    assert compiled.energy_balance < 1e-3


def test_a_stop_on_the_section_of_a_strip_is_that_of_the_engine() -> None:
    """A heavy bar falls with its end onto a clamped strip's middle section, which turns under it."""
    mechanism = Mechanism(
        points={"O": (0.0, 0.0), "M": (0.1, 0.0), "T": (0.2, 0.0), "P": (-0.05, 0.06), "E": (0.1, 0.01)},
        links=[
            Link("strip", "O", "T", Beam(Section(0.03, 2e-3).damped(0.02, 0.2)), carries={"M": 0.5}),
            Link("bar", "P", "E", Rigid(BAR)),
        ],
        joints=[Weld("O", "ground", "strip"), Revolute("P", "ground", "bar")],
        stops=[Stop("E", at=0.0, law=KelvinVoigt(2e4, 20.0), along=(0.0, 1.0), on="strip:M", link="bar")],
        gravity=(0.0, -9.81),
    )
    times = np.linspace(0.0, 0.15, 301)
    compiled = simulate(mechanism, 0.15, solver=Spectral(Controlled(tolerance=1e-8)), ledger=True)
    engine = simulate(mechanism, 0.15, solver=Exudyn(Equal(12000)))
    assert engine.signals["E.contact_force"].max() > 1.0
    for signal, bound in {"E.y": 5e-3, "strip.deflection": 5e-2}.items():
        ours, theirs = (np.interp(times, r.time, r.signals[signal]) for r in (compiled, engine))
        assert np.sqrt(np.mean((ours - theirs) ** 2)) < bound * np.std(theirs), signal
    ours, theirs = (np.trapezoid(r.signals["E.contact_force"], r.time) for r in (compiled, engine))
    assert ours == pytest.approx(theirs, rel=1e-2)
    assert compiled.energy_balance < 1e-3
