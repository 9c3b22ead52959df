"""Cases of the study `extremes` with clearance in the joints of a four-bar: clearance, laws, friction, speed, steps,
flexible rockers.

Rattling is chaotic: a motion is compared with its reference until a clearance a thousandth larger would make another one of it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from math import pi
from typing import Any

import numpy as np

from buckler.mbs import Beam, Cable, Clearance, Controlled, Equal, Exudyn, Mechanism, Modal, Result, Rigid, Section
from buckler.mbs.laws import AdamsFriction, Coulomb, FrictionLaw, Hertz, HuntCrossley, Impact, KelvinVoigt, NoFriction, NormalLaw
from buckler.mbs.library import CLOSED, RATTLING, crank_rocker
from buckler.studies.kit.published import STEEL
from buckler.studies.rattling.clearance import InPython
from buckler.studies.rattling.linkage import FourBar
from buckler.studies.trust.extremes_case import DEFAULT, KINDS, Case, Measures, finer, simulated
from buckler.studies.trust.extremes_linkages import BARS, SPEED

Array = np.ndarray[Any, Any]
START = 0.5
"""Angle of the crank at the start, rad."""
SAMPLES = np.linspace(0.02, 0.98, 49)
"""When motions are compared, of the run's length."""
DURATION = 0.010
"""Of a run at the paper's speed, s: a twentieth of a turn."""
KNOWN = 1e-3
"""How well the clearance is taken to be known, relative."""
ADAMS = AdamsFriction(static=0.3, dynamic=0.1)
STIFFNESS = RATTLING.stiffness
LAWS: dict[str, NormalLaw] = {"rattling": RATTLING, "closed": CLOSED}


@dataclass(frozen=True)
class Play:
    """The paper's crank-rocker with clearance; `with_play` names its joints, `share` scales the time run."""

    gap: float = 2.5e-4
    law: NormalLaw = RATTLING
    friction: FrictionLaw = ADAMS
    with_play: str = "OABC"
    speed: float = SPEED
    share: float = 1.0
    rocker: Callable[[], Any] = field(default=lambda: Rigid(BARS))

    @property
    def duration(self) -> float:
        """Of the run, s."""
        return self.share * DURATION * SPEED / self.speed

    def mechanism(self) -> Mechanism:
        """For the engine."""
        law: Any = (
            self.law if self.law in (RATTLING, CLOSED) else InPython(self.law)
        )  # a short run is over before its law is compiled

        def clearance(point: str, first: str, second: str) -> Clearance:
            return Clearance(point, first, second, 5e-3, self.gap, law, self.friction)

        return crank_rocker(
            self.rocker(), speed=self.speed, play=clearance, with_play=self.with_play, section=BARS, angle=START
        )  # fmt: skip

    def read(self, result: Result) -> Measures:
        """Places and speeds over the run, largest contact force and impulse."""
        times = SAMPLES * self.duration
        links = [f"{link}.{axis}" for link in ("coupler", "rocker") for axis in "xy"]
        speeds = [f"{link}.v{axis}" for link in ("coupler", "rocker") for axis in "xy"]
        normal = [result.signals[f"{p}.normal_force"] for p in self.with_play]
        along = [result.signals[f"{p}.friction_force"] for p in self.with_play]
        return {
            "journal": np.stack([result.at(name, times, outside=np.nan) for name in links]),
            "speed": np.stack([result.at(name, times, outside=np.nan) for name in speeds]),
            "force": np.array([max(np.hypot(n, t).max() for n, t in zip(normal, along, strict=True))]),
            "impulse": np.array([max(np.trapezoid(n, result.time) for n in normal)]),
        }

    def reference(self) -> Measures | None:
        """The same from the compiled solver, which shares none of the engine's equations, as long as motion is one trajectory."""
        right, other = self._compiled(1.0), self._compiled(1 + KNOWN)
        if right is None or other is None:
            return None
        apart = np.abs(right["journal"] - other["journal"]).max(axis=0) > KINDS["journal"].allowed * self.gap
        if not apart.any():
            return right
        until = int(np.argmax(apart))
        return {"journal": right["journal"][:, :until], "speed": right["speed"][:, :until]} if until else None

    def _compiled(self, factor: float) -> dict[str, Array] | None:
        from buckler.studies.rattling.turns import simulate

        bars = FourBar(
            width=BARS.width, thickness=BARS.thickness, density=STEEL.density, speed=self.speed, start=START,
            gap=tuple(factor * self.gap if joint in self.with_play else 0.0 for joint in "OABC"),  # type: ignore[arg-type]
            law=self.law, friction=self.friction,
        )  # fmt: skip
        run = simulate(bars, self.duration, tolerance=1e-9, samples=4901)
        rows, joints = np.rint(SAMPLES * 4900).astype(int), ["OABC".index(joint) for joint in self.with_play]
        if run.status not in ("OK", "SUSPECT"):  # a pin deeper than its clearance follows its law all the same
            return None
        return {
            "journal": run.q[rows][:, [2, 3, 5, 6]].T,
            "speed": run.q_t[rows][:, [2, 3, 5, 6]].T,
            "force": np.array([run.peak_force[:, joints].max()]),
            "impulse": np.array([np.trapezoid(run.normal[:, joints], run.time, axis=0).max()]),
        }

    def case(self, name: str, solver: Exudyn = DEFAULT) -> Case:
        """Make a case of rigid bars, against the compiled reference."""
        run = simulated(self.mechanism, self.duration, solver, self.read)
        return Case("four-bar with clearance", name, run, self.reference, {"journal": self.gap})

    def flexible(self, name: str, fine: Callable[[], Any], solver: Exudyn = DEFAULT) -> Case:
        """Make a case of a flexible rocker, against the engine with a finer rocker and steps a hundred times more exact."""
        run = simulated(self.mechanism, self.duration, solver, self.read)
        reference = finer(replace(self, rocker=fine).mechanism, self.duration, 1e-5, self.read)
        return Case("four-bar with clearance, flexible rocker", name, run, reference, {"journal": self.gap})


def plays() -> Iterator[Case]:
    """Number of joints, clearance, stiffness, damping, friction, speed, laws, steps."""
    for name, law in LAWS.items():
        for joints in ("B", "BC", "ABC", "OABC"):
            yield Play(with_play=joints, law=law).case(f"{joints}, {name}")
        for gap in (1e-6, 1e-5, 5e-5, 1e-3, 2e-3):
            yield Play(gap, law).case(f"clearance {1e3 * gap:g} mm, {name}")
        for rpm in (30, 3000):
            yield Play(law=law, speed=rpm * pi / 30, share=min(1.0, rpm / 120)).case(f"{rpm} r/min, {name}")
    for stiffness in (1e-4, 1e-2, 0.1, 10.0, 100.0):
        law = Impact(STIFFNESS * stiffness, 253.0 * stiffness**0.5, 1e-5)
        yield Play(law=law).case(f"{stiffness:g} times as stiff")
    frictions: dict[str, FrictionLaw] = {
        "no friction": NoFriction(), "much friction": Coulomb(0.9, 1e-3), "friction from 1e-4 m/s": Coulomb(0.3, 1e-4),
        "much friction from 1e-4 m/s": Coulomb(0.9, 1e-4), "stiction from 1e-3 m/s": AdamsFriction(0.9, 0.1, 1e-3, 1e-2),
    }  # fmt: skip
    for name, friction in frictions.items():
        yield Play(friction=friction).case(name)
    for speed in (0.1, 1.0, 100.0, 500.0):
        yield Play(speed=speed, share=0.25 if speed < 1 else 1.0).case(f"{speed:g} rad/s")
    others: tuple[NormalLaw, ...] = (
        Hertz(STIFFNESS), HuntCrossley(STIFFNESS, 0.3), KelvinVoigt(1e7, 0.0), KelvinVoigt(1e7, 300.0),
    )  # fmt: skip
    for law in others:
        yield Play(law=law).case(f"{type(law).__name__}({', '.join(f'{x:.3g}' for x in vars(law).values())})")
    for name, law in LAWS.items():
        for tolerance in (1e-5, 1e-1, 1.0, 100.0):
            yield Play(law=law).case(f"{name}, tolerance {tolerance:g}", Exudyn(Controlled(tolerance)))
        for steps in (20, 100, 1000):
            yield Play(law=law).case(f"{name}, {steps} equal steps", Exudyn(Equal(steps)))
        yield Play(law=law).case(f"{name}, no step below 1e-5 s", Exudyn(Controlled(1e-3, min_step=1e-5)))


def flexibles() -> Iterator[Case]:
    """Beams, cables and modal links, meshes, laws, steps."""
    wet, thin = BARS.damped(0.01, 0.175), Section(0.02, 0.0005, STEEL).damped(0.01, 0.175)

    def beam(count: int) -> Callable[[], Any]:
        return lambda: Beam(wet, elements=count)

    bodies: dict[str, tuple[Callable[[], Any], Callable[[], Any]]] = {
        **{f"beam of {n}": (beam(n), beam(8)) for n in (1, 2, 4)},
        **{f"cable of {n}": (lambda n=n: Cable(wet, elements=n), beam(8)) for n in (1, 4)},  # type: ignore[misc]
        "thin beam": (lambda: Beam(thin, elements=8), lambda: Beam(thin, elements=16)),
        "modal": (lambda: Modal(BARS, damping=0.01), lambda: Modal(BARS, damping=0.01)),
    }
    for name, (body, fine) in bodies.items():
        for kind, law in LAWS.items():
            yield Play(law=law, rocker=body, share=0.5).flexible(f"{name}, {kind}", fine)
    for tolerance in (1e-1, 10.0):
        play = Play(rocker=beam(4), share=0.5)
        yield play.flexible(f"beam of 4, tolerance {tolerance:g}", beam(8), Exudyn(Controlled(tolerance)))


def every() -> Iterator[Case]:
    """All cases of this file."""
    yield from plays()
    yield from flexibles()
