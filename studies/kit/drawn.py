"""Random mechanisms for studies and tests: `draw(seed=1, k=7, families=("kinks", "any chain"))`.

A family is a linkage, chain, block or strip with random bodies, drives, clearances, stops, springs and loads. Its generator
returns a mechanism and the duration of the run [s]. Numbers are in SI units. Points that are rotated or added are complex numbers
x + i y; `place` makes them pairs, and `ray(angle)` is exp(i angle). The ranges of draws are a free choice.
"""

from collections.abc import Mapping, Sequence
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
from .drawn_linkages import Dice, Generator, Run
from .published import GRAVITY, STRIP_WIDTH


class Draw(NamedTuple):
    """Random mechanism, its name, and the duration of its run [s]."""

    name: str
    mechanism: mbs.Mechanism
    duration: float


def draw(seed: int, k: int, families: Sequence[str] = (), generators: Mapping[str, Generator] | None = None) -> Draw:
    """Draw the k-th mechanism of a seed, from the families in turn; by default from all families of the generators."""
    generators = generators or FAMILIES
    family = families[k % len(families)] if families else tuple(generators)[k % len(generators)]
    dice = Dice(seed, list(generators).index(family), k)  # the index gives each family other random numbers
    return Draw(f"{family} {seed}.{k}", *generators[family](dice))


def _draw_free(dice: Dice) -> Run:
    """Draw a pendulum released for three to a hundred periods."""
    angle, length = dice.uniform(0.05, 2.8), dice.uniform(0.2, 0.6)
    points, bar = {"O": (0, 0), "A": parts.place(length * parts.ray(angle - pi / 2))}, mbs.Rigid(mbs.Section(0.02, 0.01))
    links, joints = [mbs.Link("bar", "O", "A", bar)], parts.make_revolutes("O ground bar")
    return mbs.Mechanism(points, links, joints, gravity=parts.WEIGHT), dice.log(3, 100) * 2 * pi * sqrt(2 * length / 3 / GRAVITY)


def _draw_chain(dice: Dice) -> Run:
    """Draw a released chain of one to three pendulums with loads, masses and springs."""
    count = int(dice.integers(1, 4))
    names, sizes, angles = [f"bar{k}" for k in range(count)], dice.uniform(0.1, 0.5, count), dice.uniform(-pi, pi, count)
    ends = np.concatenate([[0j], np.cumsum(sizes * np.exp(1j * angles))])
    points = {f"P{k}": parts.place(complex(z)) for k, z in enumerate(ends)} | {"Q": tuple(dice.uniform(0.5, 1.0, 2).tolist())}
    points["R"] = parts.place(ends[-1] + dice.uniform(-0.1, 0.1) * 1j * parts.ray(angles[-1]))
    stiffness, damping, angle = dice.uniform(0.1, 1), dice.uniform(0, 0.01), dice.uniform(-1, 1)
    coil = mbs.TorsionSpring("ground", "bar0", stiffness=stiffness, damping=damping, free_angle=angle)
    last = names[-1]
    loads = dice.some(
        mbs.Force("R", (dice.uniform(-1, 1), dice.uniform(-1, 1)), follows=dice.one(last, None)),
        mbs.Spring("R", "ground:Q", dice.uniform(5, 100), damping=dice.uniform(0, 0.5), free_length=dice.uniform(0.1, 0.5)),
        mbs.Torque(last, dice.one(dice.uniform(-0.05, 0.05), Expression(f"-{dice.uniform(1e-3, 1e-2)!r}*speed"))),
    )
    links = [mbs.Link(name, f"P{k}", f"P{k + 1}", parts.draw_solid(dice, sizes[k])) for k, name in enumerate(names)]
    links[-1] = replace(links[-1], carries=("R",))
    joints = [mbs.Revolute(f"P{k}", names[k - 1] if k else "ground", name) for k, name in enumerate(names)]
    masses = dice.some(mbs.Mass("R", dice.uniform(0.05, 0.5), dice.uniform(0, 1e-4)), share=0.5)
    speeds = {"bar0": dice.uniform(-3, 3)} if dice.chance() else {}
    chain = mbs.Mechanism(points, links, joints, loads=[coil, *loads], masses=masses, velocities=speeds, gravity=parts.WEIGHT)
    return chain, dice.uniform(0.2, 0.6)


def _make_block(dice: Dice, **more: Any) -> mbs.Mechanism:
    """Make a block that slides in two guides: a bar of negligible mass, the mass in the guide of A. F is 0.3 m left of A."""
    points, bar = {"A": (0, 0), "B": (0.1, 0), "F": (-0.3, 0)}, mbs.Link("bar", "A", "B", mbs.Rigid(mbs.Section(1e-3, 1e-3)))
    return mbs.Mechanism(points, [bar], guides=[mbs.Guide("A", "bar", mass=dice.uniform(0.1, 1)), mbs.Guide("B", "bar")], **more)


def _draw_grazing(dice: Dice) -> Run:
    """Draw a rigid slider that just reaches its stops, or a block that falls on one or two stops."""
    law = parts.draw_law(dice)
    if dice.chance():
        mechanism, duration = parts.draw_turning(dice, ("slider-crank",), ("rigid",))
        pin_x, slider_x = mechanism.points["A"][0], mechanism.points["B"][0]  # at crank angle 0: pin_x is the crank's length
        turning_point = slider_x - 2 * pin_x  # least x of the slider, at crank angle pi
        face = turning_point + dice.log(1e-6, 3e-3)
        # B starts at larger x, so a stop acts on that side. The second face gives another onset soon after the first.
        stops = [mbs.Stop("B", face, law), mbs.Stop("B", face - 1e-5, law)][: dice.integers(1, 3)]
        return replace(mechanism, stops=stops), duration
    pull, height, offset = dice.uniform(1, 10), dice.uniform(0.02, 0.1), dice.one(0.0, 1e-5, 1e-3)
    faces = [mbs.Stop("A", height, law), mbs.Stop("B", 0.1 + height + offset, law)][: dice.integers(1, 3)]
    return _make_block(dice, stops=faces, gravity=(pull, 0.0)), dice.uniform(1.5, 8) * sqrt(2 * height / pull)


def _draw_bouncing(dice: Dice) -> Run:
    """Draw a block on a spring that strikes a stop once or many times."""
    stiffness, stretch = dice.log(20, 2000), dice.uniform(0.02, 0.08)
    # the spring is compressed by `stretch` at first: F, its fixed end, is 0.3 m from A
    spring = mbs.Spring("A", "ground:F", stiffness=stiffness, damping=dice.uniform(0, 0.5), free_length=0.3 + stretch)
    block = _make_block(dice, loads=[spring], stops=[mbs.Stop("A", dice.uniform(0.05, 1.9) * stretch, parts.draw_law(dice))])
    return block, dice.uniform(0.5, 6) * 2 * pi * sqrt(block.guides[0].mass / stiffness)


def _make_column(length: float, body: Body, mass: float, **more: Any) -> mbs.Mechanism:
    """Make a pinned column whose end A slides along its axis."""
    links, guides = [mbs.Link("strip", "A", "B", body)], [mbs.Guide("A", "strip", mass=mass)]
    return mbs.Mechanism({"A": (0, 0), "B": (length, 0)}, links, parts.make_revolutes("B ground strip"), guides, **more)


def make_pressed_column(body: Body, share: float, duration: float) -> mbs.Mechanism:
    """Make a column whose end A is pushed in as t^3, at the end of the run by `share` of the length."""
    speed = Expression(f"{3 * share * PAPER.coupler / duration**3!r}*t**2")
    return _make_column(PAPER.coupler, body, mass=0.1, drives=[mbs.Drive("A", speed)])


def _draw_pressed(dice: Dice) -> Run:
    """Draw a strip or modal link that is shortened slowly, by 20 to 1e4 times its compression at the buckling load."""
    length, duration = PAPER.coupler, 10.0
    section = mbs.Section(STRIP_WIDTH, dice.log(2e-4, 6e-4)).damped(ratio=0.5, length=length)
    bow = dice.one(0.0, 1e-5 * length)  # small compared with the deflection, so that the load is that of a straight strip
    body = dice.one(mbs.Beam(section, imperfection=bow), mbs.Cable(section, imperfection=bow), mbs.Modal(section, damping=0.5))
    share = section.euler_load(length) / section.axial_stiffness * dice.log(20, 1e4)
    return make_pressed_column(body, share, duration), duration


def _draw_critical(dice: Dice) -> Run:
    """Draw a bowed column under 0.4 to 0.99 of its buckling load, applied slowly or suddenly."""
    length = dice.uniform(0.2, 0.4)
    body = parts.draw_strip(dice, length, thin=3e-4, thick=1.5e-3, bow=dice.log(1e-4, 1e-2) * length)
    load = dice.uniform(0.4, 0.99) * body.section.euler_load(length)
    duration = dice.uniform(2, 8) * 2 * pi / body.section.first_frequency(length)
    push = dice.one((load, 0.0), Components((Table((0.0, duration / 2), (0.0, load)), 0.0)))
    return _make_column(length, body, dice.uniform(0, 0.3), loads=[mbs.Force("A", push)]), duration


def _draw_cantilever(dice: Dice) -> Run:
    """Draw a cantilever with a rigid arm at its tip, under a tip force, gravity and, if it is a beam, a line load."""
    length = dice.uniform(0.2, 0.4)
    end = parts.place(length + dice.uniform(0.05, 0.15) * parts.ray(dice.uniform(-pi / 2, pi / 2)))
    strip, arm = parts.draw_strip(dice, length, thin=1e-3, thick=2e-3), parts.draw_bar(dice)
    mechanism = mbs.Mechanism(
        {"A": (0, 0), "B": (length, 0), "C": end}, [mbs.Link("strip", "A", "B", strip), mbs.Link("arm", "B", "C", arm)],
        [mbs.Weld("A", "ground", "strip"), dice.one(mbs.Weld, mbs.Revolute)("B", "strip", "arm")],
        loads=[mbs.Force("C", (dice.uniform(-1, 1), dice.uniform(-2, 0)))], gravity=parts.WEIGHT,
    )  # fmt: skip
    duration = dice.uniform(0.1, 0.3)
    if isinstance(mechanism.links[0].body, mbs.Beam) and dice.chance():
        force, torque = (dice.uniform(-3, 3), dice.uniform(-3, 3)), dice.uniform(-0.05, 0.05)  # [N/m], [N]
        line_load = mbs.LineLoad("strip", force, torque, turns=dice.one(True, False))
        mechanism = replace(mechanism, loads=[*mechanism.loads, line_load])
    return mechanism, duration


def _draw_landing(dice: Dice) -> Run:
    """Draw a rigid pendulum or a clamped strip that a force drives onto a stop."""
    length = dice.uniform(0.2, 0.4)
    body = parts.draw_strip(dice, length, thin=1.5e-3, thick=2.5e-3)
    strip = mbs.Link("bar", "O", "A", body, carries={"M": 0.6})  # M at 60 % of it
    bar = mbs.Link("bar", "O", "A", parts.draw_bar(dice), carries=("M",))
    link, joint = dice.one((strip, mbs.Weld), (bar, mbs.Revolute))
    return mbs.Mechanism(
        {"O": (0, 0), "A": (length, 0), "M": (0.6 * length, 0)}, [link], [joint("O", "ground", "bar")],
        stops=[mbs.Stop("M", at=-dice.uniform(1e-3, 1e-2), law=parts.draw_law(dice), along=(0.0, 1.0))],
        loads=[mbs.Force("A", (0.0, -dice.uniform(1, 10)))], gravity=parts.WEIGHT,
    ), dice.uniform(0.1, 0.2)  # fmt: skip


def _draw_spinning(dice: Dice) -> Run:
    """Draw a flexible link that starts with a spin, its welded arm under a force that follows it."""
    length, turn, spin = dice.uniform(0.3, 0.5), dice.uniform(-pi, pi), dice.one(-1, 1) * dice.uniform(5, 15)
    soft = mbs.Modal(mbs.Section(STRIP_WIDTH, dice.uniform(1.5e-3, 3e-3)), BarModes(bending=2, axial=1), damping=0.02)
    body = dice.one(parts.draw_strip(dice, length, thin=1.5e-3, bow=dice.uniform(0.01, 0.02)), soft)
    tip, stiffness = length * parts.ray(turn), dice.uniform(0.1, 1.0)
    cubic = Expression(f"{stiffness!r}*(x + x**3)")  # torque over angle, in place of a stiffness
    inner = {"M": 0.6} if body.meshed else {}  # modes carry no point between the ends
    return mbs.Mechanism(
        {"O": (0, 0), "A": parts.place(tip), "B": parts.place(tip + 0.1 * parts.ray(turn + dice.uniform(-1, 1)))},
        [mbs.Link("link", "O", "A", body, carries=inner), mbs.Link("arm", "A", "B", parts.draw_bar(dice))],
        [mbs.Revolute("O", "ground", "link"), mbs.Weld("A", "link", "arm")],
        loads=[
            mbs.Force("B", (0.0, dice.uniform(0.2, 1.0)), follows="arm"),
            mbs.TorsionSpring("ground", "link", stiffness=0.0, law=cubic, free_angle=dice.uniform(-1, 1)),
        ],
        masses=[mbs.Mass("M" if body.meshed else "B", dice.uniform(0.02, 0.1))],
        velocities={"link": spin, "arm": spin}, gravity=parts.WEIGHT,
    ), dice.uniform(0.1, 0.3)  # fmt: skip


def _draw_coupled(dice: Dice) -> Run:
    """Draw two wheels coupled by a gear or belt, a rack that lifts a weight, and a rope to a counterweight."""
    distance, radius, depth = dice.uniform(0.1, 0.2), dice.uniform(0.03, 0.05), dice.uniform(0.2, 0.4)
    left, right = distance + radius, distance + 2 * radius  # x of the weight and the counterweight
    points = {"A": (0, 0), "a": (0.02, 0), "B": (distance, 0), "b": (distance + 0.02, 0), "P": (left, 0.1), "Q": (right, 0.1)}
    points |= {"C": (left, -depth), "c": (left, -depth - 0.1), "D": (right, -depth), "d": (right, -depth - 0.1)}
    wheels = [("one", "A", dice.log(1e-4, 1e-3)), ("two", "B", dice.log(1e-4, 1e-3))]
    discs = [mbs.Rigid.of(mass=dice.uniform(0.2, 1), inertia=inertia, centre=(0.0, 0.0)) for _, _, inertia in wheels]
    # A link from a point such as A ends at the point with its small letter, a.
    links = [mbs.Link(name, at, at.lower(), disc) for (name, at, _), disc in zip(wheels, discs, strict=True)]
    weights = [("weight", "C", dice.uniform(0.1, 0.5)), ("counter", "D", dice.uniform(0.3, 0.6))]
    links += [mbs.Link(name, at, at.lower(), mbs.Rigid.of(mass=mass, inertia=1e-3)) for name, at, mass in weights]
    joints: list[Any] = [*parts.make_revolutes("A ground one", "B ground two")]
    joints += [mbs.Slider(at, name, "ground", (0, 1)) for name, at, _ in weights]
    belt = mbs.Belt("one:A", "two:B", radius, dice.uniform(0.5, 1.5) * radius, crossed=dice.one(True, False))
    pair = dice.one(mbs.Gear("one:A", "two:B", dice.one(-1, 1) * dice.uniform(0.6, 0.9)), belt)
    return mbs.Mechanism(
        points, links, joints, loads=[mbs.Torque("one", dice.uniform(-0.05, 0.05))], gravity=parts.WEIGHT,
        couplings=[pair, mbs.Rack("two:B", "weight:C", radius, (0, 1)), mbs.Rope("C", "D", over=("P", "Q"))],
    ), dice.uniform(0.05, 0.15)  # fmt: skip


SLIDER = ("slider-crank",)
FAMILIES: dict[str, Generator] = {
    "axial force": partial(parts.draw_turning, bodies=("strip",)),  # inertia presses the strip along its axis
    "pressed straight": _draw_pressed,
    "near critical": _draw_critical,
    "kinks": partial(parts.draw_turning, bodies=("rigid", "strut", "strip"), motions=("ramp", "table")),
    "grazing": _draw_grazing,
    "bouncing": _draw_bouncing,
    "free": _draw_free,
    "strip on a stop": partial(parts.draw_striking, bodies=("strip",)),
    "clearance": partial(parts.draw_rattling, bodies=("rigid",)),
    "strut": parts.draw_strut,
    "shaken": partial(parts.draw_turning, kinds=SLIDER, motions=("swing",)),
    "mixed": parts.draw_mixed,
    "any chain": _draw_chain,
    "any four-bar": partial(parts.draw_turning, kinds=("four-bar",), motions=("constant", "ramp")),
    "any slider": partial(parts.draw_turning, kinds=SLIDER),
    "any struck": partial(parts.draw_striking, bodies=("strut",), friction_share=0.0),  # friction of guides: see `any rubbing`
    "any cantilever": _draw_cantilever,
    "any guided": parts.draw_guided,
    "any rattling": partial(parts.draw_rattling, bodies=("rigid", "modal")),
    "any sliding": parts.draw_sliding,
    "any two drives": parts.draw_two_drives,
    "any rubbing": parts.draw_rubbing,
    "any landing": _draw_landing,
    "any spinning": _draw_spinning,
    "any coupled": _draw_coupled,
    "smooth": partial(parts.draw_turning, kinds=SLIDER, bodies=("strip",), load_share=0.3),
    "ramp": partial(parts.draw_turning, kinds=SLIDER, bodies=("strip",), motions=("ramp",), load_share=0.3),
    "rigid": partial(parts.draw_turning, kinds=SLIDER, bodies=("rigid",)),
    "rigid clearance": partial(parts.draw_rattling, bodies=("rigid",), joints="OABC"),
    "modal clearance": partial(parts.draw_rattling, bodies=("modal",), joints="OABC"),
    "beam clearance": partial(parts.draw_rattling, bodies=("beam",), joints="OABC"),
}
"""Generator of each family.

The families before `any ...` are difficult to simulate. The families `any ...` have mechanisms that both `Exudyn` and
`Spectral` solve. The families after them have one kind of linkage, body and drive.
"""
EVERYTHING = tuple(name for name in FAMILIES if name.startswith("any "))
"""Families that together have every kind of element, joint and body, and most laws."""
