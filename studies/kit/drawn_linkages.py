"""Parts of random mechanisms, and linkages made of them; see `buckler.studies.kit.drawn`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import cos, pi, sin, sqrt
from typing import Any

import numpy as np

from buckler import mbs
from buckler.mbs import laws
from buckler.mbs.functions import Expression, Table
from buckler.mbs.kinematics.slidercrank import SliderCrank
from buckler.mbs.library import BAR, PAPER, CrankRocker, crank_rocker, slider_crank
from buckler.mbs.modal import BarModes

from .published import GRAVITY, STRIP_WIDTH

WEIGHT = (0.0, -GRAVITY)
PREDICTABLE = 0.01
"""Longest run of a linkage with clearance [s]: a twentieth of a turn at 300 r/min, before motions of nearby clearances part."""
Made = tuple[mbs.Mechanism, float]


class Dice(np.random.Generator):
    """Generator of random numbers with the draws of a grammar."""

    def __init__(self, *seed: int) -> None:
        super().__init__(np.random.PCG64(seed))

    def log(self, low: float, high: float) -> float:
        """Draw a number whose logarithm is uniform."""
        return float(np.exp(self.uniform(np.log(low), np.log(high))))

    def chance(self, share: float = 0.5) -> bool:
        """Return True for a share of all draws."""
        return bool(self.random() < share)

    def one(self, *options: object) -> Any:
        """Choose one option, all equally likely."""
        return options[int(self.integers(len(options)))]

    def some(self, *options: object, share: float = 0.6) -> list[Any]:
        """Keep each option for a share of all draws."""
        return [option for option in options if self.chance(share)]


# --- parts -----------------------------------------------------------------------------------------------------------------


def strip(d: Dice, length: float, thin: float = 3e-4, thick: float = 3e-3, bow: float = 0.0) -> mbs.Beam | mbs.Cable:
    """Draw a damped strip, its number of elements given or left to the solver."""
    section = mbs.Section(STRIP_WIDTH, d.log(thin, thick)).damped(d.log(3e-3, 0.1), length)
    kind, fewest, most = d.one((mbs.Beam, 3, 10), (mbs.Cable, 6, 16))
    made: mbs.Beam | mbs.Cable = kind(section, elements=int(d.integers(fewest, most)) if d.chance() else None, imperfection=bow)
    return made


def bar(d: Dice) -> mbs.Rigid:
    """Draw a rigid bar."""
    return mbs.Rigid(mbs.Section(d.uniform(0.01, 0.03), d.uniform(3e-3, 1e-2)))


def solid(d: Dice, length: float) -> mbs.Rigid:
    """Draw a bar, or a rigid body whose centre of mass is off its axis."""
    mass, centre = d.uniform(0.05, 0.5), (d.uniform(0.2, 0.8) * length, d.uniform(-0.3, 0.3) * length)
    return d.one(bar(d), mbs.Rigid.of(mass=mass, inertia=d.uniform(0.05, 0.1) * mass * length**2, centre=centre))


def modal(d: Dice) -> mbs.Modal:
    """Draw a bar described by vibration modes."""
    return mbs.Modal(mbs.Section(d.uniform(5e-3, 2e-2), d.uniform(4e-3, 2e-2)), BarModes(2, 1), d.uniform(0.01, 0.05))


BODIES: dict[str, Callable[[Dice, float], Any]] = {
    "rigid": lambda d, length: bar(d),
    "strip": lambda d, length: strip(d, length, 1e-3, bow=d.uniform(-3e-3, 3e-3) * length),
    "beam": lambda d, length: mbs.Beam(BAR.damped(0.01, length)),
    "strut": lambda d, length: mbs.Strut(mbs.Section(STRIP_WIDTH, d.log(2e-4, 1e-3))),
    "modal": lambda d, length: modal(d),
}


def speed_of(d: Dice, kind: str, fast: float, duration: float) -> Any:
    """Draw the speed of a crank [rad/s]: constant, ramp, table or oscillation."""
    if kind == "constant":
        return fast
    if kind == "ramp":
        return mbs.Ramp(0.0, fast, d.log(1e-3, 0.5) * duration)
    if kind == "table":
        times = [0.0, *np.sort(d.uniform(0.05, 0.9, 3)).tolist()]
        return Table([t * duration for t in times], (fast * d.uniform(0.2, 1.0, 4)).tolist())
    often = 2 * pi * float(d.integers(20, 200)) / duration
    return Expression(f"{d.uniform(0.02, 0.3) * often!r}*cos({often!r}*t)")


def impact(d: Dice) -> Any:
    """Draw the contact law of a stop."""
    stiffness = d.log(1e4, 1e6)
    soft = laws.KelvinVoigt(stiffness, d.uniform(0.05, 1.0) * sqrt(stiffness))
    hard = laws.CarvalhoMartins(stiffness, d.uniform(0.2, 0.95), exponent=d.one(1.0, 1.5))
    return d.one(hard, soft, laws.HuntCrossley(stiffness, 0.3))


def joints_of(d: Dice) -> Callable[[str, str, str], mbs.Clearance]:
    """Draw a gap, a contact law and a friction law, for all joints with clearance of a mechanism."""
    gap, stiffness, rough = d.log(2e-5, 1e-3), 10 ** d.uniform(7.5, 10.4), d.uniform(0.05, 0.3)
    damped, lossy = laws.Impact(stiffness, d.uniform(100, 2e3), 1e-5), laws.Flores(stiffness, d.uniform(0.3, 0.9))
    law = d.one(damped, laws.Hertz(stiffness), lossy, laws.KelvinVoigt(1e7, d.uniform(0, 500)))
    pair = 1.5 * rough, rough
    friction = d.one(
        laws.NoFriction(), laws.Coulomb(rough, 0.01), laws.AdamsFriction(*pair, 0.1, 1.0), laws.AdamsFriction(*pair),
        laws.Ambrosio(rough, 0.01, 0.1), laws.Threlfall(rough, 0.1), laws.Stribeck(*pair, 0.1), laws.LuGre(*pair, 0.1),
    )  # fmt: skip
    return lambda point, pin, bush: mbs.Clearance(point, pin, bush, 5e-3, gap, law, friction)


def revolutes(*places: str) -> list[mbs.Revolute]:
    """Make ideal joints of 'point first second'."""
    return [mbs.Revolute(*each.split()) for each in places]


def place(z: complex) -> tuple[float, float]:
    """Return the coordinates of a complex number."""
    return z.real, z.imag


def ray(angle: float) -> complex:
    """Return the unit vector at an angle [rad]."""
    return complex(cos(angle), sin(angle))


# --- linkages --------------------------------------------------------------------------------------------------------------


def turning(
    d: Dice, kinds: Sequence[str] = ("slider-crank", "four-bar"), bodies: Sequence[str] = ("rigid", "strip"),
    motions: Sequence[str] = ("constant",), most: float = 0.5,
) -> Made:  # fmt: skip
    """Draw a slider-crank or four-bar without stops; the slider's inertia stays below the share `most` of the buckling load."""
    motion, fast = d.one(*motions), d.log(2, 30)
    if d.one(*kinds) == "four-bar":
        sides = CrankRocker(*(side * d.uniform(0.95, 1.05) for side in CrankRocker()))
        rocker, duration = BODIES[d.one(*bodies)](d, sides.rocker), d.uniform(0.3, 1.5) * 2 * pi / fast
        return crank_rocker(rocker, speed=speed_of(d, motion, fast, duration), lengths=sides), duration
    body, mass = d.one(*bodies), d.uniform(0.1, 0.5)
    lengths = SliderCrank(d.uniform(0.05, 0.2), d.uniform(0.25, 0.6)) if body == "rigid" else PAPER
    coupler = BODIES[body](d, lengths.coupler)
    if body == "strip":
        fast = sqrt(d.log(1e-3, most) * coupler.section.euler_load(lengths.coupler) / (mass * lengths.crank))
    duration = d.uniform(0.3, 1.5) * 2 * pi / fast
    return slider_crank(coupler, law=None, mass=mass, speed=speed_of(d, motion, fast, duration), lengths=lengths), duration


def striking(d: Dice, bodies: Sequence[str], rubs: float = 0.25) -> Made:
    """Draw a slider-crank that strikes a stop and whose thin coupler buckles; a share of the guides has friction."""
    fast, length = d.log(1, 15), PAPER.coupler
    bowed = strip(d, length, 2e-4, 8e-4, bow=d.one(-1, 1) * d.log(1e-4, 1e-2) * length)
    body = bowed if d.one(*bodies) == "strip" else mbs.Strut(mbs.Section(STRIP_WIDTH, d.log(2e-4, 6e-4)))
    dynamic = d.uniform(0, 1)
    friction = mbs.GuideFriction(dynamic, dynamic * d.uniform(1, 1.5)) if d.chance(rubs) else None
    made = slider_crank(body, law=impact(d), mass=d.uniform(0.1, 0.5), speed=fast, friction=friction)
    return made, d.uniform(0.4, 0.75) * 2 * pi / fast


def rattling(d: Dice, bodies: Sequence[str], joints: str = "") -> Made:
    """Draw a crank-rocker with clearance in the given joints, or in one to four drawn ones."""
    fast, some = d.log(5, 60), joints or "".join(d.some(*"OABC")) or "B"
    rocker, play = BODIES[d.one(*bodies)](d, CrankRocker().rocker), joints_of(d)
    made = crank_rocker(rocker, speed=fast, play=play, with_play=some, angle=d.uniform(-pi, pi))
    return replace(made, gravity=d.one(WEIGHT, (0.0, 0.0))), PREDICTABLE * d.uniform(0.5, 1.0) * 10 * pi / max(fast, 10 * pi)


def strut(d: Dice) -> Made:
    """Draw a slider-crank or four-bar with a strut."""
    return striking(d, ("strut",)) if d.chance() else turning(d, bodies=("strut",), motions=("constant", "ramp"))


def draw_mixed(d: Dice) -> Made:
    """Draw a four-bar with two flexible links, or a linkage with clearance and a flexible link or a stop."""
    kind = d.integers(3)
    if kind == 0:
        made, duration = turning(d, ("four-bar",), ("strip",))
        coupler = replace(made.link("coupler"), body=strip(d, CrankRocker().coupler, 1e-3))
        return replace(made, links=[coupler if link.name == "coupler" else link for link in made.links]), duration / 2
    if kind == 1:
        return rattling(d, ("strip", "beam"))
    near, play = PAPER.crank - PAPER.coupler - d.uniform(5e-4, 3e-3), joints_of(d)
    made = slider_crank(mbs.Rigid(BAR), law=impact(d), mass=0.3, speed=d.uniform(20, 60), stop=near)
    return replace(made, joints=[made.joints[0], play("A", "crank", "coupler")]), PREDICTABLE


def rubbing(d: Dice) -> Made:
    """Draw a rigid slider-crank, driven or released, with friction in its guide by the reaction or of given size."""
    fast = d.uniform(5, 20)
    made = slider_crank(bar(d), law=None, mass=d.uniform(0.1, 0.5), speed=fast)
    guide = replace(made.guides[0], friction=d.one(laws.Coulomb(d.uniform(0.05, 0.4), 0.05), mbs.GuideFriction(1.0)))
    if d.chance(0.6):
        made = replace(made, drives=[], velocities={"crank": fast}, loads=[mbs.Torque("crank", d.uniform(-1, 1))])
    return replace(made, guides=[guide], gravity=WEIGHT), d.uniform(0.2, 0.8) * 2 * pi / fast


def draw_guided(d: Dice) -> Made:
    """Draw a rigid slider-crank with a spring: driven on a level line, or falling on an inclined one."""
    length, turn, driven = d.uniform(0.2, 0.5), d.uniform(0.3, 1.2), d.chance()
    along = (1.0, 0.0) if driven else place(ray(d.uniform(-0.6, 0.6)))
    return mbs.Mechanism(
        {"A": (0.0, 0.0), "B": place(length * ray(turn)), "C": (2 * length, 0.0)},
        [mbs.Link("crank", "A", "B", bar(d)), mbs.Link("rod", "B", "C", bar(d))],
        revolutes("A ground crank", "B crank rod"),
        guides=[mbs.Guide("C", "rod", along=along, mass=d.uniform(0.1, 0.5))],
        loads=[mbs.Spring("C", "ground:A", stiffness=d.uniform(10, 200), damping=d.uniform(0, 1))],
        drives=[mbs.Drive("crank", d.uniform(2, 10))] if driven else [],
        gravity=WEIGHT,
    ), d.uniform(0.1, 0.3)


def sliding(d: Dice) -> Made:
    """Draw a swinging bar along which a second body slides, with springs and a motor or a torque."""
    length, turn = d.uniform(0.2, 0.4), d.uniform(-0.4, 0.4)
    end = length * ray(d.uniform(-1.0, 1.0))
    points = {"O": 0j, "A": end, "B": 0.6 * end, "C": 0.6 * end + 0.15 * ray(turn - pi / 2)}
    points["Q"] = complex(d.uniform(0, 0.3), d.uniform(-0.5, -0.3))
    joint = d.one(mbs.Slot, mbs.Slider)("B", "bob", "arm", along=place(ray(d.uniform(-0.6, 0.6))))
    motor = mbs.Motor("arm", voltage=d.uniform(2, 12), resistance=2.0, constant=0.05, inertia=1e-5, gear=d.uniform(1, 3))
    loads = d.some(
        mbs.Spring("C", "ground:Q", stiffness=d.uniform(5, 50), free_length=0.1),
        mbs.TorsionSpring("arm", "bob", stiffness=d.uniform(0.05, 0.5), damping=d.uniform(0, 0.01)),
        d.one(motor, mbs.Torque("arm", d.uniform(-0.1, 0.1))),
    )
    pull = mbs.Spring("B", "ground:O", stiffness=d.uniform(100, 500), damping=d.uniform(0, 2), free_length=0.6 * length)
    links = [mbs.Link("arm", "O", "A", bar(d)), mbs.Link("bob", "B", "C", bar(d))]
    masses = d.some(mbs.Mass("C", d.uniform(0.02, 0.2), d.uniform(0, 1e-5)), share=0.5)
    joints, places = [mbs.Revolute("O", "ground", "arm"), joint], {name: place(z) for name, z in points.items()}
    return mbs.Mechanism(places, links, joints, loads=[pull, *loads], masses=masses, gravity=WEIGHT), d.uniform(0.1, 0.25)


def two_drives(d: Dice) -> Made:
    """Draw a five-bar with two drives, one of them oscillating; one link may be modal."""
    low, fast = d.uniform(0.08, 0.12), d.uniform(3, 12)
    duration = d.uniform(0.4, 1.0) / fast
    left = speed_of(d, d.one("constant", "ramp", "table"), fast, duration)
    return mbs.Mechanism(
        {"O": (0, 0), "A": (0, low), "P": (0.3, 0), "D": (0.3, low), "B": (0.15, low + d.uniform(0.15, 0.2))},
        [mbs.Link("left", "O", "A", bar(d)), mbs.Link("right", "P", "D", bar(d)),
         mbs.Link("one", "A", "B", d.one(bar(d), modal(d))), mbs.Link("two", "D", "B", bar(d))],
        revolutes("O ground left", "P ground right", "A left one", "D right two", "B one two"),
        loads=d.some(mbs.Force("B", (d.uniform(-2, 2), d.uniform(-2, 2))), share=0.5),
        drives=[mbs.Drive("left", left), mbs.Drive("right", Expression(f"{d.uniform(0.1, 0.3) * fast!r}*cos({fast!r}*t)"))],
        gravity=WEIGHT,
    ), duration  # fmt: skip
