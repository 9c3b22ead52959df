"""Users' functions with features narrower than a step: detents, brakes, pads, trains, against closed forms.

A body on one bearing or guide passes features drawn at random. A force between two places adds its work to the square of the
speed, v1^2 = v0^2 + 2 F d/m; between two times it acts at constant acceleration; a brake leaves v0 exp(-b d/m).
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np

from buckler.mbs import Force, Link, Mechanism, Revolute, Rigid, Slider, Spring, Torque, simulate
from buckler.mbs.record.errors import Norm
from buckler.studies.extremes.case import Verdict

from .known import Answer, Known

NUMBER, QUICK = 33, 2
"""Draws of a family, and those that no test leaves out."""
ALLOWED = 1e-3
"""Error allowed, over the way that is gone; a reported error counts down to a tenth of it."""
Law = Any


def wheel(law: Law, inertia: float, speed: float) -> Mechanism:
    """Make a wheel with a torque on a bearing."""
    body = Link("r", "O", "A", Rigid.of(mass=1.0, inertia=inertia, centre=(0, 0)))
    bearing = Revolute("O", "ground", "r")
    return Mechanism({"O": (0, 0), "A": (0.1, 0)}, [body], [bearing], loads=[Torque("r", law)], velocities={"r": speed})


def block(*loads: Law) -> Mechanism:
    """Make a block of 1 kg on a guide, at rest."""
    body = Link("b", "A", "B", Rigid.of(mass=1.0, inertia=1e-3, centre=(0, 0)))
    rail = Slider("A", "b", "ground", along=(1, 0))
    return Mechanism({"A": (0, 0), "B": (0, -0.1), "O": (-1.0, 0)}, [body], [rail], loads=list(loads))


def answer(mechanism: Mechanism, duration: float, signal: str, right: float, accuracy: float | None) -> Answer:
    """Run to the end and compare a place there."""
    result = simulate(mechanism, duration, accuracy, timeout=60)
    found = float(result.signals[signal][-1])
    allowed = ALLOWED * abs(right)
    reported = max(result.error.absolute(signal, Norm.PEAK), allowed / 10)
    return Answer(found, right, allowed, "m or rad", reported, str(result.status), result.message)


def coasted(edges: list[tuple[float, float]], rises: list[float], speed: float, duration: float) -> float:
    """Way [m or rad] through stretches (start, end), in each of which the square of the speed rises by a number."""
    way = time = 0.0
    for (start, end), rise in zip(edges, rises, strict=True):
        time += (start - way) / speed
        after = float(np.sqrt(speed**2 + rise))
        time, way, speed = time + 2 * (end - start) / (speed + after), end, after
    return way + speed * (duration - time)


def detents(k: int, accuracy: float | None) -> Answer:
    """Narrow stretches of angle in which a torque acts, one to four, as a function or a formula."""
    draw = np.random.default_rng([37, k])
    count, inertia, speed, duration = 1 + k % 4, draw.uniform(0.02, 0.5), draw.uniform(2, 9), draw.uniform(3, 12)
    starts = np.sort(draw.uniform(0.2, 0.8, count)) * speed * duration
    widths = 10 ** draw.uniform(-4.3, -2.5, count) * speed * duration
    rises = draw.uniform(0.2, 1.0, count) * speed**2
    pads = [(float(a), float(a + d), float(inertia * e / 2 / d)) for a, d, e in zip(starts, widths, rises, strict=True)]
    if not all(b < c for (_, b, _), (c, _, _) in pairwise(pads)):
        return detents(k + 100, accuracy)
    texts = [f"{force!r}*(sign(angle-{a!r})-sign(angle-{b!r}))/2" for a, b, force in pads]
    law = "+".join(texts) if k % 2 else lambda _t, x, _s: sum(force for a, b, force in pads if a <= x < b)
    right = coasted([pad[:2] for pad in pads], rises.tolist(), speed, duration)
    return answer(wheel(law, inertia, speed), duration, "r.angle", right, accuracy)


def brake(k: int, accuracy: float | None) -> Answer:
    """A brake in proportion to the speed that acts for a short while."""
    draw = np.random.default_rng([38, k])
    inertia, speed, duration = draw.uniform(0.2, 3), draw.uniform(3, 20), draw.uniform(2, 20)
    begin, lasts = draw.uniform(0.1, 0.8) * duration, 10 ** draw.uniform(-4.3, -2) * duration
    rate = draw.uniform(0.3, 2) / lasts
    law = lambda t, _x, s: -rate * inertia * s if begin <= t < begin + lasts else 0.0  # noqa: E731
    left = np.exp(-rate * lasts)
    right = speed * (begin + (1 - left) / rate + left * (duration - begin - lasts))
    return answer(wheel(law, inertia, speed), duration, "r.angle", right, accuracy)


def pad_of_speed(k: int, accuracy: float | None) -> Answer:
    """A torque that is larger in a narrow range of speeds, through which a wheel is driven."""
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
    return answer(wheel(law, inertia, 0.0), duration, "r.angle", right, accuracy)


def snap(k: int, accuracy: float | None) -> Answer:
    """A spring whose tension acts over a short stretch of elongation."""
    draw = np.random.default_rng([40, k])
    speed, duration = draw.uniform(0.5, 3), draw.uniform(1, 5)
    start, wide = draw.uniform(0.2, 0.7) * speed * duration, 10 ** draw.uniform(-4, -2) * speed * duration
    rise = draw.uniform(0.3, 2) * speed**2
    law = lambda x, _v: -rise / 2 / wide if start <= x < start + wide else 0.0  # noqa: E731
    moving = block(Spring("ground:O", "b:A", 0.0, law=law), Force("A", lambda t: (0.0, 0.0)))
    moving = Mechanism(
        moving.points, moving.links, moving.joints, loads=moving.loads, velocities={"A": (speed, 0.0)}
    )  # fmt: skip
    right = coasted([(start, start + wide)], [rise], speed, duration)
    return answer(moving, duration, "A.x", right, accuracy)


def train(k: int, accuracy: float | None) -> Answer:
    """Pulses of force with a period, up to 3000, some shorter than the distance of samples."""
    draw = np.random.default_rng([41, k])
    count, period = int(10 ** draw.uniform(1.5, 3.4)), draw.uniform(0.05, 2)
    width, phase, force = draw.uniform(0.02, 0.6) * period, draw.uniform(0.0, 0.3) * period, draw.uniform(0.5, 5)
    law = lambda t: (force if (t - phase) % period < width and t >= phase else 0.0, 0.0)  # noqa: E731
    begins, end = phase + period * np.arange(count), count * period
    lasts = np.clip(end - begins, 0.0, width)
    right = float((force * lasts * (end - begins - lasts / 2)).sum())
    return answer(block(Force("A", law)), end, "A.x", right, accuracy)


class Blow:
    """A short blow whose time may be changed."""

    at, lasts = 0.0, 1e-3

    def __call__(self, t: float) -> tuple[float, float]:
        """Force at a time [s]."""
        return (1.0 / self.lasts if self.at <= t < self.at + self.lasts else 0.0), 0.0


BLOW = Blow()
"""Function whose number changes from one run to the next."""


def changed(k: int, accuracy: float | None) -> Answer:
    """A function that is the same object as in the run before, with another number."""
    draw = np.random.default_rng([42, k])
    duration = 10.0
    BLOW.at = float(draw.uniform(0.1, 0.9)) * duration
    return answer(block(Force("A", BLOW)), duration, "A.x", duration - BLOW.at - BLOW.lasts / 2, accuracy)


def comb(k: int) -> Answer:
    """Teeth of a torque over angle, finer than a function is looked at: to be named."""
    draw = np.random.default_rng([43, k])
    teeth = float(draw.uniform(2e4, 9e4)) / 30.0
    law = lambda _t, x, _s: 5.0 * (1.0 if (x * teeth) % 1.0 < 0.5 else -1.0)  # noqa: E731
    return answer(wheel(law, 0.05, 3.0), 10.0, "r.angle", 0.0, None)


FAMILIES = {
    "detents over angle, 5e-5 to 3e-3 of the way": detents,
    "brake for 5e-5 to 1e-2 of the run": brake,
    "torque that drops in a narrow range of speeds": pad_of_speed,
    "tension over 1e-4 to 1e-2 of the elongation": snap,
    "periodic pulses, 30 to 2500": train,
    "function whose number changes between runs": changed,
}


STILL = {(detents, 27, 1e-3): Verdict.SILENT, (brake, 2, None): Verdict.FALSE_ALARM}
"""Draws with a verdict that they should not have: an error within what is asked and beyond what is reported, and its opposite."""


def list_known() -> Iterator[Known]:
    """List the draws of every family, without an accuracy and with one."""
    ask = partial(Known, "features")
    for group, family in FAMILIES.items():
        for k in range(NUMBER):
            for accuracy in (None, 1e-3):
                name = f"{k}" if accuracy is None else f"{k}, accuracy {accuracy:g}"
                yield ask(group, name, partial(family, k, accuracy), slow=k >= QUICK, still=STILL.get((family, k, accuracy), ""))
    for k in range(QUICK):
        yield ask("teeth too fine to be looked at", f"{k}", partial(comb, k), accepted=(Verdict.NAMED,))
