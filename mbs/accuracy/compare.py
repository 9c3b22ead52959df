"""How far two runs of one mechanism are apart, signal by signal, as functions of time.

Both runs are functions: cubics between their samples, by the rates of what has some. They are compared at the samples of both and
half-way between, so that what lies between samples counts too. Differences are taken in the L2 norm over time; what is read off a
signal is off by no more than a norm of the difference, so that two readings that agree by chance hide nothing:

- `name`: the root of the mean square of the difference;
- `name.peak`: its largest magnitude, which bounds the error of the largest value; of places and forces;
- `name.impulse`: the largest magnitude of its integral, which bounds that of an impulse; of forces;
- `name.onset`: how much earlier or later a contact closes or opens, over the run; of contacts.

A place is measured by its range, a force or a rate by its root mean square or its peak, a component by the largest of its
vector, and all at least by `SMALL` of the largest signal of its kind and unit, places by `RESTING` of the mechanism: what is
smaller rests.

Contacts that close a little earlier or later would make forces differ wholly for that little while. Their time is told by the
onset; forces and rates are compared in a time that is bent so that onsets fall together, and not between two samples about one.
So about kinks of what drives or loads a mechanism, where accelerations jump.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from buckler.mbs.accuracy.means import means
from buckler.mbs.elements.element import Array, Kind, Signal, kinks_of
from buckler.mbs.kinematics.inertias import mechanism_mass
from buckler.mbs.record.energy import ledger, put_through
from buckler.mbs.record.lookup import between
from buckler.mbs.record.run import Run

SMALL, RESTING = 1e-2, 1e-3
"""Of the largest signal of the same kind and unit, and of the mechanism's size: smaller signals are measured by so much."""
FORCES = (Kind.REACTION, Kind.CONTACT, Kind.FRICTION, Kind.INTERNAL)
Scales = tuple[float, float]
"""Of a signal: what the root of a mean square is relative to, and what a largest difference is."""
TINY = float(np.finfo(float).tiny)


class Apart(NamedTuple):
    """A difference, and what it is measured by, in the signal's unit."""

    off: float
    scale: float

    @property
    def relative(self) -> float:
        """The one over the other; infinite for what is not finite."""
        return self.off / self.scale if np.isfinite(self.off) else np.inf


@dataclass(frozen=True)
class Functions:
    """A run as functions of time.

    Attributes
    ----------
    time : array, shape (samples,)
        s.
    signals : mapping of str to Signal
        The kinds of signals that are compared.
    size : float
        Of the mechanism, m.
    balance : float
        What its energies do not add up by, over the energy put through.
    kinks : tuple of float
        Times, s, at which accelerations and forces jump, as what drives or loads the mechanism does.
    push : float
        Force, N, that moves the mechanism by its size in the time of the run: a hundredth of it is none.
    """

    time: Array
    signals: Mapping[str, Signal]
    size: float
    balance: float = 0.0
    kinks: tuple[float, ...] = ()
    push: float = 0.0

    @classmethod
    def of(cls, run: Run) -> Functions:
        """Signals and energies of a run."""
        record, mechanism = run.record, run.record.mechanism
        energies = ledger(record)
        through, unseen = put_through(record, energies, run.values)
        balance = max(0.0, float(np.abs(energies["error"]).max()) / through - unseen)
        energies = {name: values for name, values in energies.items() if name not in ("throughput", "error")}
        found = {name: signal for name, signal in run.signals.items() if signal.kind is not Kind.COUNT}
        found |= {signal.name: signal for signal in means(mechanism, record.time, found)}
        found |= {f"energy.{n}": Signal(f"energy.{n}", v, "J", Kind.ENERGY, scale=through) for n, v in energies.items()}
        size = max(mechanism.length(link.name) for link in mechanism.links)
        push = mechanism_mass(mechanism) * size / float(record.time[-1]) ** 2
        return cls(record.time, found, size, balance, kinks_of(mechanism, float(record.time[-1])), push)

    def at(self, name: str, times: Array) -> Array:
        """A signal at other times within the run."""
        signal = self.signals[name]
        rate = self.signals[signal.rate].values if signal.rate in self.signals else None
        return between(self.time, signal.values, rate, times, signal.kind is Kind.PLACE)

    def onsets(self, name: str) -> Array:
        """When its contact closes or opens, s."""
        return self.signals[name].onsets

    @property
    def scales(self) -> dict[str, Scales]:
        """What each signal is measured by: its difference's root mean square, and its largest."""
        own: dict[str, Scales] = {}
        for name, signal in self.signals.items():
            if signal.kind in (Kind.PLACE, Kind.ENERGY):
                extent = signal.scale or float(np.ptp(signal.values))
                own[name] = extent, extent
            else:
                own[name] = float(np.sqrt(_mean(self.time, signal.values**2))), float(np.abs(signal.values).max())
        vectors: dict[str, Scales] = {}
        units: dict[tuple[str, str], Scales] = {}
        for name, signal in self.signals.items():
            group, family = signal.group or name, _family(signal)
            vectors[group] = _larger(own[name], vectors.get(group, (TINY, TINY)))
            units[family] = _larger(own[name], units.get(family, (TINY, TINY)))
        torque = units.get(("force", "N m"), (TINY, TINY))
        forces = _larger(units.get(("force", "N"), (TINY, TINY)), (torque[0] / self.size, torque[1] / self.size))
        forces = _larger(forces, (self.push, self.push))
        units |= {("force", "N"): forces, ("force", "N m"): (forces[0] * self.size, forces[1] * self.size)}
        rests = RESTING * self.size, RESTING
        found = {}
        for name, signal in self.signals.items():
            if signal.kind is Kind.PLACE:
                rest = rests[signal.unit != "m"]
                least = rest, rest
            else:
                largest = units[_family(signal)]
                least = SMALL * largest[0], SMALL * largest[1]
            found[name] = own[name] if signal.scale else _larger(vectors[signal.group or name], least)
        return found


def _family(signal: Signal) -> tuple[str, str]:
    """Signals that are small or large by each other."""
    return ("force" if signal.kind in FORCES else signal.kind), signal.unit


def _larger(a: Scales, b: Scales) -> Scales:
    return max(a[0], b[0]), max(a[1], b[1])


def compare(a: Functions, b: Functions, until: float = np.inf) -> dict[str, Apart]:
    """How far run a is from run b, by signal and by what is read off it; see above.

    Parameters
    ----------
    a, b : Functions
        Of the same mechanism, whatever their elements, steps and solver; b is what a is measured by.
    until : float
        Time, s, to which they are compared.
    """
    end = min(float(a.time[-1]), float(b.time[-1]), until)
    bent, contacts = _bend(a, b, end)
    plain, own = _grid([a.time, b.time], end), _grid([a.time, np.interp(b.time, bent[1], bent[0]), contacts], end)
    theirs = np.interp(own, *bent)
    jumps = np.append(contacts, [t for t in b.kinks if t < end])
    seen = _seen(own, a.time, jumps) * _seen(theirs, b.time, np.interp(jumps, *bent))
    found: dict[str, Apart] = {}
    for name, scales in b.scales.items():
        if name not in a.signals:
            continue
        signal = b.signals[name]
        straight = signal.kind in (Kind.PLACE, Kind.ENERGY)
        times, weights = (plain, _weights(plain)) if straight else (own, _weights(own) * seen)
        with np.errstate(all="ignore"):
            off = a.at(name, times) - b.at(name, plain if straight else theirs)
        found[name] = Apart(float(np.sqrt(weights @ off**2 / max(end, TINY))), scales[0])
        if signal.kind is Kind.PLACE or signal.kind in FORCES:
            found[f"{name}.peak"] = Apart(float(np.abs(off[weights > 0]).max(initial=0.0)), scales[1])
        if signal.kind in FORCES:
            through = float(_weights(plain) @ np.abs(b.at(name, plain)))
            along = np.cumsum(_weights(plain) * (a.at(name, plain) - b.at(name, plain)))
            found[f"{name}.impulse"] = Apart(float(np.abs(along).max()), max(through, SMALL * scales[0] * end))
        if len(signal.onsets):
            found[f"{name}.onset"] = _onset(a.onsets(name), signal.onsets, end)
    return found


def _mean(time: Array, values: Array) -> float:
    return float(np.trapezoid(values, time) / max(time[-1] - time[0], TINY)) if len(time) > 1 else float(values[0])


def _grid(times: list[Array], end: float) -> Array:
    """Times of all, once each, and half-way between."""
    every = np.unique(np.concatenate(times))
    every = np.append(every[every < end * (1 - 1e-12)], end)
    return np.sort(np.concatenate([every, (every[1:] + every[:-1]) / 2]))


def _weights(times: Array) -> Array:
    """Of Simpson's rule over times with their middles."""
    h = times[2::2] - times[:-2:2]
    out = np.zeros(len(times))
    out[:-2:2] += h / 6
    out[1::2] += 4 * h / 6
    out[2::2] += h / 6
    return out


def _bend(a: Functions, b: Functions, end: float) -> tuple[tuple[Array, Array], Array]:
    """Times of a and of b that belong together, by the onsets of their contacts; those of a."""
    pairs = [(0.0, 0.0)]
    for name in b.signals:
        if name in a.signals:
            pairs += zip(a.onsets(name), b.onsets(name), strict=False)
    kept = [(0.0, 0.0)]
    for one, other in sorted(pairs):
        if one > kept[-1][0] and other > kept[-1][1] and max(one, other) < end:
            kept.append((float(one), float(other)))
    inner = np.array(kept)
    mine, theirs = (np.append(inner[:, k], end) for k in (0, 1))
    return (mine, theirs), mine[1:-1]


def _seen(times: Array, samples: Array, jumps: Array) -> Array:
    """0 at times between two samples about an onset or a kink, else 1."""
    out, near = np.ones(len(times)), 1e-9 * float(samples[-1])
    for t in jumps:
        first = samples[max(int(np.searchsorted(samples, t - near)) - 1, 0)]
        last = samples[min(int(np.searchsorted(samples, t + near)), len(samples) - 1)]
        out[(times >= first) & (times <= last)] = 0.0
    return out


def _onset(mine: Array, theirs: Array, end: float) -> Apart:
    """How far apart the onsets are that both have; a whole run where one has none."""
    mine, theirs = mine[mine < end], theirs[theirs < end]
    count = min(len(mine), len(theirs))
    if not count:
        return Apart(end if len(mine) or len(theirs) else 0.0, max(end, TINY))
    return Apart(float(np.abs(mine[:count] - theirs[:count]).max()), max(end, TINY))


def relative(apart: Mapping[str, Any]) -> dict[str, float]:
    """The relative differences."""
    return {name: each.relative for name, each in apart.items()}
