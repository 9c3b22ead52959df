"""Cases of the study `extremes` with four-bars: ideal joints near and beyond dead centres, joints with play, flexible rockers."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from math import pi
from typing import Any

import numpy as np

from mbs import Beam, Clearance, Mechanism, Modal, Result, Rigid, Section
from mbs.laws import AdamsFriction, Coulomb, FrictionLaw, Hertz, HuntCrossley, Impact, KelvinVoigt, NoFriction, NormalLaw
from mbs.library import CrankRocker, crank_rocker
from mbs.reference import CLOSED, RATTLING, FourBar
from studies.clearance import STEEL
from studies.extremes_case import Case, Measures, finer, simulated

BARS = Section(0.005, 0.020, STEEL)
"""The paper's bars, 20 mm in the plane."""
SPEED = 10 * pi
"""Of the crank, rad/s."""
SAMPLES = np.linspace(0.02, 0.98, 49)
OFTEN = np.linspace(0.0, 1.0, 401)
"""Where what may last a few steps only is compared, of the run's length."""
PREDICTABLE = 0.010
"""Time, s, at the paper's speed for which a rattling mechanism's motion is one trajectory; a twentieth of a turn."""
ADAMS = AdamsFriction(static=0.3, dynamic=0.1)


# --- ideal joints -----------------------------------------------------------------------------------------------------


def ideal(name: str, lengths: CrankRocker, angle: float, turn: float, speed: float = SPEED, **solver: Any) -> Case:
    """Make a case of rigid bars and ideal joints, against loop closure; none is right where the crank cannot turn."""
    duration = turn / abs(speed)
    times = OFTEN * duration

    def read(result: Result) -> Measures:
        signals = {f"{link}.{what}": result.at(f"{link}.{what}", times) for link in ("coupler", "rocker") for what in ("x", "ax")}
        return {
            "place": np.stack([signals["coupler.x"], signals["rocker.x"]]),
            "acceleration": np.stack([signals["coupler.ax"], signals["rocker.ax"]]),
            "force": result.at("drive.torque", times),
        }

    def reference() -> Measures:
        bars = FourBar(*lengths, width=BARS.width, thickness=BARS.thickness, speed=speed, start=angle, gap=0)
        place, velocity, acceleration = bars.ideal(times)
        inertia = np.stack([bars.masses, bars.masses, bars.inertias], axis=-1)
        power = (inertia * velocity * acceleration).sum(axis=(1, 2))
        return {"place": place[:, 1:, 0].T, "acceleration": acceleration[:, 1:, 0].T, "force": power / speed}

    def mechanism() -> Mechanism:
        return crank_rocker(Rigid(BARS), speed=speed, section=BARS, lengths=lengths, angle=angle)

    run = simulated(mechanism, duration, solver, read)
    turns = _turns(lengths)
    return Case("four-bar, ideal joints", name, run, reference if turns else None, {"place": max(lengths)})


def _turns(lengths: CrankRocker) -> bool:
    """True if coupler and rocker reach each other at every crank angle."""
    low, high = abs(lengths.coupler - lengths.rocker), lengths.coupler + lengths.rocker
    return low < abs(lengths.frame - lengths.crank) and lengths.frame + lengths.crank < high


PAPER = CrankRocker()


def near_change_point(room: float) -> CrankRocker:
    """The paper's bars with a frame so short that at crank angle 0 coupler and rocker are in line but for this, m."""
    return PAPER._replace(frame=PAPER.crank + PAPER.coupler - PAPER.rocker + room)


def ideals() -> Iterator[Case]:
    """Dead centres near and met, linkages whose crank cannot turn, speeds and steps."""
    for room in (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-9):
        for angle in (0.5, -0.3):
            yield ideal(f"{room:g} m from a dead centre, from {angle:g} rad", near_change_point(room), angle, 2 * pi)
    square = CrankRocker(0.1, 0.2, 0.1, 0.2)
    yield ideal("parallelogram", square, 0.5, 2 * pi)
    yield ideal("parallelogram, from its dead centre", square, 0.0, 1.0)
    yield ideal("kite", CrankRocker(0.1, 0.2, 0.2, 0.1), 1.0, 2 * pi)
    for name, lengths in (
        ("crank too long", PAPER._replace(crank=0.15)),
        ("coupler too short", PAPER._replace(coupler=0.16)),
        ("coupler far too short", PAPER._replace(coupler=0.03)),
    ):
        for angle in (0.0, 0.5):
            yield ideal(f"{name}, from {angle:g} rad", lengths, angle, 2 * pi)
    for steps in (5, 20, 50, 200, 2000):
        yield ideal(f"{steps} equal steps", PAPER, 0.5, 2 * pi, uniform_steps=steps)
    for speed in (0.01, 1e3, 1e5):
        yield ideal(f"{speed:g} rad/s", PAPER, 0.5, 2 * pi, speed=speed)
    yield ideal("tolerance 1", PAPER, 0.5, 2 * pi, tolerance=1.0)
    yield ideal("tolerance 1, one step in all", PAPER, 0.5, 2 * pi, tolerance=1.0, max_step=1.0)


# --- joints with play -------------------------------------------------------------------------------------------------


class Plain:
    """A law that runs in plain Python: a short run is over before its law is compiled."""

    def __init__(self, law: Any) -> None:
        self.law = law
        self.stiffness, self.exponent = getattr(law, "stiffness", 0.0), getattr(law, "exponent", 1.0)

    def force(self, depth: Any, rate: Any, onset: Any) -> Any:
        """Force of the law, N."""
        return self.law.force(depth, rate, onset)

    def elastic(self, depth: Any) -> Any:
        """Elastic part of the law, N."""
        return self.law.elastic(depth)

    def potential(self, depth: Any) -> Any:
        """Its potential, J."""
        return self.law.potential(depth)


@dataclass(frozen=True)
class Play:
    """The paper's crank-rocker with play; `with_play` names its joints, `share` scales the time run."""

    gap: float = 2.5e-4
    law: NormalLaw = RATTLING
    friction: FrictionLaw = ADAMS
    with_play: str = "OABC"
    speed: float = SPEED
    gravity: bool = False
    share: float = 1.0
    rocker: Callable[[], Any] = field(default=lambda: Rigid(BARS))

    @property
    def duration(self) -> float:
        """Of the run, s."""
        return self.share * PREDICTABLE * SPEED / self.speed

    def mechanism(self) -> Mechanism:
        """For the engine."""
        law: Any = self.law if self.law in (RATTLING, CLOSED) else Plain(self.law)

        def clearance(point: str, first: str, second: str) -> Clearance:
            return Clearance(point, first, second, 5e-3, self.gap, law, self.friction)

        made = crank_rocker(
            self.rocker(), speed=self.speed, play=clearance, with_play=self.with_play, section=BARS, angle=0.5
        )  # fmt: skip
        return made

    def read(self, result: Result) -> Measures:
        """Places and speeds over the run, and the largest contact force."""
        times = SAMPLES * self.duration
        links = [f"{link}.{axis}" for link in ("coupler", "rocker") for axis in "xy"]
        speeds = [f"{link}.v{axis}" for link in ("coupler", "rocker") for axis in "xy"]
        forces = [result.signals[f"{p}.normal_force"] for p in self.with_play]
        return {
            "journal": np.stack([result.at(name, times) for name in links]),
            "speed": np.stack([result.at(name, times) for name in speeds]),
            "force": np.array([max(force.max() for force in forces)]),
            "impulse": np.array([max(np.trapezoid(force, result.time) for force in forces)]),
        }

    def reference(self) -> Measures | None:
        """The same from the compiled reference, which shares no code with the engine."""
        from mbs.reference import simulate

        bars = FourBar(
            width=BARS.width, thickness=BARS.thickness, density=STEEL.density, speed=self.speed, start=0.5,
            gap=tuple(self.gap if joint in self.with_play else 0.0 for joint in "OABC"),  # type: ignore[arg-type]
            law=self.law, friction=self.friction,
        )  # fmt: skip
        run = simulate(bars, self.duration, rtol=1e-9, atol=1e-10, samples=4901)
        if run.status not in ("OK", "TOO_DEEP"):
            return None
        rows = np.rint(SAMPLES * 4900).astype(int)
        normal = np.trapezoid(run.normal, run.time, axis=0)
        return {
            "journal": run.q[rows][:, [2, 3, 5, 6]].T,
            "speed": run.q_t[rows][:, [2, 3, 5, 6]].T,
            "force": np.array([run.peak_force.max()]),
            "impulse": np.array([normal.max()]),
        }

    def case(self, name: str, **solver: Any) -> Case:
        """Make a case of rigid bars, against the compiled reference."""
        run = simulated(self.mechanism, self.duration, solver, self.read)
        return Case("four-bar with play", name, run, self.reference, {"journal": self.gap})

    def flexible(self, name: str, fine: Callable[[], Any], **solver: Any) -> Case:
        """Make a case of a flexible rocker, against the engine with a finer rocker and steps a hundred times more exact."""
        run = simulated(self.mechanism, self.duration, solver, self.read)
        finely = Play(**{**self.__dict__, "rocker": fine})
        return Case("four-bar with play, flexible rocker", name, run, finer(finely.mechanism, self.duration, 1e-5, self.read),
                    {"journal": self.gap})  # fmt: skip


STIFFNESS = RATTLING.stiffness


def plays() -> Iterator[Case]:
    """Number of joints, play, stiffness, damping, friction, speed, laws, steps."""
    for joints in ("B", "BC", "ABC", "OABC"):
        for law, name in ((RATTLING, "rattling"), (CLOSED, "closed")):
            yield Play(with_play=joints, law=law).case(f"{joints}, {name}")
    for gap in (1e-6, 1e-5, 5e-5, 1e-3):
        for law, name in ((RATTLING, "rattling"), (CLOSED, "closed")):
            yield Play(gap, law).case(f"play {1e3 * gap:g} mm, {name}")
    for stiffness in (1e-4, 1e-2, 1e2):
        law = Impact(STIFFNESS * stiffness, 253.0 * stiffness**0.5, 1e-5)
        yield Play(law=law).case(f"{stiffness:g} times as stiff")
    for friction, name in ((NoFriction(), "no friction"), (Coulomb(0.9, 1e-3), "much friction")):
        yield Play(friction=friction).case(name)
    for speed in (0.1, 1.0, 100.0, 500.0):
        yield Play(speed=speed, share=0.25 if speed < 1 else 1.0).case(f"{speed:g} rad/s")
    for law in (Hertz(STIFFNESS), HuntCrossley(STIFFNESS, 0.3), KelvinVoigt(1e7, 0.0), KelvinVoigt(1e7, 300.0)):
        yield Play(law=law).case(f"{type(law).__name__}({', '.join(f'{x:.3g}' for x in vars(law).values())})")
    for law, name in ((RATTLING, "rattling"), (CLOSED, "closed")):
        for tolerance in (1e-5, 1e-1, 1.0, 100.0):
            yield Play(law=law).case(f"{name}, tolerance {tolerance:g}", tolerance=tolerance)
        for steps in (20, 100, 1000):
            yield Play(law=law).case(f"{name}, {steps} equal steps", uniform_steps=steps)
        yield Play(law=law).case(f"{name}, no step below 1e-5 s", min_step=1e-5, tolerance=1e-3)


def flexibles() -> Iterator[Case]:
    """Beams and modal links, meshes, laws, steps."""
    bodies: dict[str, Callable[[], Any]] = {
        **{f"beam of {n}": lambda n=n: Beam(BARS.damped(0.01, 0.175), elements=n) for n in (1, 2, 4)},  # type: ignore[misc]
        "thin beam": lambda: Beam(Section(0.02, 0.0005, STEEL).damped(0.01, 0.175), elements=8),
        "modal": lambda: Modal(BARS, damping=0.01),
    }
    fine: dict[str, Callable[[], Any]] = {
        "thin beam": lambda: Beam(Section(0.02, 0.0005, STEEL).damped(0.01, 0.175), elements=16),
        "modal": lambda: Modal(BARS, damping=0.01),
    }
    for name, body in bodies.items():
        for law, kind in ((RATTLING, "rattling"), (CLOSED, "closed")):
            best = fine.get(name, lambda: Beam(BARS.damped(0.01, 0.175), elements=8))
            yield Play(law=law, rocker=body, share=0.5).flexible(f"{name}, {kind}", best)
    for tolerance in (1e-1, 10.0):
        play = Play(rocker=bodies["beam of 4"], share=0.5)
        yield play.flexible(f"beam of 4, tolerance {tolerance:g}", lambda: Beam(BARS.damped(0.01, 0.175), elements=8),
                            tolerance=tolerance)  # fmt: skip


def every() -> Iterator[Case]:
    """All cases of this file."""
    yield from ideals()
    yield from plays()
    yield from flexibles()


