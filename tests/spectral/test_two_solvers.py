"""The compiled solver against Exudyn, kind by kind: places, forces and energies of the same mechanism."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

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
    Strut,
    Torque,
    TorsionSpring,
    Weld,
)  # fmt: skip
from buckler.mbs.elements.modal import Box
from buckler.mbs.engine.settings import Controlled, Equal, Exudyn
from buckler.mbs.laws import AdamsFriction, Impact, LuGre
from buckler.mbs.library import crank_rocker, slider_crank
from buckler.mbs.mechanism import Mechanism
from buckler.mbs.spectral.solver import Spectral

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
    compiled = simulate(mechanism, duration, solver=Spectral(Controlled(tolerance=1e-8), **settings), ledger=True)
    engine = simulate(mechanism, duration, solver=Exudyn(Equal(4000)))
    assert set(compiled.signals) == set(engine.signals)
    assert compiled.units == engine.units
    times = np.linspace(0.0, duration, 501)
    for signal, bound in bounds.items():
        ours, theirs = (np.interp(times, r.time, r.signals[signal]) for r in (compiled, engine))
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
