"""Forces of mechanisms with flexible links, as means over the period of their axial vibration.

A link is a spring of stiffness E A/L along itself. With the masses it holds it rings at kilohertz, started by each jump of an
acceleration, and hardly damped: how long and how much is a matter of the steps and of the integrator's damping, which no run at
an affordable step tells. What is given is the force without it: the mean over a period T of its mean over a period T, of which
(sin(pi f T)/(pi f T))^2 is left of a vibration of frequency f. Forces of contacts stay as they are: peaks are asked of an impact.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from buckler.mbs.kinematics.inertias import axial_period
from buckler.mbs.mechanism import Mechanism
from buckler.mbs.units import FORCES

Array = np.ndarray[Any, Any]
CAUGHT, LENGTHENED = 0.1, 0.8
"""First step, of a period, below which it catches a vibration; a step over the next one, at most, while they grow."""
UNRESOLVED, RINGS = {"": 0.3, ".peak": 0.3, ".rms": 0.1}, 4
"""Errors of a force that rings, of its peak and of its mean square, where an axial period has fewer steps than this: peaks were
off by 0.1 to 0.21, mean squares by 0.06."""
OF_CONTACT = ("contact_force", "normal_force", "friction_force", "force")


def told(mechanism: Mechanism) -> str:
    """What is done to the forces, in a sentence."""
    period = axial_period(mechanism)
    return (
        f"forces of joints, guides, drives and flexible links are means, twice over {period:.2g} s, which leaves frequencies"
        f" below about {0.25 / period:.2g} Hz: axial vibration is not resolved; solver=Exudyn() gives them as computed"
    )


def banded(mechanism: Mechanism, time: Array, signals: dict[str, Array], units: dict[str, str]) -> dict[str, Array]:
    """The forces that ring, averaged; empty where nothing rings.

    Parameters
    ----------
    mechanism : Mechanism
    time : array, shape (samples,)
        s.
    signals, units
        All signals of a run.
    """
    period = axial_period(mechanism)
    if not period > 0 or len(time) < 3 or any(name.endswith(".journal_x") for name in signals):
        return {}
    ringing = [name for name, unit in units.items() if rings(name, unit)]
    at, wide = start(time, period)
    return {name: averaged(time, averaged(time, signals[name][at], wide), wide) for name in ringing}


def rings(name: str, unit: str) -> bool:
    """Whether a signal of a mechanism with flexible links is a force that rings with them."""
    return unit in FORCES and name.rpartition(".")[2] not in OF_CONTACT


def unresolved(mechanism: Mechanism, step: float, errors: dict[str, float], units: Mapping[str, str]) -> dict[str, float]:
    """The errors of signals; those of forces that ring at least `UNRESOLVED` where a step, s, is too long to follow them."""
    if not RINGS * step > axial_period(mechanism) > 0:
        return errors
    ringing = [name for name, unit in units.items() if rings(name, unit)]
    least = {f"{name}{part}": share for name in ringing for part, share in UNRESOLVED.items()}
    return errors | {part: max(errors[part], share) for part, share in least.items() if part in errors}


def averaged(time: Array, values: Array, period: float | Array) -> Array:
    """Mean over a period about each time; about the nearest time of which a whole period lies within the run."""
    total = np.concatenate([[0.0], np.cumsum((values[1:] + values[:-1]) / 2 * np.diff(time))])
    period = np.minimum(period, time[-1] - time[0])
    middle = np.clip(time, time[0] + period / 2, time[-1] - period / 2)
    found: Array = (np.interp(middle + period / 2, time, total) - np.interp(middle - period / 2, time, total)) / period
    return found


def start(time: Array, period: float) -> tuple[Array, Array]:
    """Sample to take at each time, and what to take its mean over, s: its own and the period, unless steps grow from the start.

    Steps that grow from far below a period to about one catch a few points of the vibration with which a run starts, and longer
    ones then lose it. Their mean is one by chance: the sample after them stands for them all, the mean is over two long steps.
    """
    steps, at, wide = np.diff(time), np.arange(len(time)), np.full(len(time), period)
    last = int(np.argmax(np.append(steps[:-1] >= LENGTHENED * steps[1:], True)))
    if steps[0] < CAUGHT * period and steps[last] > period / 2:
        wide[time < time[last] + 2 * period] = max(period, 2 * steps[last])
        if steps[last] >= period:
            at[: last + 1] = last + 1
    return at, wide
