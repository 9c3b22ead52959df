"""Loss of vibration by numerical damping, in closed form: the difference of two runs does not show what both lose.

A strut is a spring that vibrates with the masses at its ends at a frequency w [rad/s], undamped. A step h multiplies the
amplitude of this vibration by |R(i w h)|, R the stability function of the integrator. The losses of all steps add up to the
amplitude A(t) of a force that the motion should still have at time t. Masses m err by A/(w m) in speed, and by A/(w^2 m) in
place. The force of an impact is proportional to the speed of approach; its impulse errs by A/w.

References
----------
E. Hairer, G. Wanner, Solving ordinary differential equations II, 2nd ed., Springer 1996, ch. IV.3,
doi 10.1007/978-3-642-05221-7: stability functions.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from math import inf

import numpy as np

from ..elements.signal import Kind
from ..geometry import Array
from ..record.errors import Key, Norm
from .trajectory import TINY, Trajectory

Factor = Callable[[Array], Array]
"""Factor of an amplitude in one step, as a function of the change of phase w h [rad]."""
LIGHTER = 2.0
"""Mass of the mechanism over the mass that vibrates: the lighter of the two ends of a link has at most half of it."""
COMMON = 3.0
"""Largest error that two runs have in common by the damping of strips, over their difference: their steps differ, and so do their
losses. It is 2 to 5 in most drawn mechanisms, so that the larger of both is right to a factor of 2."""
SAMPLES_BEFORE = 3
"""Number of earlier samples whose largest deviation from the mean is the amplitude: steps that damp are T/4 or longer."""


def radau(angle: Array) -> Array:
    """Compute the magnitude of the stability function of Radau IIA with three stages on the imaginary axis."""
    z = 1j * angle
    return np.asarray(np.abs((1 + z * (0.4 + 0.05 * z)) / (1 - z * (0.6 - z * (0.15 - z / 60)))))


def lost_amplitude(run: Trajectory, links: Collection[str], factor: Factor) -> Array:
    """Return the amplitude of force [N] that damping removed up to each sample from the flexible link that lost most."""
    largest = np.zeros(len(run.time))
    for mean in run.signals.values():
        if mean.source in links:
            deviation = np.pad(np.abs(run.signals[mean.source].values - mean.values), (SAMPLES_BEFORE, 0))
            amplitude = np.lib.stride_tricks.sliding_window_view(deviation, SAMPLES_BEFORE + 1).max(axis=1)
            loss = 1 - factor(2 * np.pi * np.sqrt(LIGHTER) * np.diff(run.time) / mean.period)
            largest = np.maximum(largest, np.append(0.0, np.cumsum(loss * amplitude[:-1])))
    return largest


def damping_errors(run: Trajectory, factor: Factor | None, differences: Mapping[Key, float]) -> dict[Key, float]:
    """Return relative errors of places and of impacts by numerical damping, which two runs have in common.

    Strips count only where nothing strikes, and with `COMMON` times the difference of the two runs at most: they also vibrate
    laterally, so that the formula gives too much. No error is added to deflections from a strip's own chord.
    """
    links = run.struts if run.strikes else run.struts | run.strips
    period = max((signal.period for signal in run.signals.values() if signal.source in links), default=0.0)
    found = dict[Key, float]()
    if not period or factor is None:
        return found
    frequency = 2 * np.pi * np.sqrt(LIGHTER) / period
    momentum = lost_amplitude(run, links, factor) / frequency
    speed = momentum * LIGHTER / run.mass
    displacement = float(speed[-1]) / frequency
    for name, signal in run.signals.items():
        if signal.kind is Kind.PLACE and not signal.scale and not (links & run.strips and name.endswith(".deflection")):
            error = min(displacement / (1.0 if signal.unit == "m" else run.size), float(run.own[name][0]))
            for norm in (Norm.RMS, Norm.PEAK):
                common = COMMON * differences.get((name, norm), 0.0) if links & run.strips else inf
                found[name, norm] = min(error / run.sizes[name, norm], common)
        if len(signal.depth) and len(signal.onsets):  # a contact that closes
            first = np.maximum(np.searchsorted(run.time, signal.onsets) - 1, 0)
            approach = np.abs(np.gradient(signal.depth, run.time))[first]
            worst = float(speed[first[approach.argmax()]] / max(approach.max(), TINY))
            found |= {(name, norm): worst for norm in (Norm.RMS, Norm.PEAK)}
            found[name, Norm.IMPULSE] = float(momentum[-1] / max(run.integral(name, np.abs)[-1], TINY))
    return found
