"""Grammar of random mechanisms for studies and tests.

    name, mechanism, duration = draw(seed=1, k=7, families=("kinks", "any chain"))

A family is a skeleton (linkage, chain, block, strip) with optional bodies, drives, clearances, stops, springs and loads.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from math import pi, sqrt
from typing import Any, NamedTuple

import numpy as np

from buckler import mbs
from buckler.mbs.elements.element import Body
from buckler.mbs.functions import Components, Expression, Table
from buckler.mbs.library import PAPER
from buckler.mbs.modal import BarModes

from . import drawn_linkages as parts
from .drawn_linkages import Dice, Made
from .published import GRAVITY, STRIP_WIDTH


class Draw(NamedTuple):
    """Mechanism with its name and the duration of its run [s]."""

    name: str
    mechanism: mbs.Mechanism
    duration: float


def draw(seed: int, k: int, families: Sequence[str] = (), among: Mapping[str, Callable[[Dice], Made]] | None = None) -> Draw:
    """Draw the k-th mechanism of a seed; families take turns, all of them where none is given."""
    every = among or FAMILIES
    family = families[k % len(families)] if families else tuple(every)[k % len(every)]
    return Draw(f"{family} {seed}.{k}", *every[family](Dice(seed, list(every).index(family), k)))


# --- chains and blocks -----------------------------------------------------------------------------------------------------


def _free(d: Dice) -> Made:
    """Draw a pendulum released for three to a hundred periods."""
    angle, length = d.uniform(0.05, 2.8), d.uniform(0.2, 0.6)
    points, bar = {"O": (0, 0), "A": parts.place(length * parts.ray(angle - pi / 2))}, mbs.Rigid(mbs.Section(0.02, 0.01))
    made = mbs.Mechanism(points, [mbs.Link("bar", "O", "A", bar)], parts.revolutes("O ground bar"), gravity=parts.WEIGHT)
    return made, d.log(3, 100) * 2 * pi * sqrt(2 * length / 3 / GRAVITY)


def _chain(d: Dice) -> Made:
    """Draw a released chain of one to three pendulums with loads, masses and springs."""
    count = int(d.integers(1, 4))
    names, lengths, turns = [f"bar{k}" for k in range(count)], d.uniform(0.1, 0.5, count), d.uniform(-pi, pi, count)
    ends = np.concatenate([[0j], np.cumsum(lengths * np.exp(1j * turns))])
    points = {f"P{k}": parts.place(complex(z)) for k, z in enumerate(ends)} | {"Q": tuple(d.uniform(0.5, 1.0, 2).tolist())}
    points["R"] = parts.place(ends[-1] + d.uniform(-0.1, 0.1) * 1j * parts.ray(turns[-1]))
    last, wound = names[-1], mbs.TorsionSpring("ground", "bar0", d.uniform(0.1, 1), d.uniform(0, 0.01), d.uniform(-1, 1))
    loads = d.some(
        mbs.Force("R", (d.uniform(-1, 1), d.uniform(-1, 1)), follows=d.one(last, None)),
        mbs.Spring("R", "ground:Q", stiffness=d.uniform(5, 100), damping=d.uniform(0, 0.5), free_length=d.uniform(0.1, 0.5)),
        mbs.Torque(last, d.one(d.uniform(-0.05, 0.05), Expression(f"-{d.uniform(1e-3, 1e-2)!r}*speed"))),
    )
    return mbs.Mechanism(
        points,
        [mbs.Link(x, f"P{k}", f"P{k + 1}", parts.solid(d, lengths[k]), ("R",) * (x == last)) for k, x in enumerate(names)],
        [mbs.Revolute(f"P{k}", names[k - 1] if k else "ground", name) for k, name in enumerate(names)],
        loads=[wound, *loads],
        masses=d.some(mbs.Mass("R", d.uniform(0.05, 0.5), d.uniform(0, 1e-4)), share=0.5),
        velocities={"bar0": d.uniform(-3, 3)} if d.chance() else {},
        gravity=parts.WEIGHT,
    ), d.uniform(0.2, 0.6)


def _block(d: Dice, **more: Any) -> mbs.Mechanism:
    """Make a block that slides along x."""
    points, bar = {"A": (0, 0), "B": (0.1, 0), "F": (-0.3, 0)}, mbs.Link("bar", "A", "B", mbs.Rigid(mbs.Section(1e-3, 1e-3)))
    return mbs.Mechanism(points, [bar], guides=[mbs.Guide("A", "bar", mass=d.uniform(0.1, 1)), mbs.Guide("B", "bar")], **more)


def _grazing(d: Dice) -> Made:
    """Draw a rigid slider that only just reaches its stops, or a block that moves to and fro between two."""
    law = parts.impact(d)
    if d.chance():
        made, duration = parts.turning(d, ("slider-crank",), ("rigid",))
        face = made.points["B"][0] - 2 * made.points["A"][0] + d.log(1e-6, 3e-3)  # just short of where it turns round
        return replace(made, stops=[mbs.Stop("B", face, law), mbs.Stop("B", face - 1e-5, law)][: d.integers(1, 3)]), duration
    pull, room, apart = d.uniform(1, 10), d.uniform(0.02, 0.1), d.one(0.0, 1e-5, 1e-3)
    faces = [mbs.Stop("A", room, law), mbs.Stop("B", 0.1 + room + apart, law)][: d.integers(1, 3)]
    return _block(d, stops=faces, gravity=(pull, 0.0)), d.uniform(1.5, 8) * sqrt(2 * room / pull)


def _bouncing(d: Dice) -> Made:
    """Draw a block on a spring that strikes a stop once or many times."""
    stiffness, away = d.log(20, 2000), d.uniform(0.02, 0.08)
    spring = mbs.Spring("A", "ground:F", stiffness=stiffness, damping=d.uniform(0, 0.5), free_length=0.3 + away)
    made = _block(d, loads=[spring], stops=[mbs.Stop("A", d.uniform(0.05, 1.9) * away, parts.impact(d))])
    return made, d.uniform(0.5, 6) * 2 * pi * sqrt(made.guides[0].mass / stiffness)


# --- strips ----------------------------------------------------------------------------------------------------------------


def _column(length: float, body: Body, mass: float, **more: Any) -> mbs.Mechanism:
    """Make a pinned column: its near end slides along its axis."""
    links, guides = [mbs.Link("strip", "A", "B", body)], [mbs.Guide("A", "strip", mass=mass)]
    return mbs.Mechanism({"A": (0, 0), "B": (length, 0)}, links, parts.revolutes("B ground strip"), guides, **more)


def make_pressed_column(body: Body, share: float, duration: float) -> mbs.Mechanism:
    """Make a column whose near end travels as t^3 to a share of its length."""
    return _column(
        PAPER.coupler, body, 0.1, drives=[mbs.Drive("A", Expression(f"{3 * share * PAPER.coupler / duration**3!r}*t**2"))]
    )


def _draw_pressed(d: Dice) -> Made:
    """Draw a strip or modal link compressed slowly far beyond its critical load."""
    length, duration = PAPER.coupler, 10.0
    section = mbs.Section(STRIP_WIDTH, d.log(2e-4, 6e-4)).damped(0.5, length)
    bow = d.one(0.0, 1e-5 * length)  # little beside the deflection, so that the straight strip's load holds
    body = d.one(mbs.Beam(section, imperfection=bow), mbs.Cable(section, imperfection=bow), mbs.Modal(section, damping=0.5))
    share = section.euler_load(length) / section.axial_stiffness * d.log(20, 1e4)
    return make_pressed_column(body, share, duration), duration


def _critical(d: Dice) -> Made:
    """Draw a bowed column under a load near the critical one, applied slowly or suddenly."""
    length = d.uniform(0.2, 0.4)
    body = parts.strip(d, length, 3e-4, 1.5e-3, bow=d.log(1e-4, 1e-2) * length)
    load = d.uniform(0.4, 0.99) * body.section.euler_load(length)
    duration = d.uniform(2, 8) * 2 * pi / body.section.first_frequency(length)
    push = d.one((load, 0.0), Components((Table((0.0, duration / 2), (0.0, load)), 0.0)))
    return _column(length, body, d.uniform(0, 0.3), loads=[mbs.Force("A", push)]), duration


def _cantilever(d: Dice) -> Made:
    """Draw a cantilever with a rigid arm at its tip, under a tip force, gravity and, if it is a beam, a line load."""
    length = d.uniform(0.2, 0.4)
    made = mbs.Mechanism(
        {"A": (0, 0), "B": (length, 0), "C": parts.place(length + d.uniform(0.05, 0.15) * parts.ray(d.uniform(-pi / 2, pi / 2)))},
        [mbs.Link("strip", "A", "B", parts.strip(d, length, 1e-3, 2e-3)), mbs.Link("arm", "B", "C", parts.bar(d))],
        [mbs.Weld("A", "ground", "strip"), d.one(mbs.Weld, mbs.Revolute)("B", "strip", "arm")],
        loads=[mbs.Force("C", (d.uniform(-1, 1), d.uniform(-2, 0)))],
        gravity=parts.WEIGHT,
    )
    duration = d.uniform(0.1, 0.3)
    if isinstance(made.links[0].body, mbs.Beam) and d.chance():
        along = mbs.LineLoad("strip", (d.uniform(-3, 3), d.uniform(-3, 3)), d.uniform(-0.05, 0.05), turns=d.one(True, False))
        made = replace(made, loads=[*made.loads, along])
    return made, duration


def _landing(d: Dice) -> Made:
    """Draw a rigid pendulum or a clamped strip that a force drives onto a stop."""
    length = d.uniform(0.2, 0.4)
    strip = mbs.Link("bar", "O", "A", parts.strip(d, length, 1.5e-3, 2.5e-3), carries={"M": 0.6}), mbs.Weld("O", "ground", "bar")
    rigid = mbs.Link("bar", "O", "A", parts.bar(d), carries=("M",)), mbs.Revolute("O", "ground", "bar")
    link, joint = d.one(strip, rigid)
    return mbs.Mechanism(
        {"O": (0, 0), "A": (length, 0), "M": (0.6 * length, 0)}, [link], [joint],
        stops=[mbs.Stop("M", at=-d.uniform(1e-3, 1e-2), law=parts.impact(d), along=(0.0, 1.0))],
        loads=[mbs.Force("A", (0.0, -d.uniform(1, 10)))], gravity=parts.WEIGHT,
    ), d.uniform(0.1, 0.2)  # fmt: skip


def _spinning(d: Dice) -> Made:
    """Draw a flexible link that starts with a spin, its welded arm under a force that follows it."""
    length, turn, spin = d.uniform(0.3, 0.5), d.uniform(-pi, pi), d.one(-1, 1) * d.uniform(5, 15)
    soft = mbs.Modal(mbs.Section(STRIP_WIDTH, d.uniform(1.5e-3, 3e-3)), BarModes(2, 1), 0.02)
    body = d.one(parts.strip(d, length, 1.5e-3, bow=d.uniform(0.01, 0.02)), soft)
    tip, hardening = length * parts.ray(turn), d.uniform(0.1, 1.0)
    return mbs.Mechanism(
        {"O": (0, 0), "A": parts.place(tip), "B": parts.place(tip + 0.1 * parts.ray(turn + d.uniform(-1, 1)))},
        [mbs.Link("link", "O", "A", body, carries={"M": 0.6} if body.meshed else {}), mbs.Link("arm", "A", "B", parts.bar(d))],
        [mbs.Revolute("O", "ground", "link"), mbs.Weld("A", "link", "arm")],
        loads=[
            mbs.Force("B", (0.0, d.uniform(0.2, 1.0)), follows="arm"),
            mbs.TorsionSpring("ground", "link", 0.0, law=Expression(f"{hardening!r}*(x + x**3)"), free_angle=d.uniform(-1, 1)),
        ],
        masses=[mbs.Mass("M" if body.meshed else "B", d.uniform(0.02, 0.1))],
        velocities={"link": spin, "arm": spin},
        gravity=parts.WEIGHT,
    ), d.uniform(0.1, 0.3)


def _draw_coupled(d: Dice) -> Made:
    """Draw two wheels coupled by a gear or belt, a rack that lifts a weight, and a rope to a counterweight."""
    apart, size, hang = d.uniform(0.1, 0.2), d.uniform(0.03, 0.05), d.uniform(0.2, 0.4)
    near, far = apart + size, apart + 2 * size
    points = {"A": (0, 0), "a": (0.02, 0), "B": (apart, 0), "b": (apart + 0.02, 0), "P": (near, 0.1), "Q": (far, 0.1)}
    points |= {"C": (near, -hang), "c": (near, -hang - 0.1), "D": (far, -hang), "d": (far, -hang - 0.1)}
    wheels = [("one", "A", d.log(1e-4, 1e-3)), ("two", "B", d.log(1e-4, 1e-3))]
    discs = [mbs.Rigid.of(mass=d.uniform(0.2, 1), inertia=inertia, centre=(0.0, 0.0)) for _, _, inertia in wheels]
    links = [mbs.Link(name, at, at.lower(), disc) for (name, at, _), disc in zip(wheels, discs, strict=True)]
    weights = [("weight", "C", d.uniform(0.1, 0.5)), ("counter", "D", d.uniform(0.3, 0.6))]
    links += [mbs.Link(name, at, at.lower(), mbs.Rigid.of(mass=mass, inertia=1e-3)) for name, at, mass in weights]
    joints = [*parts.revolutes("A ground one", "B ground two"), *(mbs.Slider(at, x, "ground", (0, 1)) for x, at, _ in weights)]
    belt = mbs.Belt("one:A", "two:B", size, d.uniform(0.5, 1.5) * size, crossed=d.one(True, False))
    soft = replace(belt, stiffness=d.log(1e3, 1e5), damping=d.uniform(0, 2))
    pair = d.one(mbs.Gear("one:A", "two:B", d.one(-1, 1) * d.uniform(0.6, 0.9)), belt, soft)
    return mbs.Mechanism(
        points, links, joints, loads=[mbs.Torque("one", d.uniform(-0.05, 0.05))], gravity=parts.WEIGHT,
        couplings=[pair, mbs.Rack("two:B", "weight:C", size, (0, 1)), mbs.Rope("C", "D", over=("P", "Q"))],
    ), d.uniform(0.05, 0.15)  # fmt: skip


SLIDER = ("slider-crank",)
FAMILIES: dict[str, Callable[[Dice], Made]] = {
    "axial force": partial(parts.turning, bodies=("strip",)),
    "pressed straight": _draw_pressed,
    "near critical": _critical,
    "kinks": partial(parts.turning, bodies=("rigid", "strut", "strip"), motions=("ramp", "table")),
    "grazing": _grazing,
    "bouncing": _bouncing,
    "free": _free,
    "strip on a stop": partial(parts.striking, bodies=("strip",)),
    "clearance": partial(parts.rattling, bodies=("rigid",)),
    "strut": parts.strut,
    "shaken": partial(parts.turning, kinds=SLIDER, motions=("swing",)),
    "mixed": parts.draw_mixed,
    "any chain": _chain,
    "any four-bar": partial(parts.turning, kinds=("four-bar",), motions=("constant", "ramp")),
    "any slider": partial(parts.turning, kinds=SLIDER),
    "any struck": partial(parts.striking, bodies=("strut",), rubs=0.0),
    "any cantilever": _cantilever,
    "any guided": parts.draw_guided,
    "any rattling": partial(parts.rattling, bodies=("rigid", "modal")),
    "any sliding": parts.sliding,
    "any two drives": parts.two_drives,
    "any rubbing": parts.rubbing,
    "any landing": _landing,
    "any spinning": _spinning,
    "any coupled": _draw_coupled,
    "smooth": partial(parts.turning, kinds=SLIDER, bodies=("strip",), most=0.3),
    "ramp": partial(parts.turning, kinds=SLIDER, bodies=("strip",), motions=("ramp",), most=0.3),
    "rigid": partial(parts.turning, kinds=SLIDER, bodies=("rigid",)),
    **{f"{name} clearance": partial(parts.rattling, bodies=(name,), joints="OABC") for name in ("rigid", "modal", "beam")},
}
"""Generator of each family. Those called `any` cover every element, joint and law that both solvers take."""
EVERYTHING = tuple(name for name in FAMILIES if name.startswith("any "))
"""Families of the whole grammar."""
