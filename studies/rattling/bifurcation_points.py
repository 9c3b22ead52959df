"""What one value of `bifurcation` gives: the section of one pin, the exponent, and what speaks against them.

Also how an offset grows over one turn, left alone or drawn back. The rate depends on the crank's angle far more than on anything
else, so means are taken over whole turns.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil
from typing import Any, NamedTuple

import numpy as np

from buckler.mbs import Mechanism
from buckler.mbs.geometry import Array
from buckler.mbs.laws import Impact
from buckler.mbs.spectral.chaos import last_state, lyapunov
from buckler.mbs.spectral.ensembles import offset, resume
from buckler.mbs.spectral.run import State
from buckler.mbs.spectral.scene import Scene
from buckler.mbs.spectral.start import start_rates

from ..kit.parameters import choice, integer, quantities, quantity
from ..kit.statistics import Mean
from .assumptions import JOINTS
from .bars import RockerParameters
from .turns import deep, finished, gap, period, solver

LONGEST_PERIOD = 8
"""Turns after which a section is looked at for repeating."""
REPEATS_TO = 1e-4
"""How close a repeating section must come to itself, in clearances."""
SURE = 4.0
"""Standard errors from zero at which the sign of an exponent is taken for known."""
SPREAD = 1e-9
"""Standard deviation of a seed's offset at the start, m and rad: the same start for all errors, another motion soon."""
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
    joint: str = choice("B", tuple(JOINTS), "joint whose pin is looked at", "section")
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

    def at(self, value: float) -> Mechanism:
        """The crank-rocker at one value, its crank at the angle of the section."""
        law = Impact(self.stiffness, value, self.damping_depth)
        changed: Any = {"clearance": {"gap": value}, "speed": {"speed": value}, "damping": {"law": law}}[self.over]
        return self.bars(angle=self.angle, **changed)

    def steps(self, mechanism: Mechanism) -> int:
        """Parts of a turn between which the offset is drawn back."""
        return max(50, ceil(period(mechanism) / self.interval))


class DiagramPoint(NamedTuple):
    """What one value gives: places of the pin in its bush, in clearances, (seeds, turns, 2), and their standard deviation.

    Further the exponent, 1/s; turns after which every section repeats, 0 if not within `LONGEST_PERIOD`; what speaks against
    the point, each note beginning with a name.
    """

    section: Array
    exponent: Mean
    period: int
    spread: float
    notes: tuple[str, ...]


def settled(scene: Scene, turns: int, seed: int) -> State:
    """State after some turns, from the start offset by 1e-9 m and rad as the seed draws it."""
    turn, state = period(scene.mechanism), State(0.0, scene.q0 + offset(scene, SPREAD, seed), start_rates(scene), scene.memory())
    for _ in range(turns):
        after = last_state(scene, state, turn, solver(scene.mechanism, 1e-8))
        state = rewound(scene, after.q, after.v)
    return state


def rewound(scene: Scene, q: Array, v: Array) -> State:
    """The state whole turns later as one at t = 0: the crank is where it began."""
    q, crank = q.copy(), scene.builder.bodies["crank"].offset + 2
    q[crank] = scene.q0[crank]
    return State(0.0, q, v, scene.memory())


def turn_growth(
    scene: Scene, state: State, turns: int, seed: int, *, steps: int = 100, offset: float = 1e-9, tolerance: float = 1e-11
) -> Array:
    """Growth of a small offset, ln(size after the part / offset), in each part of each turn, (turns, steps).

    Sizes are in m: angles count by their bar's half length, velocities by the crank's turn through 1/30 rad. In the first turn
    the offset also finds its direction, which the seed draws. It should not grow to the size of the clearance within a part.
    """
    interval = period(scene.mechanism) / steps
    found = lyapunov(
        scene.mechanism, interval, steps * turns, settle=0, size=offset, seed=seed, solver=solver(scene.mechanism, tolerance),
        state=state, lengths=1 / _scale(scene),
    )  # fmt: skip
    return (found.growth * interval).reshape(turns, steps)


def separation(scene: Scene, state: State, offset: float, seed: int, *, steps: int = 100) -> Array:
    """Size in m of an offset that is never drawn back, after each part of one turn; shape (steps + 1,).

    Both motions at a tolerance of 1e-14, so that offsets from 1e-12 m on are seen. The first direction is that of `turn_growth`
    for this seed.
    """
    scale, interval, fine = _scale(scene), period(scene.mechanism) / steps, solver(scene.mechanism, 1e-14)
    direction = np.random.default_rng(seed).standard_normal(2 * scene.size)
    shift = offset * direction / np.linalg.norm(direction) / scale
    other, found = state._replace(q=state.q + shift[: scene.size], v=state.v + shift[scene.size :]), [offset]
    for end in state.time + interval * np.arange(1, steps + 1):
        state, other = (last_state(scene, each, float(end), fine) for each in (state, other))
        found.append(float(np.linalg.norm(scale * np.concatenate([other.q - state.q, other.v - state.v]))))
    return np.array(found)


def _scale(scene: Scene) -> Array:
    """What makes lengths of the components of a state; shape (2 n,)."""
    lengths = np.ones(scene.size)
    for link in ("coupler", "rocker"):
        lengths[scene.builder.bodies[link].offset + 2] = scene.mechanism.length(link) / 2
    return np.concatenate([lengths, lengths * period(scene.mechanism) / (60 * np.pi)])


def exponent(growth: Array, turn: float) -> Mean:
    """Exponent from growth, shape (..., turns, steps), of turns that last so long, s; the error of one turn is nan.

    Turns are taken for independent: where joints rattle, nothing is left after one of how it began.
    """
    return Mean.of(np.asarray(growth).sum(axis=-1).ravel() / turn)


def member(p: SectionParameters, mechanism: Mechanism, seed: int) -> tuple[Array, Array, str]:
    """Section, growth of an offset and what went wrong, of one seed: settle, follow the section, go on from there."""
    scene, turn, steps = Scene.of(mechanism), period(mechanism), solver(mechanism, p.tolerance)
    state, places, wrong = settled(scene, p.settle, seed), [], ""
    for _ in range(p.turns):
        found = resume(scene, turn, steps, state, seed)
        result = finished(found)
        places.append([result[f"{p.joint}.journal_{axis}"][-1] / gap(mechanism) for axis in "xy"])
        wrong, state = wrong or deep(mechanism, result), rewound(scene, found.state.q, found.state.v)
    growth = turn_growth(
        scene, state, p.exponent_turns + 1, seed, steps=p.steps(mechanism), offset=p.offset, tolerance=p.exponent_tolerance
    )[1:]
    return np.array(places), growth, f"PENETRATION: {wrong}" if wrong else ""


def read(p: SectionParameters, mechanism: Mechanism, members: Sequence[tuple[Array, Array, str]]) -> DiagramPoint:
    """Join what the seeds gave."""
    section, growth = (np.stack([each[i] for each in members]) for i in (0, 1))
    found = exponent(growth, period(mechanism))
    turns = max((repeats(each) for each in section), key=lambda n: n or LONGEST_PERIOD + 1) % (LONGEST_PERIOD + 1)
    spread = float(np.sqrt(section.var(axis=(0, 1)).sum()))
    notes = list(dict.fromkeys(each[2] for each in members if each[2]))[:1]
    outgrown = float((p.offset * np.exp(growth) > 0.1 * gap(mechanism)).mean())
    if outgrown > 0.01:
        notes.append(f"OFFSET: grows beyond a tenth of the clearance in {outgrown:.0%} of the intervals; shorten `interval`")
    if turns and found.value > SURE * found.error:
        notes.append(f"CONTRADICTION: parts at {found.value:.3g}/s, yet repeats after {turns} turns")
    if not turns and found.value < -SURE * found.error and p.turns > LONGEST_PERIOD:
        notes.append(f"NOT_SETTLED: comes together at {-found.value:.3g}/s, yet does not repeat; raise `settle`")
    return DiagramPoint(section, found, turns, spread, tuple(notes))


def repeats(section: Array) -> int:
    """Turns after which a section, shape (turns, 2), repeats in its second half; 0 if not within `LONGEST_PERIOD`."""
    late = section[len(section) // 2 :]
    for n in range(1, min(LONGEST_PERIOD, len(late) - 1) + 1):
        if np.abs(late[n:] - late[:-n]).max() < REPEATS_TO:
            return n
    return 0


class Growth(NamedTuple):
    """Over one turn from the angle of the section: local rate at which motions part, 1/s, (members, turns, steps).

    Further the size, m, of an offset of 1e-12 m that is left alone, and what its growth comes to if it is drawn back,
    (members, steps + 1).
    """

    rate: Array
    alone: Array
    drawn: Array


def growth_over_turn(p: SectionParameters, mechanism: Mechanism, seed: int) -> tuple[Array, Array, Array]:
    """One member's part of `Growth`: rate (turns, steps), alone and drawn (steps + 1,)."""
    scene, steps = Scene.of(mechanism), p.steps(mechanism)
    state = settled(scene, p.settle, seed)
    alone = separation(scene, state, LEFT_ALONE, seed, steps=steps)
    growth = turn_growth(scene, state, p.exponent_turns + 1, seed, steps=steps, offset=p.offset, tolerance=p.exponent_tolerance)
    drawn = LEFT_ALONE * np.exp(np.concatenate([[0.0], np.cumsum(growth[0])]))
    return growth[1:] * steps / period(mechanism), alone, drawn


def fastest(rate: Array, turn: float) -> float:
    """Largest mean rate, 1/s, over any `WINDOW` of a turn (over the whole turn if that is shorter)."""
    mean = rate.mean(axis=(0, 1))
    width = min(max(1, round(WINDOW / turn * mean.size)), mean.size)
    sums = np.concatenate([[0.0], np.cumsum(np.tile(mean, 2))])
    return float((sums[width:] - sums[:-width]).max() / width)


def agreement(growth: Growth, clearance: float) -> float:
    """Largest ratio between offset left alone and drawn back, geometric mean over members, while both are small."""
    alone, drawn = (np.exp(np.log(each).mean(axis=0)) for each in (growth.alone, growth.drawn))
    small = np.logical_and.accumulate(np.maximum(growth.alone, growth.drawn).max(axis=0) < 1e-3 * clearance)
    return float(np.exp(np.abs(np.log(alone / drawn))[small].max()))
