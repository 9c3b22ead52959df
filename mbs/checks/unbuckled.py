"""Self-check of strips: no strip stays straight under a load at which a thin strip buckles.

The growth rate of bending follows from the equations of the mechanism, linearised about a pose of the run, see `growing`. So
clamps, pins, rigid links and follower loads are taken into account, and no table of end conditions is needed.
"""

from collections.abc import Iterator

import numpy as np

from ..elements.link import Link
from ..geometry import Array
from ..imports import import_late
from ..record.lookup import trapezoidal
from ..record.result import Result
from ..record.run import Run
from .check import check

BUCKLED_FROM = 5e-3
"""Relative end shortening beyond which a strip is buckled: pinned ones thinner than a 13th of their length buckle at less."""
GROWTH = 14.0
"""Time integral of the growth rate after which a strip must have bent: a disturbance has grown by e^14, a million times."""
AXIAL = 0.5
"""Axial strain over relative end shortening, above which a strip is not buckled: bending shortens it less than axial strain."""


def _strips(run: Run) -> list[Link]:
    return [link for link in run.record.mechanism.links if link.body.meshed]


@check("UNBUCKLED", _strips, "no beam and no cable")
def check_buckled(run: Run, result: Result) -> Iterator[str]:
    """Check that a strip that is much shorter than without stress, or compressed for long, has bent."""
    for link in _strips(run):
        shortening = result.signals[f"{link.name}.end_shortening"] / run.record.links[link.name].length
        strain = -result.signals[f"{link.name}.axial_force"] / link.body.section.axial_stiffness
        unbuckled = (shortening > BUCKLED_FROM) & (strain > AXIAL * shortening)
        if unbuckled.any():
            k = int(np.argmax(unbuckled))
            yield f"at t = {result.time[k]:.4g} s '{link.name}' is {shortening[k]:.2g} of its length short, unbent"
    yield from _overloaded_strips(run, result)


def _overloaded_strips(run: Run, result: Result) -> Iterator[str]:
    """Find strips that stay straight although a small deflection would grow under the mean normal force."""
    record, time, strips = run.record, result.time, _strips(run)
    forces, compressed = dict[str, Array](), dict[str, Array]()  # normal force [N]; mask of samples to check
    for link in strips:
        name, section, length = link.name, link.body.section, record.links[link.name].length
        period = 2 * np.pi / section.first_frequency(length)  # of the pinned strip
        forces[name] = recent_mean(time, result.signals[f"{name}.axial_force"], period / 4)  # without axial vibrations
        deflection = result.signals[f"{name}.deflection"]
        is_unbent = np.abs(deflection - deflection[0]) < 1e-3 * length  # false for an arch that has snapped through
        is_compressed = -forces[name] > 0.01 * section.euler_load(length)  # chosen: ends that move let it buckle below this load
        compressed[name] = is_compressed & is_unbent
    if len(time) < 3 or not any(_may_grow(link, time, -forces[link.name] * compressed[link.name]) for link in strips):
        return
    samples = np.flatnonzero(np.any(list(compressed.values()), axis=0))
    growth = import_late("checks.growing:Growth")(record)
    poses = np.unique(samples[np.linspace(0, len(samples) - 1, 25).astype(int)])  # even: each pose costs a spectrum
    rates = [growth.at(k, {name: float(force[k]) for name, force in forces.items()}) for k in poses]
    for name, force in forces.items():
        rate = _at_all_samples(poses, np.array([at_pose[name] for at_pose in rates]), -force) * compressed[name]
        should_have_bent = growth_exponent(time, rate) > GROWTH
        if should_have_bent.any():
            k = int(np.argmax(should_have_bent))
            carries = f"at t = {time[k]:.4g} s '{name}' carries {-force[k]:.3g} N, straight"
            yield f"{carries}, though its bending grows at {rate[k]:.3g} 1/s; give it an imperfection"


def _may_grow(link: Link, time: Array, force: Array) -> bool:
    """Return True if bending could have grown under a compression P [N], (times,), by an upper bound of its rate.

    A wave with the number k grows at the rate sqrt((P k^2 - EI k^4)/mu), mu the mass per length. This is at most
    P/(2 sqrt(EI mu)), at k^2 = P/(2 EI). Twice this bound is taken, as ends may move.
    """
    section = link.body.section
    fastest = force / np.sqrt(section.bending_stiffness * section.mass_per_length)
    return bool((growth_exponent(time, fastest) > GROWTH).any())


def _at_all_samples(poses: Array, rates: Array, compression: Array) -> Array:
    """Return growth rates [1/s] at all samples from those at the samples `poses`: the smaller one of both neighbours, or zero.

    It is zero where the compression is below 0.9 times that of both poses, a convention: there bending grows more slowly.
    """
    following = np.searchsorted(poses, np.arange(len(compression)), side="right")
    before, after = np.maximum(following - 1, 0), np.minimum(following, len(poses) - 1)
    least = np.minimum(compression[poses[before]], compression[poses[after]])
    return np.asarray(np.where(compression >= 0.9 * least, np.minimum(rates[before], rates[after]), 0.0))


def growth_exponent(time: Array, rate: Array) -> Array:
    """Integrate a growth rate [1/s], (times,), from the last time at which it was zero: the exponent of the growth."""
    exponent = trapezoidal(time, rate)
    return np.asarray(exponent - np.maximum.accumulate(np.where(rate > 0, 0.0, exponent)))


def recent_mean(time: Array, values: Array, span: float) -> Array:
    """Compute at each sample the mean over the last `span` seconds, or since the start, (times,)."""
    total = trapezoidal(time, values)
    begin = np.maximum(time - span, time[0])
    mean = (total - np.interp(begin, time, total)) / np.maximum(time - begin, 1e-300)  # at the start, replaced below
    return np.where(time > begin, mean, values)
