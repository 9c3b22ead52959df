"""Mechanisms of the study of two solvers: the ready ones, published problems, and ones drawn at random from the grammar."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from math import pi
from typing import NamedTuple

import numpy as np

from buckler.mbs import (
    Beam,
    Cable,
    Clearance,
    Drive,
    Force,
    Guide,
    Link,
    Mass,
    Mechanism,
    Ramp,
    Revolute,
    Rigid,
    Section,
    Spring,
    Strut,
    Torque,
    TorsionSpring,
    Weld,
)
from buckler.mbs.laws import AdamsFriction, CarvalhoMartins, Impact
from buckler.mbs.library import BAR, PAPER, CrankRocker, crank_rocker, slider_crank
from buckler.studies.kit.published import STRIP_WIDTH
from buckler.studies.trust import benchmark_problems as problems

Draw = np.random.Generator
WEIGHT = (0.0, -9.81)
STOP = CarvalhoMartins(1e5, 0.5, exponent=1.0)
LIGHTEST_STRIP = Section(STRIP_WIDTH, 3e-4)
STRIP = Section(STRIP_WIDTH, 2e-3).damped(0.01, PAPER.coupler)


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


def _bar(draw: Draw) -> Rigid:
    return Rigid(Section(draw.uniform(0.01, 0.03), draw.uniform(3e-3, 1e-2)))


def chain(draw: Draw) -> tuple[Mechanism, float]:
    """A chain of one to three pendulums with loads, masses and springs of any kind, let go."""
    count = int(draw.integers(1, 4))
    names = [f"bar{k}" for k in range(count)]
    turns = draw.uniform(-pi, pi, count)
    lengths = draw.uniform(0.1, 0.5, count)
    places = np.concatenate([[0j], np.cumsum(lengths * np.exp(1j * turns))])
    points = {f"P{k}": (float(z.real), float(z.imag)) for k, z in enumerate(places)}
    points["Q"] = (float(draw.uniform(0.5, 1.0)), float(draw.uniform(0.5, 1.0)))
    last, tip = names[-1], f"P{count}"
    loads = [
        Force(tip, (draw.uniform(-1, 1), draw.uniform(-1, 1)), follows=last if draw.random() < 0.5 else None),
        Spring(tip, "ground:Q", stiffness=draw.uniform(5, 100), damping=draw.uniform(0, 0.5), free_length=draw.uniform(0.1, 0.5)),
        TorsionSpring("ground", names[0], stiffness=draw.uniform(0.01, 1), damping=draw.uniform(0, 0.01)),
        Torque(last, draw.uniform(-0.05, 0.05)),
    ]
    return Mechanism(
        points,
        [Link(name, f"P{k}", f"P{k + 1}", _bar(draw)) for k, name in enumerate(names)],
        [Revolute(f"P{k}", names[k - 1] if k else "ground", name) for k, name in enumerate(names)],
        loads=[load for load in loads if draw.random() < 0.6],
        masses=[Mass(tip, draw.uniform(0.05, 0.5), draw.uniform(0, 1e-4))] if draw.random() < 0.5 else [],
        velocities={names[0]: draw.uniform(-3, 3)} if draw.random() < 0.5 else {},
        gravity=WEIGHT,
    ), draw.uniform(0.2, 0.6)  # fmt: skip


def four_bar(draw: Draw) -> tuple[Mechanism, float]:
    """A crank-rocker of other lengths, its speed constant or a ramp, its rocker rigid or a strip."""
    lengths = CrankRocker(*(side * draw.uniform(0.93, 1.07) for side in CrankRocker()))
    strip = Section(STRIP_WIDTH, draw.uniform(1e-3, 3e-3)).damped(0.02, lengths.rocker)
    rocker = [_bar(draw), Beam(strip), Cable(strip)][int(draw.integers(3))]
    fast = draw.uniform(5, 20)
    duration = draw.uniform(0.3, 0.8) * 2 * pi / fast
    speed = Ramp(0.0, fast, duration / 2) if draw.random() < 0.5 else fast
    return crank_rocker(rocker, speed=speed, lengths=lengths), duration


def slider(draw: Draw) -> tuple[Mechanism, float]:
    """A slider-crank without a stop whose coupler is rigid or a strip, damped and bowed."""
    strip = Section(STRIP_WIDTH, draw.uniform(1.5e-3, 3e-3)).damped(10 ** draw.uniform(-2, -1.5), PAPER.coupler)
    bow = draw.uniform(-1e-3, 1e-3)
    coupler = [_bar(draw), Beam(strip, imperfection=bow), Cable(strip, imperfection=bow)][int(draw.integers(3))]
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
    """A driven or falling bar with a block on an inclined line, pulled by a spring."""
    length, turn = draw.uniform(0.2, 0.5), draw.uniform(0.3, 1.2)
    points = {"A": (0.0, 0.0), "B": (length * np.cos(turn), length * np.sin(turn)), "C": (2 * length, 0.0)}
    return Mechanism(
        points,
        [Link("crank", "A", "B", _bar(draw)), Link("rod", "B", "C", _bar(draw))],
        [Revolute("A", "ground", "crank"), Revolute("B", "crank", "rod")],
        guides=[Guide("C", "rod", along=(1.0, 0.0), mass=draw.uniform(0.1, 0.5))],
        loads=[Spring("C", "ground:A", stiffness=draw.uniform(10, 200), damping=draw.uniform(0, 1))],
        drives=[Drive("crank", draw.uniform(2, 10))] if draw.random() < 0.5 else [],
        gravity=WEIGHT,
    ), draw.uniform(0.1, 0.3)


FAMILIES: dict[str, Callable[[Draw], tuple[Mechanism, float]]] = {
    "chain": chain,
    "four-bar": four_bar,
    "slider": slider,
    "struck": struck,
    "cantilever": cantilever,
    "guided": guided,
}
