"""Self-check of strips: each is on the branch that a thin strip takes.

The growth rate of the bending of a strip that a run keeps straight follows from the tangent of the mechanism under its load.
The pose is that of the run, with each strip in its stress-free shape between its ends, stretched by its mean normal force.
Clamps, pins, rigid links and loads that follow are then what they are; no table of ends is needed. Inertial forces are left out.
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
"""Relative end shortening beyond which a strip must be seen to be buckled."""
GROWTH = 14.0
"""Exponent by which a disturbance of a strip pressed beyond its critical load must have grown: a millionth becomes one."""
UNBENT = 1e-3
"""Change of its deflection, relative to the length, up to which the strip has not bent then."""
AXIAL = 0.5
"""Share of an end shortening that is axial strain from which a strip is unbent."""
POSES = 25
"""Times at which the tangent is looked at, evenly over those at which a strip is pressed."""
LESS = 0.9
"""Share of the lesser force of two such times down to which the lesser of their rates holds between them."""
PRESSED = 0.01
"""Share of the load of the pinned strip below which no strip is looked at."""


def _strips(run: Run) -> list[Link]:
    return [link for link in run.record.mechanism.links if link.body.meshed]


@check("UNBUCKLED", without(_strips, "no beam and no cable"))
def check_buckled(run: Run, result: Result) -> Iterator[str]:
    """Check that a strip that is short, or pressed for long, has bent."""
    yield from _straight_strips(run, result)
    yield from _overloaded_strips(run, result)


def _straight_strips(run: Run, result: Result) -> Iterator[str]:
    """Find straight strips much shorter than their arc: a chord shortened by axial strain alone is an unbuckled state."""
    for link in _strips(run):
        shortening = result.signals[f"{link.name}.end_shortening"] / run.record.links[link.name].length
        strain = -result.signals[f"{link.name}.axial_force"] / link.body.section.axial_stiffness
        unbuckled = (shortening > BUCKLED_FROM) & (strain > AXIAL * shortening)
        if unbuckled.any():
            k = int(np.argmax(unbuckled))
            yield f"at t = {result.time[k]:.4g} s '{link.name}' is {shortening[k]:.2g} of its length short, unbent"


def _overloaded_strips(run: Run, result: Result) -> Iterator[str]:
    """Find strips that stay straight although a bending grows: the least disturbance would grow.

    The normal force is the mean over a quarter of the pinned strip's first period, which leaves axial vibration out.
    """
    record, time, strips = run.record, result.time, _strips(run)
    periods = {link.name: 2 * np.pi / link.body.section.first_frequency(record.links[link.name].length) for link in strips}
    forces = {name: recent_mean(time, result.signals[f"{name}.axial_force"], period / 4) for name, period in periods.items()}
    unbent = {link.name: _unbent(record, result, link) for link in strips}
    pressed = {
        link.name: (-forces[link.name] > PRESSED * link.body.section.euler_load(record.links[link.name].length))
        & unbent[link.name]
        for link in strips
    }
    if len(time) < 3 or not any(_may_grow(record, link, time, -forces[link.name] * pressed[link.name]) for link in strips):
        return
    seen = np.flatnonzero(np.any(list(pressed.values()), axis=0))
    growth, rows = find_offer("growth")(record), np.unique(seen[np.linspace(0, len(seen) - 1, POSES).astype(int)])
    found = [growth.at(k, {name: float(force[k]) for name, force in forces.items()}) for k in rows]
    for name, force in forces.items():
        rate = _between(rows, np.array([each[name] for each in found]), -force) * pressed[name]
        straight = growth_exponent(time, rate) > GROWTH
        if straight.any():
            k = int(np.argmax(straight))
            carries = f"at t = {time[k]:.4g} s '{name}' carries {-force[k]:.3g} N, straight"
            yield f"{carries}, though its bending grows at {rate[k]:.3g} 1/s; give it an imperfection"


def _may_grow(record: Record, link: Link, time: Array, force: Array) -> bool:
    """Return True if bending could have grown under a force, N: a strip fixed at its ends grows at P/2 sqrt(EI mu) at most.

    (P k^2 - EI k^4)/mu is largest at k^2 = P/2 EI; ends that move are granted twice that rate.
    """
    section = link.body.section
    fastest = force / np.sqrt(section.bending_stiffness * section.mass_per_length)
    return bool((growth_exponent(time, fastest) > GROWTH).any())


def _between(rows: Array, rates: Array, pressing: Array) -> Array:
    """Rates at all samples from those at some: the lesser of the two neighbours', and none where the strip is pressed less."""
    at = np.searchsorted(rows, np.arange(len(pressing)), side="right")
    before, after = np.maximum(at - 1, 0), np.minimum(at, len(rows) - 1)
    least = np.minimum(pressing[rows[before]], pressing[rows[after]])
    found: Array = np.where(pressing >= LESS * least, np.minimum(rates[before], rates[after]), 0.0)
    return found


def _unbent(record: Record, result: Result, link: Link) -> Array:
    """Return where a strip's deflection is that of the start; an arch that passes its chord has bent."""
    deflection = result.signals[f"{link.name}.deflection"]
    unbent: Array = np.abs(deflection - deflection[0]) < UNBENT * record.links[link.name].length
    return unbent


def growth_exponent(time: Array, rate: Array) -> Array:
    """Compute the exponent by which a disturbance has grown since its rate of growth, 1/s, was last zero."""
    exponent = trapezoidal(time, rate)
    found: Array = exponent - np.maximum.accumulate(np.where(rate > 0, 0.0, exponent))
    return found


def recent_mean(time: Array, values: Array, span: float) -> Array:
    """Mean over the last `span` seconds, or since the start."""
    total = trapezoidal(time, values)
    since = np.maximum(time - span, time[0])
    return np.where(time > since, (total - np.interp(since, time, total)) / np.maximum(time - since, 1e-300), values)
