"""Errors by numerical damping, in closed form: two runs that lose the same vibration do not show it by their difference.

A strut is a spring that vibrates with the masses at its ends at a frequency w [rad/s]. A step h multiplies the amplitude by
|R(i w h)|, R the stability function of Radau IIA (E. Hairer, G. Wanner, Solving ordinary differential equations II, Springer
1996, ch. IV.3, doi 10.1007/978-3-642-05221-7). The losses in all steps up to a time add up to a missing amplitude A [N] of the
force. A force A cos(w t) gives the lighter mass m speeds up to A/(w m) and moves it by up to A/(w^2 m): the errors of speed and
place. The error of the impulse on m is A/w. The force of an impact errs by the share by which the speed of approach errs.

The mass m is not known. It is at most half of the mass M of the mechanism, and `MASS_RATIO` assumes this half. The record has
running means of forces over T = 2 pi sqrt(M/k), an upper bound of axial periods, k the axial stiffness. The heavier end counts as
fixed, so that w = sqrt(k/m) = sqrt(M/m) 2 pi/T.
"""

from collections.abc import Collection, Mapping
from math import inf

import numpy as np

from ..elements.signal import Kind
from ..geometry import Array
from ..record.errors import Key, Norm
from .trajectory import TINY, Trajectory

MASS_RATIO = 2.0
"""Assumed ratio M/m of the mechanism's mass to the lighter mass at the ends of a link: the least possible one. All errors
increase with the ratio, so that none is overestimated by this choice."""


def radau(angle: Array) -> Array:
    """Compute |R(i w h)| of Radau IIA with three stages, from the change of phase w h in a step [rad]."""
    z = 1j * angle
    return np.asarray(np.abs((1 + z * (0.4 + 0.05 * z)) / (1 - z * (0.6 - z * (0.15 - z / 60)))))


def compute_lost_force(run: Trajectory, forces: Collection[str]) -> Array:
    """Compute the amplitude [N] that damping removed up to each sample, (times,), from the one of `forces` that lost most."""
    largest = np.zeros(len(run.time))
    # The interval between two samples counts as a step. The amplitude is the largest deviation from the running mean at a sample
    # and the three before. A step of T/4 damps by 1 %, and shorter steps do not matter. Three steps of T/4 cover a whole period
    # 2 pi/w = T/sqrt(2), and so its largest deviation.
    for mean in run.signals.values():
        if mean.source in forces:  # the signal is a running mean, and its `source` the force that is averaged
            deviation = np.pad(np.abs(run.signals[mean.source].values - mean.values), (3, 0))
            amplitude = np.lib.stride_tricks.sliding_window_view(deviation, 4).max(axis=1)
            share_lost = 1 - radau(2 * np.pi * np.sqrt(MASS_RATIO) * np.diff(run.time) / mean.period)
            largest = np.maximum(largest, np.append(0.0, np.cumsum(share_lost * amplitude[:-1])))
    return largest


def estimate_damping_errors(run: Trajectory, differences: Mapping[Key, float]) -> dict[Key, float]:
    """Estimate relative errors of places and of impacts by numerical damping, which two runs have in common.

    Forces of strips are used only in runs without contact and friction. Strips also vibrate laterally, and the formula then gives
    too much. With strips an error is therefore at most 3 times the difference of the runs (chosen), and deflections get no error.
    Most randomly drawn mechanisms err by 2 to 5 times the difference, so that the errors of some are underestimated. No place
    errs by more than its own range, and places of journals get no error.
    """
    forces = run.strut_forces if run.strikes else run.strut_forces | run.strip_forces  # names of signals
    has_strips = bool(forces & run.strip_forces)
    periods = [signal.period for signal in run.signals.values() if signal.source in forces]
    period = max(periods, default=0.0)  # T [s]: the longest, with the largest errors
    found = dict[Key, float]()
    if not period:
        return found
    frequency = 2 * np.pi * np.sqrt(MASS_RATIO) / period  # [rad/s]
    impulse = compute_lost_force(run, forces) / frequency  # [N s]
    speed = impulse * MASS_RATIO / run.mass  # [m/s]
    displacement = float(speed[-1]) / frequency  # [m]
    for name, signal in run.signals.items():
        is_journal = bool(signal.scale)  # of the places only that of a journal has a `scale`, the clearance
        if signal.kind is Kind.PLACE and not is_journal and not (has_strips and name.endswith(".deflection")):
            own_range = float(np.ptp(signal.values))
            error = min(displacement / (1.0 if signal.unit == "m" else run.longest_link), own_range)
            for norm in (Norm.RMS, Norm.PEAK):
                limit = 3.0 * differences.get((name, norm), 0.0) if has_strips else inf
                found[name, norm] = min(error / run.sizes[name, norm], limit)
        if len(signal.depth) and len(signal.contact_events):  # only normal forces of stops have a depth
            before = np.maximum(np.searchsorted(run.time, signal.contact_events) - 1, 0)  # samples before the events
            approach = np.abs(np.gradient(signal.depth, run.time))[before]  # speeds [m/s]
            fastest = approach.argmax()  # the impact with the highest force, to which errors of forces are relative
            relative = float(speed[before[fastest]] / max(approach[fastest], TINY))
            found[name, Norm.RMS] = found[name, Norm.PEAK] = relative  # that of the fastest impact is taken for all
            found[name, Norm.IMPULSE] = float(impulse[-1] / max(run.integral(name, np.abs)[-1], TINY))
    return found
