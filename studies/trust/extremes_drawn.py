"""Families of the study `extremes` that are drawn at random: where runs were found to be wrong, and the whole grammar.

Each takes a generator and gives a mechanism, how long it runs, and what a closed form of what is right needs, if it has one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import pi
from typing import Any, NamedTuple

import numpy as np

from buckler.elastica import pinned
from buckler.mbs import (
    Beam,
    Cable,
    Clearance,
    Drive,
    Force,
    Guide,
    GuideFriction,
    Link,
    Mechanism,
    Modal,
    Ramp,
    Revolute,
    Rigid,
    Section,
    Spring,
    Stop,
    Strut,
    crank_rocker,
    slider_crank,
)
from buckler.mbs.functions import Components, Expression, Table
from buckler.mbs.laws import AdamsFriction, CarvalhoMartins, Coulomb, Flores, Hertz, Impact, KelvinVoigt, NoFriction
from buckler.mbs.library import BAR, PAPER, CrankRocker
from buckler.studies.kit.published import STRIP_WIDTH
from buckler.studies.trust.two_solvers_scenes import FAMILIES as GRAMMAR

Draw = np.random.Generator
WEIGHT = (0.0, -9.81)
PLAYED = 0.01
"""Time of a run with clearance, s: its motion is one trajectory for so long."""


class Drawn(NamedTuple):
    """A mechanism, its duration, s, and what a closed form needs.

    That is the load, N, at the end of a push, or the angle, rad, and length, m, of a bar that swings.
    """

    mechanism: Mechanism
    duration: float
    load: float | None = None
    swing: tuple[float, float] | None = None


def _log(draw: Draw, low: float, high: float) -> float:
    return float(np.exp(draw.uniform(np.log(low), np.log(high))))


def _pick(draw: Draw, choices: Any) -> Any:
    return choices[int(draw.integers(len(choices)))]


def _strip(draw: Draw, length: float, thin: float = 3e-4, thick: float = 3e-3) -> Section:
    return Section(STRIP_WIDTH, _log(draw, thin, thick)).damped(_log(draw, 5e-3, 0.1), length)


def _body(draw: Draw, section: Section, bow: float = 0.0) -> Beam | Cable:
    if draw.random() < 0.6:
        return Beam(section, elements=int(draw.integers(3, 10)), imperfection=bow)
    return Cable(section, elements=int(draw.integers(6, 16)), imperfection=bow)


def _fast(draw: Draw) -> tuple[float, float]:
    """Speed of a crank, rad/s, and the time of half a turn to two, s."""
    speed = _log(draw, 2, 30)
    return speed, draw.uniform(0.5, 2.0) * 2 * pi / speed


def axial(draw: Draw) -> Drawn:
    """Strips as links of a turning linkage, whose axial force is asked for."""
    speed, duration = _fast(draw)
    if draw.random() < 0.5:
        body = _body(draw, _strip(draw, PAPER.coupler, 1e-3), draw.uniform(-1e-3, 1e-3))
        return Drawn(slider_crank(body, law=None, mass=draw.uniform(0.1, 0.5), speed=speed), duration)
    return Drawn(crank_rocker(_body(draw, _strip(draw, CrankRocker().rocker, 5e-4)), speed=speed), duration)


def pressed(draw: Draw) -> Drawn:
    """A straight strip, or a modal link, in line with its guide and pressed slowly: the elastica's load at the end."""
    length = PAPER.coupler
    section = Section(STRIP_WIDTH, _log(draw, 2e-4, 6e-4)).damped(0.5, length)
    critical = section.euler_load(length)
    strain = critical / section.axial_stiffness
    share, duration = strain * _log(draw, 20, 1e4), 10.0
    straight = draw.random() < 0.5
    body: Any = _pick(draw, [Beam(section), Cable(section), Modal(section, damping=0.5)])
    if not straight and body.meshed:
        body = replace(body, imperfection=1e-5 * length)  # little beside the deflection, so that the straight strip's load holds
    mechanism = Mechanism(
        points={"A": (0, 0), "B": (length, 0)},
        links=[Link("strip", "A", "B", body)],
        joints=[Revolute("B", "ground", "strip")],
        guides=[Guide("A", "strip", mass=0.1)],
        drives=[Drive("A", Expression(f"{3 * share * length / duration**3!r}*t**2"))],
    )
    return Drawn(mechanism, duration, critical / pi**2 * float(pinned.load(share - strain)))


def critical(draw: Draw) -> Drawn:
    """A bowed strip near its critical load, laid on slowly or suddenly."""
    length = draw.uniform(0.2, 0.4)
    section = _strip(draw, length, 3e-4, 1.5e-3)
    load = draw.uniform(0.4, 0.99) * section.euler_load(length)
    period = 2 * pi / section.first_frequency(length)
    duration = draw.uniform(2, 8) * period
    rise = _pick(draw, [0.0, 0.5]) * duration
    push = Components((Table((0.0, rise), (0.0, load)), 0.0)) if rise else (load, 0.0)
    return Drawn(
        Mechanism(
            points={"A": (0, 0), "B": (length, 0)},
            links=[Link("strip", "A", "B", _body(draw, section, _log(draw, 1e-4, 1e-2) * length))],
            joints=[Revolute("B", "ground", "strip")],
            guides=[Guide("A", "strip", mass=draw.uniform(0, 0.3))],
            loads=[Force("A", push)],
        ),
        duration,
    )


def kinks(draw: Draw) -> Drawn:
    """Drives with kinks and short ramps, of linkages that are determined and of ones that are not."""
    speed, duration = _fast(draw)
    if draw.random() < 0.5:
        motion: Any = Ramp(0.0, speed, _log(draw, 1e-3, 0.5) * duration)
    else:
        times = np.concatenate([[0.0], np.sort(draw.uniform(0.05, 0.9, 3))]) * duration
        motion = Table(tuple(times.tolist()), tuple((speed * draw.uniform(0.2, 1.0, 4)).tolist()))
    length = PAPER.coupler
    coupler: Any = _pick(
        draw, [Rigid(BAR), Strut(Section(STRIP_WIDTH, 3e-4)), _body(draw, _strip(draw, length, 1e-3), 1e-4 * length)]
    )
    if draw.random() < 0.5:
        return Drawn(slider_crank(coupler, law=None, mass=draw.uniform(0.1, 0.5), speed=motion), duration)
    return Drawn(crank_rocker(Rigid(BAR) if coupler.massless else coupler, speed=motion), duration)


def grazing(draw: Draw) -> Drawn:
    """A rigid slider that just reaches its stops, or a block thrown to and fro between two."""
    law = CarvalhoMartins(_log(draw, 1e4, 1e7), draw.uniform(0.2, 0.9), exponent=1.0)
    if draw.random() < 0.5:
        speed, duration = _fast(draw)
        face = -(PAPER.crank + PAPER.coupler) + _log(draw, 1e-6, 3e-3)
        stops = [Stop("B", face, law), Stop("B", face - 1e-5, law)][: int(draw.integers(1, 3))]
        linkage = slider_crank(Rigid(BAR), law=None, mass=draw.uniform(0.1, 0.5), speed=speed)
        return Drawn(replace(linkage, stops=stops), duration)
    pull = draw.uniform(1, 10)
    room, apart = draw.uniform(0.02, 0.1), _pick(draw, [0.0, 1e-5, 1e-3])
    faces = [Stop("A", room, law), Stop("B", 0.1 + room + apart, law)]
    return Drawn(
        Mechanism(
            points={"A": (0, 0), "B": (0.1, 0)},
            links=[Link("bar", "A", "B", Rigid(Section(1e-3, 1e-3)))],
            guides=[Guide("A", "bar", mass=draw.uniform(0.1, 1)), Guide("B", "bar")],
            stops=faces if draw.random() < 0.5 else faces[:1],
            gravity=(pull, 0.0),
        ),
        draw.uniform(1.5, 8) * (2 * room / pull) ** 0.5,
    )


def free(draw: Draw) -> Drawn:
    """A pendulum let go, for three to a hundred periods."""
    angle, length = draw.uniform(0.05, 2.8), draw.uniform(0.2, 0.6)
    mechanism = Mechanism(
        points={"O": (0, 0), "A": (float(length * np.sin(angle)), float(-length * np.cos(angle)))},
        links=[Link("bar", "O", "A", Rigid(Section(0.02, 0.01)))],
        joints=[Revolute("O", "ground", "bar")],
        gravity=WEIGHT,
    )
    duration = _log(draw, 3, 100) * 2 * pi * (2 * length / 3 / 9.81) ** 0.5
    return Drawn(mechanism, duration, swing=(float(angle), float(length)))


def struck(draw: Draw) -> Drawn:
    """The slider-crank with a strip on its stop."""
    speed = _log(draw, 1, 15)
    section = _strip(draw, PAPER.coupler, 2e-4, 8e-4)
    law = CarvalhoMartins(_log(draw, 1e4, 1e6), draw.uniform(0.2, 0.9), exponent=_pick(draw, [1.0, 1.5]))
    body = _body(draw, section, draw.choice([-1, 1]) * _log(draw, 1e-4, 1e-2) * PAPER.coupler)
    return Drawn(slider_crank(body, law=law, mass=draw.uniform(0.1, 0.5), speed=speed), 0.7 * 2 * pi / speed)


def _law(draw: Draw) -> Any:
    k = 8e9 * _log(draw, 0.03, 3)
    laws = [Impact(k, 253.0, 1e-5), Hertz(k), Flores(k, draw.uniform(0.3, 0.9)), KelvinVoigt(1e7, draw.uniform(0, 500))]
    return _pick(draw, laws)


def _play(draw: Draw) -> Any:
    gap, law = _log(draw, 2e-5, 1e-3), _law(draw)
    friction = _pick(draw, [NoFriction(), Coulomb(0.2, 1e-2), AdamsFriction(0.3, 0.1, 0.1, 1.0)])
    return lambda point, first, second: Clearance(point, first, second, 5e-3, gap, law, friction)


def clearance(draw: Draw) -> Drawn:
    """A four-bar of rigid bars with clearance in one joint to all of them."""
    speed = _log(draw, 5, 60)
    joints = "".join(joint for joint in "OABC" if draw.random() < 0.6) or "B"
    play = _play(draw)
    made = crank_rocker(Rigid(BAR), speed=speed, play=play, with_play=joints, angle=draw.uniform(0.3, 6))
    return Drawn(made, PLAYED * 10 * pi / max(speed, 10 * pi))


def strut(draw: Draw) -> Drawn:
    """A strut in a slider-crank, with or without a stop and friction, or in a four-bar."""
    speed, duration = _fast(draw)
    body = Strut(Section(STRIP_WIDTH, _log(draw, 2e-4, 1e-3)))
    if draw.random() < 0.3:
        return Drawn(crank_rocker(body, speed=speed), 0.5 * duration)
    dynamic = draw.uniform(0, 1)
    friction = GuideFriction(dynamic, dynamic * draw.uniform(1, 1.5)) if draw.random() < 0.5 else None
    law = CarvalhoMartins(_log(draw, 1e4, 1e6), draw.uniform(0.3, 0.9), exponent=1.0) if draw.random() < 0.6 else None
    return Drawn(slider_crank(body, law=law, mass=draw.uniform(0.1, 0.5), speed=speed / 3, friction=friction), duration)


def shaken(draw: Draw) -> Drawn:
    """A drive that oscillates faster than default steps."""
    frequency, turns = _log(draw, 5, 300), int(draw.integers(20, 200))
    swing = draw.uniform(0.02, 0.3)
    motion: Any = Expression(f"{swing * 2 * pi * frequency!r}*cos({2 * pi * frequency!r}*t)")
    coupler: Any = _pick(draw, [Rigid(BAR), _body(draw, _strip(draw, PAPER.coupler, 2e-3))])
    return Drawn(slider_crank(coupler, law=None, mass=draw.uniform(0.1, 0.5), speed=motion), turns / frequency)


def mixed(draw: Draw) -> Drawn:
    """Two flexible links, clearance beside a stop, flexible links with clearance."""
    speed, duration = _fast(draw)
    kind = int(draw.integers(3))
    lengths = CrankRocker()
    if kind == 0:
        made = crank_rocker(_body(draw, _strip(draw, lengths.rocker, 1e-3)), speed=speed)
        links = [
            replace(link, body=_body(draw, _strip(draw, lengths.coupler, 1e-3))) if link.name == "coupler" else link
            for link in made.links
        ]
        return Drawn(replace(made, links=links), 0.5 * duration)
    play = _play(draw)
    if kind == 1:
        rocker = _body(draw, _strip(draw, lengths.rocker, 1e-3, 5e-3))
        return Drawn(crank_rocker(rocker, speed=10 * pi, play=play, with_play=_pick(draw, ["B", "BC", "OABC"])), PLAYED)
    law = CarvalhoMartins(_log(draw, 1e4, 1e6), draw.uniform(0.3, 0.9), exponent=1.0)
    near = PAPER.crank - PAPER.coupler - draw.uniform(5e-4, 3e-3)
    made = slider_crank(Rigid(BAR), law=law, mass=0.3, speed=draw.uniform(20, 60), stop=near)
    loose = [play("A", "crank", "coupler") if joint.point == "A" else joint for joint in made.joints]
    return Drawn(replace(made, joints=loose), PLAYED)


def sprung(draw: Draw) -> Drawn:
    """A block on a spring, thrown against stops that it meets once or many times."""
    stiffness, mass = _log(draw, 20, 2000), draw.uniform(0.1, 1)
    law = CarvalhoMartins(_log(draw, 1e4, 1e6), draw.uniform(0.2, 0.95), exponent=_pick(draw, [1.0, 1.5]))
    away = draw.uniform(0.02, 0.08)
    return Drawn(
        Mechanism(
            points={"A": (0, 0), "B": (0.1, 0), "F": (-0.3, 0)},
            links=[Link("bar", "A", "B", Rigid(Section(1e-3, 1e-3)))],
            guides=[Guide("A", "bar", mass=mass), Guide("B", "bar")],
            loads=[Spring("A", "ground:F", stiffness=stiffness, damping=draw.uniform(0, 0.5), free_length=0.3 + away)],
            stops=[Stop("A", draw.uniform(0.05, 1.9) * away, law)],
        ),
        draw.uniform(0.5, 6) * 2 * pi * (mass / stiffness) ** 0.5,
    )


def _of_the_grammar(make: Callable[[Draw], tuple[Mechanism, float]]) -> Callable[[Draw], Drawn]:
    return lambda draw: Drawn(*make(draw))


FAMILIES: dict[str, Callable[[Draw], Drawn]] = {
    "axial force": axial,
    "pressed straight": pressed,
    "near critical": critical,
    "kinks": kinks,
    "grazing": grazing,
    "bouncing": sprung,
    "free": free,
    "strip on a stop": struck,
    "clearance": clearance,
    "strut": strut,
    "shaken": shaken,
    "mixed": mixed,
    **{f"any {name}": _of_the_grammar(make) for name, make in GRAMMAR.items()},
}
"""What is drawn, by family; the last ones are those of the study of two solvers."""
