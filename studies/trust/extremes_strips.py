"""Cases of the study `extremes` with thin strips: the slider-crank that strikes, the static strip, a strip pressed in line."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from math import pi
from typing import Any

import numpy as np
from scipy.stats import qmc

from buckler.elastica import pinned
from buckler.mbs import (
    Beam,
    Cable,
    Controlled,
    Drive,
    Equal,
    Exudyn,
    Guide,
    GuideFriction,
    Link,
    Material,
    Mechanism,
    Motion,
    Result,
    Revolute,
    Section,
    Strut,
)
from buckler.mbs.engine.pressed import pinned_strip
from buckler.mbs.laws import CarvalhoMartins
from buckler.mbs.library import PAPER, slider_crank
from buckler.studies.kit.published import STRIP_WIDTH
from buckler.studies.trust.extremes_case import DEFAULT, Case, CaseOutcome, Measures, finer, simulated

LENGTH, MASS, TURN = PAPER.coupler, 0.3, 0.56
"""Of the coupler, m; of the slider, kg; how much of a turn is run: until 200 degrees, contact began at 120."""
EXACT = 1e-7
"""Tolerance of references: a hundredth of the default."""
SAMPLES = np.linspace(0.05, 1.0, 60)


@dataclass(frozen=True)
class Corner:
    """One slider-crank: thickness [m], speed [rad/s], stop stiffness [N/m], restitution, friction coefficient, damping ratio."""

    thickness: float = 3e-4
    speed: float = 1.25
    stiffness: float = 7.2e4
    restitution: float = 0.8
    friction: float = 0.1
    damping: float = 0.05
    bow: float = 1e-4

    @property
    def duration(self) -> float:
        """Of the run, s."""
        return TURN * 2 * pi / self.speed

    def mechanism(self, kind: str, **mesh: int) -> Mechanism:
        """The slider-crank with a Strut, Beam or Cable for a coupler."""
        section = Section(STRIP_WIDTH, self.thickness, Material(210e9, 7850.0, axial_damping=9e-5 if kind == "strut" else 0.0))
        wet: Any = {"section": section.damped(self.damping, LENGTH), "imperfection": -self.bow * LENGTH} | mesh
        return slider_crank(
            Strut(section) if kind == "strut" else Beam(**wet) if kind == "beam" else Cable(**wet),
            law=CarvalhoMartins(self.stiffness, self.restitution, exponent=1.0),
            mass=MASS,
            speed=self.speed,
            friction=GuideFriction.of_weight(self.friction, MASS),
        )

    def read(self, result: Result) -> Measures:
        """Largest contact force and impulse on the stop, and where the slider was."""
        force = result.signals["B.contact_force"]
        return {
            "force": np.array([force.max()]),
            "impulse": np.array([np.trapezoid(force, result.time)]),
            "path": result.at("B.x", SAMPLES * self.duration, outside=np.nan),
        }


MESHES: dict[str, dict[str, int]] = {"strut": {}, "beam": {"elements": 8}, "cable": {"elements": 12}}


def struck(
    family: str, name: str, corner: Corner, kind: str, mesh: Mapping[str, int] | None = None, solver: Exudyn = DEFAULT
) -> Case:
    """Make a case of a slider-crank; its reference has 16 elements at least, twice as many as by default."""
    mesh = MESHES[kind] if mesh is None else mesh
    fine = {} if kind == "strut" else {"elements": 24 if kind == "cable" else 16}
    run = simulated(lambda: corner.mechanism(kind, **mesh), corner.duration, solver, corner.read)
    reference = finer(lambda: corner.mechanism(kind, **fine), corner.duration, EXACT, corner.read)
    return Case(family, f"{kind}, {name}", run, reference, {"path": LENGTH})


def corners(count: int) -> Iterator[tuple[str, Corner]]:
    """Spread over the whole range of all six; thickness, speed, stiffness and damping by their logarithm."""
    for u in qmc.Sobol(6, seed=11).random(count):
        corner = Corner(5e-5 * 20 ** u[0], 0.1 * 600 ** u[1], 1e3 * 1e5 ** u[2], 0.1 + 0.9 * u[3], 0.9 * u[4], 2e-3 * 250 ** u[5])
        yield f"h = {1e3 * corner.thickness:.2g} mm, {corner.speed:.2g} rad/s, {corner.stiffness:.1e} N/m", corner


SETTINGS = {
    **{f"{n} equal steps": Exudyn(Equal(n)) for n in (50, 200, 1000, 4000, 20000)},
    **{f"tolerance {x:g}": Exudyn(Controlled(x)) for x in (1.0, 1e-1, 1e-2, 1e-3, 1e-4)},
    **{f"no step below {x:g} s": Exudyn(Controlled(min_step=x)) for x in (1e-2, 1e-3, 1e-4)},
    **{f"contact in {n} steps": Exudyn(Controlled(contact_resolution=n)) for n in (1, 4)},
    "hardly damped integrator": Exudyn(spectral_radius=0.9999),
    "Newton stops early": Exudyn(newton_relative=1e-1, newton_absolute=10.0),
}
COARSE: dict[str, tuple[str, dict[str, int]]] = {
    **{f"{n} elements of 3 nodes": ("beam", {"elements": n}) for n in (1, 2, 3, 4)},
    **{f"{n} elements of 2 nodes": ("beam", {"elements": n, "nodes": 2}) for n in (1, 2, 4, 8)},
    **{f"{n} elements": ("cable", {"elements": n}) for n in (1, 2, 4)},
}
EDGES = {
    "thinnest and slowest": Corner(5e-5, 0.1, 1e5, 0.8, 0.0),
    "thickest and fastest": Corner(1e-3, 60.0, 1e8, 0.5, 0.9),
    "elastic and stiff": Corner(3e-4, 1.25, 1e8, 1.0, 0.0),
    "dead and soft": Corner(3e-4, 1.25, 1e3, 0.1, 0.9),
    "undamped": Corner(damping=0.0),
    "much bowed": Corner(bow=0.03),
}


def slider_cranks() -> Iterator[Case]:
    """Corners of the range, edges, solver settings and meshes."""
    for name, corner in corners(16):
        for kind in ("strut", "beam", "cable"):
            yield struck("slider-crank, range", name, corner, kind)
    for name, corner in EDGES.items():
        for kind in ("strut", "beam"):
            yield struck("slider-crank, range", name, corner, kind)
    for name, solver in SETTINGS.items():
        for kind in ("strut", "beam"):
            yield struck("slider-crank, steps", name, Corner(), kind, solver=solver)
    for name, (kind, mesh) in COARSE.items():
        yield struck("slider-crank, mesh", name, Corner(), kind, mesh)


# --- static strip -----------------------------------------------------------------------------------------------------

SHORTENINGS = {
    "from 1e-6": (1e-6, 1e-5, 1e-4), "to 0.3": (1e-3, 0.1, 0.3), "to 0.95": (0.01, 0.5, 0.95), "to 1.5": (0.1, 1.0, 1.5),
}  # fmt: skip
STRIPS: dict[str, Callable[[Section], Beam | Cable]] = {
    **{f"{n} elements of 3 nodes": lambda s, n=n: Beam(s, elements=n) for n in (1, 2, 4, 8)},  # type: ignore[misc]
    **{f"{n} elements of 2 nodes": lambda s, n=n: Beam(s, elements=n, nodes=2) for n in (4, 16)},  # type: ignore[misc]
    **{f"{n} cables": lambda s, n=n: Cable(s, elements=n) for n in (1, 4, 16)},  # type: ignore[misc]
}


def static_strips() -> Iterator[Case]:
    """Meshes and shortenings, and thicknesses, against the exact elastica."""
    cases = [(f"{mesh}, {name}", mesh, 3e-4, u) for mesh in STRIPS for name, u in SHORTENINGS.items()]
    cases += [(f"h = {1e3 * h:g} mm", "8 elements of 3 nodes", h, SHORTENINGS["to 0.95"]) for h in (1e-5, 5e-5, 2e-3, 5e-3)]
    for name, mesh, thickness, u in cases:
        yield Case("static strip", name, _pressed_still(mesh, thickness, u), lambda u=u: {"load": pinned.load(np.array(u))})  # type: ignore[misc]


def _pressed_still(mesh: str, thickness: float, u: tuple[float, ...]) -> Callable[[float], CaseOutcome]:
    def run(_timeout: float) -> CaseOutcome:
        states = pinned_strip(STRIPS[mesh](Section(STRIP_WIDTH, thickness)), LENGTH, u)
        return CaseOutcome(str(states.status), states.message, {"load": states.load})

    return run


# --- strip pressed in line --------------------------------------------------------------------------------------------


def pressed(body: Beam | Cable | Strut, share: float, duration: float) -> Mechanism:
    """A strip in line with its guide, its far end on a pin; the near end travels as t^3 to a share of the length."""
    return Mechanism(
        points={"A": (0, 0), "B": (LENGTH, 0)},
        links=[Link("strip", "A", "B", body)],
        joints=[Revolute("B", "ground", "strip")],
        guides=[Guide("A", "strip", mass=0.1)],
        drives=[
            Drive(
                "A",
                Motion(lambda t: share * LENGTH * (t / duration) ** 3, lambda t: 3 * share * LENGTH * t**2 / duration**3),
            )
        ],
    )


def pressed_strips() -> Iterator[Case]:
    """Straight, hardly bowed and bowed strips, pressed slowly: the elastica at the end."""
    section = Section(STRIP_WIDTH, 3e-4)
    wet = section.damped(0.5, LENGTH)
    bodies = {
        "straight": Beam(section), "straight cable": Cable(section), "straight strut": Strut(section),
        "bowed by 1e-9 of its length": Beam(wet, imperfection=1e-9 * LENGTH),
        "bowed by 1e-3": Beam(wet, imperfection=1e-3 * LENGTH), "bowed cable": Cable(wet, imperfection=1e-3 * LENGTH),
    }  # fmt: skip
    for share, duration in ((0.3, 10.0), (0.9, 10.0)):
        for name, body in bodies.items():
            run = simulated(lambda b=body, s=share, t=duration: pressed(b, s, t), duration, DEFAULT, _push)  # type: ignore[misc]
            right = section.euler_load(LENGTH) / pi**2 * float(pinned.load(share))
            yield Case("strip pressed in line", f"{name}, {share:g} L", run, lambda f=right: {"force": np.array([f])})  # type: ignore[misc]


def _push(result: Result) -> Measures:
    """Force of the drive at the end, the block's inertia taken off."""
    late = result.time > 0.999 * result.time[-1]
    inertia = 0.1 * np.gradient(result.signals["A.vx"], result.time)
    return {"force": np.array([np.mean((result.signals["drive.force"] - inertia)[late])])}


def every() -> Iterator[Case]:
    """All cases of this file."""
    yield from slider_cranks()
    yield from static_strips()
    yield from pressed_strips()
