"""How far apart two runs of one mechanism are, in one number: what `accuracy` asks for and `Result.error` estimates.

The measure looks at what a mechanism does, not at what is derived from it by differences: places, shapes, impulses. It is the
largest of these relative differences, each an L2 norm over the time both runs cover:

- the mid-span deflection of each flexible link about its chord (a strut's end shortening), over its own norm, or over the
  smallest clearance where joints have clearance and that is larger. The end shortening of a strip that bends follows from
  its shape; what it has besides is axial vibration, micrometres at kilohertz, which only a run a hundred times dearer
  resolves, and which
  moves a point by no more;
- the place of each point, over its range, the larger one of both runs;
- the impulse of each stop's force up to each time, over its norm;
- the place of each journal in its bush over the first `PREDICTABLE` seconds, over the clearance. Rattling is chaotic: later
  trajectories say nothing of the solver, and all of the above is looked at in those seconds only.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy

from buckler.mbs.record.result import Result, cubic

Array = np.ndarray[Any, Any]
FINEST, COARSEST = 1e-6, 0.1
"""Accuracies that can be asked for."""
PREDICTABLE = 0.010
"""Time, s, for which a rattling mechanism's motion is one trajectory."""
STRAIGHT = 1e-6
"""Norm of a link's shape, relative to the mechanism's size, below which it counts as straight."""
RESTING = 1e-3
"""Range of a point, relative to the mechanism's size, below which it counts as resting."""
GRID = 4000
"""Most times looked at."""


def difference(a: Result, b: Result) -> float:
    """Difference of run a from run b of the same mechanism, relative to b; infinite if one ended before the other.

    Parameters
    ----------
    a, b : Result
        Of the same mechanism and duration, whatever their elements, steps and integrators.

    Returns
    -------
    float
        The largest of `differences`; 0 if nothing moves.
    """
    return max(differences(a, b).values(), default=0.0)


def differences(a: Result, b: Result) -> dict[str, float]:
    """The parts of `difference`: by link `name.shape`, point `name.place`, stop `name.impulse`, joint `name.journal`."""
    first, second = _Motion(a), _Motion(b)
    if not np.isclose(first.end, second.end, rtol=1e-6):
        return {"duration": float("inf")}
    times = _times(first, second)
    steps = np.diff(times, prepend=times[0], append=times[-1]) / (times[-1] - times[0])
    weights = (steps[:-1] + steps[1:]) / 2

    def norm(values: Array) -> float:
        return float(np.sqrt(weights @ (values * values).sum(axis=1)))

    found = {}
    for name, scale in second.scales(norm, times, first).items():
        off = norm(first.at(name, times) - second.at(name, times))
        found[name] = off / scale if np.isfinite(off) else float("inf")
    return found


def _times(a: _Motion, b: _Motion) -> Array:
    times = np.union1d(a.time, b.time)
    times = times[times <= min(a.end, b.end)]
    return times if len(times) <= GRID else times[np.unique(np.linspace(0, len(times) - 1, GRID).astype(int))]


class _Motion:
    """The part of a result that is compared, by part; cut to the predictable time where joints have clearance."""

    def __init__(self, result: Result) -> None:
        signals = result.signals
        names = [name.removesuffix(".journal_x") for name in signals if name.endswith(".journal_x")]
        self.end = min(float(result.time[-1]), PREDICTABLE) if names else float(result.time[-1])
        last = min(len(result.time), int(np.searchsorted(result.time, self.end)) + 2)
        self.time = result.time[:last]
        self.parts: dict[str, Array] = {}
        self.gaps: dict[str, float] = {}

        def add(name: str, *columns: str) -> None:
            self.parts[name] = np.column_stack([signals[column][:last] for column in columns])

        for name in signals:
            owner, _, kind = name.rpartition(".")
            if kind == "deflection" or (kind == "end_shortening" and f"{owner}.deflection" not in signals):
                add(f"{owner}.shape", name)
            elif kind == "vx" and f"{owner}.ax" not in signals:  # links have an acceleration, too: points suffice
                add(f"{owner}.place", f"{owner}.x", f"{owner}.y")
            elif kind == "contact_force":
                impulse = scipy.integrate.cumulative_trapezoid(signals[name][:last], self.time, initial=0.0)
                self.parts[f"{owner}.impulse"] = impulse[:, None]
        for name in names:
            add(f"{name}.journal", f"{name}.journal_x", f"{name}.journal_y")
            self.gaps[f"{name}.journal"] = _gap(result, name)
        places = [values for name, values in self.parts.items() if name.endswith(".place")]
        self.size = float(np.ptp(np.concatenate(places), axis=0).max()) if places else 1.0

    def at(self, name: str, times: Array) -> Array:
        """A part at other times."""
        values = self.parts[name]
        if len(times) == len(self.time) and (times == self.time).all():
            return values
        if name.endswith(".impulse") or len(self.time) < 3:
            return np.column_stack([np.interp(times, self.time, column) for column in values.T])
        return cubic(self.time, values, times)

    def scales(self, norm: Any, times: Array, other: _Motion) -> dict[str, float]:
        """What each part's difference is relative to; parts without any motion, in the other run neither, have none."""
        found = {}
        for name, values in self.parts.items():
            kind = name.rpartition(".")[2]
            if kind == "journal":
                found[name] = self.gaps[name]
            elif kind == "place":
                extent = float(max(np.ptp(each, axis=0).max() for each in (values, other.parts[name])))
                if extent > RESTING * self.size:
                    found[name] = extent
            elif kind == "shape":
                found[name] = max(norm(self.at(name, times)), STRAIGHT * self.size, min(self.gaps.values(), default=0.0))
            else:
                found[name] = max(norm(self.at(name, times)), np.finfo(float).tiny)  # none here but some there is infinitely off
        return found


def _gap(result: Result, joint: str) -> float:
    """Clearance of a joint, m, from its signals: eccentricity less penetration; the largest eccentricity if it never touched."""
    eccentricity = np.hypot(result.signals[f"{joint}.journal_x"], result.signals[f"{joint}.journal_y"])
    deep = int(np.argmax(result.signals[f"{joint}.penetration"]))
    depth = float(result.signals[f"{joint}.penetration"][deep])
    return float(eccentricity[deep]) - depth if depth > 0 else max(float(eccentricity.max()), np.finfo(float).tiny)
