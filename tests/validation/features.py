"""Users' functions with features that are narrower than a step of a solver, against closed forms.

A body with one degree of freedom passes random features: detents, brakes, drops of a torque, snaps of a spring, trains of pulses.
A force F over a distance d changes the speed from v0 to v1 with v1^2 = v0^2 + 2 F d/m. A force over a time gives a constant
acceleration. A brake of the force -b v leaves the speed v0 exp(-b t/m) after a time t.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np

from buckler.mbs import Force, Link, Mechanism, Revolute, Rigid, Slider, Spring, Torque, simulate
from buckler.mbs.record.errors import Norm
from buckler.studies.extremes.case import Verdict

from .known import Answer, Known

NUMBER, QUICK = 33, 2
"""Random mechanisms of a family, and how many of them are not marked as slow."""
ALLOWED = 1e-3
"""Error allowed over the distance moved; a reported error below a tenth of it counts as that tenth."""
Law = Any
"""Function or formula of a torque, or a load."""


def wheel(law: Law, inertia: float, speed: float) -> Mechanism:
    """Make a wheel of an inertia [kg m^2] on a bearing, with a torque and a start speed [rad/s]."""
    body = Link("r", "O", "A", Rigid.of(mass=1.0, inertia=inertia, centre=(0, 0)))
    bearing = Revolute("O", "ground", "r")
    return Mechanism({"O": (0, 0), "A": (0.1, 0)}, [body], [bearing], loads=[Torque("r", law)], velocities={"r": speed})


def block(*loads: Law) -> Mechanism:
    """Make a block of 1 kg on a guide, at rest."""
    body = Link("b", "A", "B", Rigid.of(mass=1.0, inertia=1e-3, centre=(0, 0)))
    rail = Slider("A", "b", "ground", along=(1, 0))
    return Mechanism({"A": (0, 0), "B": (0, -0.1), "O": (-1.0, 0)}, [body], [rail], loads=list(loads))


def compare(mechanism: Mechanism, duration: float, signal: str, right: float, accuracy: float | None) -> Answer:
    """Run a mechanism, and compare the last value of a signal with the right one."""
    result = simulate(mechanism, duration, accuracy)
    found = float(result.signals[signal][-1])
    allowed = ALLOWED * abs(right)
    reported = max(result.error.absolute(signal, Norm.PEAK), allowed / 10)
    return Answer(found, right, allowed, "m or rad", reported, str(result.status), result.message)


def find_distance(edges: list[tuple[float, float]], rises: list[float], speed: float, duration: float) -> float:
    """Compute the distance moved [m or rad], when intervals (start, end) of it add to the square of the speed."""
    distance = time = 0.0
    for (start, end), rise in zip(edges, rises, strict=True):
        time += (start - distance) / speed
        after = float(np.sqrt(speed**2 + rise))
        time, distance, speed = time + 2 * (end - start) / (speed + after), end, after
    return distance + speed * (duration - time)


def detents(k: int, accuracy: float | None) -> Answer:
    """Turn a wheel through one to four narrow intervals of angle with a torque, a function or a formula."""
    draw = np.random.default_rng([37, k])
    count, inertia, speed, duration = 1 + k % 4, draw.uniform(0.02, 0.5), draw.uniform(2, 9), draw.uniform(3, 12)
    starts = np.sort(draw.uniform(0.2, 0.8, count)) * speed * duration
    widths = 10 ** draw.uniform(-4.3, -2.5, count) * speed * duration
    rises = draw.uniform(0.2, 1.0, count) * speed**2
    intervals = [(float(a), float(a + d), float(inertia * e / 2 / d)) for a, d, e in zip(starts, widths, rises, strict=True)]
    if not all(b < c for (_, b, _), (c, _, _) in pairwise(intervals)):  # they overlap: draw again
        return detents(k + 100, accuracy)
    texts = [f"{force!r}*(sign(angle-{a!r})-sign(angle-{b!r}))/2" for a, b, force in intervals]
    law = "+".join(texts) if k % 2 else lambda _t, x, _s: sum(force for a, b, force in intervals if a <= x < b)
    right = find_distance([(a, b) for a, b, _ in intervals], rises.tolist(), speed, duration)
    return compare(wheel(law, inertia, speed), duration, "r.angle", right, accuracy)


def brake(k: int, accuracy: float | None) -> Answer:
    """Slow a wheel down for a short time, by a torque in proportion to its speed."""
    draw = np.random.default_rng([38, k])
    inertia, speed, duration = draw.uniform(0.2, 3), draw.uniform(3, 20), draw.uniform(2, 20)
    begin, length = draw.uniform(0.1, 0.8) * duration, 10 ** draw.uniform(-4.3, -2) * duration
    rate = draw.uniform(0.3, 2) / length
    law = lambda t, _x, s: -rate * inertia * s if begin <= t < begin + length else 0.0  # noqa: E731
    decay = np.exp(-rate * length)
    right = speed * (begin + (1 - decay) / rate + decay * (duration - begin - length))
    return compare(wheel(law, inertia, speed), duration, "r.angle", right, accuracy)


def dropping_torque(k: int, accuracy: float | None) -> Answer:
    """Drive a wheel by a torque that drops in a narrow range of speeds."""
    draw = np.random.default_rng([39, k])
    inertia, pull, duration = draw.uniform(0.2, 3), draw.uniform(1, 5), draw.uniform(2, 10)
    top = pull * duration
    low, more = draw.uniform(0.2, 0.7) * top, draw.uniform(1.0, 3.0)
    high = low + 10 ** draw.uniform(-3.5, -2) * top
    law = lambda _t, _x, s: inertia * pull * (1 - more / (1 + more) if low <= s < high else 1.0)  # noqa: E731
    slow = pull / (1 + more)
    times = low / pull, (high - low) / slow
    rest = duration - sum(times)
    right = low * times[0] / 2 + (low + high) / 2 * times[1] + high * rest + pull * rest**2 / 2
    return compare(wheel(law, inertia, 0.0), duration, "r.angle", right, accuracy)


def snap(k: int, accuracy: float | None) -> Answer:
    """Move a block on a spring whose tension acts over a short interval of its elongation only."""
    draw = np.random.default_rng([40, k])
    speed, duration = draw.uniform(0.5, 3), draw.uniform(1, 5)
    start, width = draw.uniform(0.2, 0.7) * speed * duration, 10 ** draw.uniform(-4, -2) * speed * duration
    rise = draw.uniform(0.3, 2) * speed**2
    law = lambda x, _v: -rise / 2 / width if start <= x < start + width else 0.0  # noqa: E731
    moving = block(Spring("ground:O", "b:A", 0.0, law=law), Force("A", lambda t: (0.0, 0.0)))
    moving = replace(moving, velocities={"A": (speed, 0.0)})
    right = find_distance([(start, start + width)], [rise], speed, duration)
    return compare(moving, duration, "A.x", right, accuracy)


def train(k: int, accuracy: float | None) -> Answer:
    """Push a block by 30 to 2500 pulses of force with a period, some of which fall between the samples of a run."""
    draw = np.random.default_rng([41, k])
    count, period = int(10 ** draw.uniform(1.5, 3.4)), draw.uniform(0.05, 2)
    width, phase, force = draw.uniform(0.02, 0.6) * period, draw.uniform(0.0, 0.3) * period, draw.uniform(0.5, 5)
    law = lambda t: (force if (t - phase) % period < width and t >= phase else 0.0, 0.0)  # noqa: E731
    begins, end = phase + period * np.arange(count), count * period
    lengths = np.clip(end - begins, 0.0, width)
    right = float((force * lengths * (end - begins - lengths / 2)).sum())
    return compare(block(Force("A", law)), end, "A.x", right, accuracy)


class Pulse:
    """Short pulse of a force of impulse 1 N s, whose time can be changed."""

    start, length = 0.0, 1e-3  # [s]

    def __call__(self, t: float) -> tuple[float, float]:
        """Return the force (x, y) [N] at a time [s]."""
        return (1.0 / self.length if self.start <= t < self.start + self.length else 0.0), 0.0


PULSE = Pulse()
"""Function whose start changes from one run to the next, though it stays the same object."""


def changing_pulse(k: int, accuracy: float | None) -> Answer:
    """Push a block by the same function as in the run before, with another start."""
    draw = np.random.default_rng([42, k])
    duration = 10.0
    PULSE.start = float(draw.uniform(0.1, 0.9)) * duration
    return compare(block(Force("A", PULSE)), duration, "A.x", duration - PULSE.start - PULSE.length / 2, accuracy)


def comb(k: int) -> Answer:
    """Turn a wheel by a torque with teeth over its angle, finer than a function is searched: the run must say so."""
    draw = np.random.default_rng([43, k])
    teeth = float(draw.uniform(2e4, 9e4)) / 30.0
    law = lambda _t, x, _s: 5.0 * (1.0 if (x * teeth) % 1.0 < 0.5 else -1.0)  # noqa: E731
    return compare(wheel(law, 0.05, 3.0), 10.0, "r.angle", 0.0, None)


FAMILIES = {
    "detents over angle, 5e-5 to 3e-3 of the way": detents,
    "brake for 5e-5 to 1e-2 of the run": brake,
    "torque that drops in a narrow range of speeds": dropping_torque,
    "tension over 1e-4 to 1e-2 of the elongation": snap,
    "periodic pulses, 30 to 2500": train,
    "function whose number changes between runs": changing_pulse,
}


STILL = {(dropping_torque, 22, 1e-3): Verdict.SILENT, (brake, 2, None): Verdict.FALSE_ALARM}
"""Verdicts that are not accepted yet: a true error above the reported one though within the accuracy, and a false alarm."""


def list_known() -> Iterator[Known]:
    """Yield the random mechanisms of every family, with the default accuracy and with one asked for."""
    case = partial(Known, "features")
    for group, family in FAMILIES.items():
        for k in range(NUMBER):
            for accuracy in (None, 1e-3):
                name = f"{k}" if accuracy is None else f"{k}, accuracy {accuracy:g}"
                yield case(group, name, partial(family, k, accuracy), slow=k >= QUICK, still=STILL.get((family, k, accuracy), ""))
    for k in range(QUICK):
        yield case("teeth too fine to be looked at", f"{k}", partial(comb, k), accepted=(Verdict.NAMED,))
