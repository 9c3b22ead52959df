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
smaller rests. Energies are measured by what is put through, and by a hundred times what vibrations that nobody sees may hold.

Contacts that close a little earlier or later would make forces differ wholly for that little while. Their time is told by the
onset; forces and rates are compared in a time that is bent so that onsets fall together, and not between two samples about one.
So about kinks of what drives or loads a mechanism, where accelerations jump.

A point that passes a stop by less than its place is off may as well have touched it: the force that it would have had counts as
a difference.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from buckler.mbs.elements.clearance import clearances
from buckler.mbs.elements.element import kinks_of
from buckler.mbs.elements.signal import Kind, Signal
from buckler.mbs.geometry import Array
from buckler.mbs.record.energy import ledger, put_through
from buckler.mbs.record.lookup import between
from buckler.mbs.record.means import axial_period, follows, mechanism_mass
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
        Force, N, that moves the mechanism by its size, or by its clearance, in the time of the run: a hundredth of it is none.
    taken : float
        Amplitude, m, of the axial vibration of a strut that holds the energy that is missing: numerical damping took no more. A
        strut is stiffer before its Euler load than beyond, so that a vibration moves its mean; 0 without struts.
    """

    time: Array
    signals: Mapping[str, Signal]
    size: float
    balance: float = 0.0
    kinks: tuple[float, ...] = ()
    push: float = 0.0
    taken: float = 0.0

    @classmethod
    def of(cls, run: Run) -> Functions:
        """Signals and energies of a run."""
        record, mechanism = run.record, run.record.mechanism
        energies = ledger(record)
        through, unseen = put_through(record, energies, run.values)
        missing, mass = float(np.abs(energies["error"]).max()), mechanism_mass(mechanism)
        balance = max(0.0, missing / through - unseen)
        energies = {name: values for name, values in energies.items() if name not in ("throughput", "error")}
        found = {name: signal for name, signal in run.signals.items() if signal.kind is not Kind.COUNT}
        whole = through * (1 + unseen / SMALL)
        found |= {f"energy.{n}": Signal(f"energy.{n}", v, "J", Kind.ENERGY, scale=whole) for n, v in energies.items()}
        size = max(mechanism.length(link.name) for link in mechanism.links)
        way = min([size, *(joint.gap for joint in clearances(mechanism))])
        push = mass * way / float(record.time[-1]) ** 2
        struts = any(link.body.flexible and link.body.massless for link in mechanism.links)
        taken = axial_period(mechanism) / (2 * np.pi) * float(np.sqrt(2 * missing / mass)) if struts else 0.0
        return cls(record.time, found, size, balance, kinks_of(mechanism, float(record.time[-1])), push, taken)

    @property
    def unresolved(self) -> list[str]:
        """Forces that ring in periods that the steps do not follow."""
        rings = {name.removesuffix(".mean"): signal.period for name, signal in self.signals.items() if signal.period > 0}
        return [name for name, period in rings.items() if not follows(self.time, period)]

    def at(self, times: Array) -> dict[str, Array]:
        """All signals at other times within the run."""
        groups: dict[tuple[bool, bool], list[str]] = {}
        for name, signal in self.signals.items():
            groups.setdefault((signal.rate in self.signals, signal.kind is Kind.PLACE), []).append(name)
        found: dict[str, Array] = {}
        for (known, smooth), names in groups.items():
            values = np.stack([self.signals[name].values for name in names], axis=1)
            rates = np.stack([self.signals[self.signals[name].rate].values for name in names], axis=1) if known else None
            found |= zip(names, between(self.time, values, rates, times, smooth).T, strict=True)
        return found

    @cached_property
    def own(self) -> dict[str, Scales]:
        """The size of each signal: of a place or an energy its range, else the root of its mean square and its largest."""
        found: dict[str, Scales] = {}
        for name, signal in self.signals.items():
            if signal.kind in (Kind.PLACE, Kind.ENERGY):
                extent = signal.scale or float(np.ptp(signal.values))
                found[name] = extent, extent
            else:
                found[name] = float(np.sqrt(_mean(self.time, signal.values**2))), float(np.abs(signal.values).max())
        return found

    @cached_property
    def scales(self) -> dict[str, Scales]:
        """What each signal is measured by: its difference's root mean square, and its largest."""
        own = self.own
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
    with np.errstate(all="ignore"):
        flat = a.at(plain), b.at(plain)
        warped = flat if np.array_equal(own, plain) and np.array_equal(theirs, plain) else (a.at(own), b.at(theirs))
    evenly, along_both, found = _weights(plain), _weights(own) * seen, dict[str, Apart]()
    for name, scales in b.scales.items():
        if name not in a.signals:
            continue
        signal = b.signals[name]
        straight = signal.kind in (Kind.PLACE, Kind.ENERGY)
        (mine, other), weights = (flat, evenly) if straight else (warped, along_both)
        missed = _missed(a, b, name, plain)
        with np.errstate(all="ignore"):
            off = mine[name] - other[name]
        apart = float(np.sqrt(weights @ off**2 / max(end, TINY))) + float(np.sqrt(evenly @ missed**2 / max(end, TINY)))
        found[name] = Apart(apart, scales[0])
        if signal.kind is Kind.PLACE or signal.kind in FORCES:
            largest = np.abs(off[weights > 0]).max(initial=0.0) + missed.max()
            found[f"{name}.peak"] = Apart(float(largest), scales[1])
        if signal.kind in FORCES:
            through = float(evenly @ np.abs(flat[1][name]))
            along = np.abs(np.cumsum(evenly * (flat[0][name] - flat[1][name]))).max() + evenly @ missed
            found[f"{name}.impulse"] = Apart(float(along), max(through, SMALL * scales[0] * end))
        if len(signal.onsets):
            found[f"{name}.onset"] = _onset(a.signals[name].onsets, signal.onsets, end)
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
            pairs += zip(a.signals[name].onsets, b.signals[name].onsets, strict=False)
    kept = [(0.0, 0.0)]
    for one, other in sorted(pairs):
        if one > kept[-1][0] and other > kept[-1][1] and max(one, other) < end:
            kept.append((float(one), float(other)))
    inner = np.array(kept)
    mine, theirs = (np.append(inner[:, k], end) for k in (0, 1))
    return (mine, theirs), mine[1:-1]


def _seen(times: Array, samples: Array, jumps: Array) -> Array:
    """0 at times between two samples about an onset or a kink, else 1; samples of both sides of one leave nothing between."""
    out, near = np.ones(len(times)), 1e-6 * float(samples[-1])
    for t in jumps:
        last = min(int(np.searchsorted(samples, t - near)), len(samples) - 1)
        first = max(int(np.searchsorted(samples, t + near, side="right")) - 1, 0)
        out[(times >= samples[min(first, last)]) & (times <= samples[max(first, last)])] = 0.0
    return out


def _missed(a: Functions, b: Functions, name: str, times: Array) -> Array:
    """Force, N, of contacts that neither run has, in depths as much larger as those of the two are apart."""
    if not len(b.signals[name].depth):
        return np.zeros(len(times))
    depths = [between(run.time, run.signals[name].depth, None, times, smooth=True) for run in (a, b)]
    deeper = np.max(depths, axis=0) + np.abs(depths[0] - depths[1]).max()
    spell = np.cumsum(np.diff(deeper > 0, prepend=False))
    touching = np.unique(spell[np.max(depths, axis=0) > 0])
    return np.asarray(np.where(np.isin(spell, touching), 0.0, b.signals[name].elastic(np.maximum(deeper, 0.0))))


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
