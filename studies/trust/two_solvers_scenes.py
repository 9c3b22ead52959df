"""Mechanisms of the study of two solvers: the ready ones, published problems, and ones drawn at random from the grammar."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from math import pi
from typing import Any, NamedTuple

import numpy as np

from buckler.mbs import (
    Beam,
    Cable,
    Clearance,
    Drive,
    Force,
    Guide,
    GuideFriction,
    Link,
    Mass,
    Mechanism,
    Modal,
    Motor,
    Ramp,
    Revolute,
    Rigid,
    Section,
    Slider,
    Slot,
    Spring,
    Stop,
    Strut,
    Torque,
    TorsionSpring,
    Weld,
)
from buckler.mbs.functions import Expression
from buckler.mbs.laws import (
    AdamsFriction,
    Ambrosio,
    CarvalhoMartins,
    Coulomb,
    Flores,
    Hertz,
    HuntCrossley,
    Impact,
    KelvinVoigt,
    LuGre,
    NoFriction,
    Stribeck,
    Threlfall,
)
from buckler.mbs.library import BAR, PAPER, CrankRocker, crank_rocker, slider_crank
from buckler.mbs.modal import BarModes
from buckler.studies.kit.published import STRIP_WIDTH
from buckler.studies.trust import benchmark_problems as problems

Draw = np.random.Generator
WEIGHT = (0.0, -9.81)
PLAYED = 5e-3
"""Time of a run with clearance, s: its motion is one trajectory for so long."""
STOP = CarvalhoMartins(1e5, 0.5, exponent=1.0)
LIGHTEST_STRIP = Section(STRIP_WIDTH, 3e-4)
STRIP = Section(STRIP_WIDTH, 2e-3).damped(0.01, PAPER.coupler)


@dataclass(frozen=True)
class Drag:
    """A torque of (t, angle, speed) against the speed, N m s/rad."""

    rate: float

    def __call__(self, t: float, angle: float, speed: float) -> float:
        """Torque, N m."""
        return -self.rate * speed


@dataclass(frozen=True)
class Hardening:
    """The moment of a spring of (angle, rate) that grows with the cube, N m/rad, against its turn."""

    stiffness: float

    def __call__(self, angle: float, rate: float) -> float:
        """Moment, N m."""
        return self.stiffness * (angle + angle**3)


class Pair(NamedTuple):
    """A mechanism for both solvers: what it is called, and how long it runs, s."""

    name: str
    mechanism: Mechanism
    duration: float


def _play(point: str, pin: str, bush: str) -> Clearance:
    return Clearance(point, pin, bush, 5e-3, 1e-4, Impact(1e8, 1e3, 1e-4), AdamsFriction(0.3, 0.2))


def known() -> Iterator[Pair]:
    """The ready mechanisms and the published problems, over short times."""
    strut = slider_crank(Strut(LIGHTEST_STRIP), law=STOP, mass=0.3, speed=6.0)
    yield Pair("slider-crank, strut, stop", strut, 0.5)
    yield Pair("slider-crank, beam", slider_crank(Beam(STRIP), law=None, mass=0.3, speed=20.0), 0.2)
    cable = slider_crank(Cable(STRIP, imperfection=1e-3), law=None, mass=0.3, speed=20.0)
    yield Pair("slider-crank, cable", cable, 0.2)
    yield Pair("crank-rocker", crank_rocker(Rigid(BAR), speed=30.0), 0.2)
    yield Pair("Andrews", problems.andrews(), 0.01)
    yield Pair("crank-rocker, clearance", crank_rocker(Rigid(BAR), speed=30.0, play=_play), 0.01)
    yield Pair("crank-rocker, clearance, beam", crank_rocker(Beam(BAR), speed=30.0, play=_play), 0.01)
    yield Pair("four-bars", problems.four_bars(2), 1.0)
    yield Pair("Simeon", problems.simeon(), 0.02)
    yield Pair("double pendulum", problems.double_pendulum(), 1.0)
    yield Pair("Princeton", problems.princeton(8.896), 0.05)


def drawn(seed: int, k: int) -> Pair:
    """The k-th random mechanism of a seed; families take turns."""
    draw = np.random.default_rng([seed, k])
    name, make = list(FAMILIES.items())[k % len(FAMILIES)]
    mechanism, duration = make(draw)
    return Pair(f"{name} {seed}.{k}", mechanism, duration)


def _one(draw: Draw, *options: Any) -> Any:
    """One of them, alike."""
    return options[int(draw.integers(len(options)))]


def _bar(draw: Draw) -> Rigid:
    return Rigid(Section(draw.uniform(0.01, 0.03), draw.uniform(3e-3, 1e-2)))


def _solid(draw: Draw, length: float) -> Rigid:
    """A bar, or a body with its centre of mass aside."""
    if draw.random() < 0.5:
        return _bar(draw)
    mass, centre = draw.uniform(0.05, 0.5), (draw.uniform(0.2, 0.8) * length, draw.uniform(-0.3, 0.3) * length)
    return Rigid.of(mass=mass, inertia=draw.uniform(0.05, 0.1) * mass * length**2, centre=centre)


def _direction(draw: Draw) -> tuple[float, float]:
    """Of a line, less than 35 degrees off the x axis."""
    turn = draw.uniform(-0.6, 0.6)
    return (float(np.cos(turn)), float(np.sin(turn)))


def chain(draw: Draw) -> tuple[Mechanism, float]:
    """A chain of one to three pendulums with loads, masses and springs of any kind, let go."""
    count = int(draw.integers(1, 4))
    names = [f"bar{k}" for k in range(count)]
    turns = draw.uniform(-pi, pi, count)
    lengths = draw.uniform(0.1, 0.5, count)
    places = np.concatenate([[0j], np.cumsum(lengths * np.exp(1j * turns))])
    points = {f"P{k}": (float(z.real), float(z.imag)) for k, z in enumerate(places)}
    points["Q"] = (float(draw.uniform(0.5, 1.0)), float(draw.uniform(0.5, 1.0)))
    aside = places[-1] + draw.uniform(-0.1, 0.1) * 1j * np.exp(1j * turns[-1])
    points["R"] = (float(aside.real), float(aside.imag))
    last, tip = names[-1], "R"
    pulled: list[Any] = [
        Force(tip, (draw.uniform(-1, 1), draw.uniform(-1, 1)), follows=last if draw.random() < 0.5 else None),
        Spring(tip, "ground:Q", stiffness=draw.uniform(5, 100), damping=draw.uniform(0, 0.5), free_length=draw.uniform(0.1, 0.5)),
    ]
    wound = TorsionSpring(
        "ground", names[0], stiffness=draw.uniform(0.1, 1), damping=draw.uniform(0, 0.01), free_angle=draw.uniform(-1, 1)
    )
    pulled.append(Torque(last, _one(draw, draw.uniform(-0.05, 0.05), Drag(draw.uniform(1e-3, 1e-2)))))
    return Mechanism(
        points,
        [
            Link(name, f"P{k}", f"P{k + 1}", _solid(draw, lengths[k]), carries=("R",) if name == last else ())
            for k, name in enumerate(names)
        ],
        [Revolute(f"P{k}", names[k - 1] if k else "ground", name) for k, name in enumerate(names)],
        loads=[wound, *(load for load in pulled if draw.random() < 0.6)],
        masses=[Mass(tip, draw.uniform(0.05, 0.5), draw.uniform(0, 1e-4))] if draw.random() < 0.5 else [],
        velocities={names[0]: draw.uniform(-3, 3)} if draw.random() < 0.5 else {},
        gravity=WEIGHT,
    ), draw.uniform(0.2, 0.6)  # fmt: skip


def four_bar(draw: Draw) -> tuple[Mechanism, float]:
    """A crank-rocker of other lengths, its speed constant or a ramp, its rocker rigid or a strip."""
    lengths = CrankRocker(*(side * draw.uniform(0.93, 1.07) for side in CrankRocker()))
    strip = Section(STRIP_WIDTH, draw.uniform(1e-3, 3e-3)).damped(0.02, lengths.rocker)
    rocker = _one(draw, _bar(draw), Beam(strip), Cable(strip))
    fast = draw.uniform(5, 20)
    duration = draw.uniform(0.3, 0.8) * 2 * pi / fast
    speed = Ramp(0.0, fast, duration / 2) if draw.random() < 0.5 else fast
    return crank_rocker(rocker, speed=speed, lengths=lengths), duration


def slider(draw: Draw) -> tuple[Mechanism, float]:
    """A slider-crank without a stop whose coupler is rigid or a strip, damped and bowed."""
    strip = Section(STRIP_WIDTH, draw.uniform(1.5e-3, 3e-3)).damped(10 ** draw.uniform(-2, -1.5), PAPER.coupler)
    bow = draw.uniform(-1e-3, 1e-3)
    coupler = _one(draw, _bar(draw), Beam(strip, imperfection=bow), Cable(strip, imperfection=bow))
    fast = draw.uniform(5, 25)
    return slider_crank(coupler, law=None, mass=draw.uniform(0.1, 0.5), speed=fast), draw.uniform(0.3, 0.8) * 2 * pi / fast


def struck(draw: Draw) -> tuple[Mechanism, float]:
    """The slider-crank with a strut on its stop."""
    section = Section(STRIP_WIDTH, draw.uniform(2e-4, 4e-4))
    fast = draw.uniform(3, 8)
    return slider_crank(Strut(section), law=STOP, mass=draw.uniform(0.2, 0.5), speed=fast), 0.7 * 2 * pi / fast


def cantilever(draw: Draw) -> tuple[Mechanism, float]:
    """A clamped strip with a rigid arm welded or pinned to its tip, loaded there, heavy."""
    length, arm = draw.uniform(0.2, 0.4), draw.uniform(0.05, 0.15)
    turn = draw.uniform(-pi / 2, pi / 2)
    points = {"A": (0.0, 0.0), "B": (length, 0.0), "C": (length + arm * np.cos(turn), arm * np.sin(turn))}
    joint = Weld if draw.random() < 0.5 else Revolute
    kind = Beam if draw.random() < 0.5 else Cable
    strip = kind(Section(STRIP_WIDTH, draw.uniform(1e-3, 2e-3)).damped(0.02, length))
    return Mechanism(
        points,
        [Link("strip", "A", "B", strip), Link("arm", "B", "C", _bar(draw))],
        [Weld("A", "ground", "strip"), joint("B", "strip", "arm")],
        loads=[Force("C", (draw.uniform(-1, 1), draw.uniform(-2, 0)))],
        gravity=WEIGHT,
    ), draw.uniform(0.1, 0.3)


def guided(draw: Draw) -> tuple[Mechanism, float]:
    """A driven bar with a block on a line, or a falling one with a block on an inclined line, pulled by a spring."""
    length, turn = draw.uniform(0.2, 0.5), draw.uniform(0.3, 1.2)
    points = {"A": (0.0, 0.0), "B": (length * np.cos(turn), length * np.sin(turn)), "C": (2 * length, 0.0)}
    driven = draw.random() < 0.5
    return Mechanism(
        points,
        [Link("crank", "A", "B", _bar(draw)), Link("rod", "B", "C", _bar(draw))],
        [Revolute("A", "ground", "crank"), Revolute("B", "crank", "rod")],
        guides=[Guide("C", "rod", along=(1.0, 0.0) if driven else _direction(draw), mass=draw.uniform(0.1, 0.5))],
        loads=[Spring("C", "ground:A", stiffness=draw.uniform(10, 200), damping=draw.uniform(0, 1))],
        drives=[Drive("crank", draw.uniform(2, 10))] if driven else [],
        gravity=WEIGHT,
    ), draw.uniform(0.1, 0.3)


def rattling(draw: Draw) -> tuple[Mechanism, float]:
    """A crank-rocker with clearance in some joints, of any law and friction, its rocker rigid or of modes."""
    play = _any_play(draw)
    some = "".join(joint for joint in "OABC" if draw.random() < 0.5) or "B"
    bar = Section(draw.uniform(5e-3, 2e-2), draw.uniform(5e-3, 2e-2))
    rocker = _one(draw, Rigid(bar), Modal(bar, BarModes(2, 1), draw.uniform(0.01, 0.05)))
    made = crank_rocker(rocker, speed=draw.uniform(10, 40), play=play, with_play=some, section=bar, angle=draw.uniform(-pi, pi))
    return replace(made, gravity=WEIGHT if draw.random() < 0.5 else (0.0, 0.0)), PLAYED


def _any_play(draw: Draw) -> Callable[[str, str, str], Clearance]:
    """Joints with clearance of one law and friction."""
    stiff, gap = 10 ** draw.uniform(7.5, 9), 10 ** draw.uniform(-4.3, -3.5)
    law = _one(draw, Impact(stiff, draw.uniform(100, 2e3), 1e-5), Flores(stiff, draw.uniform(0.3, 0.9)), Hertz(stiff))
    rough = draw.uniform(0.05, 0.3)
    friction = _one(
        draw, AdamsFriction(1.5 * rough, rough), Coulomb(rough, 0.05), NoFriction(), Ambrosio(rough, 0.01, 0.1),
        Threlfall(rough, 0.1), Stribeck(1.5 * rough, rough, 0.1), LuGre(1.5 * rough, rough, 0.1),
    )  # fmt: skip
    return lambda point, pin, bush: Clearance(point, pin, bush, 5e-3, gap, law, friction)


def sliding(draw: Draw) -> tuple[Mechanism, float]:
    """A swinging bar in whose slot or along which a block on a bar slides, pulled by a spring, turned by a motor or a torque."""
    length, turn = draw.uniform(0.2, 0.4), draw.uniform(-0.4, 0.4)
    end, slope = complex(length * np.exp(1j * draw.uniform(-1.0, 1.0))), 0.15 * np.exp(1j * (turn - pi / 2))
    bob = complex(0.6 * end + slope)
    points = {
        "O": (0.0, 0.0), "A": (end.real, end.imag), "B": (0.6 * end.real, 0.6 * end.imag), "C": (bob.real, bob.imag),
        "Q": (draw.uniform(0, 0.3), draw.uniform(-0.5, -0.3)),
    }  # fmt: skip
    joint = (Slot if draw.random() < 0.5 else Slider)("B", "bob", "arm", along=_direction(draw))
    push: Any = Motor("arm", voltage=draw.uniform(2, 12), resistance=2.0, constant=0.05, inertia=1e-5, gear=draw.uniform(1, 3))
    loads: list[Any] = [
        Spring("B", "ground:O", stiffness=draw.uniform(100, 500), damping=draw.uniform(0, 2), free_length=0.6 * length),
        Spring("C", "ground:Q", stiffness=draw.uniform(5, 50), free_length=0.1),
        TorsionSpring("arm", "bob", stiffness=draw.uniform(0.05, 0.5), damping=draw.uniform(0, 0.01)),
        push if draw.random() < 0.5 else Torque("arm", draw.uniform(-0.1, 0.1)),
    ]
    return Mechanism(
        points,
        [Link("arm", "O", "A", _bar(draw)), Link("bob", "B", "C", _bar(draw))],
        [Revolute("O", "ground", "arm"), joint],
        loads=[loads[0], *(load for load in loads[1:] if draw.random() < 0.6)],
        masses=[Mass("C", draw.uniform(0.02, 0.2), draw.uniform(0, 1e-5))] if draw.random() < 0.5 else [],
        gravity=WEIGHT,
    ), draw.uniform(0.1, 0.25)


def two_drives(draw: Draw) -> tuple[Mechanism, float]:
    """A five-bar turned by two drives, constant, ramped or swinging, its links rigid or one of modes."""
    low, fast = draw.uniform(0.08, 0.12), draw.uniform(3, 12)
    points = {"O": (0.0, 0.0), "A": (0.0, low), "P": (0.3, 0.0), "D": (0.3, low), "B": (0.15, low + draw.uniform(0.15, 0.2))}
    bar = Section(0.02, draw.uniform(4e-3, 8e-3))
    middle = _one(draw, _bar(draw), Modal(bar, BarModes(2, 1), 0.02))
    duration = draw.uniform(0.2, 0.5) / fast * 2
    swing = draw.uniform(0.1, 0.3)
    drives: list[Any] = [
        Drive("left", _one(draw, fast, Ramp(0.0, fast, duration / 2))),
        Drive("right", Expression(f"{swing * fast!r}*cos({fast!r}*t)")),
    ]
    return Mechanism(
        points,
        [
            Link("left", "O", "A", _bar(draw)), Link("right", "P", "D", _bar(draw)), Link("one", "A", "B", middle),
            Link("two", "D", "B", _bar(draw)),
        ],
        [
            Revolute("O", "ground", "left"), Revolute("P", "ground", "right"), Revolute("A", "left", "one"),
            Revolute("D", "right", "two"), Revolute("B", "one", "two"),
        ],
        loads=[Force("B", (draw.uniform(-2, 2), draw.uniform(-2, 2)))] if draw.random() < 0.5 else [],
        drives=drives,
        gravity=WEIGHT,
    ), duration  # fmt: skip


def rubbing(draw: Draw) -> tuple[Mechanism, float]:
    """A slider-crank of rigid links, driven or let go, whose guide rubs, by its own reaction or as given."""
    fast = draw.uniform(5, 20)
    made = slider_crank(_bar(draw), law=None, mass=draw.uniform(0.1, 0.5), speed=fast)
    guide = replace(
        made.guides[0], friction=Coulomb(draw.uniform(0.05, 0.4), 0.05) if draw.random() < 0.6 else GuideFriction(1.0)
    )
    if draw.random() < 0.6:
        made = replace(made, drives=[], velocities={"crank": fast}, loads=[Torque("crank", draw.uniform(-1, 1))])
    return replace(made, guides=[guide], gravity=WEIGHT), draw.uniform(0.2, 0.8) * 2 * pi / fast


def landing(draw: Draw) -> tuple[Mechanism, float]:
    """A pendulum, rigid or a clamped strip, let go or bent by a force, that lands with a point on a stop of the ground."""
    length = draw.uniform(0.2, 0.4)
    points = {"O": (0.0, 0.0), "A": (length, 0.0), "M": (0.6 * length, 0.0)}
    law = _one(draw, CarvalhoMartins(1e4, 0.6, exponent=1.0), KelvinVoigt(1e4, draw.uniform(5, 50)), HuntCrossley(1e5, 0.3))
    strip = draw.random() < 0.5
    section = Section(STRIP_WIDTH, draw.uniform(1.5e-3, 2.5e-3)).damped(0.02, length)
    link = (
        Link("bar", "O", "A", Beam(section), carries={"M": 0.6}) if strip else Link("bar", "O", "A", _bar(draw), carries=("M",))
    )
    stop = Stop("M", at=-draw.uniform(1e-3, 1e-2), law=law, along=(0.0, 1.0))
    return Mechanism(
        points, [link], [(Weld if strip else Revolute)("O", "ground", "bar")], stops=[stop],
        loads=[Force("A", (0.0, -draw.uniform(1, 10)))], gravity=WEIGHT,
    ), draw.uniform(0.1, 0.2)  # fmt: skip


def spinning(draw: Draw) -> tuple[Mechanism, float]:
    """A soft bowed link on a pin, a strip or one of modes, that starts with a spin; an arm welded to its tip is pushed; heavy."""
    length, turn, spin = draw.uniform(0.3, 0.5), draw.uniform(-pi, pi), _one(draw, -1, 1) * draw.uniform(5, 15)
    section = Section(STRIP_WIDTH, draw.uniform(1.5e-3, 3e-3))
    strip, bow = section.damped(0.02, length), draw.uniform(0.01, 0.02)
    body = _one(draw, Beam(strip, imperfection=bow), Cable(strip, imperfection=bow), Modal(section, BarModes(2, 1), 0.02))
    tip = complex(length * np.exp(1j * turn))
    end = complex(tip + 0.1 * np.exp(1j * (turn + draw.uniform(-1, 1))))
    return Mechanism(
        {"O": (0.0, 0.0), "A": (tip.real, tip.imag), "B": (end.real, end.imag)},
        [Link("link", "O", "A", body, carries={"M": 0.6} if body.meshed else {}), Link("arm", "A", "B", _bar(draw))],
        [Revolute("O", "ground", "link"), Weld("A", "link", "arm")],
        loads=[
            Force("B", (0.0, draw.uniform(0.2, 1.0)), follows="arm"),
            TorsionSpring("ground", "link", stiffness=0.0, law=Hardening(draw.uniform(0.1, 1.0)), free_angle=draw.uniform(-1, 1)),
        ],
        masses=[Mass("M" if body.meshed else "B", draw.uniform(0.02, 0.1))],
        velocities={"link": spin, "arm": spin},
        gravity=WEIGHT,
    ), draw.uniform(0.1, 0.3)


FAMILIES: dict[str, Callable[[Draw], tuple[Mechanism, float]]] = {
    "chain": chain,
    "four-bar": four_bar,
    "slider": slider,
    "struck": struck,
    "cantilever": cantilever,
    "guided": guided,
    "rattling": rattling,
    "sliding": sliding,
    "two drives": two_drives,
    "rubbing": rubbing,
    "landing": landing,
    "spinning": spinning,
}
