"""Self-check of strips: none stays straight where a thin strip buckles.

The growth rate of the bending of a straight strip follows from the tangent of the mechanism under its load. The pose is that of
the run, with each strip in its stress-free shape between its ends, stretched by its mean normal force. So clamps, pins, rigid
links and follower loads are taken into account, and no table of end conditions is needed. Inertial forces are left out.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..elements.link import Link
from ..geometry import Array
from ..offers import find_offer
from ..record.lookup import trapezoidal
from ..record.record import Record
from ..record.result import Result
from ..record.run import Run
from .check import check, without

BUCKLED_FROM = 5e-3
"""Relative end shortening beyond which a strip must be buckled."""
GROWTH = 14.0
"""Exponent of the growth of a disturbance, under more than the critical load, after which a strip must have bent: e^14 is 1e6."""
UNBENT = 1e-3
"""Change of the deflection, over the length, up to which a strip has not bent."""
AXIAL = 0.5
"""Share of axial strain in the end shortening above which a strip is not buckled."""
POSES = 25
"""Number of times at which the tangent is computed, evenly over those at which a strip is compressed."""
LESS_FORCE = 0.9
"""Share of the lesser force at two neighbouring ones of these times above which the lesser rate holds between them."""
COMPRESSED = 0.01
"""Share of the Euler load below which no strip is checked."""


def _strips(run: Run) -> list[Link]:
    return [link for link in run.record.mechanism.links if link.body.meshed]


@check("UNBUCKLED", without(_strips, "no beam and no cable"))
def check_buckled(run: Run, result: Result) -> Iterator[str]:
    """Check that a strip that is shortened, or compressed for long, has bent."""
    yield from _straight_strips(run, result)
    yield from _overloaded_strips(run, result)


def _straight_strips(run: Run, result: Result) -> Iterator[str]:
    """Find strips much shorter than their arc by axial strain alone, which is an unbuckled state."""
    for link in _strips(run):
        shortening = result.signals[f"{link.name}.end_shortening"] / run.record.links[link.name].length
        strain = -result.signals[f"{link.name}.axial_force"] / link.body.section.axial_stiffness
        unbuckled = (shortening > BUCKLED_FROM) & (strain > AXIAL * shortening)
        if unbuckled.any():
            k = int(np.argmax(unbuckled))
            yield f"at t = {result.time[k]:.4g} s '{link.name}' is {shortening[k]:.2g} of its length short, unbent"


def _overloaded_strips(run: Run, result: Result) -> Iterator[str]:
    """Find strips that stay straight although the least bending would grow.

    The normal force is the mean over a quarter of the pinned strip's first period, without axial vibration.
    """
    record, time, strips = run.record, result.time, _strips(run)
    periods = {link.name: 2 * np.pi / link.body.section.first_frequency(record.links[link.name].length) for link in strips}
    forces = {name: recent_mean(time, result.signals[f"{name}.axial_force"], period / 4) for name, period in periods.items()}
    unbent = {link.name: _unbent(record, result, link) for link in strips}
    compressed = {
        link.name: (-forces[link.name] > COMPRESSED * link.body.section.euler_load(record.links[link.name].length))
        & unbent[link.name]
        for link in strips
    }
    if len(time) < 3 or not any(_may_grow(record, link, time, -forces[link.name] * compressed[link.name]) for link in strips):
        return
    samples = np.flatnonzero(np.any(list(compressed.values()), axis=0))
    growth, rows = find_offer("growth")(record), np.unique(samples[np.linspace(0, len(samples) - 1, POSES).astype(int)])
    found = [growth.at(k, {name: float(force[k]) for name, force in forces.items()}) for k in rows]
    for name, force in forces.items():
        rate = _between(rows, np.array([each[name] for each in found]), -force) * compressed[name]
        straight = growth_exponent(time, rate) > GROWTH
        if straight.any():
            k = int(np.argmax(straight))
            carries = f"at t = {time[k]:.4g} s '{name}' carries {-force[k]:.3g} N, straight"
            yield f"{carries}, though its bending grows at {rate[k]:.3g} 1/s; give it an imperfection"


def _may_grow(record: Record, link: Link, time: Array, force: Array) -> bool:
    """Return True if bending could have grown under a force, N, by an upper bound of the rate, P/2 sqrt(EI mu) with fixed ends.

    (P k^2 - EI k^4)/mu is largest at k^2 = P/2 EI; for ends that move the bound is taken twice as large.
    """
    section = link.body.section
    fastest = force / np.sqrt(section.bending_stiffness * section.mass_per_length)
    return bool((growth_exponent(time, fastest) > GROWTH).any())


def _between(rows: Array, rates: Array, compression: Array) -> Array:
    """Return rates at all samples from some: the lesser one of both neighbours, and zero at a smaller compression."""
    at = np.searchsorted(rows, np.arange(len(compression)), side="right")
    before, after = np.maximum(at - 1, 0), np.minimum(at, len(rows) - 1)
    least = np.minimum(compression[rows[before]], compression[rows[after]])
    found: Array = np.where(compression >= LESS_FORCE * least, np.minimum(rates[before], rates[after]), 0.0)
    return found


def _unbent(record: Record, result: Result, link: Link) -> Array:
    """Return True at samples at which a strip has its initial deflection; an arch on the other side of its chord has bent."""
    deflection = result.signals[f"{link.name}.deflection"]
    unbent: Array = np.abs(deflection - deflection[0]) < UNBENT * record.links[link.name].length
    return unbent


def growth_exponent(time: Array, rate: Array) -> Array:
    """Compute the exponent by which a disturbance has grown since its rate of growth, 1/s, was last zero."""
    exponent = trapezoidal(time, rate)
    found: Array = exponent - np.maximum.accumulate(np.where(rate > 0, 0.0, exponent))
    return found


def recent_mean(time: Array, values: Array, span: float) -> Array:
    """Return the mean over the last `span` seconds, or since the start."""
    total = trapezoidal(time, values)
    since = np.maximum(time - span, time[0])
    return np.where(time > since, (total - np.interp(since, time, total)) / np.maximum(time - since, 1e-300), values)
