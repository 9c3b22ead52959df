"""Random parts, contact laws and linkages for the random mechanisms of `buckler.studies.kit.drawn`.

All numbers are in SI units; 10 pi rad/s is 300 r/min. The ranges of draws are a free choice.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import cos, pi, sin, sqrt
from typing import Any

import numpy as np

from buckler import mbs
from buckler.mbs import laws
from buckler.mbs.functions import Expression, Table
from buckler.mbs.library import BAR, PAPER, CrankRocker, SliderCrank, crank_rocker, slider_crank
from buckler.mbs.modal import BarModes

from .published import GRAVITY, STRIP_WIDTH

WEIGHT = (0.0, -GRAVITY)
"""Gravity in the plane, downwards [m/s^2]."""
PREDICTABLE = 0.01
"""Duration for which the motion of a crank-rocker with clearance can be predicted at speeds up to 300 r/min [s]."""
Run = tuple[mbs.Mechanism, float]
"""Random mechanism and the duration of its run [s]."""


class Dice(np.random.Generator):
    """Source of random numbers and choices."""

    def __init__(self, *seed: int) -> None:
        super().__init__(np.random.PCG64(seed))

    def log(self, low: float, high: float) -> float:
        """Draw a number whose logarithm is uniform."""
        return float(np.exp(self.uniform(np.log(low), np.log(high))))

    def chance(self, share: float = 0.5) -> bool:
        """Return True with probability `share`."""
        return bool(self.random() < share)

    def one(self, *options: object) -> Any:
        """Choose one option, all equally likely."""
        return options[int(self.integers(len(options)))]

    def some(self, *options: object, share: float = 0.6) -> list[Any]:
        """Choose any number of options, each with probability `share`."""
        return [option for option in options if self.chance(share)]


Generator = Callable[[Dice], Run]
"""Function that draws a mechanism of a family."""


def predictable_time(speed: float) -> float:
    """Return the duration of a run with clearance at a crank speed [rad/s]: above 300 r/min a twentieth of a turn."""
    return PREDICTABLE * 10 * pi / max(speed, 10 * pi)


def draw_strip(dice: Dice, length: float, thin: float = 3e-4, thick: float = 3e-3, bow: float = 0.0) -> mbs.Beam | mbs.Cable:
    """Draw a damped strip, `thin` to `thick`, with a bow [m]; for half of the strips the run chooses the elements."""
    section = mbs.Section(STRIP_WIDTH, dice.log(thin, thick)).damped(ratio=dice.log(3e-3, 0.1), length=length)
    kind, fewest, beyond = dice.one((mbs.Beam, 3, 10), (mbs.Cable, 6, 16))
    elements = int(dice.integers(fewest, beyond)) if dice.chance() else None  # below `beyond`
    body: mbs.Beam | mbs.Cable = kind(section, elements=elements, imperfection=bow)
    return body


def draw_bar(dice: Dice) -> mbs.Rigid:
    """Draw a rigid bar."""
    return mbs.Rigid(mbs.Section(dice.uniform(0.01, 0.03), dice.uniform(3e-3, 1e-2)))


def draw_solid(dice: Dice, length: float) -> mbs.Rigid:
    """Draw a bar, or a rigid body whose centre of mass is off its axis."""
    mass, centre = dice.uniform(0.05, 0.5), (dice.uniform(0.2, 0.8) * length, dice.uniform(-0.3, 0.3) * length)
    return dice.one(draw_bar(dice), mbs.Rigid.of(mass=mass, inertia=dice.uniform(0.05, 0.1) * mass * length**2, centre=centre))


def draw_modal(dice: Dice) -> mbs.Modal:
    """Draw a bar described by vibration modes."""
    section = mbs.Section(dice.uniform(5e-3, 2e-2), dice.uniform(4e-3, 2e-2))
    return mbs.Modal(section, BarModes(bending=2, axial=1), damping=dice.uniform(0.01, 0.05))


BODIES: dict[str, Callable[[Dice, float], Any]] = {
    "rigid": lambda dice, length: draw_bar(dice),
    "strip": lambda dice, length: draw_strip(dice, length, 1e-3, bow=dice.uniform(-3e-3, 3e-3) * length),
    "beam": lambda dice, length: mbs.Beam(BAR.damped(0.01, length)),
    "strut": lambda dice, length: mbs.Strut(mbs.Section(STRIP_WIDTH, dice.log(2e-4, 1e-3))),
    "modal": lambda dice, length: draw_modal(dice),
}
"""Functions that draw a body of a kind and a length [m]; a "strip" is thin and bowed, a "beam" a thick straight bar."""


def draw_speed(dice: Dice, kind: str, speed: float, duration: float) -> Any:
    """Draw the speed of a crank [rad/s]: constant `speed`, a ramp up to it, or a table below it; "swing" does not use `speed`."""
    if kind == "constant":
        return speed
    if kind == "ramp":
        return mbs.Ramp(0.0, speed, dice.log(1e-3, 0.5) * duration)
    if kind == "table":
        times = [0.0, *np.sort(dice.uniform(0.05, 0.9, 3)).tolist()]
        return Table([t * duration for t in times], (speed * dice.uniform(0.2, 1.0, 4)).tolist())
    angular_frequency = 2 * pi * float(dice.integers(20, 200)) / duration  # 20 to 199 periods in a run
    speed_amplitude = dice.uniform(0.02, 0.3) * angular_frequency  # the angle swings by 0.02 to 0.3 rad
    return Expression(f"{speed_amplitude!r}*cos({angular_frequency!r}*t)")


def draw_law(dice: Dice) -> Any:
    """Draw the contact law of a stop."""
    stiffness = dice.log(1e4, 1e6)
    soft = laws.KelvinVoigt(stiffness, dice.uniform(0.05, 1.0) * sqrt(stiffness))  # damping ratio 0.05 to 1 for 1/4 kg
    hard = laws.CarvalhoMartins(stiffness, dice.uniform(0.2, 0.95), exponent=dice.one(1.0, 1.5))
    return dice.one(hard, soft, laws.HuntCrossley(stiffness, restitution=0.3))


def draw_clearance(dice: Dice) -> Callable[[str, str, str], mbs.Clearance]:
    """Draw a gap, a contact law and a friction law; return the function (point, pin, bush) that makes a joint with them."""
    gap, stiffness, sliding = dice.log(2e-5, 1e-3), 10 ** dice.uniform(7.5, 10.4), dice.uniform(0.05, 0.3)
    damped = laws.Impact(stiffness, damping=dice.uniform(100, 2e3), damping_depth=1e-5)
    lossy = laws.Flores(stiffness, restitution=dice.uniform(0.3, 0.9))
    linear = laws.KelvinVoigt(1e7, dice.uniform(0, 500))  # [N/m], the other stiffnesses are in N/m^1.5
    law = dice.one(damped, laws.Hertz(stiffness), lossy, linear)
    pair = 1.5 * sliding, sliding  # coefficients of static and sliding friction
    friction = dice.one(
        laws.NoFriction(), laws.Coulomb(sliding, v_reg=0.01), laws.AdamsFriction(*pair, v_s=0.1, v_d=1.0),
        laws.AdamsFriction(*pair), laws.Ambrosio(sliding, v0=0.01, v1=0.1), laws.Threlfall(sliding, v0=0.1),
        laws.Stribeck(*pair, v_stribeck=0.1), laws.LuGre(*pair, v_stribeck=0.1),
    )  # fmt: skip
    return lambda point, pin, bush: mbs.Clearance(point, pin, bush, 5e-3, gap, law, friction)  # pins of 5 mm radius


def make_revolutes(*places: str) -> list[mbs.Revolute]:
    """Make ideal joints, each from a text of its point and its two links: 'A crank coupler'."""
    return [mbs.Revolute(*each.split()) for each in places]


def place(point: complex) -> tuple[float, float]:
    """Return the coordinates (x, y) of a point x + i y."""
    return point.real, point.imag


def ray(angle: float) -> complex:
    """Return the unit vector at an angle [rad] as a complex number."""
    return complex(cos(angle), sin(angle))


def draw_turning(
    dice: Dice, kinds: Sequence[str] = ("slider-crank", "four-bar"), bodies: Sequence[str] = ("rigid", "strip"),
    motions: Sequence[str] = ("constant",), load_share: float = 0.5,
) -> Run:  # fmt: skip
    """Draw a slider-crank or four-bar without stops; the slider loads a strip below `load_share` of its buckling load."""
    motion, speed = dice.one(*motions), dice.log(2, 30)
    if dice.one(*kinds) == "four-bar":
        sides = CrankRocker(*(side * dice.uniform(0.95, 1.05) for side in CrankRocker()))
        rocker, duration = BODIES[dice.one(*bodies)](dice, sides.rocker), dice.uniform(0.3, 1.5) * 2 * pi / speed
        return crank_rocker(rocker, speed=draw_speed(dice, motion, speed, duration), lengths=sides), duration
    body, mass = dice.one(*bodies), dice.uniform(0.1, 0.5)
    lengths = SliderCrank(dice.uniform(0.05, 0.2), dice.uniform(0.25, 0.6)) if body == "rigid" else PAPER
    coupler = BODIES[body](dice, lengths.coupler)
    if body == "strip":
        inertia_force = dice.log(1e-3, load_share) * coupler.section.euler_load(lengths.coupler)  # mass * crank * speed^2
        speed = sqrt(inertia_force / (mass * lengths.crank))
    duration = dice.uniform(0.3, 1.5) * 2 * pi / speed
    return slider_crank(coupler, law=None, mass=mass, speed=draw_speed(dice, motion, speed, duration), lengths=lengths), duration


def draw_striking(dice: Dice, bodies: Sequence[str], friction_share: float = 0.25) -> Run:
    """Draw a slider-crank that strikes a stop and whose thin coupler buckles; `friction_share` of the guides have friction."""
    speed, length = dice.log(1, 15), PAPER.coupler
    bowed = draw_strip(dice, length, 2e-4, 8e-4, bow=dice.one(-1, 1) * dice.log(1e-4, 1e-2) * length)
    body = bowed if dice.one(*bodies) == "strip" else mbs.Strut(mbs.Section(STRIP_WIDTH, dice.log(2e-4, 6e-4)))
    dynamic = dice.uniform(0, 1)
    friction = mbs.GuideFriction(dynamic, dynamic * dice.uniform(1, 1.5)) if dice.chance(friction_share) else None
    mechanism = slider_crank(body, law=draw_law(dice), mass=dice.uniform(0.1, 0.5), speed=speed, friction=friction)
    return mechanism, dice.uniform(0.4, 0.75) * 2 * pi / speed


def draw_rattling(dice: Dice, bodies: Sequence[str], joints: str = "") -> Run:
    """Draw a crank-rocker with clearance in the given joints, or in one to four drawn ones of O, A, B, C."""
    speed, joints = dice.log(5, 60), joints or "".join(dice.some(*"OABC")) or "B"
    rocker, make_joint = BODIES[dice.one(*bodies)](dice, CrankRocker().rocker), draw_clearance(dice)
    linkage = crank_rocker(rocker, speed=speed, play=make_joint, with_play=joints, angle=dice.uniform(-pi, pi))
    linkage = replace(linkage, gravity=dice.one(WEIGHT, (0.0, 0.0)))
    return linkage, dice.uniform(0.5, 1.0) * predictable_time(speed)


def draw_strut(dice: Dice) -> Run:
    """Draw a slider-crank or four-bar with a strut."""
    if dice.chance():
        return draw_striking(dice, ("strut",))
    return draw_turning(dice, bodies=("strut",), motions=("constant", "ramp"))


def draw_mixed(dice: Dice) -> Run:
    """Draw a four-bar with two flexible links, a crank-rocker with clearance and a flexible link, or clearance and a stop."""
    kind = dice.integers(3)
    if kind == 0:  # for half the time of one flexible link, chosen
        mechanism, duration = draw_turning(dice, ("four-bar",), ("strip",))
        coupler = replace(mechanism.link("coupler"), body=draw_strip(dice, CrankRocker().coupler, 1e-3))
        return replace(mechanism, links=[coupler if link.name == "coupler" else link for link in mechanism.links]), duration / 2
    if kind == 1:
        return draw_rattling(dice, ("strip", "beam"))
    start = float(PAPER.slider(0.0))  # x of the slider at crank angle 0, its largest: from there it moves towards the stop
    face, make_joint = start - dice.uniform(5e-4, 3e-3), draw_clearance(dice)
    mechanism = slider_crank(mbs.Rigid(BAR), law=draw_law(dice), mass=0.3, speed=dice.uniform(20, 60), stop=face)
    ground_joint, _ = mechanism.joints  # the other one, of crank and coupler, gets a clearance
    # `PREDICTABLE` holds for a single clearance up to 60 rad/s: a gap larger by 1e-3 moved none of 19 journals by a tenth of it.
    return replace(mechanism, joints=[ground_joint, make_joint("A", "crank", "coupler")]), PREDICTABLE


def draw_rubbing(dice: Dice) -> Run:
    """Draw a rigid slider-crank, driven or released; its guide has Coulomb friction, or friction of constant size."""
    speed = dice.uniform(5, 20)
    mechanism = slider_crank(draw_bar(dice), law=None, mass=dice.uniform(0.1, 0.5), speed=speed)
    coulomb, constant = laws.Coulomb(dice.uniform(0.05, 0.4), v_reg=0.05), mbs.GuideFriction(dynamic=1.0)  # 1 N
    guide = replace(mechanism.guides[0], friction=dice.one(coulomb, constant))
    if dice.chance(0.6):
        mechanism = replace(mechanism, drives=[], velocities={"crank": speed}, loads=[mbs.Torque("crank", dice.uniform(-1, 1))])
    return replace(mechanism, guides=[guide], gravity=WEIGHT), dice.uniform(0.2, 0.8) * 2 * pi / speed


def draw_guided(dice: Dice) -> Run:
    """Draw a rigid slider-crank with a spring: driven on a level line, or falling on an inclined one."""
    length, turn, is_driven = dice.uniform(0.2, 0.5), dice.uniform(0.3, 1.2), dice.chance()
    along = (1.0, 0.0) if is_driven else place(ray(dice.uniform(-0.6, 0.6)))
    return mbs.Mechanism(
        {"A": (0.0, 0.0), "B": place(length * ray(turn)), "C": (2 * length, 0.0)},
        [mbs.Link("crank", "A", "B", draw_bar(dice)), mbs.Link("rod", "B", "C", draw_bar(dice))],
        make_revolutes("A ground crank", "B crank rod"),
        guides=[mbs.Guide("C", "rod", along=along, mass=dice.uniform(0.1, 0.5))],
        loads=[mbs.Spring("C", "ground:A", stiffness=dice.uniform(10, 200), damping=dice.uniform(0, 1))],
        drives=[mbs.Drive("crank", dice.uniform(2, 10))] if is_driven else [],
        gravity=WEIGHT,
    ), dice.uniform(0.1, 0.3)


def draw_sliding(dice: Dice) -> Run:
    """Draw a swinging bar along which a second body slides, with springs and a motor or a torque."""
    length, turn = dice.uniform(0.2, 0.4), dice.uniform(-0.4, 0.4)
    end = length * ray(dice.uniform(-1.0, 1.0))
    points = {"O": 0j, "A": end, "B": 0.6 * end, "C": 0.6 * end + 0.15 * ray(turn - pi / 2)}
    points["Q"] = complex(dice.uniform(0, 0.3), dice.uniform(-0.5, -0.3))
    joint = dice.one(mbs.Slot, mbs.Slider)("B", "bob", "arm", along=place(ray(dice.uniform(-0.6, 0.6))))
    motor = mbs.Motor("arm", voltage=dice.uniform(2, 12), resistance=2.0, constant=0.05, inertia=1e-5, gear=dice.uniform(1, 3))
    loads = dice.some(
        mbs.Spring("C", "ground:Q", stiffness=dice.uniform(5, 50), free_length=0.1),
        mbs.TorsionSpring("arm", "bob", stiffness=dice.uniform(0.05, 0.5), damping=dice.uniform(0, 0.01)),
        dice.one(motor, mbs.Torque("arm", dice.uniform(-0.1, 0.1))),
    )
    pull = mbs.Spring("B", "ground:O", stiffness=dice.uniform(100, 500), damping=dice.uniform(0, 2), free_length=0.6 * length)
    links = [mbs.Link("arm", "O", "A", draw_bar(dice)), mbs.Link("bob", "B", "C", draw_bar(dice))]
    masses = dice.some(mbs.Mass("C", dice.uniform(0.02, 0.2), dice.uniform(0, 1e-5)), share=0.5)
    joints, places = [mbs.Revolute("O", "ground", "arm"), joint], {name: place(z) for name, z in points.items()}
    return mbs.Mechanism(places, links, joints, loads=[pull, *loads], masses=masses, gravity=WEIGHT), dice.uniform(0.1, 0.25)


def draw_two_drives(dice: Dice) -> Run:
    """Draw a five-bar with two drives, one of them oscillating; one link may be modal."""
    crank_length, speed = dice.uniform(0.08, 0.12), dice.uniform(3, 12)
    duration = dice.uniform(0.4, 1.0) / speed  # the cranks turn by 0.4 to 1 rad
    left = draw_speed(dice, dice.one("constant", "ramp", "table"), speed, duration)
    return mbs.Mechanism(
        {"O": (0, 0), "A": (0, crank_length), "P": (0.3, 0), "D": (0.3, crank_length),
         "B": (0.15, crank_length + dice.uniform(0.15, 0.2))},
        [mbs.Link("left", "O", "A", draw_bar(dice)), mbs.Link("right", "P", "D", draw_bar(dice)),
         mbs.Link("one", "A", "B", dice.one(draw_bar(dice), draw_modal(dice))), mbs.Link("two", "D", "B", draw_bar(dice))],
        make_revolutes("O ground left", "P ground right", "A left one", "D right two", "B one two"),
        loads=dice.some(mbs.Force("B", (dice.uniform(-2, 2), dice.uniform(-2, 2))), share=0.5),
        drives=[mbs.Drive("left", left), mbs.Drive("right", Expression(f"{dice.uniform(0.1, 0.3) * speed!r}*cos({speed!r}*t)"))],
        gravity=WEIGHT,
    ), duration  # fmt: skip
