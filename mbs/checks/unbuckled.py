"""Self-check of strips: are they on the branch that a thin strip takes?"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from buckler.mbs.checks.check import Check
from buckler.mbs.elements.element import Array
from buckler.mbs.record.quadrature import trapezoidal
from buckler.mbs.record.record import Record
from buckler.mbs.record.result import Result
from buckler.mbs.record.run import Run

BUCKLED_FROM = 5e-3
"""Relative end shortening beyond which a strip must be seen to be buckled."""
GROWTH = 14.0
"""Exponent by which a disturbance of a strip pressed beyond its critical load must have grown: a millionth becomes one."""
UNBENT = 1e-3
"""Change of its deflection, relative to the length, up to which the strip has not bent then."""
HELD = {0: 1.0, 1: 2.0457, 2: 4.0}
"""Critical load over Euler's by the number of clamped ends (S. Timoshenko, J. Gere, Theory of Elastic Stability, section 2.4)."""
AXIAL = 0.5
"""Share of an end shortening that is axial strain from which a strip is unbent."""


def _unbuckled(run: Run, result: Result) -> Iterator[str]:
    yield from _straight_strips(run.record, result)
    yield from _overloaded_strips(run.record, result)


def _straight_strips(record: Record, result: Result) -> Iterator[str]:
    """A strip much shorter than its arc must have bent: a chord shortened by axial strain alone is an unbuckled state."""
    for link in record.mechanism.links:
        if link.body.meshed:
            shortening = result.signals[f"{link.name}.end_shortening"] / record.links[link.name].length
            strain = -result.signals[f"{link.name}.axial_force"] / link.body.section.axial_stiffness
            unbuckled = (shortening > BUCKLED_FROM) & (strain > AXIAL * shortening)
            if unbuckled.any():
                k = int(np.argmax(unbuckled))
                yield f"at t = {result.time[k]:.4g} s '{link.name}' is {shortening[k]:.2g} of its length short, unbent"


def _overloaded_strips(record: Record, result: Result) -> Iterator[str]:
    """A strip pressed beyond its critical load cannot stay straight for long: the least disturbance grows.

    With P beyond P_cr a deflection grows at the rate w1 sqrt(P/P_cr - 1), w1 the first bending frequency; P is the mean over a
    quarter of its period, which leaves axial vibration out.
    """
    for link in record.mechanism.links:
        if not link.body.meshed or len(result.time) < 3:
            continue
        section, length = link.body.section, record.links[link.name].length
        welds = [joint for joint in record.mechanism.joints if joint.keeps_angle and link.name in (joint.first, joint.second)]
        clamped = len({joint.point for joint in welds} & {link.start, link.end})
        frequency, critical = resistance(section, length, clamped)
        pressed = -result.signals[f"{link.name}.axial_force"] / critical
        loaded = recent_mean(result.time, pressed, np.pi / (2 * frequency))
        deflection = result.signals[f"{link.name}.deflection"]
        unbent = np.abs(deflection - deflection[0]) < UNBENT * length  # an arch that passes its chord has bent
        straight = (grown(result.time, loaded, frequency) > GROWTH) & unbent
        if straight.any():
            k = int(np.argmax(straight))
            beyond = f"{pressed[k]:.3g} times its critical load"
            yield f"at t = {result.time[k]:.4g} s '{link.name}' carries {beyond}, straight; give it an imperfection"


def resistance(section: Any, length: float, clamped: int) -> tuple[float, float]:
    """First bending frequency, rad/s, and critical load, N, of a strip with this many clamped ends, the others pinned.

    The frequency follows the load as if the clamped strip's shape were the same; it is 12 % low for two ends.
    """
    return section.first_frequency(length) * HELD[clamped] ** 0.5, section.euler_load(length) * HELD[clamped]


def grown(time: Array, loaded: Array, frequency: float) -> Array:
    """Exponent by which a disturbance of a link has grown since its load, in critical ones, last began to exceed 1."""
    rate = frequency * np.sqrt(np.maximum(loaded - 1, 0.0))
    exponent = trapezoidal(time, rate)
    found: Array = exponent - np.maximum.accumulate(np.where(rate > 0, 0.0, exponent))
    return found


def recent_mean(time: Array, values: Array, span: float) -> Array:
    """Mean over the last `span` seconds, or since the start."""
    total = trapezoidal(time, values)
    since = np.maximum(time - span, time[0])
    return np.where(time > since, (total - np.interp(since, time, total)) / np.maximum(time - since, 1e-300), values)


def no_strip(run: Run, _result: Result) -> str:
    """Why there is nothing to look at, where no link is a meshed strip."""
    return "" if any(link.body.meshed for link in run.record.mechanism.links) else "no beam and no cable"


CHECK = Check(
    "UNBUCKLED",
    "failed when a strip is much shorter than its arc by axial strain, or stays straight beyond its critical load for longer "
    "than the least disturbance takes to grow",
    _unbuckled,
    {"end shortening": BUCKLED_FROM, "axial share": AXIAL, "growth, exponent": GROWTH, "deflection that is none": UNBENT},
    no_strip,
)
