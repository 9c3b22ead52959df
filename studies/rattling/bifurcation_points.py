"""What one value of `bifurcation` gives: the section of one pin, the exponent, and what speaks against them.

Also how an offset grows over one turn, left alone or drawn back.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil
from typing import Any, NamedTuple

import numpy as np

from buckler.mbs.laws import Impact
from buckler.studies.kit.parameters import choice, integer, quantities, quantity
from buckler.studies.rattling.fourbar import RockerParameters, journals
from buckler.studies.rattling.linkage import JOINTS, FourBar
from buckler.studies.rattling.parting import Exponent, exponent, last, separation, settled, turn_by_turn, turn_growth

Array = np.ndarray[Any, Any]
LONGEST_PERIOD = 8
"""Turns after which a section is looked at for repeating."""
REPEATS_TO = 1e-4
"""How close a repeating section must come to itself, in clearances."""
SURE = 4.0
"""Standard errors from zero at which the sign of an exponent is taken for known."""
LEFT_ALONE = 1e-12
"""The offset that is not drawn back, m."""
WINDOW = 0.04
"""Stretch of time, s, in which the fastest growth is looked for."""
AXES = {
    "clearance": ("radial clearance [mm]", 1e3, "log"),
    "speed": ("speed of the crank [rad/s]", 1.0, "linear"),
    "damping": ("contact damping $c_{max}$ [N s/m]", 1.0, "log"),
}
"""What may be varied: its label, a factor to its unit, and the spacing of its values."""


@dataclass(frozen=True)
class SectionParameters(RockerParameters):
    """Parameters of the study `bifurcation`."""

    over: str = choice("damping", tuple(AXES), "what is varied", "range")
    clearances: tuple[float, ...] = quantities((3e-5, 1e-3), "m", 1e-6, 2e-3, "from, to (over clearance)", "range")
    speeds: tuple[float, ...] = quantities((10.0, 80.0), "rad/s", 0.1, 500, "from, to (over speed)", "range")
    dampings: tuple[float, ...] = quantities((253.0, 253e3), "N.s/m", 1, 1e8, "from, to (over damping)", "range")
    count: int = integer(20, 2, 2000, "values in the range", "range")
    joint: str = choice("B", JOINTS, "joint whose pin is looked at", "section")
    angle: float = quantity(0.0, "rad", -7, 7, "crank angle of the section", "section")
    settle: int = integer(10, 0, 10**6, "turns before the section", "section")
    turns: int = integer(20, 2, 10**6, "turns of the section, for each seed", "section")
    exponent_turns: int = integer(4, 1, 10**6, "turns for the exponent, for each seed, after one for its direction", "exponent")
    offset: float = quantity(1e-9, "m", 1e-12, 1e-6, "size to which the offset is drawn back", "exponent")
    interval: float = quantity(2e-3, "s", 1e-5, 1, "longest time between drawing back", "exponent")
    exponent_tolerance: float = quantity(1e-11, "1", 1e-13, 1e-5, "of the integrator while motions part", "exponent")
    seeds: int = integer(2, 1, 10**4, "members, each from its own offset of 1e-9 m at the start", "numerics")
    seed: int = integer(0, 0, 2**31 - 1, "the first of them", "numerics")

    def check(self) -> None:
        """Check the range; build what is at its ends."""
        super().check()
        for name in ("clearances", "speeds", "dampings"):
            ends = getattr(self, name)
            if len(ends) != 2 or not ends[0] < ends[1]:
                raise ValueError(f"{name} = {','.join(f'{end:g}' for end in ends)}: must be two numbers, the first the smaller")
        for value in self.values[[0, -1]]:
            self.at(float(value))

    @property
    def values(self) -> Array:
        """What is varied, shape (count,), SI."""
        low, high = getattr(self, f"{self.over}s")
        return (np.geomspace if AXES[self.over][2] == "log" else np.linspace)(low, high, self.count)

    def at(self, value: float) -> FourBar:
        """The crank-rocker at one value, its crank at the angle of the section."""
        law = Impact(self.stiffness, value, self.damping_depth)
        changed: Any = {"clearance": {"gap": value}, "speed": {"speed": value}, "damping": {"law": law}}[self.over]
        return self.fourbar(start=self.angle, **changed)

    def steps(self, fourbar: FourBar) -> int:
        """Parts of a turn between which the offset is drawn back."""
        return max(50, ceil(fourbar.period / self.interval))


class DiagramPoint(NamedTuple):
    """What one value gives.

    Attributes
    ----------
    section : array, shape (seeds, turns, 2)
        Place of the pin in its bush, in clearances.
    exponent : Exponent
        1/s, with its standard error.
    period : int
        Turns after which every section repeats, 0 if it does not within `LONGEST_PERIOD`.
    spread : float
        Standard deviation of the section, in clearances.
    notes : tuple of str
        What speaks against the point, each beginning with a name.
    """

    section: Array
    exponent: Exponent
    period: int
    spread: float
    notes: tuple[str, ...]


# --- one value ----------------------------------------------------------------------------------------------------------


def member(p: SectionParameters, fourbar: FourBar, seed: int) -> tuple[Array, Array, str]:
    """Section, growth of an offset and what went wrong, of one seed: settle, follow the section, go on from there."""
    state, gap = settled(fourbar, p.settle, seed), fourbar.gaps[0]
    places, deep = [], ""
    for run in turn_by_turn(fourbar, state, p.turns, p.tolerance):
        places.append(run.q[-1])
        deep = deep or run.message
        state = last(run)
    section = journals(fourbar, np.array(places))[:, JOINTS.index(p.joint)] / gap
    growth = turn_growth(
        fourbar, state, p.exponent_turns + 1, seed, steps=p.steps(fourbar), offset=p.offset, tolerance=p.exponent_tolerance
    )[1:]
    return section, growth, f"PENETRATION: {deep}" if deep else ""


def read(p: SectionParameters, fourbar: FourBar, members: Sequence[tuple[Array, Array, str]]) -> DiagramPoint:
    """Join what the seeds gave."""
    section, growth = (np.stack([each[i] for each in members]) for i in (0, 1))
    found = exponent(growth, fourbar.period)
    period = max((repeats(each) for each in section), key=lambda n: n or LONGEST_PERIOD + 1) % (LONGEST_PERIOD + 1)
    spread = float(np.sqrt(section.var(axis=(0, 1)).sum()))
    notes = list(dict.fromkeys(each[2] for each in members if each[2]))[:1]
    outgrown = float((p.offset * np.exp(growth) > 0.1 * fourbar.gaps[0]).mean())
    if outgrown > 0.01:
        notes.append(f"OFFSET: grows beyond a tenth of the clearance in {outgrown:.0%} of the intervals; shorten `interval`")
    if period and found.value > SURE * found.error:
        notes.append(f"CONTRADICTION: parts at {found.value:.3g}/s, yet repeats after {period} turns")
    if not period and found.value < -SURE * found.error and p.turns > LONGEST_PERIOD:
        notes.append(f"NOT_SETTLED: comes together at {-found.value:.3g}/s, yet does not repeat; raise `settle`")
    return DiagramPoint(section, found, period, spread, tuple(notes))


def repeats(section: Array) -> int:
    """Turns after which a section, shape (turns, 2), repeats in its second half; 0 if not within `LONGEST_PERIOD`."""
    late = section[len(section) // 2 :]
    for n in range(1, min(LONGEST_PERIOD, len(late) - 1) + 1):
        if np.abs(late[n:] - late[:-n]).max() < REPEATS_TO:
            return n
    return 0


# --- growth over a turn ---------------------------------------------------------------------------------------------------


class Growth(NamedTuple):
    """Over one turn from the angle of the section, at the parameters themselves.

    Attributes
    ----------
    rate : array, shape (members, turns, steps)
        Local rate at which motions part, 1/s.
    alone, drawn : array, shape (members, steps + 1)
        Size, m, of an offset of 1e-12 m that is left alone, and what its growth comes to if it is drawn back.
    """

    rate: Array
    alone: Array
    drawn: Array


def growth_over_turn(p: SectionParameters, fourbar: FourBar, seed: int) -> tuple[Array, Array, Array]:
    """One member's part of `Growth`: rate (turns, steps), alone and drawn (steps + 1,)."""
    state, steps = settled(fourbar, p.settle, seed), p.steps(fourbar)
    alone = separation(fourbar, state, LEFT_ALONE, seed, steps=steps)
    growth = turn_growth(fourbar, state, p.exponent_turns + 1, seed, steps=steps, offset=p.offset, tolerance=p.exponent_tolerance)
    drawn = LEFT_ALONE * np.exp(np.concatenate([[0.0], np.cumsum(growth[0])]))
    return growth[1:] * steps / fourbar.period, alone, drawn


def fastest(rate: Array, period: float) -> float:
    """Largest mean rate, 1/s, over any `WINDOW` of a turn (over the whole turn if that is shorter)."""
    mean = rate.mean(axis=(0, 1))
    width = min(max(1, round(WINDOW / period * mean.size)), mean.size)
    sums = np.concatenate([[0.0], np.cumsum(np.tile(mean, 2))])
    return float((sums[width:] - sums[:-width]).max() / width)


def agreement(growth: Growth, clearance: float) -> float:
    """Largest ratio between offset left alone and drawn back, geometric mean over members, while both are small."""
    alone, drawn = (np.exp(np.log(each).mean(axis=0)) for each in (growth.alone, growth.drawn))
    small = np.logical_and.accumulate(np.maximum(growth.alone, growth.drawn).max(axis=0) < 1e-3 * clearance)
    return float(np.exp(np.abs(np.log(alone / drawn))[small].max()))
