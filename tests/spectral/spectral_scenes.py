"""Mechanisms that between them have every kind of the compiled kernel, and differences to check it with."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from buckler.mbs import (
    Beam,
    Cable,
    Clearance,
    Force,
    GuideFriction,
    Link,
    Mechanism,
    Revolute,
    Rigid,
    States,
    Stop,
    Strut,
    Torque,
)
from buckler.mbs.elements.modal import Box, Modal
from buckler.mbs.elements.section import Material, Section
from buckler.mbs.laws import AdamsFriction, CarvalhoMartins, ExactRestitution, Impact, LuGre
from buckler.mbs.library import crank_rocker, slider_crank
from buckler.mbs.spectral.motion import kirchhoff, reissner
from buckler.mbs.spectral.scene import CompiledScene
from buckler.mbs.spectral.tables import StripKind

DAMPED = Section(0.03, 0.003, Material(210e9, 7850.0, 0.3, bending_damping=1e-3, axial_damping=2e-5))
STOP = CarvalhoMartins(1e5, 0.5, exponent=1.0)


def play(law: Any, friction: Any) -> Callable[[str, str, str], Clearance]:
    return lambda point, first, second: Clearance(point, first, second, 5e-3, 1e-4, law, friction)


def scenes() -> dict[str, CompiledScene]:
    bar = Section(0.02, 0.005)
    dry = GuideFriction(1.0, 2.0, 0.1)
    return {
        "beam": CompiledScene.of(slider_crank(Beam(DAMPED, imperfection=1e-3), law=STOP, mass=0.3, speed=1.25), 5),
        "cable": CompiledScene.of(slider_crank(Cable(DAMPED, imperfection=1e-3), law=None, mass=0.3, speed=1.25), 5),
        "strut": CompiledScene.of(slider_crank(Strut(DAMPED), law=STOP, mass=0.3, speed=1.25, friction=dry)),
        "impact": CompiledScene.of(
            crank_rocker(Rigid(bar), speed=30.0, play=play(Impact(1e8, 1e3, 1e-4), AdamsFriction(0.3, 0.2)))
        ),
        "lugre": CompiledScene.of(
            crank_rocker(Beam(bar), speed=30.0, play=play(ExactRestitution(1e8, 0.5), LuGre(0.3, 0.2, 0.01))), 4
        ),
        "states": CompiledScene.of(_governed()),
        "rough": CompiledScene.of(_rough()),
        "modal": CompiledScene.of(crank_rocker(Modal(bar, mesh=Box((6, 1, 1))), speed=30.0)),
    }


def _governed() -> Mechanism:
    """A slider-crank whose loads, on the turn and on a point of rigid links, have states, with laws that are not linear."""
    turn = States(["sin(angle) - state2", "state1*state2 + speed"], (0.2, 0.3))
    push = States(["x*vx - state1", "vy + state1*y", "state2*state3 - t"], (0.4, 0.5, 0.6))
    loads = [
        Torque("coupler", "state1*speed + 3*angle*state2", states=turn),
        Force("crank:A", ["state1*vx + 2*state3*y", "state2*x + vy"], states=push),
    ]
    return replace(slider_crank(Rigid(DAMPED), law=None, mass=0.3, speed=1.25), loads=loads)


def _rough() -> Mechanism:
    """A free link and a hinged one that touch, after a small motion, at rough faces of each other and of the ground."""
    body, rough = Rigid.of(mass=0.5, inertia=1e-3, centre=(0.05, 0.0)), AdamsFriction(0.3, 0.2)
    points = {"A": (0.0, 0.0), "B": (0.1, 0.02), "C": (0.02, -0.01), "D": (0.2, -0.03)}
    faces = [("A", (0.3, 1.0), "ground"), ("B", (0.2, -1.0), "two"), ("A", (1.0, 0.1), "two"), ("B", (-1.0, 0.5), "ground")]
    stops = []
    for point, along, on in faces:
        unit = np.array(along) / np.hypot(*along)
        at = float(unit @ points[point])
        stops += [Stop(point, at=at + off, law=STOP, along=along, on=on, friction=rough) for off in (1e-6, -1e-6)]
    links = [Link("one", "A", "B", body), Link("two", "C", "D", body)]
    return Mechanism(points, links, [Revolute("D", "ground", "two")], stops=stops)


def state(scene: CompiledScene, seed: int, size: float = 1e-4, rate: float = 1.0) -> tuple[Any, Any, Any]:
    """Coordinates, rates and multipliers at random about the start."""
    rng = np.random.default_rng(seed)
    q = scene.q0 + size * rng.standard_normal(scene.size)
    return q, rate * rng.standard_normal(scene.size), 10 * rng.standard_normal(len(scene.row_names))


def energy(scene: CompiledScene, q: Any, v: Any) -> dict[str, float]:
    """Kinetic energy, strain energy of strips and modes, and potential of gravity, J."""
    s, strain = scene.tables, 0.0
    for kind, members, points, first, at, _ in s.strips:
        fields = 3 if kind == StripKind.REISSNER else 2
        places = s.dofs[first : first + fields * members].reshape(fields, members)
        weights, *free = s.data[at + 5 : at + 5 + 4 * points].reshape(4, points)
        values = s.data[at + 5 + 4 * points :][: 3 * points * members].reshape(3, points, members)
        of = [each @ q[places].T for each in values]
        strains, _ = (reissner if kind == StripKind.REISSNER else kirchhoff)(of, [0.0 * each for each in of])
        strain += 0.5 * sum(d * weights @ (e - e0) ** 2 for d, e, e0 in zip(s.data[at : at + 3], strains, free, strict=True))
    for first, modes, at in s.modal:
        strain += 0.5 * float(s.data[at + modes + 2 * modes**2 :][:modes] @ q[first + 3 : first + 3 + modes] ** 2)
    kinetic = 0.5 * float(v @ scene.mass_at(q) @ v)
    return {"kinetic": kinetic, "strain": float(strain), "weight": -float(s.factors[-1] * s.weight @ (q - scene.q0))}


def slope(function: Callable[[Any], Any], at: Any, step: float) -> Any:
    """Derivative by central differences, extrapolated once, shape (values, len(at))."""
    columns = []
    for e in np.eye(len(at)):
        one, two = ((function(at + h * e) - function(at - h * e)) / (2 * h) for h in (step, step / 2))
        columns.append((4 * two - one) / 3)
    return np.array(columns).T


def apart(a: Any, b: Any) -> float:
    return float(np.abs(a - b).max() / max(np.abs(b).max(), 1e-300))
