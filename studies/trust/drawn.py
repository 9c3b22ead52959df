"""Mechanisms drawn at random: one grammar for studies and tests.

    name, mechanism, duration = drawn(seed=1, k=7, families=("kinks", "any chain"))

A family is a skeleton (linkage, chain, block, strip, ...) and what may be put on it: bodies, drives, clearances, stops,
springs, loads. What is drawn can be compared, and written to a file.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from math import cos, pi, sin, sqrt
from typing import Any, NamedTuple

import numpy as np

from buckler import mbs
from buckler.mbs import laws
from buckler.mbs.functions import Components, Expression, Table
from buckler.mbs.kinematics.slidercrank import SliderCrank
from buckler.mbs.library import BAR, PAPER, CrankRocker, crank_rocker, slider_crank
from buckler.mbs.modal import BarModes
from buckler.studies.kit.published import STRIP_WIDTH

WEIGHT = (0.0, -9.81)
PLAYED = 0.01
"""Longest time of a run with clearance, s: its motion is one trajectory for so long."""
Made = tuple[mbs.Mechanism, float]


class Dice(np.random.Generator):
    """A generator of random numbers with the draws a grammar needs."""

    def __init__(self, *seed: int) -> None:
        super().__init__(np.random.PCG64(seed))

    def log(self, low: float, high: float) -> float:
        """A number, its logarithm uniform."""
        return float(np.exp(self.uniform(np.log(low), np.log(high))))

    def chance(self, share: float = 0.5) -> bool:
        """True for a share of all draws."""
        return bool(self.random() < share)

    def one(self, *options: Any) -> Any:
        """One of them, alike."""
        return options[int(self.integers(len(options)))]

    def some(self, *options: Any, share: float = 0.6) -> list[Any]:
        """Each for a share of all draws."""
        return [option for option in options if self.chance(share)]


class Drawn(NamedTuple):
    """A mechanism, what it is called, and how long it runs, s."""

    name: str
    mechanism: mbs.Mechanism
    duration: float


def drawn(seed: int, k: int, families: Sequence[str] = ()) -> Drawn:
    """The k-th random mechanism of a seed; families take turns, all of them where none is named."""
    names = families or tuple(FAMILIES)
    family = names[k % len(names)]
    return Drawn(f"{family} {seed}.{k}", *FAMILIES[family](Dice(seed, list(FAMILIES).index(family), k)))


# --- parts -----------------------------------------------------------------------------------------------------------------


def _strip(d: Dice, length: float, thin: float = 3e-4, thick: float = 3e-3, bow: float = 0.0) -> mbs.Beam | mbs.Cable:
    """A damped strip of elements that are named, or left to the run."""
    section = mbs.Section(STRIP_WIDTH, d.log(thin, thick)).damped(d.log(3e-3, 0.1), length)
    kind, fewest, most = d.one((mbs.Beam, 3, 10), (mbs.Cable, 6, 16))
    made: mbs.Beam | mbs.Cable = kind(section, elements=int(d.integers(fewest, most)) if d.chance() else None, imperfection=bow)
    return made


def _bar(d: Dice) -> mbs.Rigid:
    return mbs.Rigid(mbs.Section(d.uniform(0.01, 0.03), d.uniform(3e-3, 1e-2)))


def _solid(d: Dice, length: float) -> mbs.Rigid:
    """A bar, or a body with its centre of mass aside."""
    mass, centre = d.uniform(0.05, 0.5), (d.uniform(0.2, 0.8) * length, d.uniform(-0.3, 0.3) * length)
    return d.one(_bar(d), mbs.Rigid.of(mass=mass, inertia=d.uniform(0.05, 0.1) * mass * length**2, centre=centre))


def _modal(d: Dice) -> mbs.Modal:
    return mbs.Modal(mbs.Section(d.uniform(5e-3, 2e-2), d.uniform(4e-3, 2e-2)), BarModes(2, 1), d.uniform(0.01, 0.05))


BODIES: dict[str, Callable[[Dice, float], Any]] = {
    "rigid": lambda d, length: _bar(d),
    "strip": lambda d, length: _strip(d, length, 1e-3, bow=d.uniform(-3e-3, 3e-3) * length),
    "beam": lambda d, length: mbs.Beam(BAR.damped(0.01, length)),
    "strut": lambda d, length: mbs.Strut(mbs.Section(STRIP_WIDTH, d.log(2e-4, 1e-3))),
    "modal": lambda d, length: _modal(d),
}


def _motion(d: Dice, kind: str, fast: float, duration: float) -> Any:
    """Speed of a crank over time, rad/s."""
    if kind == "constant":
        return fast
    if kind == "ramp":
        return mbs.Ramp(0.0, fast, d.log(1e-3, 0.5) * duration)
    if kind == "table":
        times = [0.0, *np.sort(d.uniform(0.05, 0.9, 3)).tolist()]
        return Table([t * duration for t in times], (fast * d.uniform(0.2, 1.0, 4)).tolist())
    often = 2 * pi * float(d.integers(20, 200)) / duration
    return Expression(f"{d.uniform(0.02, 0.3) * often!r}*cos({often!r}*t)")


def _impact(d: Dice) -> Any:
    """Law of a stop."""
    stiffness = d.log(1e4, 1e6)
    soft = laws.KelvinVoigt(stiffness, d.uniform(0.05, 1.0) * sqrt(stiffness))
    return d.one(
        laws.CarvalhoMartins(stiffness, d.uniform(0.2, 0.95), exponent=d.one(1.0, 1.5)), soft, laws.HuntCrossley(stiffness, 0.3)
    )


def _play(d: Dice) -> Callable[[str, str, str], mbs.Clearance]:
    """Joints with clearance of one law and friction."""
    gap, stiffness, rough = d.log(2e-5, 1e-3), 10 ** d.uniform(7.5, 10.4), d.uniform(0.05, 0.3)
    law = d.one(
        laws.Impact(stiffness, d.uniform(100, 2e3), 1e-5), laws.Hertz(stiffness), laws.Flores(stiffness, d.uniform(0.3, 0.9)),
        laws.KelvinVoigt(1e7, d.uniform(0, 500)),
    )  # fmt: skip
    friction = d.one(
        laws.NoFriction(), laws.Coulomb(rough, 0.01), laws.AdamsFriction(1.5 * rough, rough, 0.1, 1.0),
        laws.AdamsFriction(1.5 * rough, rough), laws.Ambrosio(rough, 0.01, 0.1), laws.Threlfall(rough, 0.1),
        laws.Stribeck(1.5 * rough, rough, 0.1), laws.LuGre(1.5 * rough, rough, 0.1),
    )  # fmt: skip
    return lambda point, pin, bush: mbs.Clearance(point, pin, bush, 5e-3, gap, law, friction)


def _place(z: complex) -> tuple[float, float]:
    return z.real, z.imag


def _ray(angle: float) -> complex:
    return complex(cos(angle), sin(angle))


# --- linkages --------------------------------------------------------------------------------------------------------------


def _turning(
    d: Dice, kinds: Sequence[str] = ("slider-crank", "four-bar"), bodies: Sequence[str] = ("rigid", "strip"),
    motions: Sequence[str] = ("constant",), most: float = 0.5,
) -> Made:  # fmt: skip
    """A slider-crank or four-bar without stops; a slider's inertia takes up to `most` of the load at which a strip buckles."""
    motion, fast = d.one(*motions), d.log(2, 30)
    if d.one(*kinds) == "four-bar":
        sides = CrankRocker(*(side * d.uniform(0.95, 1.05) for side in CrankRocker()))
        rocker, duration = BODIES[d.one(*bodies)](d, sides.rocker), d.uniform(0.3, 1.5) * 2 * pi / fast
        return crank_rocker(rocker, speed=_motion(d, motion, fast, duration), lengths=sides), duration
    body, mass = d.one(*bodies), d.uniform(0.1, 0.5)
    lengths = SliderCrank(d.uniform(0.05, 0.2), d.uniform(0.25, 0.6)) if body == "rigid" else PAPER
    coupler = BODIES[body](d, lengths.coupler)
    if body == "strip":
        fast = sqrt(d.log(1e-3, most) * coupler.section.euler_load(lengths.coupler) / (mass * lengths.crank))
    duration = d.uniform(0.3, 1.5) * 2 * pi / fast
    return slider_crank(coupler, law=None, mass=mass, speed=_motion(d, motion, fast, duration), lengths=lengths), duration


def _striking(d: Dice, bodies: Sequence[str], rubs: float = 0.25) -> Made:
    """The slider-crank on its stop, its coupler so thin that it buckles; a share of guides rubs. It ends pressed, or released."""
    fast, length = d.log(1, 15), PAPER.coupler
    bowed = _strip(d, length, 2e-4, 8e-4, bow=d.one(-1, 1) * d.log(1e-4, 1e-2) * length)
    body = bowed if d.one(*bodies) == "strip" else mbs.Strut(mbs.Section(STRIP_WIDTH, d.log(2e-4, 6e-4)))
    dynamic = d.uniform(0, 1)
    friction = mbs.GuideFriction(dynamic, dynamic * d.uniform(1, 1.5)) if d.chance(rubs) else None
    made = slider_crank(body, law=_impact(d), mass=d.uniform(0.1, 0.5), speed=fast, friction=friction)
    return made, d.uniform(0.4, 0.75) * 2 * pi / fast


def _rattling(d: Dice, bodies: Sequence[str], joints: str = "") -> Made:
    """A crank-rocker with clearance in the joints named, or in one to all."""
    fast, some = d.log(5, 60), joints or "".join(d.some(*"OABC")) or "B"
    made = crank_rocker(
        BODIES[d.one(*bodies)](d, CrankRocker().rocker), speed=fast, play=_play(d), with_play=some, angle=d.uniform(-pi, pi)
    )
    return replace(made, gravity=d.one(WEIGHT, (0.0, 0.0))), PLAYED * d.uniform(0.5, 1.0) * 10 * pi / max(fast, 10 * pi)


def _strut(d: Dice) -> Made:
    """A strut in a slider-crank or four-bar."""
    return _striking(d, ("strut",)) if d.chance() else _turning(d, bodies=("strut",), motions=("constant", "ramp"))


def _mixed(d: Dice) -> Made:
    """Two flexible links, or clearance beside a flexible link or a stop."""
    kind = d.integers(3)
    if kind == 0:
        made, duration = _turning(d, ("four-bar",), ("strip",))
        coupler = replace(made.link("coupler"), body=_strip(d, CrankRocker().coupler, 1e-3))
        return replace(made, links=[coupler if link.name == "coupler" else link for link in made.links]), duration / 2
    if kind == 1:
        return _rattling(d, ("strip", "beam"))
    near, play = PAPER.crank - PAPER.coupler - d.uniform(5e-4, 3e-3), _play(d)
    made = slider_crank(mbs.Rigid(BAR), law=_impact(d), mass=0.3, speed=d.uniform(20, 60), stop=near)
    return replace(made, joints=[made.joints[0], play("A", "crank", "coupler")]), PLAYED


def _rubbing(d: Dice) -> Made:
    """A slider-crank of rigid links, driven or let go, whose guide rubs, by its own reaction or as given."""
    fast = d.uniform(5, 20)
    made = slider_crank(_bar(d), law=None, mass=d.uniform(0.1, 0.5), speed=fast)
    guide = replace(made.guides[0], friction=d.one(laws.Coulomb(d.uniform(0.05, 0.4), 0.05), mbs.GuideFriction(1.0)))
    if d.chance(0.6):
        made = replace(made, drives=[], velocities={"crank": fast}, loads=[mbs.Torque("crank", d.uniform(-1, 1))])
    return replace(made, guides=[guide], gravity=WEIGHT), d.uniform(0.2, 0.8) * 2 * pi / fast


def _guided(d: Dice) -> Made:
    """A driven bar with a block on a line, or a falling one with a block on an inclined line, pulled by a spring."""
    length, turn, driven = d.uniform(0.2, 0.5), d.uniform(0.3, 1.2), d.chance()
    along = (1.0, 0.0) if driven else _place(_ray(d.uniform(-0.6, 0.6)))
    return mbs.Mechanism(
        {"A": (0.0, 0.0), "B": _place(length * _ray(turn)), "C": (2 * length, 0.0)},
        [mbs.Link("crank", "A", "B", _bar(d)), mbs.Link("rod", "B", "C", _bar(d))],
        [mbs.Revolute("A", "ground", "crank"), mbs.Revolute("B", "crank", "rod")],
        guides=[mbs.Guide("C", "rod", along=along, mass=d.uniform(0.1, 0.5))],
        loads=[mbs.Spring("C", "ground:A", stiffness=d.uniform(10, 200), damping=d.uniform(0, 1))],
        drives=[mbs.Drive("crank", d.uniform(2, 10))] if driven else [],
        gravity=WEIGHT,
    ), d.uniform(0.1, 0.3)


def _sliding(d: Dice) -> Made:
    """A swinging bar in whose slot or along which a block on a bar slides, pulled by springs, turned by a motor or a torque."""
    length, turn = d.uniform(0.2, 0.4), d.uniform(-0.4, 0.4)
    end = length * _ray(d.uniform(-1.0, 1.0))
    points = {"O": 0j, "A": end, "B": 0.6 * end, "C": 0.6 * end + 0.15 * _ray(turn - pi / 2)}
    points["Q"] = complex(d.uniform(0, 0.3), d.uniform(-0.5, -0.3))
    joint = d.one(mbs.Slot, mbs.Slider)("B", "bob", "arm", along=_place(_ray(d.uniform(-0.6, 0.6))))
    motor = mbs.Motor("arm", voltage=d.uniform(2, 12), resistance=2.0, constant=0.05, inertia=1e-5, gear=d.uniform(1, 3))
    loads = d.some(
        mbs.Spring("C", "ground:Q", stiffness=d.uniform(5, 50), free_length=0.1),
        mbs.TorsionSpring("arm", "bob", stiffness=d.uniform(0.05, 0.5), damping=d.uniform(0, 0.01)),
        d.one(motor, mbs.Torque("arm", d.uniform(-0.1, 0.1))),
    )
    pull = mbs.Spring("B", "ground:O", stiffness=d.uniform(100, 500), damping=d.uniform(0, 2), free_length=0.6 * length)
    return mbs.Mechanism(
        {name: _place(z) for name, z in points.items()},
        [mbs.Link("arm", "O", "A", _bar(d)), mbs.Link("bob", "B", "C", _bar(d))],
        [mbs.Revolute("O", "ground", "arm"), joint],
        loads=[pull, *loads],
        masses=d.some(mbs.Mass("C", d.uniform(0.02, 0.2), d.uniform(0, 1e-5)), share=0.5),
        gravity=WEIGHT,
    ), d.uniform(0.1, 0.25)


def _two_drives(d: Dice) -> Made:
    """A five-bar turned by two drives, one of them swinging; one of its links may be of modes."""
    low, fast = d.uniform(0.08, 0.12), d.uniform(3, 12)
    duration = d.uniform(0.4, 1.0) / fast
    left = _motion(d, d.one("constant", "ramp", "table"), fast, duration)
    return mbs.Mechanism(
        {"O": (0, 0), "A": (0, low), "P": (0.3, 0), "D": (0.3, low), "B": (0.15, low + d.uniform(0.15, 0.2))},
        [
            mbs.Link("left", "O", "A", _bar(d)), mbs.Link("right", "P", "D", _bar(d)),
            mbs.Link("one", "A", "B", d.one(_bar(d), _modal(d))), mbs.Link("two", "D", "B", _bar(d)),
        ],
        [
            mbs.Revolute("O", "ground", "left"), mbs.Revolute("P", "ground", "right"), mbs.Revolute("A", "left", "one"),
            mbs.Revolute("D", "right", "two"), mbs.Revolute("B", "one", "two"),
        ],
        loads=d.some(mbs.Force("B", (d.uniform(-2, 2), d.uniform(-2, 2))), share=0.5),
        drives=[mbs.Drive("left", left), mbs.Drive("right", Expression(f"{d.uniform(0.1, 0.3) * fast!r}*cos({fast!r}*t)"))],
        gravity=WEIGHT,
    ), duration  # fmt: skip


# --- chains and blocks -----------------------------------------------------------------------------------------------------


def _free(d: Dice) -> Made:
    """A pendulum let go, for three to a hundred periods."""
    angle, length = d.uniform(0.05, 2.8), d.uniform(0.2, 0.6)
    return mbs.Mechanism(
        {"O": (0, 0), "A": _place(length * _ray(angle - pi / 2))},
        [mbs.Link("bar", "O", "A", mbs.Rigid(mbs.Section(0.02, 0.01)))],
        [mbs.Revolute("O", "ground", "bar")],
        gravity=WEIGHT,
    ), d.log(3, 100) * 2 * pi * sqrt(2 * length / 3 / 9.81)


def _chain(d: Dice) -> Made:
    """A chain of one to three pendulums with loads, masses and springs of any kind, let go."""
    count = int(d.integers(1, 4))
    names, lengths, turns = [f"bar{k}" for k in range(count)], d.uniform(0.1, 0.5, count), d.uniform(-pi, pi, count)
    ends = np.concatenate([[0j], np.cumsum(lengths * np.exp(1j * turns))])
    points = {f"P{k}": _place(complex(z)) for k, z in enumerate(ends)}
    points |= {"Q": tuple(d.uniform(0.5, 1.0, 2).tolist()), "R": _place(ends[-1] + d.uniform(-0.1, 0.1) * 1j * _ray(turns[-1]))}
    last = names[-1]
    wound = mbs.TorsionSpring(
        "ground", "bar0", stiffness=d.uniform(0.1, 1), damping=d.uniform(0, 0.01), free_angle=d.uniform(-1, 1)
    )
    loads = d.some(
        mbs.Force("R", (d.uniform(-1, 1), d.uniform(-1, 1)), follows=d.one(last, None)),
        mbs.Spring("R", "ground:Q", stiffness=d.uniform(5, 100), damping=d.uniform(0, 0.5), free_length=d.uniform(0.1, 0.5)),
        mbs.Torque(last, d.one(d.uniform(-0.05, 0.05), Expression(f"-{d.uniform(1e-3, 1e-2)!r}*speed"))),
    )
    return mbs.Mechanism(
        points,
        [
            mbs.Link(name, f"P{k}", f"P{k + 1}", _solid(d, lengths[k]), carries=("R",) if name == last else ())
            for k, name in enumerate(names)
        ],
        [mbs.Revolute(f"P{k}", names[k - 1] if k else "ground", name) for k, name in enumerate(names)],
        loads=[wound, *loads],
        masses=d.some(mbs.Mass("R", d.uniform(0.05, 0.5), d.uniform(0, 1e-4)), share=0.5),
        velocities={"bar0": d.uniform(-3, 3)} if d.chance() else {},
        gravity=WEIGHT,
    ), d.uniform(0.2, 0.6)


def _block(d: Dice, **more: Any) -> mbs.Mechanism:
    """A block on a line."""
    return mbs.Mechanism(
        {"A": (0, 0), "B": (0.1, 0), "F": (-0.3, 0)},
        [mbs.Link("bar", "A", "B", mbs.Rigid(mbs.Section(1e-3, 1e-3)))],
        guides=[mbs.Guide("A", "bar", mass=d.uniform(0.1, 1)), mbs.Guide("B", "bar")],
        **more,
    )


def _grazing(d: Dice) -> Made:
    """A rigid slider that just reaches its stops, or a block thrown to and fro between two."""
    law = _impact(d)
    if d.chance():
        made, duration = _turning(d, ("slider-crank",), ("rigid",))
        face = made.points["B"][0] - 2 * made.points["A"][0] + d.log(1e-6, 3e-3)  # just short of where it turns round
        return replace(made, stops=[mbs.Stop("B", face, law), mbs.Stop("B", face - 1e-5, law)][: d.integers(1, 3)]), duration
    pull, room, apart = d.uniform(1, 10), d.uniform(0.02, 0.1), d.one(0.0, 1e-5, 1e-3)
    faces = [mbs.Stop("A", room, law), mbs.Stop("B", 0.1 + room + apart, law)][: d.integers(1, 3)]
    return _block(d, stops=faces, gravity=(pull, 0.0)), d.uniform(1.5, 8) * sqrt(2 * room / pull)


def _bouncing(d: Dice) -> Made:
    """A block on a spring, thrown against a stop that it meets once or many times."""
    stiffness, away = d.log(20, 2000), d.uniform(0.02, 0.08)
    spring = mbs.Spring("A", "ground:F", stiffness=stiffness, damping=d.uniform(0, 0.5), free_length=0.3 + away)
    made = _block(d, loads=[spring], stops=[mbs.Stop("A", d.uniform(0.05, 1.9) * away, _impact(d))])
    return made, d.uniform(0.5, 6) * 2 * pi * sqrt(made.guides[0].mass / stiffness)


# --- strips ----------------------------------------------------------------------------------------------------------------


def _column(length: float, body: Any, mass: float, **more: Any) -> mbs.Mechanism:
    """A link in line with the guide of its near end, its far end on a pin."""
    return mbs.Mechanism(
        {"A": (0, 0), "B": (length, 0)},
        [mbs.Link("strip", "A", "B", body)],
        [mbs.Revolute("B", "ground", "strip")],
        guides=[mbs.Guide("A", "strip", mass=mass)],
        **more,
    )


def _pressed(d: Dice) -> Made:
    """A strip, or a modal link, in line with its guide and pressed slowly far beyond its critical load."""
    length, duration = PAPER.coupler, 10.0
    section = mbs.Section(STRIP_WIDTH, d.log(2e-4, 6e-4)).damped(0.5, length)
    bow = d.one(0.0, 1e-5 * length)  # little beside the deflection, so that the straight strip's load holds
    body = d.one(mbs.Beam(section, imperfection=bow), mbs.Cable(section, imperfection=bow), mbs.Modal(section, damping=0.5))
    share = section.euler_load(length) / section.axial_stiffness * d.log(20, 1e4)
    return _column(length, body, 0.1, drives=[mbs.Drive("A", Expression(f"{3 * share * length / duration**3!r}*t**2"))]), duration


def _critical(d: Dice) -> Made:
    """A bowed strip near its critical load, laid on slowly or suddenly."""
    length = d.uniform(0.2, 0.4)
    body = _strip(d, length, 3e-4, 1.5e-3, bow=d.log(1e-4, 1e-2) * length)
    load = d.uniform(0.4, 0.99) * body.section.euler_load(length)
    duration = d.uniform(2, 8) * 2 * pi / body.section.first_frequency(length)
    push = d.one((load, 0.0), Components((Table((0.0, duration / 2), (0.0, load)), 0.0)))
    return _column(length, body, d.uniform(0, 0.3), loads=[mbs.Force("A", push)]), duration


def _cantilever(d: Dice) -> Made:
    """A clamped strip with a rigid arm welded or pinned to its tip, loaded there and, if it is a beam, along itself, heavy."""
    length = d.uniform(0.2, 0.4)
    made = mbs.Mechanism(
        {"A": (0, 0), "B": (length, 0), "C": _place(length + d.uniform(0.05, 0.15) * _ray(d.uniform(-pi / 2, pi / 2)))},
        [mbs.Link("strip", "A", "B", _strip(d, length, 1e-3, 2e-3)), mbs.Link("arm", "B", "C", _bar(d))],
        [mbs.Weld("A", "ground", "strip"), d.one(mbs.Weld, mbs.Revolute)("B", "strip", "arm")],
        loads=[mbs.Force("C", (d.uniform(-1, 1), d.uniform(-2, 0)))],
        gravity=WEIGHT,
    )
    duration = d.uniform(0.1, 0.3)
    if isinstance(made.links[0].body, mbs.Beam) and d.chance():
        along = mbs.LineLoad("strip", (d.uniform(-3, 3), d.uniform(-3, 3)), d.uniform(-0.05, 0.05), turns=d.one(True, False))
        made = replace(made, loads=[*made.loads, along])
    return made, duration


def _landing(d: Dice) -> Made:
    """A pendulum, rigid or a clamped strip, let go or bent by a force, that lands with a point on a stop of the ground."""
    length = d.uniform(0.2, 0.4)
    strip = mbs.Link("bar", "O", "A", _strip(d, length, 1.5e-3, 2.5e-3), carries={"M": 0.6}), mbs.Weld("O", "ground", "bar")
    rigid = mbs.Link("bar", "O", "A", _bar(d), carries=("M",)), mbs.Revolute("O", "ground", "bar")
    link, joint = d.one(strip, rigid)
    return mbs.Mechanism(
        {"O": (0, 0), "A": (length, 0), "M": (0.6 * length, 0)}, [link], [joint],
        stops=[mbs.Stop("M", at=-d.uniform(1e-3, 1e-2), law=_impact(d), along=(0.0, 1.0))],
        loads=[mbs.Force("A", (0.0, -d.uniform(1, 10)))], gravity=WEIGHT,
    ), d.uniform(0.1, 0.2)  # fmt: skip


def _spinning(d: Dice) -> Made:
    """A soft bowed link on a pin, a strip or one of modes, that starts with a spin; an arm welded to its tip is pushed; heavy."""
    length, turn, spin = d.uniform(0.3, 0.5), d.uniform(-pi, pi), d.one(-1, 1) * d.uniform(5, 15)
    soft = mbs.Modal(mbs.Section(STRIP_WIDTH, d.uniform(1.5e-3, 3e-3)), BarModes(2, 1), 0.02)
    body = d.one(_strip(d, length, 1.5e-3, bow=d.uniform(0.01, 0.02)), soft)
    tip, hardening = length * _ray(turn), d.uniform(0.1, 1.0)
    return mbs.Mechanism(
        {"O": (0, 0), "A": _place(tip), "B": _place(tip + 0.1 * _ray(turn + d.uniform(-1, 1)))},
        [mbs.Link("link", "O", "A", body, carries={"M": 0.6} if body.meshed else {}), mbs.Link("arm", "A", "B", _bar(d))],
        [mbs.Revolute("O", "ground", "link"), mbs.Weld("A", "link", "arm")],
        loads=[
            mbs.Force("B", (0.0, d.uniform(0.2, 1.0)), follows="arm"),
            mbs.TorsionSpring("ground", "link", 0.0, law=Expression(f"{hardening!r}*(x + x**3)"), free_angle=d.uniform(-1, 1)),
        ],
        masses=[mbs.Mass("M" if body.meshed else "B", d.uniform(0.02, 0.1))],
        velocities={"link": spin, "arm": spin},
        gravity=WEIGHT,
    ), d.uniform(0.1, 0.3)


def _coupled(d: Dice) -> Made:
    """Two wheels on fixed axles, geared or belted, stiffly or not: a torque on one lifts a weight by a rack, eased by another."""
    apart, size, hang = d.uniform(0.1, 0.2), d.uniform(0.03, 0.05), d.uniform(0.2, 0.4)
    near, far = apart + size, apart + 2 * size
    points = {"A": (0, 0), "a": (0.02, 0), "B": (apart, 0), "b": (apart + 0.02, 0), "P": (near, 0.1), "Q": (far, 0.1)}
    points |= {"C": (near, -hang), "c": (near, -hang - 0.1), "D": (far, -hang), "d": (far, -hang - 0.1)}
    wheels = [("one", "A", d.log(1e-4, 1e-3)), ("two", "B", d.log(1e-4, 1e-3))]
    links = [
        mbs.Link(name, at, at.lower(), mbs.Rigid.of(mass=d.uniform(0.2, 1), inertia=inertia, centre=(0.0, 0.0)))
        for name, at, inertia in wheels
    ]
    weights = [("weight", "C", d.uniform(0.1, 0.5)), ("counter", "D", d.uniform(0.3, 0.6))]
    links += [mbs.Link(name, at, at.lower(), mbs.Rigid.of(mass=mass, inertia=1e-3)) for name, at, mass in weights]
    joints = [mbs.Revolute(at, "ground", name) for name, at, _ in wheels] + [
        mbs.Slider(at, name, "ground", (0, 1)) for name, at, _ in weights
    ]
    belt = mbs.Belt("one:A", "two:B", size, d.uniform(0.5, 1.5) * size, crossed=d.one(True, False))
    soft = replace(belt, stiffness=d.log(1e3, 1e5), damping=d.uniform(0, 2))
    pair = d.one(mbs.Gear("one:A", "two:B", d.one(-1, 1) * d.uniform(0.6, 0.9)), belt, soft)
    return mbs.Mechanism(
        points, links, joints, loads=[mbs.Torque("one", d.uniform(-0.05, 0.05))], gravity=WEIGHT,
        couplings=[pair, mbs.Rack("two:B", "weight:C", size, (0, 1)), mbs.Rope("C", "D", over=("P", "Q"))],
    ), d.uniform(0.05, 0.15)  # fmt: skip


SLIDER = ("slider-crank",)
FAMILIES: dict[str, Callable[[Dice], Made]] = {
    "axial force": partial(_turning, bodies=("strip",)),
    "pressed straight": _pressed,
    "near critical": _critical,
    "kinks": partial(_turning, bodies=("rigid", "strut", "strip"), motions=("ramp", "table")),
    "grazing": _grazing,
    "bouncing": _bouncing,
    "free": _free,
    "strip on a stop": partial(_striking, bodies=("strip",)),
    "clearance": partial(_rattling, bodies=("rigid",)),
    "strut": _strut,
    "shaken": partial(_turning, kinds=SLIDER, motions=("swing",)),
    "mixed": _mixed,
    "any chain": _chain,
    "any four-bar": partial(_turning, kinds=("four-bar",), motions=("constant", "ramp")),
    "any slider": partial(_turning, kinds=SLIDER),
    "any struck": partial(_striking, bodies=("strut",), rubs=0.0),
    "any cantilever": _cantilever,
    "any guided": _guided,
    "any rattling": partial(_rattling, bodies=("rigid", "modal")),
    "any sliding": _sliding,
    "any two drives": _two_drives,
    "any rubbing": _rubbing,
    "any landing": _landing,
    "any spinning": _spinning,
    "any coupled": _coupled,
    "smooth": partial(_turning, kinds=SLIDER, bodies=("strip",), most=0.3),
    "ramp": partial(_turning, kinds=SLIDER, bodies=("strip",), motions=("ramp",), most=0.3),
    "rigid": partial(_turning, kinds=SLIDER, bodies=("rigid",)),
    "rigid clearance": partial(_rattling, bodies=("rigid",), joints="OABC"),
    "modal clearance": partial(_rattling, bodies=("modal",), joints="OABC"),
    "beam clearance": partial(_rattling, bodies=("beam",), joints="OABC"),
}
"""What is drawn, by family. Those called `any` are the whole grammar: every element, joint and law that both solvers take."""
EVERYTHING = tuple(name for name in FAMILIES if name.startswith("any "))
